"""A surrogate that finds its own degrees: it grows until it is as accurate as asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate.sparse.axes import Axis
from pymoo_hdte.surrogate.sparse.held_out import HeldOut, draw_designs
from pymoo_hdte.surrogate.sparse.influence import Influence, expected_sizes
from pymoo_hdte.surrogate.sparse.interpolation import GrowingInterpolation
from pymoo_hdte.surrogate.sparse.moments import SparseMoments
from pymoo_hdte.surrogate.sparse.polynomial import SparsePolynomial

Array = NDArray[np.float64]

HELD_OUT_DESIGNS = 16
"""Designs with two points each at which the error is measured."""
HELD_OUT_SHARE = 0.2
"""Share of the runs at which that number is doubled; set by hand."""
JUDGED_DESIGNS = 32
"""Designs at which the size of a surplus is judged."""
SMALLEST_SCATTER = 0.1
"""Scatter below this share of its median over the designs is judged as if it were that; by hand."""
SCATTER_OF_RANGE = 1e-4
"""The same, as a share of the response's deviation over all points."""
TAIL_GROWTH = 4.0
"""How many times what it adds at its end values the scatter beyond all runs may add; by hand.

An unbounded scatter has no runs beyond its quantiles of 1e-5. Moved to these, that part adds about
as much to mean and deviation as it does for a linear response, and a third of it for exp(1.5 a) of
a standard normal a. A polynomial of degree 18 adds some thousand times as much: it runs away there.
"""
FAR_ERROR = 1e6
"""How many times its error inside a polynomial may be off beyond all runs; by hand.

An exact one, with an error of rounding, is exact there as well.
"""
BATCH = 0.04
"""Share of the set that is added at once, before all sizes are judged anew; set by hand."""


@dataclass(frozen=True)
class AdaptiveFit:
    """What growth ended with.

    Attributes
    ----------
    polynomial : SparsePolynomial
        In -1..1 of every axis, r responses in their units.
    moments : SparseMoments
        Of it.
    mean_error, std_error : ndarray, shape (r,)
        Estimated errors of mean and standard deviation as shares of the scatter.
    n_runs : int
        Calls of the function, those at held-out points among them.
    smallest_scatter : ndarray, shape (r,)
        What a smaller scatter is judged as, in the responses' units.
    failed : ndarray, shape (k, d)
        Points in -1..1 at which the function failed.
    held_out_points : ndarray, shape (v, d)
        Points not used.
    held_out_error : ndarray, shape (v, r)
        Function minus surrogate there, as a share of the scatter.
    """

    polynomial: SparsePolynomial
    moments: SparseMoments
    mean_error: Array
    std_error: Array
    n_runs: int
    smallest_scatter: Array
    failed: Array
    held_out_points: Array
    held_out_error: Array

    @property
    def largest_error(self) -> float:
        """Of mean and standard deviation of all responses, as a share of the scatter."""
        return float(max(self.mean_error.max(), self.std_error.max()))


class _Growth:
    """The state between two batches."""

    def __init__(
        self,
        axes: list[Axis],
        function: Callable[[Array], Array],
        random_state: np.random.Generator,
    ) -> None:
        self.axes, self.function, self.random_state = axes, function, random_state
        self.grown = GrowingInterpolation(axes)
        self.held_out = HeldOut.draw(axes, HELD_OUT_DESIGNS, random_state)
        self.influence = Influence(axes, draw_designs(axes, JUDGED_DESIGNS, random_state))
        self.failed: list[Array] = []
        self.n_runs = 0
        self.truth = self.run(self.held_out.points)

    def run(self, points: Array) -> Array:
        """Return the function's values, NaN in every response where it failed in one."""
        values = np.array(self.function(points), dtype=float)
        self.n_runs += len(points)
        bad = ~np.isfinite(values).all(axis=1)
        values[bad] = np.nan
        self.failed += list(points[bad])
        return values

    def grow(self, wanted: list[tuple[int, ...]]) -> None:
        """Run the function for these indices and add them."""
        values = self.run(np.array([self.grown.point(index) for index in wanted]))
        for index, row in zip(wanted, values, strict=True):
            self.grown.add(index, row)

    def judge(self) -> AdaptiveFit:
        """Measure the surrogate as it stands."""
        self.grown.complete()
        polynomial = self.grown.polynomial()
        # Where there are no runs the polynomial runs away: its error would hide behind a scatter
        # that is not there.
        moments = SparseMoments(polynomial, self.axes, [axis.cut for axis in self.axes])
        _, judged = moments(self.influence.designs)
        spread = np.nanstd(self.truth, axis=0)
        least = np.maximum(SMALLEST_SCATTER * np.median(judged, axis=0), SCATTER_OF_RANGE * spread)
        least = np.where(least > 0.0, least, np.finfo(float).tiny ** 0.25)
        self.scale = np.maximum(judged, least)
        mean, std = moments(self.held_out.designs)
        found = polynomial(self.held_out.points)
        scale = np.maximum(std, least)
        left = self.truth - found
        of_mean, of_std, self.unexplained = self.held_out.errors(
            left, found - np.tile(mean, (2, 1)), scale
        )
        return AdaptiveFit(
            polynomial,
            moments,
            of_mean,
            of_std,
            self.n_runs,
            least,
            np.array(self.failed).reshape(-1, len(self.axes)),
            self.held_out.points,
            left / np.tile(scale, (2, 1)),
        )

    def with_tails(self, fit: AdaptiveFit, accuracy: float) -> AdaptiveFit:
        """Return the fit with the scatter beyond all runs, or with the error of leaving it out."""
        if all(len(axis.cut.nodes) == len(axis.measure.nodes) for axis in self.axes):
            return fit
        whole = SparseMoments(fit.polynomial, self.axes)
        ended = SparseMoments(fit.polynomial, self.axes, [axis.ended for axis in self.axes])
        without, added, at_ends = (
            np.array(one(self.influence.designs)) for one in (fit.moments, whole, ended)
        )
        beyond, at_ends = (
            np.abs(added - without) / self.scale,
            np.abs(at_ends - without) / self.scale,
        )
        if np.all(beyond <= accuracy):
            return replace(fit, moments=whole)
        moments, doubt = fit.moments, TAIL_GROWTH * at_ends.max(axis=1)
        if np.all(beyond <= np.maximum(accuracy, TAIL_GROWTH * at_ends)):
            inside = np.array([fit.mean_error, fit.std_error])
            moments, doubt = whole, np.minimum(at_ends.max(axis=1), FAR_ERROR * inside)
        of_mean, of_std = fit.mean_error + doubt[0], fit.std_error + doubt[1]
        return replace(fit, moments=moments, mean_error=of_mean, std_error=of_std)

    def hold_out_more(self, budget: int) -> None:
        """Keep the points not used in step with the set: more of them tell errors better."""
        wanted = min(HELD_OUT_SHARE * self.n_runs, budget - self.n_runs) / 2.0
        count = int(wanted) - len(self.held_out.designs)
        if count < len(self.held_out.designs):
            return
        more = HeldOut.draw(self.axes, count, self.random_state)
        truth = self.run(more.points)
        half, new = len(self.held_out.designs), len(more.designs)
        self.truth = np.concatenate(
            [self.truth[:half], truth[:new], self.truth[half:], truth[new:]]
        )
        self.held_out = self.held_out.joined(more)

    def next_indices(self, most: int) -> list[tuple[int, ...]]:
        """Return the candidates that are expected to matter most."""
        candidates = self.grown.candidates()
        sizes = self.influence.sizes(self.grown.indices, self.grown.surpluses, self.scale)
        guesses = expected_sizes(self.grown, sizes, candidates, self.unexplained)
        return [candidates[row] for row in np.argsort(-guesses, kind="stable")[:most]]


def fit_adaptively(
    axes: list[Axis],
    function: Callable[[Array], Array],
    accuracy: float,
    budget: int,
    random_state: np.random.Generator,
    acceptable: Callable[[AdaptiveFit], bool] = lambda fit: True,
    at_once: int = 1,
) -> AdaptiveFit:
    """Grow a surrogate until mean and standard deviation are accurate, or the budget is spent.

    Parameters
    ----------
    axes : list of Axis, length d
    function : callable
        Maps points of shape (n, d) in -1..1 to (n, r) values, NaN where it fails.
    accuracy : float
        Largest error of both as a share of the scatter.
    budget : int
        Most points at which the function is called.
    random_state : numpy.random.Generator
        Places the points that are not used.
    acceptable : callable
        A further condition to stop.
    at_once : int
        Least number of indices to add together.

    Returns
    -------
    AdaptiveFit
        Of the accuracy asked for unless the budget is spent.
    """
    growth = _Growth(axes, function, random_state)
    growth.grow(growth.grown.candidates())
    growth.grow(growth.grown.candidates())
    while True:
        fit = growth.judge()
        if fit.largest_error <= accuracy:
            fit = growth.with_tails(fit, accuracy)
            if fit.largest_error <= accuracy and acceptable(fit):
                return fit
        growth.hold_out_more(budget)
        batch = max(at_once, int(BATCH * len(growth.grown.members)))
        wanted = growth.next_indices(min(batch, budget - growth.n_runs))
        if not wanted:
            return fit
        growth.grow(wanted)
