"""Effects of the output encoder: they change what is read, not the motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive.effects.base import DriveEffect, DriveSizes, Lines, Session
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import unknown, wave_starts

ENCODER_LINE = "encoder_line"
"""Name of an error of the encoder's scale, which no verdict names: see `Guess.name`."""


@dataclass(frozen=True)
class Eccentricity(DriveEffect):
    """The disc of the output encoder is off centre: amplitude cos(theta_out + phase) is added.

    A once-per-turn error of the drive itself looks the same unless the encoder is turned on its
    shaft.

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

    def reading(self, output_angle: Values, elapsed: Values | float) -> Values:
        """Return what is added to the reading of true output angles.

        Parameters
        ----------
        output_angle : ndarray, shape (n,)
            rad.
        elapsed : float or ndarray, shape (n,)
            Time of the session, s; not used.

        Returns
        -------
        ndarray, shape (n,)
            rad.
        """
        return np.asarray(self.amplitude * np.cos(self.order * output_angle + self.phase))

    def reading_lines(self, records: Session) -> tuple[Values, Lines]:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            Of r records, each with m lines.
        """
        found = np.zeros((len(records.elapsed), len(records.orders)), dtype=complex)
        # theta_out is theta_in / N except for the transmission error, a part in 10^3.
        line = np.isclose(records.orders, self.order / records.ratio)
        found[:, line] = self.amplitude * np.exp(1j * self.phase)
        return np.zeros(len(found)), found


_CLOSED = 1e-6
"""Cycles per output turn by which a line of the encoder's scale may differ from a whole number."""


def _off_centre(sizes: DriveSizes) -> list[Guess]:
    """Guess a disc off centre, and errors of its scale wherever whole cycles per turn are seen."""
    found = [_turning(sizes, 1.0)]
    for order in sizes.further().seen:
        turns = order * sizes.slower
        if turns > 1.5 and abs(turns - round(turns)) < _CLOSED:
            found.append(_turning(sizes, float(round(turns))))
    return found


def _turning(sizes: DriveSizes, turns: float) -> Guess:
    family = sizes.family(turns)
    unknowns = family.waves("amplitude", sizes.largest_error, sizes.error)

    def build(values: Sequence[float]) -> tuple[DriveEffect, ...]:
        lines = family.lines(values)
        return tuple(Eccentricity(amplitude, phase, order) for order, amplitude, phase in lines)

    starts = wave_starts(unknowns)
    if turns == 1.0:
        return Guess(unknowns, starts, build, family)
    sentence = "The output encoder errs {order} times in its turn."
    return Guess(unknowns, starts, build, family, sentence=sentence, name=ENCODER_LINE)


register(
    Effect(
        Eccentricity.name,
        None,
        ("sensor",),
        {"amplitude": "angle", "phase": "angle", "order": ""},
        "The output encoder sits off centre.",
        _off_centre,
        change=Eccentricity,
        exact=True,
    )
)


@dataclass(frozen=True)
class ThermalDrift(DriveEffect):
    """Drift of the output angle's reading as the rig warms up: rate time (1 - exp(-t / time)).

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
            rad; not used.
        elapsed : float or ndarray, shape (n,)
            Time of the session, s.

        Returns
        -------
        ndarray, shape (n,)
            rad.
        """
        drift = self.after(np.asarray(elapsed, dtype=float))
        return np.broadcast_to(drift, np.shape(output_angle))

    def reading_lines(self, records: Session) -> tuple[Values, Lines]:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            Of r records, each with m lines.
        """
        left = np.einsum("kr,rkm->rm", self.bends(records.elapsed), records.bends)
        return self.after(records.elapsed) + left[:, 0].real, left[:, 1:]


def _drift(sizes: DriveSizes) -> list[Guess]:
    """Guess a drift that settles early in the session, during it, or hardly.

    One that settles within a twentieth of the session is over before two records are taken; one
    that takes twenty sessions is a straight line. The fastest has settled in that shortest time.
    """
    duration = sizes.duration
    if duration == 0.0:
        return []
    typical, fastest = sizes.error / duration, 20.0 * sizes.largest_error / duration
    unknowns = (
        unknown("rate", -fastest, fastest, typical),
        unknown("time", duration / 20.0, 20.0 * duration, duration / 2.0),
    )
    return [Guess(unknowns, [(typical, share * duration) for share in (0.1, 0.5, 5.0)])]


register(
    Effect(
        ThermalDrift.name,
        None,
        ("sensor",),
        {"rate": "angle rate", "time": "time"},
        "The reading of the output angle drifts with time.",
        _drift,
        change=ThermalDrift,
    )
)
