"""Zeros of sensors that do not stay within a session: they drift as the rig warms up, or change.

The sensors are the output encoder and those of the torques of input and output.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, Lines, Session
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import Parameter, unknown

_TORQUES = ("input torque sensor", "output torque sensor")
"""In the order of `DriveEffect.torque_reading`."""


class SensorZero(DriveEffect):
    """What is added to the reading of one sensor, which a subclass gives by its time."""

    port: ClassVar[str] = "sensor"
    sensor: ClassVar[str]

    @property
    def only_reads(self) -> bool:
        """Whether no motion follows: the output torque that is read is a condition of it."""
        return self.sensor != _TORQUES[1]

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, rad or N.m, at times (n,) of the session, s."""
        raise NotImplementedError

    def reading_lines(self, records: Session) -> tuple[Values, Lines] | None:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            r records, each with m lines; in none of them a zero changes at once.
        """
        if self.sensor in _TORQUES:
            return None
        lines = np.zeros((len(records.elapsed), len(records.orders)), dtype=complex)
        return self.added(records.elapsed), lines

    def torque_reading(self, elapsed: Values) -> Values | None:
        """Return what is added to the readings of both torques, N.m, shape (2, n).

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.
        """
        if self.sensor not in _TORQUES:
            return None
        added = self.added(np.asarray(elapsed))
        return np.array([added if sensor == self.sensor else 0.0 * added for sensor in _TORQUES])


@dataclass(frozen=True)
class ThermalDrift(SensorZero):
    """Drift of the output angle's reading as the rig warms up: rate time (1 - exp(-t / time)).

    Attributes
    ----------
    name, port, sensor : str
        ``"thermal_drift"`` and ``"sensor"``, in model files and verdicts; which sensor it is.
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
    sensor: ClassVar[str] = "output encoder"
    rate: float
    time: float = math.inf

    def __post_init__(self) -> None:
        real_number("thermal_drift.rate", self.rate)
        if self.time != math.inf:
            real_number("thermal_drift.time", self.time, above=0.0)

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, rad, shape (n,).

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.
        """
        if self.time == math.inf:
            return np.asarray(self.rate * elapsed)
        return np.asarray(-self.rate * self.time * np.expm1(-elapsed / self.time))

    def bends(self, elapsed: Values) -> Values:
        """Return the second to fourth derivative of `added` by time.

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

    def reading_lines(self, records: Session) -> tuple[Values, Lines]:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            r records, each with m lines.
        """
        bending = np.einsum("kr,rkm->rm", self.bends(records.elapsed), records.bends)
        return self.added(records.elapsed) + bending[:, 0].real, bending[:, 1:]


@dataclass(frozen=True)
class TorqueDrift(SensorZero):
    """A zero of a torque sensor that runs to a size: size (1 - exp(-t / time)) is added to it.

    Attributes
    ----------
    size : float
        N.m.
    time : float
        Time constant, s.

    Raises
    ------
    InvalidInput
        For a size that is not finite, or a time constant that is not above 0.
    """

    size: float
    time: float

    def __post_init__(self) -> None:
        real_number(f"{self.name}.size", self.size)
        real_number(f"{self.name}.time", self.time, above=0.0)

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, N.m, at times (n,) of the session, s."""
        return np.asarray(-self.size * np.expm1(-elapsed / self.time))


@dataclass(frozen=True)
class InputTorqueDrift(TorqueDrift):
    """A `TorqueDrift` of the input torque's sensor.

    Examples
    --------
    >>> InputTorqueDrift(size=0.002, time=600.0).torque_reading(np.array([0.0, np.inf])).tolist()
    [[0.0, 0.002], [0.0, 0.0]]
    """

    name: ClassVar[str] = "input_torque_drift"
    sensor: ClassVar[str] = _TORQUES[0]


@dataclass(frozen=True)
class OutputTorqueDrift(TorqueDrift):
    """A `TorqueDrift` of the output torque's sensor."""

    name: ClassVar[str] = "output_torque_drift"
    sensor: ClassVar[str] = _TORQUES[1]


@dataclass(frozen=True)
class NewZero(SensorZero):
    """A new zero of the output encoder: size is added to every reading from a time on.

    Attributes
    ----------
    name, port, sensor : str
        ``"new_zero"`` and ``"sensor"``, in model files and verdicts; which sensor it is.
    size : float
        rad; N.m for a sensor of a torque.
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
    sensor: ClassVar[str] = "output encoder"
    size: float
    after: float

    def __post_init__(self) -> None:
        real_number(f"{self.name}.size", self.size)
        real_number(f"{self.name}.after", self.after)

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, rad or for a torque N.m, shape (n,).

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.
        """
        return np.where(elapsed >= self.after, self.size, 0.0)


@dataclass(frozen=True)
class NewInputTorqueZero(NewZero):
    """A `NewZero` of the input torque's sensor."""

    name: ClassVar[str] = "new_input_torque_zero"
    sensor: ClassVar[str] = _TORQUES[0]


@dataclass(frozen=True)
class NewOutputTorqueZero(NewZero):
    """A `NewZero` of the output torque's sensor."""

    name: ClassVar[str] = "new_output_torque_zero"
    sensor: ClassVar[str] = _TORQUES[1]


def _sizes_of(sensor: str, sizes: DriveSizes) -> tuple[float, float]:
    """Return the typical and the largest change of a zero, rad or N.m."""
    if sensor not in _TORQUES:
        return sizes.error, sizes.largest_error
    place = _TORQUES.index(sensor)
    return sizes.readings[place], sizes.largest_readings[place]


def _drifts(
    sensor: str, unknown_of: Callable[[float, float, float], tuple[Parameter, float]]
) -> Callable[[DriveSizes], list[Guess]]:
    def guesses(sizes: DriveSizes) -> list[Guess]:
        """Guess a drift that settles early in the session, during it, or hardly.

        One that settles within a twentieth of the session is over before two records are taken; one
        that takes twenty sessions is a straight line.
        """
        duration, (typical, largest) = sizes.duration, _sizes_of(sensor, sizes)
        if not (duration and typical):
            return []
        first, start = unknown_of(typical, largest, duration)
        time = unknown("time", duration / 20.0, 20.0 * duration, duration / 2.0)
        return [Guess((first, time), [(start, share * duration) for share in (0.1, 0.5, 5.0)])]

    return guesses


def _rate(typical: float, largest: float, duration: float) -> tuple[Parameter, float]:
    """Return the unknown rate of a drift; the fastest has settled in the shortest time."""
    start, fastest = typical / duration, 20.0 * largest / duration
    return unknown("rate", -fastest, fastest, start), start


def _size(typical: float, largest: float, duration: float) -> tuple[Parameter, float]:
    return unknown("size", -largest, largest, typical), typical


def _changes(kind: type[NewZero]) -> Callable[[DriveSizes], list[Guess]]:
    def guesses(sizes: DriveSizes) -> list[Guess]:
        """Guess a change between any two records: small ones may look like a drift."""
        typical, _ = _sizes_of(kind.sensor, sizes)
        return [_changed(kind, sizes, after) for after in sizes.changes if typical]

    return guesses


def _changed(kind: type[NewZero], sizes: DriveSizes, after: float) -> Guess:
    typical, largest = _sizes_of(kind.sensor, sizes)

    def build(values: Sequence[float]) -> tuple[DriveEffect, ...]:
        return (kind(values[0], after),)

    return Guess(
        (unknown("size", -largest, largest, typical, linear=True),),
        build=build,
        among=len(sizes.changes),
        form=f"{after:.0f} s",
        sentence=f"The zero of the {kind.sensor} changed {after:.0f} s into the session.",
    )


register(
    Effect(
        ThermalDrift.name,
        None,
        ("sensor",),
        {"rate": "angle rate", "time": "time"},
        "The reading of the output angle drifts with time.",
        _drifts(ThermalDrift.sensor, _rate),
        change=ThermalDrift,
        forms="drift_in_time",
    )
)
for drift in (InputTorqueDrift, OutputTorqueDrift):
    register(
        Effect(
            drift.name,
            None,
            ("sensor",),
            {"size": "torque", "time": "time"},
            f"The zero of the {drift.sensor} drifts with time.",
            _drifts(drift.sensor, _size),
            change=drift,
            forms="as_listed",
            nuisance_at=("sensor",),
        )
    )
for change in (NewZero, NewInputTorqueZero, NewOutputTorqueZero):
    register(
        Effect(
            change.name,
            None,
            ("sensor",),
            {"size": "torque" if change.sensor in _TORQUES else "angle", "after": "time"},
            f"The zero of the {change.sensor} changed during the session.",
            _changes(change),
            change=change,
            exact=True,
            nuisance_at=("sensor",),
        )
    )
