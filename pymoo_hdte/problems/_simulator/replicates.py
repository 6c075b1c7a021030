"""A random simulator: several runs at each point, whose own scatter is a response of its own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from pymoo_hdte._unchanging import Unchanging
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.data import Data, Runs
from pymoo_hdte.problems._simulator.runs import Simulator
from pymoo_hdte.surrogate._sparse.axes import Axis
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial

Array = NDArray[np.float64]

SEED = "seed"
"""Name of the argument by which a random simulator takes its seed, a whole number."""
LARGEST_SEED = 2**31


class Replicates:
    """Runs of a random simulator as means and variances of every point.

    Parameters
    ----------
    simulate : Simulator
        With the seed as its last input.
    count : int
        Runs at each point, 2 or more.
    seed : int
        Of the seeds of the runs.

    Attributes
    ----------
    runs : Runs
        All runs so far, without their seeds.
    """

    def __init__(self, simulate: Simulator, count: int, seed: int) -> None:
        self._simulate, self.count = simulate, count
        self._random_state = np.random.default_rng([seed, 1])
        self.runs = Runs(np.empty((0, len(simulate.names) - 1)), np.empty((0, 0)))

    def __call__(self, values: Array) -> Array:
        """Return means and variances, shape (n, 2 r), at inputs of shape (n, d).

        Both are NaN where one of the runs failed. Errors are those of `Simulator`.
        """
        X = np.repeat(values, self.count, axis=0)
        seeds = self._random_state.integers(0, LARGEST_SEED, len(X)).astype(float)
        Y = self._simulate(np.column_stack([X, seeds]))
        self.keep(X, Y)
        parts = Y.reshape(len(values), self.count, -1)
        return np.hstack([parts.mean(axis=1), parts.var(axis=1, ddof=1)])

    def keep(self, X: Array, Y: Array) -> None:
        """Add runs to ``runs``."""
        before = self.runs.Y.reshape(-1, Y.shape[1])
        self.runs = Runs(np.concatenate([self.runs.X, X]), np.concatenate([before, Y]))

    def grouped(self, data: Data) -> tuple[Array, Array]:
        """Return points of runs in hand, and means and variances there, as a call does.

        Raises
        ------
        InvalidInput
            If some point has a single run.
        """
        points, places, counts = np.unique(
            data.points, axis=0, return_inverse=True, return_counts=True
        )
        if counts.min() < 2:
            raise InvalidInput("runs of data at one point", 1, "2 or more for a random simulator")
        parts = [data.values[places.ravel() == place] for place in range(len(points))]
        moments = [np.hstack([part.mean(axis=0), part.var(axis=0, ddof=1)]) for part in parts]
        return points, np.array(moments)


class OwnMoments(Unchanging):
    """The simulator's own variance around designs, and draws of what it adds.

    Parameters
    ----------
    polynomial : SparsePolynomial
        Variances of all responses, in squares of their units.
    axes : list of Axis
    scatter : ndarray, shape (k, d)
        Common samples.
    """

    def __init__(self, polynomial: SparsePolynomial, axes: list[Axis], scatter: Array) -> None:
        self.moments, self._scatter = SparseMoments(polynomial, axes), scatter
        count = len(scatter)
        shares = (np.random.default_rng(3).permutation(count) + 0.5) / count
        self.normal = np.asarray(ndtri(shares))

    def around(self, designs: Array) -> list[OwnScatter]:
        """Return it around designs of shape (n, m), by response."""
        expansion = self.moments.expansion(designs)
        return [OwnScatter(self, expansion[:, place]) for place in range(expansion.shape[1])]

    @cached_property
    def basis(self) -> Array:
        """The polynomials at the samples, shape (k, q)."""
        return self.moments.basis(self._scatter)


@dataclass(frozen=True)
class OwnScatter:
    """The own variance of one response around n designs."""

    moments: OwnMoments
    expansion: Array

    def variance(self, weights: Array | None, part: slice) -> Array:
        """Return its mean over the scatter, shape (n,), at least 0."""
        mean = self.expansion[:, 0]
        if weights is not None:
            values = self.expansion @ self.moments.basis[part].T
            mean = mean + np.mean((weights - 1.0) * values, axis=1)
        return np.maximum(mean, 0.0)

    def drawn(self, part: slice) -> Array:
        """Return normal deviations of these variances at the samples, shape (n, k)."""
        variance = np.maximum(self.expansion @ self.moments.basis[part].T, 0.0)
        return np.sqrt(variance) * self.moments.normal[part]
