"""Data sheets on file: read with the units of every quantity, and written in SI."""

from __future__ import annotations

from dataclasses import asdict
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import named_by_file, toml_with_lines
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive.datasheet import (
    LARGEST_TWIST,
    LOST_POWER,
    MEMBERS,
    NOMINAL_QUANTITIES,
    DataSheet,
    ErrorSource,
    Mesh,
    Nominal,
)
from pymoo_hdte.effects.quantities import with_unit

Arrangement = tuple[str, str | None]
PLACES = {
    "circular_spline_teeth": "teeth.circular_spline",
    "pressure_angle": "mesh.pressure_angle",
    "stiffness": "nominal.stiffness",
}
"""Where a file has what the classes of a data sheet refuse, by its name there."""

USUAL_ARRANGEMENT: Arrangement = ("circular_spline", None)
"""``held`` and ``orders_as_held`` of a data sheet that does not say them."""
EARLIER_ARRANGEMENT: Arrangement = ("flexspline", "circular_spline")
"""``held`` and ``orders_as_held`` that stored models mean that do not say them: the paper's."""


def load_datasheet(path: str | Path) -> DataSheet:
    """Read and check a data sheet in the format of ``drive/data/hs_20_100.toml``.

    Parameters
    ----------
    path : str or Path
        A TOML file, in which every quantity has its unit.

    Returns
    -------
    DataSheet

    Raises
    ------
    InvalidInput
        Naming file and line, for a wrong, missing, superfluous, negative, non-finite or unit-less
        field.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> load_datasheet("my_drive.toml").ratio
    80.0
    """
    path = Path(path)
    # What the data sheet itself refuses is named as it stands in the file.
    with toml_with_lines(path) as top, named_by_file(path, PLACES):
        sheet = datasheet_from_fields(top)
        check_twist(sheet)
    return sheet


def datasheet_from_fields(sheet: Fields, unstated: Arrangement | None = None) -> DataSheet:
    """Build a data sheet from its table.

    Parameters
    ----------
    sheet : Fields
    unstated : (str, str or None), optional
        ``held`` and ``orders_as_held`` of a table without them, such as `EARLIER_ARRANGEMENT`. By
        default the circular spline is held, as makers state their ratios.

    Raises
    ------
    InvalidInput
        As `load_datasheet`.
    """
    teeth = sheet.table("teeth")
    held, as_held = unstated or USUAL_ARRANGEMENT
    if teeth.has("held"):
        held, as_held = teeth.choice("held", MEMBERS), None
    if teeth.has("orders_as_held"):
        as_held = teeth.choice("orders_as_held", MEMBERS)
    rated = sheet.table("rated")
    result = DataSheet(
        name=sheet.text("name"),
        source=sheet.text("source"),
        flexspline_teeth=teeth.whole("flexspline", 2),
        circular_spline_teeth=teeth.whole("circular_spline", 3),
        held=held,
        orders_as_held=as_held,
        input_speed=rated.quantity("input_speed", "speed", above=0.0),
        load_torque=rated.quantity("load_torque", "torque"),
        nominal=_nominal(sheet.table("nominal")),
        mesh=_mesh(sheet.table("mesh")),
        error_sources=tuple(_error_source(row) for row in sheet.tables("error_source")),
    )
    for table in (teeth, rated, sheet):
        table.finish()
    return result


def hs_20_100() -> DataSheet:
    """Return the data sheet of the drive in the paper, HS-20-100 (Tables 1, 2 and 4).

    Examples
    --------
    >>> hs_20_100().circular_spline_teeth
    202
    """
    with as_file(files("pymoo_hdte.drive") / "data" / "hs_20_100.toml") as path:
        return load_datasheet(path)


def check_twist(sheet: DataSheet, field: str = "stiffness", cause: str = LOST_POWER) -> None:
    """Refuse a stiffness that the rated load would twist as no drive can bear.

    Parameters
    ----------
    sheet : DataSheet
    field : str
        The field that the error names.
    cause : str
        The likely mistake, as the end of a sentence.

    Raises
    ------
    InvalidInput
        If the rated load twists the drive by more than `LARGEST_TWIST`.

    Examples
    --------
    >>> check_twist(hs_20_100())
    """
    stiffness, load = sheet.nominal.stiffness, abs(sheet.load_torque)
    if load > LARGEST_TWIST * stiffness:
        allowed = (
            f"at least {load / LARGEST_TWIST:.3g} N.m/rad, or the rated load of the "
            f"data sheet would twist the drive by more than {LARGEST_TWIST:g} rad; {cause}"
        )
        raise InvalidInput(field, float(f"{stiffness:.6g}"), allowed)


def _nominal(table: Fields) -> Nominal:
    values = {
        name: table.quantity(name, kind, above=0.0) for name, kind in NOMINAL_QUANTITIES.items()
    }
    table.finish()
    return Nominal(**values)


def _mesh(table: Fields) -> Mesh:
    mesh = Mesh(
        error_influence=table.number("error_influence", above=0.0),
        teeth_in_mesh=table.whole("teeth_in_mesh", 1),
        pitch_diameter=table.quantity("pitch_diameter", "length", above=0.0),
        pressure_angle=table.quantity("pressure_angle", "angle", at_least=0.0),
    )
    table.finish()
    return mesh


def _error_source(row: Fields) -> ErrorSource:
    source = ErrorSource(
        component=row.text("component"),
        symbol=row.text("symbol"),
        description=row.text("description"),
        error_class=row.text("class"),
        mean=row.quantity("mean", "length", at_least=0.0),
        std=row.quantity("std", "length", at_least=0.0),
    )
    row.finish()
    return source


def sheet_table(sheet: DataSheet) -> dict[str, Any]:
    """Return the table of a data sheet, from which `datasheet_from_fields` makes it again."""
    nominal = asdict(sheet.nominal)
    return {
        "name": sheet.name,
        "source": sheet.source,
        "teeth": {
            "flexspline": sheet.flexspline_teeth,
            "circular_spline": sheet.circular_spline_teeth,
            "held": sheet.held,
            **({"orders_as_held": sheet.orders_as_held} if sheet.orders_as_held else {}),
        },
        "rated": {
            "input_speed": with_unit(sheet.input_speed, "speed"),
            "load_torque": with_unit(sheet.load_torque, "torque"),
        },
        "nominal": {
            name: with_unit(nominal[name], quantity)
            for name, quantity in NOMINAL_QUANTITIES.items()
        },
        "mesh": {
            "error_influence": sheet.mesh.error_influence,
            "teeth_in_mesh": sheet.mesh.teeth_in_mesh,
            "pitch_diameter": with_unit(sheet.mesh.pitch_diameter, "length"),
            "pressure_angle": with_unit(sheet.mesh.pressure_angle, "angle"),
        },
        "error_source": [
            {
                "component": source.component,
                "symbol": source.symbol,
                "description": source.description,
                "class": source.error_class,
                "mean": with_unit(source.mean, "length"),
                "std": with_unit(source.std, "length"),
            }
            for source in sheet.error_sources
        ],
    }
