"""One response around designs: its expansion, values at common samples, and its extremes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte._unchanging import Unchanging
from pymoo_hdte.problems._simulator.crashes import SuccessAround
from pymoo_hdte.problems._simulator.replicates import OwnScatter
from pymoo_hdte.problems._simulator.tails import NormalScatter, Tail
from pymoo_hdte.problems._simulator.worst import largest_in_box
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.success import STUDENT_OF_DRAWS
from pymoo_hdte.surrogate.box import corners
from pymoo_hdte.surrogate.moments import deviation, divide_or_zero

Array = NDArray[np.float64]

SAMPLES = 4096
"""Samples of the scatter: four scrambled Sobol sequences."""
PARTS = 4
STUDENT = 3.182
"""Standard errors of a mean of four parts within which it lies with 95 %: Student's t(3).

The size of the standard error itself is taken from these four; 2 would cover some 86 %.
"""
RESOLVED = 10.0 / SAMPLES
"""Smallest probability beyond a quantile for which they serve: ten have an error of a third."""
OFTEN = 0.1
"""Smallest probability of an event for which they serve: 410 of them have an error of 5 %."""
MOST_CORNERS = 256
"""Corners of the box of the scatter at which a search for the extreme begins, at most."""
_INSIDE, _LINE = 64, 33
"""Points within at which it begins besides, and points on a line through the box."""


def sampling_error(parts: Array) -> Array:
    """Return the 95 % half-width of a mean, shape (n,), from its independent parts, (4, n)."""
    return np.asarray(STUDENT * parts.std(axis=0, ddof=1) / np.sqrt(PARTS))


class CommonSamples(Unchanging):
    """Samples of the scatter that serve all designs, and the expansion's polynomials there.

    Parameters
    ----------
    moments : SparseMoments
    seed : int
        Seed of the scrambling.

    Attributes
    ----------
    scatter : ndarray, shape (4096, d)
        Values of s on every axis.
    """

    def __init__(self, moments: SparseMoments, seed: int) -> None:
        self.moments = moments
        axes = moments.axes
        seeds = np.random.default_rng(seed).spawn(PARTS)
        shares = [
            scipy.stats.qmc.Sobol(len(axes), rng=child_seed).random(SAMPLES // PARTS)
            for child_seed in seeds
        ]
        p = np.concatenate(shares)
        self.scatter = np.column_stack([axis.sample(p[:, j]) for j, axis in enumerate(axes)])
        self._seed = seed

    @cached_property
    def normal_scatter(self) -> NormalScatter:
        """The scatter as a function of standard normal variables."""
        return NormalScatter(self.moments.axes)

    @cached_property
    def basis(self) -> Array:
        """The polynomials at the samples, shape (4096, q)."""
        return self.moments.basis(self.scatter)

    @cached_property
    def box(self) -> tuple[Array, dict[int, Array]]:
        """Ends of the scatter, shape (d, 2), and values in it of the axes that take no others."""
        ends = np.array([axis.scatter_ends for axis in self.moments.axes])
        discrete = {}
        for j, ((low, high), axis) in enumerate(zip(ends, self.moments.axes, strict=True)):
            if axis.discrete is not None:
                values = axis.discrete.values
                discrete[j] = values[(values >= low) & (values <= high)]
        return ends, discrete

    @cached_property
    def starts(self) -> tuple[Array, Array]:
        """Corners and some samples within the box, shape (k, d), and the polynomials there."""
        ends, _ = self.box
        inside = np.clip(self.scatter[:_INSIDE], *ends.T)
        some = corners(ends, MOST_CORNERS, np.random.default_rng(self._seed))
        points = np.concatenate([some, inside])
        return points, self.moments.basis(points)


class Around:
    """One response around n designs.

    Parameters
    ----------
    common : CommonSamples
    expansion : ndarray, shape (n, q)
        Expansion of the response, from `SparseMoments.expansion`.
    part : slice
        The samples to use.

    Attributes
    ----------
    resolved, often : float
        Smallest probabilities, beyond a quantile and of an event, for which the samples serve.
    beside : dict of str to Around
        All responses around these designs by name, itself among them; None stands for the only one.
    mean_error, std_error : ndarray, shape (n,)
        Errors of mean and standard deviation in the response's unit.
    success : SuccessAround or None
        How likely runs succeed there, if some have failed; statistics then are of those that do.
    own : OwnScatter or None
        What the response of a random simulator scatters by itself.
    n_runs : int
        Runs behind it.
    """

    resolved, often = RESOLVED, OFTEN

    def __init__(
        self,
        common: CommonSamples,
        expansion: Array,
        part: slice = slice(None),
        success: SuccessAround | None = None,
        own: OwnScatter | None = None,
    ) -> None:
        self._common, self.expansion, self._part = common, expansion, part
        self.success, self.own, self.n_runs = success, own, 0
        self.beside: dict[str | None, Around] = {None: self}
        self.mean_error = self.std_error = np.zeros(len(expansion))

    def tail(
        self,
        row: int,
        margin: Callable[[Mapping[str | None, Array]], Array],
        target: Callable[[Array, Array], float] = lambda values, weights: 0.0,
    ) -> Tail:
        """Return samples around one design where a margin of the responses is above a level."""
        expansions = {name: around.expansion[row] for name, around in self.beside.items()}
        moments = self._common.moments
        return Tail(self._common.normal_scatter, moments.basis, expansions, margin, target)

    @cached_property
    def weights(self) -> Array | None:
        """What the samples count, shape (n, k), their mean 1; None if all count alike."""
        if self.success is None:
            return None
        weights = np.maximum(self.success.probabilities(self._part), np.finfo(float).tiny)
        return weights / weights.mean(axis=1, keepdims=True)

    @cached_property
    def success_share(self) -> Array:
        """The probability that a run succeeds, shape (n,)."""
        if self.success is None:
            return np.ones(len(self.expansion))
        return self.success.probabilities(self._part).mean(axis=1)

    @cached_property
    def mean(self) -> Array:
        """The mean, shape (n,), exact where all runs succeed."""
        if self.weights is None:
            return self.expansion[:, 0]
        # The samples tell how failures change it: without any, it is the exact one.
        values = self.expansion @ self._common.basis[self._part].T
        return self.expansion[:, 0] + np.mean((self.weights - 1.0) * values, axis=1)

    @cached_property
    def std(self) -> Array:
        """The standard deviation, shape (n,), exact where all runs succeed."""
        by_inputs = deviation(self.expansion)
        if self.weights is not None:
            values = self.expansion @ self._common.basis[self._part].T
            mean = np.mean(self.weights * values, axis=1, keepdims=True)
            variance = np.mean(self.weights * (values - mean) ** 2, axis=1)
            by_inputs = by_inputs * np.sqrt(divide_or_zero(variance, values.var(axis=1)))
        if self.own is None:
            return by_inputs
        return np.sqrt(by_inputs**2 + self.own.variance(self.weights, self._part))

    def error_of_success(self, value: Callable[[Around], Array]) -> Array:
        """Return by how much a number may be off since success is uncertain, shape (n,).

        Parameters
        ----------
        value : callable
            Returns the number, shape (n,), of what is around designs.
        """
        if self.success is None:
            return np.zeros(len(self.expansion))
        part = slice(0, SAMPLES // PARTS)
        own = value(self._with(self.success, part))
        others = [value(self._with(draw, part)) for draw in self.success.drawn()]
        parts = np.array([value(quarter) for quarter in self.quarters()])
        posterior = np.sqrt(np.mean((np.array(others) - own) ** 2, axis=0))
        return STUDENT_OF_DRAWS * posterior + sampling_error(parts)

    def _with(self, success: SuccessAround | None, part: slice) -> Around:
        """Return all responses with another probability of success and a part of the samples."""
        others = {
            id(around): Around(self._common, around.expansion, part, success, around.own)
            for around in self.beside.values()
        }
        beside = {name: others[id(around)] for name, around in self.beside.items()}
        for around in others.values():
            around.beside = beside
        return others[id(self)]

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Values at the samples, shape (n, k), and the polynomials there, shape (k, q)."""
        basis = self._common.basis[self._part]
        values = self.expansion @ basis.T
        return values if self.own is None else values + self.own.drawn(self._part), basis

    @property
    def common_alone(self) -> bool:
        """Whether only common samples serve: others know no failures and no own scatter."""
        return self.success is not None or self.own is not None

    def quarters(self) -> Iterator[Around]:
        """Yield the same with each independent part of the samples."""
        step = SAMPLES // PARTS
        for start in range(0, SAMPLES, step):
            yield self._with(self.success, slice(start, start + step))

    def extreme(self, side: float) -> tuple[Array, Array]:
        """Return the largest value in the box, shape (n,), and the polynomials there, (n, q).

        The smallest for ``side`` -1; where runs fail, only where one is likelier to succeed.
        """
        moments, (ends, discrete) = self._common.moments, self._common.box
        starts, basis = self._common.starts

        def value(points: Array) -> Array:
            basis = moments.basis(points.reshape(-1, points.shape[2]))
            basis = basis.reshape(*points.shape[:2], -1)
            values = side * np.einsum("nkq,nq->nk", basis, self.expansion)
            if self.success is not None:
                values = np.where(self.success.likely_at(points), values, -np.inf)
            return np.asarray(values)

        values = side * self.expansion @ basis.T
        if self.success is not None:
            values = np.where(self.success.likely_at(starts), values, -np.inf)
        first = starts[np.argmax(values, axis=1)]
        at = moments.basis(largest_in_box(first, ends, value, _LINE, discrete))
        return np.einsum("nq,nq->n", self.expansion, at), at
