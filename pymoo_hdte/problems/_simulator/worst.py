"""The worst that values within intervals do to a goal: a search on the surrogate at each design."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_CORNERS = 64
"""Corners at which the search looks first; with six intervals all of them."""
_INSIDE = 16
"""Points within, at which it looks besides."""
_LINE, _SWEEPS, _NEARER = 9, 8, 0.25
"""Points on a line, sweeps along all intervals, and what shortens a line from one to the next.

The last points are 1/8 * 0.25^7 = 8e-6 of an interval apart: a smooth maximum between them is
missed by some 1e-11 of what the goal varies by.
"""


class WorstOver:
    """The values of intervals that are worst for a goal, at each of n designs.

    Parameters
    ----------
    bounds : ndarray, shape (q, 2)
        Ends of the intervals in their units.
    """

    def __init__(self, bounds: Array) -> None:
        self._lower, self._width = bounds[:, 0], bounds[:, 1] - bounds[:, 0]
        q = len(bounds)
        inside = scipy.stats.qmc.Sobol(q, rng=np.random.default_rng(1)).random(_INSIDE)
        if 2**q <= MOST_CORNERS:
            corners = np.array(list(product((0.0, 1.0), repeat=q)))
        else:
            corners = np.random.default_rng(1).integers(0, 2, (MOST_CORNERS, q)).astype(float)
        self._starts = np.concatenate([corners, np.full((1, q), 0.5), inside])

    def __call__(self, designs: Array, goal: Callable[[Array], Array]) -> Array:
        """Return the designs with the worst values behind them, shape (n, m + q).

        Parameters
        ----------
        designs : ndarray, shape (n, m)
        goal : callable
            Maps designs with values behind them, shape (k, m + q), to what is to be small, (k,).
        """
        starts = np.broadcast_to(self._starts, (len(designs), *self._starts.shape))
        best = self._worst_of(designs, starts, goal)
        line = np.linspace(-0.5, 0.5, _LINE)
        for sweep in range(_SWEEPS):
            for j in range(len(self._width)):
                # The first sweep looks along the whole interval.
                centre = 0.5 if not sweep else best[:, j, None]
                along = np.clip(centre + line * _NEARER**sweep, 0.0, 1.0)
                along = np.broadcast_to(along, (len(best), _LINE))
                tried = np.repeat(best[:, None], _LINE + 1, axis=1)
                tried[:, 1:, j] = along
                best = self._worst_of(designs, tried, goal)
        return np.column_stack([designs, self._lower + self._width * best])

    def largest(self, designs: Array, number: Callable[[Array], Array]) -> Array:
        """Return the largest of a number over corners and points within, shape (n,)."""
        starts = np.broadcast_to(self._starts, (len(designs), *self._starts.shape))
        return self._of(designs, starts, number).max(axis=1, initial=-np.inf)

    def _worst_of(self, designs: Array, tried: Array, goal: Callable[[Array], Array]) -> Array:
        """Return the worst of the values tried at each design, shape (n, q)."""
        worst = np.argmax(self._of(designs, tried, goal), axis=1)
        return np.array(tried[np.arange(len(designs)), worst])

    def _of(self, designs: Array, tried: Array, number: Callable[[Array], Array]) -> Array:
        count = tried.shape[1]
        values = (self._lower + self._width * tried).reshape(-1, tried.shape[2])
        points = np.column_stack([np.repeat(designs, count, axis=0), values])
        return number(points).reshape(len(designs), count) if len(points) else np.empty((0, count))
