"""A drive model: data sheet, kinematic error, effects. It maps uncertain parameters to the DTE."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of
from pymoo_hdte.drive.datasheet import NOMINAL_FIELDS, DataSheet, unit_of
from pymoo_hdte.drive.datasheet_file import (
    EARLIER_ARRANGEMENT,
    datasheet_from_fields,
    hs_20_100,
    sheet_table,
)
from pymoo_hdte.drive.effects import DriveEffect, effect_from_fields
from pymoo_hdte.drive.kinematic_error import KinematicError
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.drive.solve.hill import found_steady_states, hill_steady_state
from pymoo_hdte.drive.solve.order_spectrum import OrderSpectrum
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.effects.quantities import with_unit
from pymoo_hdte.io.archive import FileFormat
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.io.toml import read_toml
from pymoo_hdte.units import ARCSEC

PARAMETERS = ("theta_s", "K", "J_in", "B_in", "B_fc")
"""The uncertain parameters xi of Section 2.3, in this order.

Examples
--------
>>> dict(zip(PARAMETERS, PARAMETER_UNITS))["K"]
'N.m/rad'
"""

PARAMETER_UNITS = tuple(unit_of(name) for name in PARAMETERS)
"""Units of `PARAMETERS`, one for each.

Examples
--------
>>> PARAMETER_UNITS[PARAMETERS.index("J_in")]
'kg.m2'
"""

FORMAT = FileFormat("pymoo_hdte drive model", version=1, fields=("data_sheet", "model"))

PRESETS = ("published", "calibrated", "resonant")
"""Names of the models that `preset` returns.

Examples
--------
>>> [preset(name).name for name in PRESETS]
['published', 'calibrated', 'resonant']
"""

LARGEST_STATIC_ERROR = 0.1
"""rad; any larger theta_s must be an angle in other units."""


@dataclass(frozen=True)
class DriveModel:
    """The equations of motion, Eq. (9), of one drive under rated conditions, and its effects.

    Attributes
    ----------
    name, description, provenance : str
        ``description`` says in a sentence what the model is, ``provenance`` where its values come
        from.
    sheet : DataSheet
        The drive and its rated condition.
    kinematic_error : KinematicError
        What theta_s is over the input angle.
    effects : tuple of DriveEffect
        In the order in which they are applied.

    Raises
    ------
    InvalidInput
        If an effect stands twice at one port and order.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> print(f"{model.dte_arcsec(model.nominal[np.newaxis])[0]:.1f} arcsec")
    86.7 arcsec
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

    @property
    def nominal(self) -> NDArray[np.float64]:
        """Nominal values of `PARAMETERS`, shape (5,), SI units."""
        values = self.sheet.nominal
        return np.array([getattr(values, NOMINAL_FIELDS[name]) for name in PARAMETERS])

    @cached_property
    def _unit_phasors(self) -> NDArray[np.complex128]:
        return self.kinematic_error.unit_phasors(self.sheet.ratio)

    def coefficients(self, parameters: ArrayLike) -> Coefficients:
        """Return the equations of motion of n designs.

        Parameters
        ----------
        parameters : array_like, shape (n, 5)
            `PARAMETERS` in SI units, each above 0.

        Returns
        -------
        Coefficients

        Raises
        ------
        InvalidInput
            If the shape is wrong, a value is not finite or not above 0, or theta_s is 0.1 or more.
        """
        values = finite_array("parameters", parameters, (None, len(PARAMETERS)))
        for name, column in zip(PARAMETERS, values.T, strict=True):
            if np.any(column <= 0.0):
                raise InvalidInput(name, float(column.min()), "above 0")
        theta_s, stiffness, input_inertia, input_damping, mesh_damping = values.T
        if np.any(theta_s >= LARGEST_STATIC_ERROR):
            limit = f"below {LARGEST_STATIC_ERROR} rad; it is not given in arcsec"
            raise InvalidInput("theta_s", float(theta_s.max()), limit)
        coefficients = Coefficients(
            ratio=self.sheet.ratio,
            input_speed=self.sheet.input_speed,
            load_torque=self.sheet.load_torque,
            stiffness=stiffness,
            damping=mesh_damping,
            stiffness_depth=0.0,
            stiffness_phase=0.0,
            input_inertia=input_inertia,
            input_damping=input_damping,
            output_inertia=self.sheet.nominal.output_inertia,
            output_damping=self.sheet.nominal.output_damping,
            error_orders=np.array(self.kinematic_error.orders),
            error_phasors=theta_s[:, None] * self._unit_phasors,
        )
        for effect in self.effects:
            coefficients = effect.apply(coefficients)
        return coefficients

    def steady_state(self, parameters: ArrayLike) -> OrderSpectrum:
        """Return the steady-state theta_d of n designs, rad, as an order spectrum.

        Parameters as in `coefficients`; the methods are those of
        `pymoo_hdte.drive.solve.hill`.

        Raises
        ------
        InvalidInput
            As `coefficients`.
        UnstableDrive
            If the varying stiffness makes a design's motion grow.
        ArithmeticError
            If the harmonics of a deeply varying stiffness do not die out.
        """
        return hill_steady_state(self.coefficients(parameters))

    def dte_arcsec(self, parameters: ArrayLike) -> NDArray[np.float64]:
        """Return the DTE of n designs, shape (n,), in arcsec (Section 4).

        It is the peak-to-peak of the steady-state theta_d over one output turn. Parameters and
        errors as in `steady_state`.
        """
        return self.steady_state(parameters).peak_to_peak(self.sheet.ratio) / ARCSEC

    def dte_where_found(self, parameters: ArrayLike) -> NDArray[np.float64]:
        """Return `dte_arcsec` of those of n designs that have a steady state.

        Parameters
        ----------
        parameters : array_like, shape (n, 5)
            As in `coefficients`.

        Returns
        -------
        ndarray, shape (n,)
            arcsec; NaN for a design whose motion grows or is not found.

        Raises
        ------
        InvalidInput
            As `coefficients`.
        ArithmeticError
            If the harmonics of a deeply varying stiffness do not die out.
        """
        found, spectrum = found_steady_states(self.coefficients(parameters))
        dte = np.full(len(found), np.nan)
        dte[found] = spectrum.peak_to_peak(self.sheet.ratio) / ARCSEC
        return dte

    def at(self, input_speed: float, load_torque: float) -> DriveModel:
        """Return the model at another operating condition.

        Parameters
        ----------
        input_speed : float
            Mean speed of the input, rad/s, above 0.
        load_torque : float
            N.m at the output, at least 0.

        Returns
        -------
        DriveModel

        Raises
        ------
        InvalidInput
            If a value is not finite or out of range.
        """
        sheet = replace(self.sheet, input_speed=input_speed, load_torque=load_torque)
        return replace(self, sheet=sheet)

    def to_dict(self) -> dict[str, Any]:
        """Return what makes the model, JSON-able, as a record beside results.

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

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the whole model to ``path``, replacing it in one step (``docs/file_format.md``).

        Raises
        ------
        InvalidInput
            If the file could not give the model back: a text or the list of error sources is
            empty, or an effect is not one that `effect_from_fields` builds.
        OSError
            If the file cannot be written.
        """
        tables = model_tables(self)
        if _from_fields(*parts_of(tables)).effects != tuple(self.effects):
            raise InvalidInput("effects", self.effects, "those that `effect_from_fields` builds")
        FORMAT.write(path, tables)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> DriveModel:
        """Read a model that `save` wrote.

        Parameters
        ----------
        path : str or path-like
            Of a file in the format of ``docs/file_format.md``.

        Returns
        -------
        DriveModel

        Raises
        ------
        InvalidInput, OSError
            As `FileFormat.read`, and for a field that `load_datasheet` or `load_model` refuses.
        """
        return _from_fields(*parts_of(FORMAT.read(path)[0]))


def load_model(path: str | Path, sheet: DataSheet) -> DriveModel:
    """Read a model file in the format of ``drive/data/calibrated.toml``.

    Parameters
    ----------
    path : str or Path
        Of a TOML file, in which every quantity has its unit.
    sheet : DataSheet
        Of the drive that the model is of.

    Returns
    -------
    DriveModel

    Raises
    ------
    InvalidInput
        For a wrong, missing, superfluous or unit-less field.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> sheet = load_datasheet("my_drive.toml")
    >>> load_model("my_drive_model.toml", sheet).name
    'my_drive'
    """
    return _from_fields(read_toml(Path(path)), sheet)


def _from_fields(fields: Fields, sheet: DataSheet) -> DriveModel:
    error = fields.table("kinematic_error")
    effects = fields.tables("effect") if fields.has("effect") else []
    model = DriveModel(
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
    return model


def preset(name: str) -> DriveModel:
    """Return one of the `PRESETS` of the HS-20-100.

    Parameters
    ----------
    name : {"published", "calibrated", "resonant"}
        ``"published"`` is the equations of motion, Eq. (9), with the printed values of
        Table 4; ``"calibrated"`` adds named effects whose values were fitted to published
        statistics; ``"resonant"`` is an earlier fit, a harder benchmark, whose front is
        disconnected on a surrogate of order 3.

    Returns
    -------
    DriveModel

    Raises
    ------
    InvalidInput
        For another name.

    Examples
    --------
    >>> preset("resonant").sheet.name
    'HS-20-100'
    """
    one_of("model", name, PRESETS)
    with as_file(files("pymoo_hdte.drive") / "data" / f"{name}.toml") as path:
        return load_model(path, hs_20_100())


def model_tables(model: DriveModel) -> dict[str, Any]:
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
