"""The largest value in a box by searches along one axis after the other; the worst of intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate.box import corners

Array = NDArray[np.float64]

_SWEEPS, _NEARER, _LEAST = 16, 0.25, 0.25**8
"""Most sweeps along all axes, what shortens a line from one to the next, and where they end.

With 9 points on a line, the last are 1/8 * 0.25^7 = 8e-6 of an axis apart: a smooth maximum between
them is missed by some 1e-11 of what the value varies by. A line at whose end the best lies is not
shortened: where axes are linked, the next one moves it on. Shortened all the same, 500 quadratic
functions of two axes with a correlation of 0.5 were missed by up to 1.5 % of an axis squared.
"""
_FURTHER = (0.125, 16.0)
"""Shortest and longest step on along what a sweep has moved, as shares of that.

With a correlation of 0.9 a sweep goes a fifth of the way; by such steps the largest error of these
functions is 2e-5, 2e-2 without.
"""
_CORNERS, _INSIDE, _LINE = 64, 16, 9
"""Corners of the intervals, points within, and points on a line at which a goal is looked at.

Every one costs all statistics of a design. With six intervals these are all corners.
"""


def largest_in_box(
    optima: Array,
    ends: Array,
    value: Callable[[Array], Array],
    line: int,
    discrete: Mapping[int, Array] | None = None,
) -> Array:
    """Return the points of a box to which searches lead, shape (n, d); values are largest there.

    Parameters
    ----------
    optima : ndarray, shape (n, d)
        Where they begin.
    ends : ndarray, shape (d, 2)
    value : callable
        Maps points of shape (n, k, d) to their values, shape (n, k).
    line : int
        Points on a line through the box.
    discrete : mapping of int to ndarray, optional
        Values of the axes that take no others.
    """
    width, steps = ends[:, 1] - ends[:, 0], np.linspace(-0.5, 0.5, line)
    widths = np.tile(width, (len(optima), 1))
    further = np.append(0.0, np.geomspace(*_FURTHER, line))[:, None]
    for sweep in range(_SWEEPS):
        before = optima
        for j in np.flatnonzero(width > 0.0).tolist():
            # The first sweep looks along the whole line, later ones ever nearer.
            centre = optima[:, j] if sweep else np.full(len(optima), ends[j].mean())
            along = centre[:, None] + widths[:, j, None] * steps
            free = not (discrete and j in discrete)
            if discrete and not free:
                along = np.tile(discrete[j], (len(optima), 1))
            tried = np.repeat(optima[:, None], along.shape[1] + 1, axis=1)
            tried[:, 1:, j] = np.clip(along, *ends[j])
            best = np.argmax(value(tried), axis=1)
            optima = tried[np.arange(len(tried)), best]
            at_end = free and sweep > 0 and np.isin(best, (1, line))
            widths[:, j] *= np.where(at_end, 1.0, _NEARER)
        if np.all(widths <= _LEAST * width):
            break
        if sweep:
            moved = optima - before
            if discrete:
                moved[:, list(discrete)] = 0.0
            tried = np.clip(optima[:, None] + further * moved[:, None], *ends.T)
            optima = best_of(tried, value(tried))
    return optima


def best_of(points: Array, values: Array) -> Array:
    """Return the points with the largest values, shape (n, d), from (n, k, d) and (n, k)."""
    return np.array(points[np.arange(len(points)), np.argmax(values, axis=1)])


class WorstOver:
    """The values of intervals that are worst for a goal, at each of n designs.

    Parameters
    ----------
    bounds : ndarray, shape (q, 2)
        Ends of the intervals in their units.
    """

    def __init__(self, bounds: Array) -> None:
        self._bounds = bounds
        inside = scipy.stats.qmc.Sobol(len(bounds), rng=np.random.default_rng(1)).random(_INSIDE)
        inside = np.vstack([np.full((1, len(bounds)), 0.5), inside])
        inside = bounds[:, 0] + np.diff(bounds).T * inside
        self._starts = np.vstack([corners(bounds, _CORNERS, np.random.default_rng(1)), inside])

    def __call__(self, designs: Array, goal: Callable[[Array], Array]) -> Array:
        """Return the designs with the worst values behind them, shape (n, m + q).

        Parameters
        ----------
        designs : ndarray, shape (n, m)
        goal : callable
            Maps designs with values behind them, shape (k, m + q), to what is to be small, (k,).
        """

        def value(tried: Array) -> Array:
            return self._of(designs, tried, goal)

        starts = np.broadcast_to(self._starts, (len(designs), *self._starts.shape))
        first = best_of(starts, value(starts))
        return np.column_stack([designs, largest_in_box(first, self._bounds, value, _LINE)])

    def largest(self, designs: Array, number: Callable[[Array], Array]) -> Array:
        """Return the largest of a number over corners and points within, shape (n,)."""
        starts = np.broadcast_to(self._starts, (len(designs), *self._starts.shape))
        return self._of(designs, starts, number).max(axis=1, initial=-np.inf)

    def _of(self, designs: Array, tried: Array, number: Callable[[Array], Array]) -> Array:
        count = tried.shape[1]
        behind = tried.reshape(-1, tried.shape[2])
        points = np.column_stack([np.repeat(designs, count, axis=0), behind])
        return number(points).reshape(len(designs), count) if len(points) else np.empty((0, count))
