"""A folder of a report: written whole or not at all, and never over anything else."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Collection
from pathlib import Path

from pymoo_hdte.checks import InvalidInput

PAGE_FILE = "report.html"


def check_folder(out: Path, always: Collection[str], sometimes: Collection[str] = ()) -> None:
    """Refuse a folder that could not take a report, before anybody waits for one.

    Parameters
    ----------
    out : Path
        New, empty, or an earlier report, which will be replaced.
    always, sometimes : collection of str
        Names of the files by which an earlier report is known: all of the first, no others.

    Raises
    ------
    InvalidInput
        If ``out`` holds anything else.
    OSError
        If it cannot be written.
    """
    allowed = "a folder that is new, empty or an earlier report, but not the one you are in"
    dangling = any(one.is_symlink() and not one.exists() for one in out.absolute().parents)
    folder = out.is_dir() or not out.exists()
    if dangling or out.is_symlink() or not folder or out.resolve() == Path.cwd():
        raise InvalidInput("folder of the report", str(out), allowed)
    if out.is_dir():
        present = {path.name for path in out.iterdir()}
        if present and not set(always) <= present <= {*always, *sometimes}:
            raise InvalidInput("folder of the report", str(out), allowed)
    parent = next(folder for folder in out.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(parent))
    if not os.access(parent, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(parent))


def write_folder(out: Path, files: dict[str, str]) -> None:
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
