"""Checked fields with units of a parsed TOML table: for data sheets, model files and rigs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from difflib import get_close_matches
from typing import Any

from pymoo_hdte.checks import Complaints, InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.units import UNITS, suggestion, usual_spelling


class Fields:
    """One TOML table whose fields are removed when read, so that any remaining field is an error.

    Parameters
    ----------
    table : mapping
        The parsed table.
    path : str
        Where the table stands, for error messages (``"hs_20_100.toml: nominal"``).

    Raises
    ------
    InvalidInput
        By every method: for a missing, misspelt, unit-less, non-finite or out-of-range field.
    """

    def __init__(self, table: Any, path: str) -> None:
        if not isinstance(table, Mapping):
            raise InvalidInput(path, table, "a table of fields")
        self._unread = dict(table)
        self._path = path

    def name_of(self, field: str) -> str:
        """Return the name of a field in error messages."""
        return f"{self._path}.{field}"

    def take(self, field: str, allowed: str) -> Any:
        """Return the raw value of a field that must be there; ``allowed`` words the error."""
        if field not in self._unread:
            similar = get_close_matches(field, self._unread, 1)
            what = f"missing; is it {similar[0]!r}?" if similar else "missing"
            raise InvalidInput(self.name_of(field), None, f"{allowed} (the field is {what})")
        return self._unread.pop(field)

    def table(self, field: str) -> Fields:
        """Return a nested table."""
        return Fields(self.take(field, "a table of fields"), self.name_of(field))

    def tables(self, field: str) -> list[Fields]:
        """Return a non-empty array of tables."""
        rows = self.take(field, "an array of tables")
        if not isinstance(rows, list) or not rows:
            raise InvalidInput(self.name_of(field), rows, "a non-empty array of tables")
        return [Fields(row, f"{self.name_of(field)}[{index}]") for index, row in enumerate(rows)]

    def text(self, field: str) -> str:
        """Return a non-empty string."""
        value = self.take(field, "a non-empty string")
        if not isinstance(value, str) or not value.strip():
            raise InvalidInput(self.name_of(field), value, "a non-empty string")
        return value

    def choice(self, field: str, words: Collection[str]) -> str:
        """Return a string that is one of ``words``."""
        return one_of(self.name_of(field), self.take(field, f"one of {', '.join(words)}"), words)

    def truth(self, field: str) -> bool:
        """Return a truth value."""
        value = self.take(field, "true or false")
        if not isinstance(value, bool):
            raise InvalidInput(self.name_of(field), value, "true or false")
        return value

    def whole(self, field: str, at_least: int) -> int:
        """Return a whole number."""
        allowed = f"a whole number of at least {at_least}"
        return whole_number(self.name_of(field), self.take(field, allowed), at_least)

    def number(self, field: str, **limits: float) -> float:
        """Return a dimensionless finite number within ``limits`` (see `checks.real_number`)."""
        return real_number(self.name_of(field), self.take(field, "a finite number"), **limits)

    def numbers(self, field: str) -> tuple[float, ...]:
        """Return a list of finite numbers."""
        raw = self.take(field, "a list of numbers")
        if not isinstance(raw, list):
            raise InvalidInput(self.name_of(field), raw, "a list of numbers")
        return tuple(
            real_number(f"{self.name_of(field)}[{index}]", value) for index, value in enumerate(raw)
        )

    def texts(self, field: str) -> tuple[str, ...]:
        """Return a list of non-empty strings."""
        raw = self.take(field, "a list of strings")
        if not isinstance(raw, list) or not all(isinstance(text, str) and text for text in raw):
            raise InvalidInput(self.name_of(field), raw, "a list of non-empty strings")
        return tuple(raw)

    def quantity(self, field: str, kind: str, **limits: float) -> float:
        """Return a quantity in SI units, given as ``{ value = ..., unit = "..." }``.

        ``kind`` is one of `UNITS`, or the only unit that it may be given in, one of SI.
        """
        units = UNITS.get(kind, {kind: 1.0})
        allowed = f'{{ value = ..., unit = "..." }} with a unit among {", ".join(units)}'
        raw = self.take(field, allowed)
        if not isinstance(raw, Mapping) or set(raw) != {"value", "unit"}:
            raise InvalidInput(self.name_of(field), raw, allowed)
        unit = usual_spelling(raw["unit"]) if isinstance(raw["unit"], str) else ""
        if unit not in units:
            allowed = f"{', '.join(units)}{suggestion(str(raw['unit']), units)}"
            raise InvalidInput(f"{self.name_of(field)}.unit", raw["unit"], allowed)
        return real_number(f"{self.name_of(field)}.value", raw["value"], **limits) * units[unit]

    def names(self) -> tuple[str, ...]:
        """Return the names of the remaining fields."""
        return tuple(self._unread)

    def has(self, field: str) -> bool:
        """Tell whether an optional field is there."""
        return field in self._unread

    def is_table(self, field: str) -> bool:
        """Tell whether a remaining field is a table."""
        return isinstance(self._unread.get(field), Mapping)

    def is_number(self, field: str) -> bool:
        """Tell whether a remaining field is a number."""
        return isinstance(self._unread.get(field), int | float)

    def finish(self) -> None:
        """Raise `InvalidInput` if a field was not asked for: it is misspelt or misplaced."""
        complaints = Complaints()
        for field, value in self._unread.items():
            with complaints.noted():
                raise InvalidInput(self.name_of(field), value, "no such field here")
        complaints.finish()
