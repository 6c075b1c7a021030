"""The file of a drive model: the tables of the two TOML formats, in SI units, as one header."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from pymoo_hdte.drive.datasheet import NOMINAL_QUANTITIES, DataSheet, datasheet_from_fields
from pymoo_hdte.drive.port_effects import with_unit
from pymoo_hdte.io.archive import FileFormat
from pymoo_hdte.io.fields import Fields

if TYPE_CHECKING:
    from pymoo_hdte.drive.model import DriveModel

FORMAT = FileFormat("pymoo_hdte drive model", version=1, fields=("data_sheet", "model"))


def model_tables(model: DriveModel) -> dict[str, Any]:
    """Return the header's tables: ``data_sheet`` and ``model``, as in the files of ``drive/data``.

    Quantities are in the SI unit of `toml_fields.UNITS` whose factor is 1, so no bit is lost.
    """
    error = model.kinematic_error
    table = {
        "name": model.name,
        "description": model.description,
        "provenance": model.provenance,
        "kinematic_error": {
            "orders": list(error.orders),
            "amplitudes": list(error.amplitudes),
            "phases": list(error.phases),
            "reading": error.reading,
            "std": with_unit(error.std, "angle"),
        },
    }
    # TOML has no empty array of tables.
    effects = {"effect": [effect.to_dict() for effect in model.effects]} if model.effects else {}
    return {"data_sheet": sheet_table(model.sheet), "model": table | effects}


def parts_of(tables: dict[str, Any]) -> tuple[Fields, DataSheet]:
    """Return the fields of the model and the data sheet that `model_tables` were made from.

    Raises
    ------
    InvalidInput
        For a wrong, missing or superfluous field of the data sheet.
    """
    sheet = datasheet_from_fields(Fields(tables["data_sheet"], "data_sheet"))
    return Fields(tables["model"], "model"), sheet


def sheet_table(sheet: DataSheet) -> dict[str, Any]:
    """Return the table of a data sheet, from which `datasheet_from_fields` makes it again."""
    nominal = asdict(sheet.nominal)
    return {
        "name": sheet.name,
        "source": sheet.source,
        "teeth": {
            "flexspline": sheet.flexspline_teeth,
            "circular_spline": sheet.circular_spline_teeth,
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
