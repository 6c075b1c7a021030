"""Points of the inputs: where the function is run, and draws of the scatter around designs."""

from __future__ import annotations

import warnings

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate.sparse.axes import Axis

_GRID = np.linspace(-1.0, 1.0, 4001)

Array = NDArray[np.float64]


class SpreadPoints:
    """A scrambled Sobol sequence over the inputs, every beginning of which is spread evenly.

    Designed variables are spread evenly over all that designs reach with their scatter, noise by
    the root of its density: rare values are met more often than they occur.

    Parameters
    ----------
    axes : list of Axis, length d
    random_state : numpy.random.Generator
        Of the scrambling.
    """

    def __init__(self, axes: list[Axis], random_state: np.random.Generator) -> None:
        self._sequence = scipy.stats.qmc.Sobol(len(axes), rng=random_state)
        self._shares = [_spread_over(axis) for axis in axes]

    def next(self, count: int) -> Array:
        """Return the next points, shape (count, d), in -1..1."""
        with warnings.catch_warnings():
            # Any number of points will do here, not only a power of 2.
            warnings.simplefilter("ignore", UserWarning)
            p = self._sequence.random(count)
        columns = [np.interp(one, share, _GRID) for one, share in zip(p.T, self._shares, strict=True)]
        return np.column_stack(columns)


def _spread_over(axis: Axis) -> Array:
    """Return the share of the points below each value of a grid in -1..1."""
    density = np.ones_like(_GRID)
    if not axis.designed and axis.scatter is not None:
        density = axis.scatter.distribution.density(axis.centre + axis.half_width * _GRID)
        density = np.sqrt(np.where(np.isfinite(density), density, 0.0))
    below = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1])))
    return below / below[-1]


def draw_designs(axes: list[Axis], count: int, random_state: np.random.Generator) -> Array:
    """Return designs spread evenly over the box of those axes that have one, shape (count, m)."""
    bounds = np.array([axis.design for axis in axes if axis.design is not None])
    share = scipy.stats.qmc.LatinHypercube(len(bounds), rng=random_state).random(count)
    return bounds[:, 0] + (bounds[:, 1] - bounds[:, 0]) * share


def draw_around(
    axes: list[Axis], designs: Array, count: int, random_state: np.random.Generator
) -> Array:
    """Return draws of the scatter around designs of shape (v, m), shape (v, count, d), in -1..1."""
    shape = len(designs), count
    p = scipy.stats.qmc.LatinHypercube(len(axes), rng=random_state).random(shape[0] * count)
    points, column = np.empty((*shape, len(axes))), 0
    for j, axis in enumerate(axes):
        own = designs[:, column] if axis.designed else None
        column += axis.designed
        offset, factor, _, _ = axis.around(own)
        points[..., j] = offset[:, None] + factor[:, None] * axis.sample(p[:, j]).reshape(shape)
    return np.clip(points, -1.0, 1.0)


def nearest_designs(axes: list[Axis], points: Array) -> Array:
    """Return the designs nearest to points of shape (n, d), shape (n, m)."""
    columns = []
    for axis, z in zip(axes, points.T, strict=True):
        if axis.design is not None:
            columns.append(np.clip(axis.physical(z), *axis.design))
    return np.column_stack(columns)
