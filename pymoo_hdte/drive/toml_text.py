"""A drive model as text: the two TOML files that `load_datasheet` and `load_model` read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pymoo_hdte.drive.datasheet import DataSheet, sheet_table
from pymoo_hdte.drive.model import DriveModel, model_tables


def model_toml(model: DriveModel) -> str:
    """Return the model, without its data sheet, as the text that `load_model` reads back exactly.

    Its values are in SI units, with all their digits.
    """
    return _document(model_tables(model)["model"])


def sheet_toml(sheet: DataSheet) -> str:
    """Return a data sheet as the text that `load_datasheet` reads back exactly, in SI units."""
    return _document(sheet_table(sheet))


def _document(table: Mapping[str, Any]) -> str:
    """Return a table as TOML: first its plain fields, then the tables in it."""
    plain = {name: value for name, value in table.items() if not _holds_tables(value)}
    parts = [_fields(plain)]
    for name, value in table.items():
        if isinstance(value, Mapping):
            parts.append(toml_table(f"[{name}]", value))
        elif _holds_tables(value):
            parts.extend(toml_table(f"[[{name}]]", row) for row in value)
    return "\n".join(parts)


def _holds_tables(value: object) -> bool:
    rows = value if isinstance(value, list) else [value]
    return any(isinstance(row, Mapping) for row in rows)


def toml_table(heading: str, fields: Mapping[str, object]) -> str:
    """Return plain fields below the heading of their table."""
    return f"{heading}\n{_fields(fields)}"


def _fields(fields: Mapping[str, object]) -> str:
    return "".join(f"{name} = {_value(value)}\n" for name, value in fields.items())


def toml_string(text: str) -> str:
    """Return a text in quotes, as every TOML reader gives it back."""
    # JSON escapes in the same way all that TOML must have escaped, but for DEL.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object) -> str:
    """Return a text, number, list or table of these in TOML."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{name} = {_value(one)}" for name, one in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, list):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(float(value))
    return toml_string(str(value))
