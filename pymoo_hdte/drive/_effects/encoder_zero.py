"""Changes of the output encoder's zero within a session: as the rig warms up, or at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, Lines, Session
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class ThermalDrift(DriveEffect):
    """Drift of the output angle's reading as the rig warms up: rate time (1 - exp(-t / time)).

    Attributes
    ----------
    name, port : str
        ``"thermal_drift"`` and ``"sensor"``, in model files and verdicts.
    rate : float
        Rate at the start of the session, rad/s.
    time : float
        Time constant, s; infinite for a steady drift, rate t.

    Raises
    ------
    InvalidInput
        For a rate that is not finite, or a time constant that is not above 0.

    Examples
    --------
    >>> ThermalDrift(rate=1e-8).time
    inf
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
            r records, each with m lines.
        """
        bending = np.einsum("kr,rkm->rm", self.bends(records.elapsed), records.bends)
        return self.after(records.elapsed) + bending[:, 0].real, bending[:, 1:]


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
        forms="drift_in_time",
    )
)


@dataclass(frozen=True)
class NewZero(DriveEffect):
    """A new zero of the output encoder: size is added to every reading from a time on.

    Attributes
    ----------
    name, port : str
        ``"new_zero"`` and ``"sensor"``, in model files and verdicts.
    size : float
        rad.
    after : float
        Time of the session, s.

    Raises
    ------
    InvalidInput
        For a number that is not finite.

    Examples
    --------
    >>> NewZero(size=5e-5, after=600.0).port
    'sensor'
    """

    name: ClassVar[str] = "new_zero"
    port: ClassVar[str] = "sensor"
    size: float
    after: float

    def __post_init__(self) -> None:
        real_number("new_zero.size", self.size)
        real_number("new_zero.after", self.after)

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
        late = np.asarray(elapsed) >= self.after
        return np.broadcast_to(np.where(late, self.size, 0.0), np.shape(output_angle))

    def reading_lines(self, records: Session) -> tuple[Values, Lines]:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            r records, each with m lines; none of them is taken during the change.
        """
        lines = np.zeros((len(records.elapsed), len(records.orders)), dtype=complex)
        return np.where(records.elapsed >= self.after, self.size, 0.0), lines


def _new_zero(sizes: DriveSizes) -> list[Guess]:
    """Guess a change between any two records: small ones may look like a drift."""
    return [_changed(sizes, after) for after in sizes.changes]


def _changed(sizes: DriveSizes, after: float) -> Guess:
    largest = sizes.largest_error

    def build(values: Sequence[float]) -> tuple[DriveEffect, ...]:
        return (NewZero(values[0], after),)

    return Guess(
        (unknown("size", -largest, largest, sizes.error, linear=True),),
        build=build,
        among=len(sizes.changes),
        form=f"{after:.0f} s",
        sentence=f"The zero of the output encoder changed {after:.0f} s into the session.",
    )


register(
    Effect(
        NewZero.name,
        None,
        ("sensor",),
        {"size": "angle", "after": "time"},
        "The zero of the output encoder changed during the session.",
        _new_zero,
        change=NewZero,
        exact=True,
        nuisance_at=("sensor",),
    )
)
