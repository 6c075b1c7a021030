"""What a drive model holds, and how files tell it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive._effects import DriveEffect, effect_from_fields
from pymoo_hdte.drive.datasheet import DataSheet
from pymoo_hdte.drive.datasheet_file import (
    EARLIER_ARRANGEMENT,
    datasheet_from_fields,
    sheet_table,
)
from pymoo_hdte.drive.kinematic_error import KinematicError
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.effects.quantities import with_unit
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True)
class ModelValues:
    """The values of a `DriveModel`, without its equations of motion.

    Attributes
    ----------
    name, description, provenance : str
    sheet : DataSheet
    kinematic_error : KinematicError
    effects : tuple of DriveEffect

    Raises
    ------
    InvalidInput
        For two effects of one name at the same port and order.

    Examples
    --------
    >>> from pymoo_hdte.drive import hs_20_100
    >>> error = KinematicError((2.0,), (1.0,), (0.0,), "peak_to_peak", std=60.0 * ARCSEC)
    >>> ModelValues("mine", "a joint", "a catalogue", hs_20_100(), error).effects
    ()
    """

    name: str
    description: str
    provenance: str
    sheet: DataSheet
    kinematic_error: KinematicError
    effects: tuple[DriveEffect, ...] = ()

    def __post_init__(self) -> None:
        places = [place_of(effect) for effect in self.effects]
        if len(set(places)) != len(places):
            names = [effect.name for effect in self.effects]
            raise InvalidInput("effects", names, "each effect once, at each port and order")

    def to_dict(self) -> dict[str, Any]:
        """Return the values of the model, JSON-able, as a record beside results.

        Units stand in the keys; ``nominal`` is in SI.
        """
        error = self.kinematic_error
        return {
            "name": self.name,
            "description": self.description,
            "provenance": self.provenance,
            "data_sheet": self.sheet.name,
            "flexspline_teeth": self.sheet.flexspline_teeth,
            "circular_spline_teeth": self.sheet.circular_spline_teeth,
            "nominal": asdict(self.sheet.nominal),
            "input_speed_rad_s": self.sheet.input_speed,
            "load_torque_Nm": self.sheet.load_torque,
            "kinematic_error": {
                "orders": list(error.orders),
                "amplitudes": list(error.amplitudes),
                "phases_rad": list(error.phases),
                "reading": error.reading,
                "std_arcsec": error.std / ARCSEC,
            },
            "effects": [effect.to_dict() for effect in self.effects],
        }


def model_tables(model: ModelValues) -> dict[str, Any]:
    """Return the header's tables: ``data_sheet`` and ``model``, as in the files of ``drive/data``.

    Quantities are in the SI unit of `units.UNITS` whose factor is 1, so no bit is lost.
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
    sheet = sheet_table(model.sheet)
    if (model.sheet.held, model.sheet.orders_as_held) == EARLIER_ARRANGEMENT:
        # Files keep the bytes that they had when there was no other arrangement.
        for name in ("held", "orders_as_held"):
            del sheet["teeth"][name]
    return {"data_sheet": sheet, "model": table | effects}


def parts_of(tables: dict[str, Any]) -> tuple[Fields, DataSheet]:
    """Return the fields of the model and the data sheet that `model_tables` were made from.

    Raises
    ------
    InvalidInput
        For a wrong, missing or superfluous field of the data sheet.
    """
    table = Fields(tables["data_sheet"], "data_sheet")
    sheet = datasheet_from_fields(table, EARLIER_ARRANGEMENT)
    return Fields(tables["model"], "model"), sheet


def values_of(fields: Fields, sheet: DataSheet) -> dict[str, Any]:
    """Return the arguments of `ModelValues` that the fields of a model file say.

    Raises
    ------
    InvalidInput
        For a wrong, missing, superfluous or unit-less field.
    """
    error = fields.table("kinematic_error")
    effects = fields.tables("effect") if fields.has("effect") else []
    values = dict(
        name=fields.text("name"),
        description=fields.text("description"),
        provenance=fields.text("provenance"),
        sheet=sheet,
        kinematic_error=KinematicError(
            orders=error.numbers("orders"),
            amplitudes=error.numbers("amplitudes"),
            phases=error.numbers("phases"),
            reading=error.text("reading"),
            std=error.quantity("std", "angle"),
        ),
        effects=tuple(effect_from_fields(table) for table in effects),
    )
    error.finish()
    fields.finish()
    return values
