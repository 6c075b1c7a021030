"""A drive model: data sheet, kinematic error, effects. It maps uncertain parameters to the DTE."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte._io.archive import FileFormat
from pymoo_hdte._io.toml import read_toml
from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.hill import found_steady_states, hill_steady_state
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive.datasheet import NOMINAL_FIELDS, DataSheet
from pymoo_hdte.drive.datasheet_file import hs_20_100
from pymoo_hdte.drive.model_values import ModelValues, model_tables, parts_of, values_of
from pymoo_hdte.drive.parameters import PARAMETERS, checked
from pymoo_hdte.units import ARCSEC

FORMAT = FileFormat("pymoo_hdte drive model", version=1, fields=("data_sheet", "model"))

PRESETS = ("published", "calibrated", "resonant")
"""Names of the models that `preset` returns.

Examples
--------
>>> [preset(name).name for name in PRESETS]
['published', 'calibrated', 'resonant']
"""


@dataclass(frozen=True)
class DriveModel(ModelValues):
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
        theta_s, stiffness, input_inertia, input_damping, mesh_damping = checked(parameters).T
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
        `pymoo_hdte.drive._solve.hill`.

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
        has_state, spectrum = found_steady_states(self.coefficients(parameters))
        dte = np.full(len(has_state), np.nan)
        dte[has_state] = spectrum.peak_to_peak(self.sheet.ratio) / ARCSEC
        return dte

    def at(self, input_speed: float, load_torque: float) -> DriveModel:
        """Return the model at another operating condition.

        Parameters
        ----------
        input_speed : float
            Mean speed of the input, rad/s, above 0.
        load_torque : float
            N.m at the output; negative where it drives the motion.

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
        if values_of(*parts_of(tables))["effects"] != tuple(self.effects):
            raise InvalidInput("effects", self.effects, "those that `effect_from_fields` builds")
        FORMAT.write(path, tables)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> DriveModel:
        """Read a model that `save` wrote.

        Parameters
        ----------
        path : str or path-like
            A file in the format of ``docs/file_format.md``.

        Returns
        -------
        DriveModel

        Raises
        ------
        InvalidInput, OSError
            As `FileFormat.read`, and for a field that `load_datasheet` or `load_model` refuses.
        """
        return cls(**values_of(*parts_of(FORMAT.read(path)[0])))


def load_model(path: str | Path, sheet: DataSheet) -> DriveModel:
    """Read a model file in the format of ``drive/data/calibrated.toml``.

    Parameters
    ----------
    path : str or Path
        A TOML file, in which every quantity has its unit.
    sheet : DataSheet
        Data sheet of the drive.

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
    return DriveModel(**values_of(read_toml(Path(path)), sheet))


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
