"""What runs tell about one response at other points: mean, deviation and covariance."""

from __future__ import annotations

import numpy as np

# Its linear algebra loads when it is first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.kernel import EvenPolynomials, covariance
from pymoo_hdte.surrogate._sparse.regression import Regression

Array = NDArray[np.float64]

_AT_ONCE = 4096
"""Points whose covariances with the runs are held in memory together."""


class Posterior:
    """A response as a normal process, given some runs; the prior is that of `_sparse.kernel`.

    Parameters
    ----------
    points : ndarray, shape (n, d)
        Runs in -1..1.
    values : ndarray, shape (n,)
        The response there, in its unit.
    start : ndarray, shape (d, 3), or None
        Parameters of the prior to start from.

    Attributes
    ----------
    parameters : ndarray, shape (d, 3)
        Of the prior.
    """

    def __init__(self, points: Array, values: Array, start: Array | None = None) -> None:
        self._polynomials = EvenPolynomials.for_runs(len(points))
        self._features = self._polynomials(points)
        self._regression = Regression(self._features, values, np.ones(len(values)), start)
        self.parameters = self._regression.parameters
        # Runs that are predicted worse than expected make the deviation larger, never smaller.
        surprise = max(self._regression.surprises[0], 1.0)
        self._size = self._regression.unit * np.sqrt(self._regression.size) * surprise

    def moments(self, points: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation at points of shape (m, d), (m,) each."""
        blocks = np.array_split(points, max(1, -(-len(points) // _AT_ONCE)))
        means, stds = zip(*(self._moments(block) for block in blocks), strict=True)
        return np.concatenate(means), np.concatenate(stds)

    def _moments(self, points: Array) -> tuple[Array, Array]:
        regression, features = self._regression, self._polynomials(points)
        across = covariance(self._features, features, regression.variance)
        mean = regression.centre + regression.unit * (regression.weights @ across)
        prior = np.ones(len(points))
        for feature, of_axis in zip(features, regression.variance, strict=True):
            prior *= 1.0 + of_axis @ feature**2
        known = regression.whitened(across)
        left = np.maximum(prior - np.einsum("nm,nm->m", known, known), 0.0)
        return mean, self._size * np.sqrt(left)

    def covariance(self, points: Array) -> Array:
        """Return the covariance among points of shape (m, d), shape (m, m)."""
        regression, features = self._regression, self._polynomials(points)
        known = regression.whitened(covariance(self._features, features, regression.variance))
        inside = covariance(features, features, regression.variance)
        return self._size**2 * (inside - known.T @ known)


def draws(mean: Array, covariance_: Array, count: int, random_state: np.random.Generator) -> Array:
    """Return draws of a normal vector, shape (count, m); rounding of its covariance is mended."""
    values, vectors = scipy.linalg.eigh(covariance_)
    factor = vectors * np.sqrt(np.maximum(values, 0.0))
    return mean + random_state.normal(size=(count, len(mean))) @ factor.T
