"""TOML files: read with clear errors, written so that every number is read back exactly."""

from __future__ import annotations

import io
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from pymoo_hdte._io.budget import LARGEST_TOML, regular_file
from pymoo_hdte._io.encodings import decoded
from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import Complaints, InvalidInput, complaints_of

_DEEPEST_KEY = 50
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{{_DEEPEST_KEY}}}")
"""The time of tomllib grows with the square of a key's parts: 40,000 of them take a minute."""


def toml_text(table: Mapping[str, Any]) -> str:
    """Return a table as TOML.

    Parameters
    ----------
    table : mapping
        Table of texts, numbers, truth values, lists and tables of these; numpy scalars are numbers.

    Returns
    -------
    str
        Every float has all its digits.

    Raises
    ------
    TypeError
        For a value that TOML does not have, such as None.

    Examples
    --------
    >>> print(toml_text({"name": "joint", "gain": {"value": 0.1}}), end="")
    name = "joint"
    <BLANKLINE>
    [gain]
    value = 0.1
    """
    return tomli_w.dumps(_plain(table))


def _plain(value: Any) -> Any:
    """Return a value without numpy's scalars, which TOML writers do not support."""
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


def read_toml(path: Path) -> Fields:
    """Return the top table of a TOML file.

    Raises
    ------
    InvalidInput
        If the file is not valid TOML, larger than `budget.LARGEST_TOML`, a pipe or a device.
    OSError
        If it cannot be read.
    """
    return Fields(_parsed(path, str(path))[1], path.name)


@contextmanager
def toml_with_lines(path: Path) -> Iterator[Fields]:
    """Give the top table of a file; errors about its fields leave the block with their line.

    Raises
    ------
    InvalidInput
        As `read_toml`, or whatever is raised inside the block.
    OSError
        If it cannot be read.
    """
    text, table = _parsed(path, path.name)
    try:
        yield Fields(table, path.name)
    except InvalidInput as error:
        complaints = Complaints()
        for complaint in complaints_of(error):
            with complaints.noted():
                raise _with_line(complaint, path, text) from None
        complaints.finish()


@contextmanager
def named_by_file(path: Path, places: Mapping[str, str] | None = None) -> Iterator[None]:
    """Have errors within that do not name a file name this one.

    Parameters
    ----------
    path : Path
    places : mapping of str, optional
        Where the file has fields that are named otherwise.

    Raises
    ------
    InvalidInput
        Whatever is raised inside the block.
    """
    try:
        yield
    except InvalidInput as error:
        if error.field.startswith(f"{path.name}."):
            raise
        known = (places or {}).get(error.field)
        place = f"{path.name}.{known}" if known else f"{path.name}: {error.field}"
        raise InvalidInput(place, error.value, error.allowed) from None


def _with_line(error: InvalidInput, path: Path, text: str) -> InvalidInput:
    """Return an error with the line of its field; an error about something else as it is."""
    if not error.field.startswith(f"{path.name}."):
        return error
    key = error.field.removeprefix(f"{path.name}.")
    field = f"{path.name}, line {_line_of(text, key)}: {key}"
    return InvalidInput(field, error.value, error.allowed)


def _parsed(path: Path, named: str) -> tuple[str, dict[str, Any]]:
    """Return the text of a file and its top table."""
    regular_file(path)
    with path.open("rb") as file:
        content = file.read(LARGEST_TOML + 1)
    if len(content) > LARGEST_TOML:
        raise InvalidInput(
            named, f"more than {LARGEST_TOML} bytes", f"at most {LARGEST_TOML} bytes"
        )
    try:
        text = io.StringIO(decoded(content), newline=None).read()
        if _DEEP_KEY.search(text):
            raise ValueError(f"a key of more than {_DEEPEST_KEY} parts")
        return text, tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # Besides invalid TOML: too many digits for Python, and brackets nested too deeply.
        raise InvalidInput(named, str(error), "valid TOML in UTF-8") from None


def _line_of(text: str, key: str) -> int:
    """Return the line of ``table[index].field``, or of its table if the field is absent."""
    lines = _lines_of_keys(text)
    while key not in lines and key:
        key = re.sub(r"(^|[.\[: ])[^.\[: ]*$", "", key)
    return lines.get(key, 1)


def _lines_of_keys(text: str) -> dict[str, int]:
    lines: dict[str, int] = {}
    counts: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*\[\[([^]]+)]]", line):
            name = header[1].strip()
            table = f"{name}[{counts.get(name, 0)}]"
            counts[name] = counts.get(name, 0) + 1
            lines[table] = number
        elif header := re.match(r"\s*\[([^]]+)]", line):
            head, dot, tail = header[1].strip().partition(".")
            # A table inside the latest of an array of tables.
            latest = f"[{counts[head] - 1}]" if dot and head in counts else ""
            table = f"{head}{latest}{dot}{tail}"
            lines[table] = number
        elif field := re.match(r"\s*([\w-]+)\s*=", line):
            lines.setdefault(f"{table}.{field[1]}".lstrip("."), number)
    return lines
