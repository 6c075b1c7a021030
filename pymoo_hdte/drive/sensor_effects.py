"""Named effects of the output encoder: they change what is read, not the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive.port_effects import with_unit
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.laws.law import Values


@dataclass(frozen=True)
class Eccentricity:
    """The disc of the output encoder is off centre: amplitude cos(theta_out + phase) is added.

    A once-per-turn error of the drive itself reads the same unless the encoder is clocked anew.

    Attributes
    ----------
    name, port : str
        ``"eccentricity"`` and ``"sensor"``, in model files and verdicts.
    amplitude, phase : float
        rad.
    order : float
        Cycles per output turn: 1 off centre, 2 oval or tilted, more for the scale itself.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or an order that is not above 0.
    """

    name: ClassVar[str] = "eccentricity"
    port: ClassVar[str] = "sensor"
    amplitude: float
    phase: float
    order: float = 1.0

    def __post_init__(self) -> None:
        real_number("eccentricity.amplitude", self.amplitude)
        real_number("eccentricity.phase", self.phase)
        real_number("eccentricity.order", self.order, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients as they are."""
        return coefficients

    def reading(self, output_angle: Values, elapsed: Values | float) -> Values:
        """Return what is added to the reading of true output angles.

        Parameters
        ----------
        output_angle : ndarray, shape (n,)
            rad.
        elapsed : float or ndarray, shape (n,)
            Time of the session, s; plays no part.

        Returns
        -------
        ndarray, shape (n,)
            rad.
        """
        return np.asarray(self.amplitude * np.cos(self.order * output_angle + self.phase))

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        amplitude, phase = with_unit(self.amplitude, "angle"), with_unit(self.phase, "angle")
        table = {"name": self.name, "amplitude": amplitude, "phase": phase}
        return table if self.order == 1.0 else table | {"order": self.order}


@dataclass(frozen=True)
class ThermalDrift:
    """The output angle reads what grows while the rig warms up: rate time (1 - exp(-t / time)).

    Attributes
    ----------
    name, port : str
        ``"thermal_drift"`` and ``"sensor"``, in model files and verdicts.
    rate : float
        At the start of the session, rad/s.
    time : float
        Time constant, s; infinite for a steady drift, rate t.

    Raises
    ------
    InvalidInput
        For a rate that is not finite, or a time constant that is not above 0.
    """

    name: ClassVar[str] = "thermal_drift"
    port: ClassVar[str] = "sensor"
    rate: float
    time: float = math.inf

    def __post_init__(self) -> None:
        real_number("thermal_drift.rate", self.rate)
        if self.time != math.inf:
            real_number("thermal_drift.time", self.time, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients as they are."""
        return coefficients

    def after(self, elapsed: Values) -> Values:
        """Return what is added to the reading, rad, after elapsed seconds of the session.

        Both have one shape, e.g. (n,).
        """
        if self.time == math.inf:
            return np.asarray(self.rate * elapsed)
        return np.asarray(-self.rate * self.time * np.expm1(-elapsed / self.time))

    def bends(self, elapsed: Values) -> Values:
        """Return the second to fourth derivative of `after` by time.

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.

        Returns
        -------
        ndarray, shape (3, n)
            rad/s^2, rad/s^3 and rad/s^4.
        """
        rate = self.rate * np.exp(-elapsed / self.time)
        return np.array([rate / (-self.time) ** power for power in (1, 2, 3)])

    def reading(self, output_angle: Values, elapsed: Values | float) -> Values:
        """Return what is added to the reading of true output angles.

        Parameters
        ----------
        output_angle : ndarray, shape (n,)
            rad; plays no part.
        elapsed : float or ndarray, shape (n,)
            Time of the session, s.

        Returns
        -------
        ndarray, shape (n,)
            rad.
        """
        drift = self.after(np.asarray(elapsed, dtype=float))
        return np.broadcast_to(drift, np.shape(output_angle))

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        table = {"name": self.name, "rate": with_unit(self.rate, "angle rate")}
        return table if self.time == math.inf else table | {"time": with_unit(self.time, "time")}
