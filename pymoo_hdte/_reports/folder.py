"""A folder of a report: written whole or not at all, and never over anything else."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymoo_hdte._interrupts import orderly
from pymoo_hdte._reports.in_use import in_use
from pymoo_hdte.checks import InvalidInput

PAGE_FILE = "report.html"


@dataclass(frozen=True)
class ReportFolder:
    """The files of one kind of report, by which an earlier report is recognised.

    Attributes
    ----------
    document : str
        Name of the JSON file, which stands beside `PAGE_FILE`.
    others : tuple of str
        Names of further files.
    optional : tuple of str
        Names of files that may be missing.
    """

    document: str
    others: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()

    @property
    def always(self) -> tuple[str, ...]:
        """Names of the files without which a folder is no report."""
        return (PAGE_FILE, self.document, *self.others)

    @property
    def files(self) -> tuple[str, ...]:
        """Names of all files that a report may have."""
        return (*self.always, *self.optional)

    def check(self, out: Path) -> None:
        """Refuse a folder that could not take a report, before the long work starts.

        Parameters
        ----------
        out : Path
            A folder that is new, empty, or an earlier report, which will be replaced.

        Raises
        ------
        InvalidInput
            If it holds anything else.
        OSError
            If it cannot be written.
        """
        allowed = "a folder that is new, empty or an earlier report, but not the one you are in"
        dangling = any(
            parent.is_symlink() and not parent.exists() for parent in out.absolute().parents
        )
        folder = out.is_dir() or not out.exists()
        if dangling or out.is_symlink() or not folder or out.resolve() == Path.cwd():
            raise InvalidInput("folder of the report", str(out), allowed)
        if out.is_dir():
            present = {path.name for path in out.iterdir()}
            if present and not set(self.always) <= present <= set(self.files):
                raise InvalidInput("folder of the report", str(out), allowed)
        parent = next(folder for folder in out.absolute().parents if folder.exists())
        if not parent.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(parent))
        if not os.access(parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(parent))

    @contextmanager
    def held(self, out: Path) -> Iterator[None]:
        """Check a folder and keep other commands from it, until the report is written.

        Parameters
        ----------
        out : Path
            As for `check`.

        Raises
        ------
        InvalidInput
            As `check`, or if another command is about to write there.
        OSError
            As `check`.
        """
        self.check(out)
        # Beside the folder, which will be replaced.
        whole = out.absolute()
        with in_use(whole.with_name(f".{whole.name}.in-use"), "folder of the report", out):
            yield

    def write(
        self, out: Path, page: str, document: dict[str, Any], texts: Mapping[str, str]
    ) -> None:
        """Write all files or, after an error, none.

        Parameters
        ----------
        out : Path
            A folder that is new, empty, or an earlier report, which is replaced.
        page : str
            HTML.
        document : dict
            Document of plain types and finite numbers.
        texts : mapping of str
            Contents of the further files, by name.

        Raises
        ------
        InvalidInput, OSError
            As `check`; OSError also for a full disk.
        ArithmeticError
            If a number of the document is not finite.
        """
        self.check(out)
        try:
            text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        except ValueError as error:
            raise ArithmeticError(f"a number of {self.document} is not finite") from error
        contents = {self.document: text, PAGE_FILE: page, **texts}
        if not set(self.always) <= set(contents) <= set(self.files):
            raise ValueError(f"files of a report: {sorted(contents)}, allowed: {self.files}")
        with orderly():
            _write_all(out, contents)


def _write_all(out: Path, files: Mapping[str, str]) -> None:
    """Write files to a draft beside ``out`` and put that in its place.

    Killed between the two renames, it leaves an earlier report in a hidden folder beside ``out``.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=out.parent) as workshop:
        draft = Path(workshop) / "report"
        draft.mkdir()
        for name, text in files.items():
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
        earlier = Path(workshop) / "earlier"
        try:
            if out.exists():
                out.replace(earlier)
            draft.replace(out)
        except BaseException:
            if earlier.exists() and not out.exists():
                earlier.replace(out)
            raise
