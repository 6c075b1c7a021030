"""A drive model as text: the two TOML files that `load_datasheet` and `load_model` read."""

from __future__ import annotations

import json
from collections.abc import Mapping

from pymoo_hdte.drive.datasheet import DataSheet
from pymoo_hdte.drive.model import DriveModel


def model_toml(model: DriveModel) -> str:
    """Return the model, without its data sheet, as the text that `load_model` reads back exactly.

    Its values are in SI units, with all their digits.
    """
    error = model.kinematic_error
    top = {
        "name": model.name,
        "description": model.description,
        "provenance": model.provenance,
    }
    kinematic_error = {
        "orders": list(error.orders),
        "amplitudes": list(error.amplitudes),
        "phases": list(error.phases),
        "reading": error.reading,
        "std": _quantity(error.std, "rad"),
    }
    parts = [
        _fields(top),
        _table("[kinematic_error]", kinematic_error),
        *(_table("[[effect]]", effect.to_dict()) for effect in model.effects),
    ]
    return "\n".join(parts)


def sheet_toml(sheet: DataSheet) -> str:
    """Return a data sheet as the text that `load_datasheet` reads back exactly, in SI units."""
    teeth = {
        "flexspline": sheet.flexspline_teeth,
        "circular_spline": sheet.circular_spline_teeth,
    }
    rated = {
        "input_speed": _quantity(sheet.input_speed, "rad/s"),
        "load_torque": _quantity(sheet.load_torque, "N.m"),
    }
    units = {"static_error": "rad", "stiffness": "N.m/rad"} | {
        f"{port}_inertia": "kg.m2" for port in ("input", "output")
    }
    nominal = {
        field: _quantity(value, units.get(field, "N.m.s/rad"))
        for field, value in vars(sheet.nominal).items()
    }
    mesh = {
        "error_influence": sheet.mesh.error_influence,
        "teeth_in_mesh": sheet.mesh.teeth_in_mesh,
        "pitch_diameter": _quantity(sheet.mesh.pitch_diameter, "m"),
        "pressure_angle": _quantity(sheet.mesh.pressure_angle, "rad"),
    }
    sources = [
        {
            "component": source.component,
            "symbol": source.symbol,
            "description": source.description,
            "class": source.error_class,
            "mean": _quantity(source.mean, "m"),
            "std": _quantity(source.std, "m"),
        }
        for source in sheet.error_sources
    ]
    parts = [
        _fields({"name": sheet.name, "source": sheet.source}),
        _table("[teeth]", teeth),
        _table("[rated]", rated),
        _table("[nominal]", nominal),
        _table("[mesh]", mesh),
        *(_table("[[error_source]]", source) for source in sources),
    ]
    return "\n".join(parts)


def _quantity(value: float, unit: str) -> dict[str, object]:
    return {"value": value, "unit": unit}


def _table(heading: str, fields: Mapping[str, object]) -> str:
    return f"{heading}\n{_fields(fields)}"


def _fields(fields: Mapping[str, object]) -> str:
    return "".join(f"{name} = {_value(value)}\n" for name, value in fields.items())


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
    # JSON escapes what TOML must have escaped, and in the same way.
    return json.dumps(value, ensure_ascii=False)
