"""Zeros of the torque sensors that do not stay: they run away as the bench warms up, or change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import unknown

_SENSORS = ("input", "output")
"""Torque sensors, in the order of `DriveEffect.torque_reading`."""


class TorqueSensorEffect(DriveEffect):
    """A change of what one of the torque sensors reads, which a subclass gives by its time."""

    port: ClassVar[str] = "sensor"
    sensor: ClassVar[str]

    @property
    def only_reads(self) -> bool:
        """Whether no motion follows: the output torque that is read is a condition of it."""
        return self.sensor == "input"

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, N.m, at times (n,) of the session, s."""
        raise NotImplementedError

    def torque_reading(self, elapsed: Values) -> Values:
        """Return what is added to the readings of both torques, N.m, shape (2, n).

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.
        """
        added = self.added(np.asarray(elapsed))
        return np.array(
            [added if sensor == self.sensor else np.zeros_like(added) for sensor in _SENSORS]
        )


@dataclass(frozen=True)
class TorqueDrift(TorqueSensorEffect):
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
    sensor: ClassVar[str] = "input"


@dataclass(frozen=True)
class OutputTorqueDrift(TorqueDrift):
    """A `TorqueDrift` of the output torque's sensor."""

    name: ClassVar[str] = "output_torque_drift"
    sensor: ClassVar[str] = "output"


@dataclass(frozen=True)
class NewTorqueZero(TorqueSensorEffect):
    """A new zero of a torque sensor: size is added to every reading from a time on.

    Attributes
    ----------
    size : float
        N.m.
    after : float
        Time of the session, s.

    Raises
    ------
    InvalidInput
        For a number that is not finite.
    """

    size: float
    after: float

    def __post_init__(self) -> None:
        real_number(f"{self.name}.size", self.size)
        real_number(f"{self.name}.after", self.after)

    def added(self, elapsed: Values) -> Values:
        """Return what is added to the reading, N.m, at times (n,) of the session, s."""
        return np.where(elapsed >= self.after, self.size, 0.0)


@dataclass(frozen=True)
class NewInputTorqueZero(NewTorqueZero):
    """A `NewTorqueZero` of the input torque's sensor."""

    name: ClassVar[str] = "new_input_torque_zero"
    sensor: ClassVar[str] = "input"


@dataclass(frozen=True)
class NewOutputTorqueZero(NewTorqueZero):
    """A `NewTorqueZero` of the output torque's sensor."""

    name: ClassVar[str] = "new_output_torque_zero"
    sensor: ClassVar[str] = "output"


def _drift(kind: type[TorqueDrift]) -> Callable[[DriveSizes], list[Guess]]:
    def guesses(sizes: DriveSizes) -> list[Guess]:
        """Guess a drift that settles early in the session, during it, or hardly: as of an angle."""
        duration, (typical, largest) = sizes.duration, _sizes_of(kind.sensor, sizes)
        if not (duration and typical):
            return []
        unknowns = (
            unknown("size", -largest, largest, typical),
            unknown("time", duration / 20.0, 20.0 * duration, duration / 2.0),
        )
        return [Guess(unknowns, [(typical, share * duration) for share in (0.1, 0.5, 5.0)])]

    return guesses


def _changes(kind: type[NewTorqueZero]) -> Callable[[DriveSizes], list[Guess]]:
    def guesses(sizes: DriveSizes) -> list[Guess]:
        """Guess a change between any two records that are not taken at once."""
        typical, _ = _sizes_of(kind.sensor, sizes)
        return [_changed(kind, sizes, after) for after in sizes.changes if typical]

    return guesses


def _changed(kind: type[NewTorqueZero], sizes: DriveSizes, after: float) -> Guess:
    typical, largest = _sizes_of(kind.sensor, sizes)

    def build(values: Sequence[float]) -> tuple[DriveEffect, ...]:
        return (kind(values[0], after),)

    return Guess(
        (unknown("size", -largest, largest, typical, linear=True),),
        build=build,
        among=len(sizes.changes),
        form=f"{after:.0f} s",
        sentence=f"The zero of the {kind.sensor} torque sensor changed {after:.0f} s into the "
        "session.",
    )


def _sizes_of(sensor: str, sizes: DriveSizes) -> tuple[float, float]:
    """Return the typical and the largest change of a zero, N.m."""
    place = _SENSORS.index(sensor)
    return sizes.readings[place], sizes.largest_readings[place]


for drift in (InputTorqueDrift, OutputTorqueDrift):
    register(
        Effect(
            drift.name,
            None,
            ("sensor",),
            {"size": "torque", "time": "time"},
            f"The zero of the {drift.sensor} torque sensor drifts with time.",
            _drift(drift),
            change=drift,
            forms="as_listed",
            nuisance_at=("sensor",),
        )
    )
for change in (NewInputTorqueZero, NewOutputTorqueZero):
    register(
        Effect(
            change.name,
            None,
            ("sensor",),
            {"size": "torque", "after": "time"},
            f"The zero of the {change.sensor} torque sensor changed during the session.",
            _changes(change),
            change=change,
            exact=True,
            nuisance_at=("sensor",),
        )
    )
