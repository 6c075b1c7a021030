"""Line numbers for errors in TOML files, which the parser of Python does not keep."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive.toml_fields import Fields


@contextmanager
def toml_with_lines(path: Path) -> Iterator[Fields]:
    """Give the top table of a file; errors about its fields leave the block with their line.

    Raises
    ------
    InvalidInput
        If the file is not valid TOML, or whatever is raised inside the block.
    OSError
        If it cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8")
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(path.name, str(error), "valid TOML in UTF-8") from None
    try:
        yield Fields(table, path.name)
    except InvalidInput as error:
        if not error.field.startswith(f"{path.name}."):
            raise
        key = error.field.removeprefix(f"{path.name}.")
        field = f"{path.name}, line {_line_of(text, key)}: {key}"
        raise InvalidInput(field, error.value, error.allowed) from None


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
            table = header[1].strip()
            lines[table] = number
        elif field := re.match(r"\s*([\w-]+)\s*=", line):
            lines.setdefault(f"{table}.{field[1]}".lstrip("."), number)
    return lines
