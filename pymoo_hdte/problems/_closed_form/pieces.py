"""Where a curve f2 = f(f1) is a Pareto front: the pieces on which it falls below all before."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
_HALVINGS = 45
_SECTIONS = 45
"""The interval shrinks by 3e-14, and by 4e-10, where a minimum is as low as at its place."""


def least_between(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Return the minimisers of a function with one minimum in each interval, by golden section.

    Parameters
    ----------
    function : callable
        Maps shape (n,) to (n,), each entry by itself.
    low, high : ndarray, shape (n,)
        Ends of the intervals.

    Returns
    -------
    ndarray, shape (n,)
    """
    low, high = np.array(low), np.array(high)
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(_SECTIONS):
        down = at_left < at_right
        low, high = np.where(down, low, left), np.where(down, right, high)
        new = np.where(down, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        value = function(new)
        left, right = np.where(down, new, right), np.where(down, left, new)
        at_left, at_right = np.where(down, value, at_right), np.where(down, at_left, value)
    ends = np.array([low, high, (low + high) / 2.0])
    values = np.array([function(end) for end in ends])
    return np.take_along_axis(ends, values.argmin(axis=0)[None], axis=0)[0]


def first_below(function: Callable[[Array], Array], low: float, high: float, level: float) -> float:
    """Return where a function that is above a level at ``low`` falls below it, by bisection."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if function(np.array([middle]))[0] < level:
            high = middle
        else:
            low = middle
    return high


def falling_points(
    function: Callable[[Array], Array], low: float, high: float, count: int, grid: int = 2001
) -> Array:
    """Return places at which a function is below all its values to the left.

    Their ends are exact to rounding, if no piece or gap is narrower than two steps of the grid.

    Parameters
    ----------
    function : callable
        Maps shape (n,) to (n,).
    low, high : float
        Ends of the interval.
    count : int
        About how many places; even within each piece.
    grid : int
        Number of places at which pieces are looked for.

    Returns
    -------
    ndarray, increasing
    """
    places = np.linspace(low, high, grid)
    values = function(places)
    before = np.concatenate([[np.inf], np.minimum.accumulate(values)[:-1]])
    inside = np.concatenate([[False], values < before, [False]])
    starts, stops = np.flatnonzero(np.diff(inside.astype(int)) != 0).reshape(-1, 2).T
    pieces, level = [], np.inf
    for start, stop in zip(starts, stops - 1, strict=True):
        around = places[[max(stop - 1, 0), min(stop + 1, grid - 1)]]
        end = float(least_between(function, around[:1], around[1:])[0])
        begin = low
        if start:
            begin = first_below(function, places[start - 1], places[start], level)
        pieces.append((begin, end))
        level = float(function(np.array([end]))[0])
    lengths = np.array([end - begin for begin, end in pieces])
    # A function that rises from the first place on has one piece without a length.
    shares = lengths / max(lengths.sum(), np.finfo(float).tiny)
    counts = np.maximum(2, np.ceil(count * shares).astype(int))
    chosen = np.concatenate([np.linspace(*ends, n) for ends, n in zip(pieces, counts, strict=True)])
    values = function(chosen)
    lowest = np.concatenate([[np.inf], np.minimum.accumulate(values)[:-1]])
    # Rounding may put the first place of a piece level with the last of the one before.
    return chosen[values < lowest]
