"""A smooth loop that forgets: the one curve of its rise, and how it follows a path.

States z lie between -1 and 1, ways are in torsions of yield. Whatever the state, a motion one way
goes on along the same rise from -1 to 1, so that a path needs a search where it turns back only.
"""

from __future__ import annotations

import numpy as np

from pymoo_hdte._compilation import compiled
from pymoo_hdte.effects.law import Values

Rise = tuple[Values, Values, int, float, float]
"""States of a rise at steps of equal ways, their slopes, the step of the state zero; exponent and
share."""

_STEP = 0.04
"""Ways between the states that are integrated, in torsions of yield: errors of the state stay at
some 1e-5, for exponents below 1 at some 1e-4."""
_STEPS = 1000
"""Of them: after forty torsions of yield nothing is left of where it began, to the last digit."""
_FLAT = 1e-12
"""Slope below which a state is that of the end of the rise."""
_SETTLED = 1e-10
"""Share of the force by which a state that repeats itself may be wrong."""
_ROUNDING = 1e-15
"""What rounding leaves of its change in a passage, as a share of the force."""
_PASSAGES = 50
_RESTS = 1e-12
"""Way, in torsions of yield, within which a port rests: it bears what wound it up."""


@compiled
def slope_of(z: float, exponent: float, share: float) -> float:
    """Return dz over the way of a motion towards positive z, in torsions of yield."""
    return 1.0 - (1.0 if z > 0.0 else 1.0 - 2.0 * share) * abs(z) ** exponent


@compiled
def _from_zero(way: float, exponent: float, share: float) -> tuple[float, float]:
    """Return z and its slope after a short way from zero, by the series in what the slope loses.

    Small loops settle by what little the slope loses there, which steps would miss.
    """
    n, lost = exponent, 1.0 - slope_of(way, exponent, share)
    first = 1.0 / (n + 1.0)
    second = n * first / (2.0 * n + 1.0)
    third = (n * second + 0.5 * n * (n - 1.0) * first**2) / (3.0 * n + 1.0)
    z = way * (1.0 - lost * (first - lost * (second - lost * third)))
    return z, slope_of(z, exponent, share)


@compiled
def rise_of(exponent: float, share: float) -> Rise:
    """Return a motion towards positive z, from -1 to 1.

    By the classical method of Runge and Kutta, from its series next to zero, where it has a kink.
    """
    z, slope = np.empty(2 * _STEPS + 1), np.empty(2 * _STEPS + 1)
    z[_STEPS], slope[_STEPS] = 0.0, 1.0
    place = _STEPS
    for way in (_STEP, -_STEP):
        now, going = _from_zero(way, exponent, share)
        for step in range(1, _STEPS + 1):
            if step > 1:
                second = slope_of(now + 0.5 * way * going, exponent, share)
                third = slope_of(now + 0.5 * way * second, exponent, share)
                fourth = slope_of(now + way * third, exponent, share)
                now += way * (going + 2.0 * second + 2.0 * third + fourth) / 6.0
                now = min(now, 1.0)
                going = slope_of(now, exponent, share)
            place = _STEPS + (step if way > 0.0 else -step)
            z[place], slope[place] = now, going
            if now <= -1.0:
                break
    # The last place is that of the way down.
    return z[place:], slope[place:], _STEPS - place, exponent, share


@compiled
def state_at(way: float, rise: Rise) -> tuple[float, float]:
    """Return z and its slope after a way from zero along a rise: cubics between its steps."""
    z, slope, zero, exponent, share = rise
    if abs(way) <= _STEP:
        return _from_zero(way, exponent, share)
    steps = way / _STEP + zero
    if steps >= len(z) - 1:
        return 1.0, 0.0
    if steps < 0.0:
        return z[0], slope[0]
    if np.isnan(steps):
        return np.nan, np.nan
    place = int(steps)
    s = steps - place
    start, end = _STEP * slope[place], _STEP * slope[place + 1]
    growth = z[place + 1] - z[place]
    bend, twist = 3.0 * growth - 2.0 * start - end, start + end - 2.0 * growth
    value = z[place] + s * (start + s * (bend + s * twist))
    return value, (start + s * (2.0 * bend + 3.0 * s * twist)) / _STEP


@compiled
def way_to(z: float, rise: Rise) -> float:
    """Return the way from zero along a rise to a state."""
    values, zero = rise[0], rise[2]
    place = max(int(np.searchsorted(values, z)) - 1, 0)
    if np.isnan(z):
        return z
    way = _STEP * (place - zero)
    if place == len(values) - 1:
        return way
    growth = values[place + 1] - values[place]
    way += _STEP * (z - values[place]) / growth if growth > 0.0 else 0.0
    for _ in range(3):
        there, slope = state_at(way, rise)
        way += (z - there) / slope if slope > _FLAT else 0.0
    return way


@compiled
def _passed(
    path: Values,
    z: float,
    before: float,
    rise: Rise,
    along: Values,
    slope: Values,
    retained: Values,
) -> float:
    """Follow a path from a state and a position; return how the last state depends on the first."""
    product, side, way = 1.0, 1.0, way_to(z, rise)
    z, going = state_at(way, rise)
    for step in range(len(path)):
        change = path[step] - before
        before = path[step]
        if change * side < 0.0:
            side = -side
            way = way_to(side * z, rise)
            going = state_at(way, rise)[1]
        slope_before = going
        way += abs(change)
        z, going = state_at(way, rise)
        z *= side
        along[step], slope[step] = z, going
        # States that differ by little stay apart as long as it takes to pass their difference.
        retained[step] = going / slope_before if slope_before > 0.0 else 0.0
        product *= retained[step]
    return product


@compiled
def follow(
    path: Values,
    recurs: bool,
    rise: Rise,
    along: Values,
    slope: Values,
    retained: Values,
) -> None:
    """Follow paths (n, steps) from rest; where their second half recurs, as it does for ever."""
    rows, steps = path.shape
    half = steps // 2
    for row in range(rows):
        if not (recurs and np.ptp(path[row]) > _RESTS):
            _passed(path[row], 0.0, 0.0, rise, along[row], slope[row], retained[row])
            continue
        _settle(path[row, half:], rise, along[row, half:], slope[row, half:], retained[row, half:])
        for column in (along, slope, retained):
            column[row, :half] = column[row, half:]


@compiled
def _settle(
    path: Values,
    rise: Rise,
    along: Values,
    slope: Values,
    retained: Values,
) -> None:
    """Follow a path from the state to which it returns.

    A passage leads two states nearer to each other, and keeps their order: Newton's method stays
    between states that a passage raises and lowers. The nearer it leads them, the less a change is
    of what is still missing.
    """
    z, low, high = 0.0, -1.0, 1.0
    for _ in range(_PASSAGES):
        product = _passed(path, z, path[-1], rise, along, slope, retained)
        change = along[-1] - z
        if abs(change) <= max(_SETTLED * (1.0 - product), _ROUNDING):
            break
        if change > 0.0:
            low = z
        else:
            high = z
        z += change / (1.0 - product) if product < 1.0 else change
        if not low < z < high:
            z = 0.5 * (low + high)
