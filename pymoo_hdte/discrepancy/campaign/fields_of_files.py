"""Fields of a campaign's file with their units in their names: built into objects, and back."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, TypeVar

from pymoo_hdte.checks import Complaints, InvalidInput, real_number
from pymoo_hdte.discrepancy.campaign.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy.campaign.format import Names
from pymoo_hdte.discrepancy.campaign.records import RunningRecord, TorsionRecord
from pymoo_hdte.io.fields import Fields

Checked = TypeVar("Checked", BelievedDrive, Rig, RunningRecord | TorsionRecord)


def in_units(values: Any, names: Names) -> dict[str, Any]:
    """Return the attributes of an object under the names and in the units of the file."""

    def rounded(value: Any, factor: float) -> Any:
        if isinstance(value, tuple):
            return [rounded(item, factor) for item in value]
        # Twelve digits hide the rounding of the conversion and exceed the accuracy of any value.
        digits = f"{value / factor:.12g}"
        return int(digits) if digits.lstrip("-").isdigit() else float(digits)

    return {key: rounded(getattr(values, name), factor) for name, (key, factor) in names.items()}


def build(kind: type[Checked], names: Names, table: Fields, place: str, **known: Any) -> Checked:
    """Build a checked object from a table; its errors name the field as the file does."""
    optional = {field.name for field in fields(kind) if field.default is not MISSING}
    values = dict(known)
    complaints = Complaints()
    for attribute, (key, factor) in names.items():
        if attribute in known or (attribute in optional and not table.has(key)):
            continue
        with complaints.noted():
            values[attribute] = _si(table.take(key, "a number"), f"{place}.{key}", factor)
    with complaints.noted():
        table.finish()
    complaints.finish()
    try:
        return kind(**values)
    except InvalidInput as error:
        if error.field not in names:
            raise
        raise placed_in_table(error, error.field, names, place) from None


def _si(raw: Any, field: str, factor: float) -> Any:
    """Return a number or a tuple of numbers in SI units; whole numbers without unit stay whole."""
    if isinstance(raw, list):
        return tuple(_number_in_si(item, field, factor) for item in raw)
    return _number_in_si(raw, field, factor)


def _number_in_si(raw: Any, field: str, factor: float) -> float:
    number = real_number(field, raw) * factor
    return raw if isinstance(raw, int) and factor == 1.0 else number


def placed_in_table(error: InvalidInput, attribute: str, names: Names, place: str) -> InvalidInput:
    """Return an error about an attribute as one about its field in the file, in its unit."""
    key, factor = names[attribute]
    value = error.value
    if isinstance(value, float):
        value /= factor
    elif isinstance(value, tuple):
        value = tuple(number / factor for number in value)
    return InvalidInput(f"{place}.{key}", value, error.allowed)
