"""Delay between a force and the motion that it causes, by the phase of the force balance.

A delay turns the phase of a force in proportion to frequency, which no mass, damper, spring or
friction does. It is fitted with the base, and with friction, gravity and a constant force at each
port, so that what the base lacks does not pass for a delay (as sensor delays in MuJoCo's
``sysid``). Where the ranges of frequency do not agree on it, its interval is wide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import t

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.balances import ForceBalance

Values = NDArray[np.float64]

_RANGES = 10
"""Ranges of frequency, each of which is left out once."""
_ROUNDS = 20
_SETTLED = 1e-4
"""Change of a delay, in periods of the cutoff, below which it is found."""
_QUOTIENT = 1e-2
"""Half the step of the derivative by a delay, in periods of the cutoff."""
_LONGEST = 2.0
"""Largest delay in periods of the cutoff; the records have twice as much beside their rows."""


@dataclass(frozen=True)
class Delay:
    """The time by which a force acts later than its record says.

    Attributes
    ----------
    input : str
    value : float
        s; negative where the record is late.
    spread : float
        Half the width of its 95 % interval, s.
    samples : float
        The value in samples of the slowest record.
    """

    input: str
    value: float
    spread: float
    samples: float

    @property
    def evident(self) -> bool:
        """Whether its interval excludes zero."""
        return abs(self.value) > self.spread


def delays(data: MeasuredData, effects: tuple[LawAt, ...] = ()) -> list[Delay]:
    """Return the delay of each input that can be told, each with the others as recorded.

    Parameters
    ----------
    data : MeasuredData
        Force balances of the records.
    effects : tuple of LawAt
        Laws that were found, whose sizes are fitted with the delay.
    """
    found = (_delay(data, one.name, (*data.known, *effects)) for one in data.mechanism.inputs)
    return [one for one in found if one is not None]


def _delay(data: MeasuredData, name: str, laws: tuple[LawAt, ...]) -> Delay | None:
    """Return the delay of an input, or None where the records do not tell it.

    The best fit is found by the method of Gauss and Newton.
    """
    columns = _columns(data, name, laws)
    every = np.arange(len(data.frequency))
    period = 1.0 / data.spectra[0].cutoff
    half, value = _QUOTIENT * period, 0.0
    for _ in range(_ROUNDS):
        early, late = (
            force_of_input(data, name, value - half),
            force_of_input(data, name, value + half),
        )
        force, slope = force_of_input(data, name, value), (late - early) / (2.0 * half)
        change = _change(force, slope, columns, every)
        value += float(np.clip(change, -0.25 * period, 0.25 * period))
        if not abs(value) < _LONGEST * period:
            return None
        if abs(change) < _SETTLED * period:
            break
    else:
        return None
    _, spread = jackknifed(data, lambda rows: _change(force, slope, columns, rows))
    slowest = max(one.record.step for one in data.spectra)
    return Delay(name, value, float(spread), value / slowest) if spread < period else None


def jackknifed(
    data: MeasuredData, estimate: Callable[[NDArray[np.int_]], ArrayLike]
) -> tuple[Values, Values]:
    """Return an estimate, and half the width of its 95 % interval.

    Without each range of frequency in turn (Tukey's jackknife), because the residual of a model is
    not white.

    Parameters
    ----------
    data : MeasuredData
    estimate : callable
        From the rows that it may use.
    """
    every = np.arange(len(data.frequency))
    ranges = np.array_split(np.argsort(data.frequency, kind="stable"), _RANGES)
    without = np.array([estimate(np.setdiff1d(every, one)) for one in ranges])
    variance = (_RANGES - 1.0) * np.var(without, axis=0)
    return np.asarray(estimate(every)), np.asarray(t.ppf(0.975, _RANGES - 1) * variance**0.5)


def _change(force: Values, slope: Values, columns: Values, rows: NDArray[np.int_]) -> float:
    """Return by how much a delay, s, has to change to fit rows of a whitened force, (n,)."""
    basis, _ = np.linalg.qr(columns[rows])
    unexplained = force[rows] - basis @ (basis.T @ force[rows])
    moved = slope[rows] - basis @ (basis.T @ slope[rows])
    power = float(moved @ moved)
    return -float(moved @ unexplained) / power if power else float("nan")


def force_of_input(data: MeasuredData, name: str, delay: float) -> Values:
    """Return the whitened force of an input, (n,), at its believed gain."""
    (gain,) = (one.gain.value for one in data.mechanism.inputs if one.name == name)
    return in_units_of_noise(data, [gain * one.of_input(name, delay) for one in data.spectra])


def _columns(data: MeasuredData, name: str, laws: tuple[LawAt, ...]) -> Values:
    """Return the whitened forces, (n, columns), of all that is fitted with a delay."""
    slopes = [
        data._linear[1][:, place]
        for place, one in enumerate(data.base)
        if one.name != f"gain of {name}"
    ]
    columns = np.column_stack([*slopes, *free_forces(data, name, laws)])
    scale = np.linalg.norm(columns, axis=0)
    return np.asarray(columns[:, scale > 0.0] / scale[scale > 0.0])


def free_forces(data: MeasuredData, name: str, laws: tuple[LawAt, ...]) -> list[Values]:
    """Return the whitened forces, (n,) each, of which the size is free beside an input.

    Those of laws, of friction, gravity and a constant at each port, and of the other inputs.
    """
    forces = [in_units_of_noise(data, [one.forces([law]) for one in data.spectra]) for law in laws]
    shapes = [list(_shapes(one, data)) for one in data.spectra]
    forces += [in_units_of_noise(data, list(each)) for each in zip(*shapes, strict=True)]
    return forces + [
        force_of_input(data, other.name, 0.0)
        for other in data.mechanism.inputs
        if other.name != name
    ]


def _shapes(balance: ForceBalance, data: MeasuredData) -> Iterator[Values]:
    """Yield dry friction, gravity and a constant force at each port that is not read."""
    for port in data.mechanism.ports:
        if not port.read:
            motion = balance.ports[port.name]
            yield balance.of_port(port.name, np.sign(motion.speed))
            yield balance.of_port(port.name, np.ones_like(motion.speed))
            if data.mechanism.turns(port):
                yield balance.of_port(port.name, np.sin(motion.position))
                yield balance.of_port(port.name, np.cos(motion.position))


def in_units_of_noise(data: MeasuredData, coefficients: list[Values]) -> Values:
    """Return coefficients (n_balances, n_bins) of each record in units of its noise, (n,)."""
    return np.concatenate(
        [
            (one / deviation)[balance.kept]
            for one, balance, deviation in zip(
                coefficients, data.spectra, data.deviation, strict=True
            )
        ]
    )
