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

_OFFSETS = np.linspace(-1.0, 1.0, 81)
"""Distances, in resolutions, at which the order of one direction is searched for."""
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
        Variance of the amplitude, real and imaginary part together, from the powers of the
        neighbouring orders.
    middle, spread : float
        Mean and variance of the positions.
    """

    amplitude: complex
    variance: float
    middle: float
    spread: float

    @property
    def known(self) -> float:
        """Inverse variance of the order, which is the slope of the phase over the position."""
        return 2.0 * abs(self.amplitude) ** 2 * self.spread / self.variance


@dataclass(frozen=True, eq=False)
class Size:
    """The parts of a line of an order, and their uncertainty.

    Attributes
    ----------
    parts : tuple of Part
        The part that is the same both ways, the one that turns, or both; the larger first.
    ways : int
        Directions, 1 or 2, in which it was seen.
    variance : float
        Variance of the order, in the square of its unit.
    """

    parts: tuple[Part, ...]
    ways: int
    variance: float


def size_of(port: str, seen: SeenOrder, bands: Sequence[HighBand], rules: Rules) -> Size:
    """Return the parts of a line; if a port moves one way only, all of it counts as a torque."""
    lines = [_line(seen, bands, way) for way in (1.0, -1.0)]
    known = [line for line in lines if line is not None]
    variance = 1.0 / sum(line.known for line in known)
    if len(known) == 2:
        # Several orders that the travel does not resolve add up differently in the two directions.
        apart = (_strongest_order(seen, bands, 1.0) - _strongest_order(seen, bands, -1.0)) ** 2
        if apart > chi2.isf(rules.second_speed_chance, 1) * sum(1.0 / line.known for line in known):
            variance += apart / 4.0
    return Size(_parts(port, seen, known, variance, rules), len(known), variance)


def _strongest_order(seen: SeenOrder, bands: Sequence[HighBand], way: float) -> float:
    """Return the order of largest power within the resolution while the port moves one way."""
    orders = seen.order + seen.resolution * _OFFSETS
    powers = np.abs(phasors(*_rows_of_line(seen, bands, way), orders))
    return float(orders[np.argmax(powers)])


def _parts(
    port: str, seen: SeenOrder, known: Sequence[_Line], of_order: float, rules: Rules
) -> tuple[Part, ...]:
    mean = sum(line.amplitude for line in known) / len(known)
    variance = sum(line.variance for line in known) / len(known) ** 2
    middle = sum(line.middle for line in known) / len(known)
    # A driving torque acts with the motion, a force of friction against it.
    lines = [("torque_ripple", "amplitude", -mean)]
    if len(known) == 2:
        turning = 0.5 * (known[0].amplitude - known[1].amplitude)
        lines.append(("position_dependent_friction", "level", turning))
    strongest = max(abs(line) for _, _, line in lines)
    least = min(strongest, (-np.log(rules.position_order_chance) * variance) ** 0.5)
    sized = []
    for name, size, line in lines:
        if abs(line) >= least:
            amplitude, phase = line_with_variance(line.real, line.imag, 0.5 * variance * np.eye(2))
            # The phase is that at position 0, which lies the mean position away from the rows.
            phase = phase[0], float(phase[1] + of_order * middle**2)
            numbers = {"order": seen.order, size: amplitude[0], "phase": phase[0]}
            law = LawAt(name, port, effect_named(name).law_of(numbers))
            sized.append((abs(line), Part(law, {size: amplitude, "phase": phase})))
    return tuple(part for _, part in sorted(sized, key=lambda entry: -entry[0]))


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
    position, signal = _rows_of_line(seen, bands, way, slowest, fastest)
    if len(signal) < FEWEST_ROWS:
        return None
    line = np.exp(1j * seen.order * position)
    amplitude = complex(2.0 * np.mean(signal * line.conj()))
    # The line is removed, because it would leak into its neighbours.
    residual = signal - (amplitude * line).real
    orders = seen.order + seen.resolution * NEIGHBOURS
    around = np.abs(np.exp(-1j * np.outer(orders, position)) @ residual) ** 2
    # Powers of noise are exponential, with a median of log 2.
    variance = 4.0 * float(np.median(around)) / np.log(2.0) / len(signal) ** 2
    middle, spread = float(np.mean(position)), float(np.var(position))
    return _Line(amplitude, max(variance, 1e-300), middle, spread)


def _rows_of_line(
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
    rows = []
    edges = np.quantile(speed, np.linspace(0.0, 1.0, _SPEEDS + 1))
    edges[0] = 0.0
    for slowest, fastest in pairwise(edges):
        by_way = [_line(seen, bands, way, slowest, fastest) for way in (1.0, -1.0)]
        lines = [line for line in by_way if line is not None]
        if lines:
            power = np.mean([abs(line.amplitude) ** 2 for line in lines])
            variance = np.mean([line.variance for line in lines]) / (2.0 * len(lines))
            middle = np.mean(speed[(speed > slowest) & (speed <= fastest)])
            rows.append((middle, power**0.5, variance**0.5))
    return np.array(rows).reshape(len(rows), 3)


def trend_of(speeds: Values, rules: Rules) -> str:
    """Return sentences on how an amplitude changes with the speed, and on its possible cause."""
    unknown = "How it changes with speed remains open."
    if len(speeds) < 4 or speeds[-1, 0] <= rules.growth_ratio * speeds[0, 0]:
        return unknown
    # Relative to the middle, so that slope and level are uncorrelated.
    weight = (speeds[:, 1] / speeds[:, 2]) ** 2
    way = np.log(speeds[:, 0])
    way = way - np.average(way, weights=weight)
    size = np.log(speeds[:, 1])
    power = float(np.sum(weight * way * size) / np.sum(weight * way**2))
    residual = size - np.average(size, weights=weight) - power * way
    degrees = len(speeds) - 2
    spread = max(float(np.sum(weight * residual**2)) / degrees, 1.0) / float(
        np.sum(weight * way**2)
    )
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


def force_before_and_after(
    order: float, laws: Sequence[LawAt], bands: Sequence[HighBand]
) -> Pair | None:
    """Return the root mean square of other records before and after laws are removed."""
    before = after = 0.0
    count = 0
    for band in bands:
        rows = band.inside(order)
        if not rows.any():
            continue
        motion = PortMotion(band.position[rows], band.speed[rows])
        force = band.plain[rows]
        residual = force - np.sum([law_force(law.law, motion, 0.0) for law in laws], axis=0)
        before, after = before + float(np.sum(force**2)), after + float(np.sum(residual**2))
        count += len(force)
    return ((before / count) ** 0.5, (after / count) ** 0.5) if count else None
