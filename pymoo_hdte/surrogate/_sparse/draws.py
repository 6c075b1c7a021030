"""Points of the inputs: where the function is run, and draws of the scatter around designs."""

from __future__ import annotations

import warnings

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.axes import Axis

OUTWARD = 0.2
"""Exponent of 1 / (1 - z^2) in the density of the runs: at an end, neighbours are on one side.

0.5 suits polynomials of high degree in few variables, 0 those of low degree in many. Chosen among
0, 0.2 and 0.4: piston needed more than 130, 98 and 122 runs, cantilever 88, 71 and 109, wing
weight 59, 53 and 48, Ishigami's function 47, 42 and 42.
"""
TEMPERED = 0.9
"""How far the density of the runs is flattened in an unbounded input: its power is 1 less this.

With n such inputs, less this over n: all of them are far out together otherwise, where the scatter
hardly goes. By hand; with 0.5 the runs ended before those values of exp(1.5 a) that matter.
"""
_GRID = np.linspace(-1.0, 1.0, 4001)

Array = NDArray[np.float64]


class SpreadPoints:
    """A scrambled Sobol sequence over the inputs, every beginning of which is spread evenly.

    Designed variables are spread evenly over all that designs reach with their scatter, noise by
    a power of its density: rare values are met more often than they occur.

    Parameters
    ----------
    axes : list of Axis, length d
    random_state : numpy.random.Generator
        Generator of the scrambling.
    """

    def __init__(self, axes: list[Axis], random_state: np.random.Generator) -> None:
        self._axes = axes
        self._sequence = scipy.stats.qmc.Sobol(len(axes), rng=random_state)
        self._shares = [_spread_over(axis, _power(axes, axis)) for axis in axes]

    def next(self, count: int) -> Array:
        """Return the next points, shape (count, d), in -1..1."""
        with warnings.catch_warnings():
            # Any number of points will do here, not only a power of 2.
            warnings.simplefilter("ignore", UserWarning)
            p = self._sequence.random(count)
        columns = [
            np.interp(column, share, _GRID)
            if axis.discrete is None
            else axis.cube(axis.discrete.drawn(column, _power(self._axes, axis)))
            for axis, column, share in zip(self._axes, p.T, self._shares, strict=True)
        ]
        return np.column_stack(columns)


def relevance(axes: list[Axis], points: Array) -> Array:
    """Return the density of the scatter at points over that of the runs, shape (n,).

    Parameters
    ----------
    axes : list of Axis, length d
    points : ndarray, shape (n, d)
        Points in -1..1.
    """
    # Single values have no neighbours that are missing at an end.
    between = points[:, [axis.discrete is None for axis in axes]]
    ratio = np.prod(np.maximum(1.0 - between**2, 0.0), axis=1) ** OUTWARD
    for axis, z in zip(axes, points.T, strict=True):
        density = _density(axis, z)
        if density is not None:
            ratio *= (density * axis.half_width) ** (1.0 - _power(axes, axis))
    return ratio / max(float(ratio.mean()), np.finfo(float).tiny)


def _power(axes: list[Axis], axis: Axis) -> float:
    """Return the power of a noise's density by which runs are spread."""
    return 1.0 - (
        TEMPERED / sum(noise.is_unbounded for noise in axes) if axis.is_unbounded else 0.5
    )


def _density(axis: Axis, z: Array) -> Array | None:
    """Return the density of a noise at places in -1..1, 0 where it has none; None of a design."""
    if axis.designed or axis.scatter is None:
        return None
    density = axis.scatter.distribution.density(axis.centre + axis.half_width * z)
    return np.where(np.isfinite(density), density, 0.0)


def _spread_over(axis: Axis, power: float) -> Array:
    """Return the share of the points below each value of a grid in -1..1."""
    of_noise = _density(axis, _GRID)
    density = np.ones_like(_GRID) if of_noise is None else of_noise**power
    middle = 0.5 * (_GRID[1:] + _GRID[:-1])
    outward = (1.0 - middle**2) ** -OUTWARD
    below = np.append(0.0, np.cumsum(outward * (density[1:] + density[:-1])))
    return below / below[-1]


def draw_designs(axes: list[Axis], count: int, random_state: np.random.Generator) -> Array:
    """Return designs spread evenly over the box of those axes that have one, shape (count, m)."""
    bounds = np.array([axis.design for axis in axes if axis.design is not None])
    share = scipy.stats.qmc.LatinHypercube(len(bounds), rng=random_state).random(count)
    return bounds[:, 0] + (bounds[:, 1] - bounds[:, 0]) * share


def draw_around(
    axes: list[Axis], designs: Array, count: int, random_state: np.random.Generator
) -> tuple[Array, Array]:
    """Return draws of the scatter around designs of shape (v, m), and what each weighs.

    Rare values of an unbounded scatter are drawn oftener than they occur and weigh less: they may
    carry much of the deviation.

    Returns
    -------
    points : ndarray, shape (v, count, d)
        Points in -1..1.
    weights : ndarray, shape (v, count)
        Weights, which sum to 1 at each design.
    """
    shape = len(designs), count
    p = scipy.stats.qmc.LatinHypercube(len(axes), rng=random_state).random(shape[0] * count)
    # The more axes, the less each may be changed for the weights to remain alike.
    power = 1.0 - 0.5 / max(1, sum(axis.is_unbounded for axis in axes))
    points, weights, column = np.empty((*shape, len(axes))), np.ones(shape), 0
    for j, axis in enumerate(axes):
        own = designs[:, column] if axis.designed else None
        column += axis.designed
        offset, factor, _, _ = axis.around(own)
        values, weight = _rare_oftener(axis, p[:, j], power)
        points[..., j] = offset[:, None] + factor[:, None] * values.reshape(shape)
        weights *= weight.reshape(shape)
    return np.clip(points, -1.0, 1.0), weights / weights.sum(axis=1, keepdims=True)


def _rare_oftener(axis: Axis, p: Array, power: float) -> tuple[Array, Array]:
    """Return values of s drawn by a power of their density, and what they weigh, same shape."""
    if axis.scatter is None or not axis.is_unbounded:
        return axis.sample(p), np.ones_like(p)
    ends = axis.scatter.lower, axis.scatter.upper
    values = np.linspace(*ends, len(_GRID))
    density = np.maximum(axis.scatter.distribution.density(values), 0.0)
    tempered = np.where(np.isfinite(density), density, 0.0) ** power
    below = np.append(0.0, np.cumsum(tempered[1:] + tempered[:-1]))
    drawn = np.interp(p, below / below[-1], values)
    weight = np.interp(drawn, values, tempered) ** (1.0 / power - 1.0)
    return np.log1p(drawn) if axis.logarithmic else drawn, weight


def nearest_designs(axes: list[Axis], points: Array) -> Array:
    """Return the designs nearest to points of shape (n, d), shape (n, m)."""
    columns = []
    for axis, z in zip(axes, points.T, strict=True):
        if axis.design is not None:
            columns.append(np.clip(axis.physical(z), *axis.design))
    return np.column_stack(columns)
