"""What all reports share: a folder written whole or not at all, its page, and how numbers look."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.revise import MODEL_FILE, SHEET_FILE

VERDICT_FILE = "verdict.json"
PAGE_FILE = "report.html"
FILES = (VERDICT_FILE, PAGE_FILE, MODEL_FILE, SHEET_FILE)


def page(package: str, template: str, **values: Any) -> str:
    """Return a page from a template of a package, which may include ``style.css``."""
    environment = Environment(
        loader=ChoiceLoader(
            [PackageLoader(one, ".") for one in (package, "pymoo_hdte.discrepancy")]
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    return environment.get_template(template).render(**values)


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for the reader, without an exponent where it can be helped."""
    if value is None or not np.isfinite(value):
        return "\N{EN DASH}"
    size = abs(value)
    if value == 0.0 or 1e-3 <= size < 1e5:
        shown = np.format_float_positional(value, digits, fractional=False, trim="-")
        return shown.replace("-", "\N{MINUS SIGN}")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}·10{power}".replace("-", "\N{MINUS SIGN}")


def check_folder(out: Path) -> None:
    """Refuse a folder that could not take a report, before anybody waits for one.

    Errors as in `write_report`.
    """
    allowed = "a folder that is new, empty or an earlier report"
    if out.is_symlink() or (out.exists() and not out.is_dir()):
        raise InvalidInput("folder of the report", str(out), allowed)
    if out.is_dir():
        present = {path.name for path in out.iterdir()}
        if present and not {VERDICT_FILE, PAGE_FILE} <= present <= set(FILES):
            raise InvalidInput("folder of the report", str(out), allowed)
    parent = next(folder for folder in out.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(parent))
    if not os.access(parent, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(parent))


def write_folder(out: Path, files: dict[str, str]) -> None:
    """Write files to a draft beside ``out`` and put that in its place."""
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
