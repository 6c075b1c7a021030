"""What lies beyond all runs: how much an unbounded scatter adds there to mean and deviation.

There are no runs beyond the quantiles of 1e-5. What the response adds to the variance in the last
three tenfold steps of the probability before them, where there are runs, is told by the surrogate;
their ratios are continued as a series. A response that oscillates and grows may pass
through its mean at the last run, where a single value would tell that nothing is beyond.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.axes import TAIL, Axis
from pymoo_hdte.surrogate._sparse.measures import Measure
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial

Array = NDArray[np.float64]

STEPS = (1000.0 * TAIL, 100.0 * TAIL, 10.0 * TAIL, TAIL)
"""Probabilities beyond which the last three steps begin, and the last ends."""
LARGEST_RATIO = 0.9
"""Ratio of two steps above which it is taken as this: 9 times the last step if it stays."""
FAR_OFF = 4.0
"""How many times the estimate the polynomial itself may add beyond all runs; by hand.

Moved to the last runs, what lies beyond adds about as much to mean and deviation as it does for a
linear response, and a third of it for exp(1.5 a) of a standard normal a. A polynomial of degree 18
adds some thousand times as much: it runs away there.
"""
IN_DOUBT = 0.5
"""Share of the estimate that counts as error where the polynomial adds about as much; by hand."""
EXACT_ERROR = 1e-10
EXACT_DEGREE = 8
"""Error inside, as a share of the scatter, and degree, up to which a polynomial is the response."""


def beyond_all_runs(
    polynomial: SparsePolynomial, axes: list[Axis], designs: Array, scale: Array, error: float
) -> tuple[SparseMoments, Array]:
    """Return the moments to use, and the errors of mean and deviation by the tails, shape (2, r).

    Parameters
    ----------
    polynomial : SparsePolynomial
    axes : list of Axis, length d
    designs : ndarray, shape (n, m)
        At which the errors are judged; the largest counts.
    scale : ndarray, shape (n, r)
        Scatter there, of which errors are shares.
    error : float
        Error of the surrogate inside, as a share of the scatter.
    """
    whole = SparseMoments(polynomial, axes)
    unbounded = [j for j, axis in enumerate(axes) if axis.is_unbounded]
    degree = max(polynomial.degrees[j] for j in unbounded)
    if error <= EXACT_ERROR and degree <= EXACT_DEGREE:
        return whole, np.zeros((2, scale.shape[1]))
    inside = SparseMoments(polynomial, axes, [axis.cut for axis in axes])
    ended = SparseMoments(polynomial, axes, [axis.ended for axis in axes])
    without, added, at_ends = (np.array(moments(designs)) for moments in (inside, whole, ended))
    series = _series(polynomial, axes, unbounded, designs, without[0]) / scale**2
    expected = np.abs(at_ends - without) / scale
    expected[0] = np.maximum(expected[0], np.sqrt(2.0 * TAIL * series))
    expected[1] = np.maximum(expected[1], 0.5 * series)
    if np.all(np.abs(added - without) / scale <= FAR_OFF * expected):
        return whole, IN_DOUBT * expected.max(axis=1)
    return inside, FAR_OFF * expected.max(axis=1)


def _series(
    polynomial: SparsePolynomial,
    axes: list[Axis],
    unbounded: list[int],
    designs: Array,
    mean: Array,
) -> Array:
    """Return the variance expected beyond all runs, shape (n, r), in squares of units."""
    variance = np.zeros_like(mean)
    for j in unbounded:
        for upper in (False, True):
            third, second, outermost = (
                _added(polynomial, axes, j, slab, designs, mean)
                for slab in _slabs(axes[j].measure, upper)
            )
            ratio, before = _ratio(outermost, second), _ratio(second, third)
            slower = np.minimum(ratio / np.maximum(before, np.finfo(float).tiny), 1.0)
            following = ratio * slower
            variance += outermost * following / (1.0 - following * slower)
    return variance


def _ratio(later: Array, earlier: Array) -> Array:
    """Return the ratio of two steps; where nothing was added before, what comes may go on."""
    return np.minimum(later / np.maximum(earlier, np.finfo(float).tiny), LARGEST_RATIO)


def _slabs(measure: Measure, upper: bool) -> list[tuple[float, Measure | None]]:
    """Return probability and measure of the last three steps on one side."""
    order = slice(None, None, -1) if upper else slice(None)
    nodes, weights = measure.nodes[order], measure.weights[order]
    beyond = np.cumsum(weights) - 0.5 * weights
    slabs: list[tuple[float, Measure | None]] = []
    for high, low in pairwise(STEPS):
        inside = (beyond > low) & (beyond <= high)
        share = float(weights[inside].sum())
        places = nodes[inside][order], weights[inside][order] / (share or 1.0)
        slabs.append((share, Measure(*places) if share else None))
    return slabs


def _added(
    polynomial: SparsePolynomial,
    axes: list[Axis],
    axis: int,
    slab: tuple[float, Measure | None],
    designs: Array,
    mean: Array,
) -> Array:
    """Return what a step of one axis adds to the variance, shape (n, r)."""
    share, measure = slab
    if measure is None:
        return np.zeros_like(mean)
    measures = [entry.cut for entry in axes]
    measures[axis] = measure
    there, std = SparseMoments(polynomial, axes, measures)(designs)
    return share * (std**2 + (there - mean) ** 2)
