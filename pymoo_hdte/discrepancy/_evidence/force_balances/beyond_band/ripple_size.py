"""The size of an order beyond the band: its parts, over the speed, and in other records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, t

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.high_band import (
    FEWEST_ROWS,
    HighBand,
)
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.order_search import (
    NEIGHBOURS,
    SeenOrder,
    phasors,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.unknowns import line_with_variance
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force

Values = NDArray[np.float64]
Pair = tuple[float, float]

_NEAR = np.linspace(-1.0, 1.0, 81)
"""Distances, in resolutions, between which the order of one direction is looked for."""
_SPEEDS = 6
"""Groups of equally many rows by speed."""


@dataclass(frozen=True, eq=False)
class Part:
    """One law of a ripple.

    Attributes
    ----------
    law : LawAt
        `torque_ripple` where the force is the same both ways, or `position_dependent_friction`
        where it turns with the direction.
    values : dict of str to (float, float)
        Values of the law that were fitted, each with its variance, SI.
    """

    law: LawAt
    values: dict[str, Pair]


@dataclass(frozen=True)
class _Line:
    """The force while a port moves one way: the real part of amplitude times exp(i order position).

    Attributes
    ----------
    amplitude : complex
        N or N.m.
    variance : float
        Of it, real and imaginary part together, by the powers of the neighbouring orders.
    middle, spread : float
        Mean and variance of the positions.
    """

    amplitude: complex
    variance: float
    middle: float
    spread: float

    @property
    def known(self) -> float:
        """Inverse of the variance of the order: it is the slope of a phase over the position."""
        return 2.0 * abs(self.amplitude) ** 2 * self.spread / self.variance


@dataclass(frozen=True, eq=False)
class Size:
    """What a line of an order is.

    Attributes
    ----------
    parts : tuple of Part
        The part that is the same both ways, the one that turns, or both; the larger first.
    ways : int
        Directions, 1 or 2, in which it was seen.
    variance : float
        Of the order, its unit squared.
    """

    parts: tuple[Part, ...]
    ways: int
    variance: float


def size_of(port: str, seen: SeenOrder, bands: Sequence[HighBand], rules: Rules) -> Size:
    """Return the parts of a line; while a port moves one way, all of it counts as a torque."""
    lines = [_line(seen, bands, way) for way in (1.0, -1.0)]
    both = [one for one in lines if one is not None]
    variance = 1.0 / sum(one.known for one in both)
    if len(both) == 2:
        # Several orders that the travel does not resolve add up otherwise in either direction.
        apart = (_nearest(seen, bands, 1.0) - _nearest(seen, bands, -1.0)) ** 2
        if apart > chi2.isf(rules.second_speed_chance, 1) * sum(1.0 / one.known for one in both):
            variance += apart / 4.0
    return Size(_parts(port, seen, both, variance, rules), len(both), variance)


def _nearest(seen: SeenOrder, bands: Sequence[HighBand], way: float) -> float:
    """Return the order of largest power within the resolution while the port moves one way."""
    near = seen.order + seen.resolution * _NEAR
    powers = np.abs(phasors(*_moving(seen, bands, way), near))
    return float(near[np.argmax(powers)])


def _parts(
    port: str, seen: SeenOrder, both: Sequence[_Line], of_order: float, rules: Rules
) -> tuple[Part, ...]:
    mean = sum(one.amplitude for one in both) / len(both)
    variance = sum(one.variance for one in both) / len(both) ** 2
    middle = sum(one.middle for one in both) / len(both)
    # A driving torque acts with the motion, a force of friction against it.
    lines = [("torque_ripple", "amplitude", -mean)]
    if len(both) == 2:
        turning = 0.5 * (both[0].amplitude - both[1].amplitude)
        lines.append(("position_dependent_friction", "level", turning))
    strongest = max(abs(line) for _, _, line in lines)
    least = min(strongest, (-np.log(rules.position_order_chance) * variance) ** 0.5)
    found = []
    for name, size, line in lines:
        if abs(line) >= least:
            amplitude, phase = line_with_variance(line.real, line.imag, 0.5 * variance * np.eye(2))
            # The phase is that at position 0, as far from the rows as their mean position.
            phase = phase[0], float(phase[1] + of_order * middle**2)
            numbers = {"order": seen.order, size: amplitude[0], "phase": phase[0]}
            law = LawAt(name, port, effect_named(name).law_of(numbers))
            found.append((abs(line), Part(law, {size: amplitude, "phase": phase})))
    return tuple(part for _, part in sorted(found, key=lambda one: -one[0]))


def _line(
    seen: SeenOrder,
    bands: Sequence[HighBand],
    way: float,
    slowest: float = 0.0,
    fastest: float = np.inf,
) -> _Line | None:
    """Return the line of an order while the port moves one way, None with too few rows.

    Parameters
    ----------
    seen : SeenOrder
    bands : sequence of HighBand
    way : {1.0, -1.0}
    slowest, fastest : float
        Speeds between which rows are taken.
    """
    position, signal = _moving(seen, bands, way, slowest, fastest)
    if len(signal) < FEWEST_ROWS:
        return None
    line = np.exp(1j * seen.order * position)
    amplitude = complex(2.0 * np.mean(signal * line.conj()))
    # Without the line, which would leak into its neighbours.
    left = signal - (amplitude * line).real
    orders = seen.order + seen.resolution * NEIGHBOURS
    around = np.abs(np.exp(-1j * np.outer(orders, position)) @ left) ** 2
    # Powers of noise are exponential, with a median of log 2.
    variance = 4.0 * float(np.median(around)) / np.log(2.0) / len(signal) ** 2
    middle, spread = float(np.mean(position)), float(np.var(position))
    return _Line(amplitude, max(variance, 1e-300), middle, spread)


def _moving(
    seen: SeenOrder,
    bands: Sequence[HighBand],
    way: float,
    slowest: float = 0.0,
    fastest: float = np.inf,
) -> tuple[Values, Values]:
    """Return positions and forces, (n,) each, of the rows of a line: see `_line`."""
    turned, force = [], []
    for band in bands:
        speed = way * band.speed
        rows = band.inside(seen.order) & (speed > slowest) & (speed <= fastest)
        turned.append(band.position[rows])
        force.append(band.plain[rows])
    return np.concatenate(turned), np.concatenate(force)


def over_speed(seen: SeenOrder, bands: Sequence[HighBand], speed: Values) -> Values:
    """Return the amplitude over the speed: (n, 3), see `Ripple`; ``speed`` is that of all rows."""
    found = []
    edges = np.quantile(speed, np.linspace(0.0, 1.0, _SPEEDS + 1))
    edges[0] = 0.0
    for slowest, fastest in pairwise(edges):
        here = [_line(seen, bands, way, slowest, fastest) for way in (1.0, -1.0)]
        lines = [one for one in here if one is not None]
        if lines:
            power = np.mean([abs(line.amplitude) ** 2 for line in lines])
            variance = np.mean([line.variance for line in lines]) / (2.0 * len(lines))
            middle = np.mean(speed[(speed > slowest) & (speed <= fastest)])
            found.append((middle, power**0.5, variance**0.5))
    return np.array(found).reshape(len(found), 3)


def trend_of(speeds: Values, rules: Rules) -> str:
    """Return in words how an amplitude changes with the speed, and what may be its cause."""
    unknown = "How it changes with speed remains open."
    if len(speeds) < 4 or speeds[-1, 0] <= rules.growth_ratio * speeds[0, 0]:
        return unknown
    # Relative to the middle, so that slope and level are uncorrelated.
    weight = (speeds[:, 1] / speeds[:, 2]) ** 2
    way = np.log(speeds[:, 0])
    way = way - np.average(way, weights=weight)
    size = np.log(speeds[:, 1])
    power = float(np.sum(weight * way * size) / np.sum(weight * way**2))
    left = size - np.average(size, weights=weight) - power * way
    degrees = len(speeds) - 2
    spread = max(float(np.sum(weight * left**2)) / degrees, 1.0) / float(np.sum(weight * way**2))
    reach = float(t.isf(0.5 * rules.growth_chance, degrees)) * spread**0.5
    range_ = float(np.log(speeds[-1, 0] / speeds[0, 0]))
    least = float(np.log(rules.growth_ratio))
    numbers = f"from {speeds[0, 1]:.2g} at {speeds[0, 0]:.2g} to {speeds[-1, 1]:.2g} at "
    numbers += f"{speeds[-1, 0]:.2g} (SI)"
    if abs(power) > reach and abs(power) * range_ >= least:
        if power > 0.0:
            return (
                f"It grows with the speed, {numbers}: so does a kinematic error that accelerates "
                "what it moves, or a resonance above; a torque of its own would not."
            )
        return (
            f"It falls with the speed, {numbers}: so does a torque that the drive does not follow; "
            "a kinematic error that accelerates what it moves would grow."
        )
    if (abs(power) + reach) * range_ < least:
        return (
            f"It hardly changes with the speed, {numbers}: a torque, or a kinematic error against "
            "a spring."
        )
    return unknown


def gap_of(order: float, laws: Sequence[LawAt], bands: Sequence[HighBand]) -> Pair | None:
    """Return the root mean square in other records before and after laws are taken away."""
    before = after = 0.0
    count = 0
    for band in bands:
        rows = band.inside(order)
        if not rows.any():
            continue
        motion = PortMotion(band.position[rows], band.speed[rows])
        force = band.plain[rows]
        left = force - np.sum([law_force(one.law, motion, 0.0) for one in laws], axis=0)
        before, after = before + float(np.sum(force**2)), after + float(np.sum(left**2))
        count += len(force)
    return ((before / count) ** 0.5, (after / count) ** 0.5) if count else None
