"""The most probable polynomial of one response under the prior of its kernel, given some runs.

Sizes, decays and parities of the axes are those of the largest marginal likelihood. What a run left
out would have been predicted as follows in closed form (Rasmussen and Williams, Gaussian Processes
for Machine Learning, 2006, sections 5.4.1 and 5.4.2).
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Its linear algebra and optimisers load when they are first used.
import scipy
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular

from pymoo_hdte.surrogate._sparse.kernel import (
    ENDS,
    EXPECTED,
    START,
    covariance,
    factors,
    slope_by_axes,
    variances,
)

Array = NDArray[np.float64]

NUGGET = 1e-10
"""Variance of an error of the runs, as a share of the response's: keeps the solution stable."""
MOST_LEARNT = 300
"""Runs from which the parameters are learnt at most; the polynomial is of all."""
_ITERATIONS, _GAIN = 60, 1e-5
"""Most steps of learning, and the share of the loss below which a step ends it.

The loss is a logarithm of a likelihood of some hundreds: the last steps add some hundredths to it,
and cost a third of the time.
"""
NOISE = (np.log(1e-8), np.log(1e-4), np.log(10.0))
"""Logarithms of the least variance of the runs' own scatter, where its search starts, and the most.

As shares of the prior variance of the response's mean.
"""


class Regression:
    """The posterior of one response.

    Parameters
    ----------
    features : list of ndarray, each of shape (k, n)
        The polynomials of every axis at the runs.
    values : ndarray, shape (n,)
        The response there, in its unit.
    relevance : ndarray, shape (n,)
        How much every run counts in ``surprises``.
    parameters : ndarray, shape (d, 3), optional
        Where to start learning them.
    shares : ndarray, shape (n,), optional
        Variance of every run's own scatter over that of one run; 1 by default.
    noisy : bool
        Whether runs may scatter by themselves.
    of : ndarray, shape (n,), optional
        The response whose deviation `surprises` counts; ``values`` by default.

    Attributes
    ----------
    parameters : ndarray, shape (d, 3)
    variance : ndarray, shape (d, k)
        Prior variances by axis and degree.
    left_out : ndarray, shape (n,)
        Every run minus what the others predict there, in the response's unit.
    surprises : ndarray, shape (2,)
        Root mean square of that over the standard deviation of the prediction, as it matters for
        the response's mean and for its standard deviation.
    noise : float
        Variance by which runs scatter by themselves (mesh, tolerance of a solver), as a share of
        the prior's unit; 0 unless the runs tell of it.
    noise_std : float
        The same as a standard deviation of one run, in the response's unit.

    Notes
    -----
    Runs scatter by themselves where that makes them more probable.
    """

    def __init__(
        self,
        features: list[Array],
        values: Array,
        relevance: Array,
        parameters: Array | None = None,
        shares: Array | None = None,
        noisy: bool = True,
        of: Array | None = None,
    ) -> None:
        self.centre = float(values.mean())
        self.unit = float(values.std()) or 1.0
        self._features = features
        standard = (values - self.centre) / self.unit
        start = np.tile(START, (len(features), 1)) if parameters is None else parameters
        shares = np.ones(len(values)) if shares is None else shares
        self.parameters, self.noise = _learnt(features, standard, start, shares, noisy)
        self.variance, _ = variances(self.parameters, len(features[0]))
        self._noises = self.noise * shares
        matrix = with_nugget(covariance(features, features, self.variance), self._noises)
        self._lower = cholesky(matrix, lower=True)
        self._inverse = cho_solve((self._lower, True), np.eye(len(values)))
        self.weights = self._inverse @ standard
        self.size = float(standard @ self.weights) / len(values)
        self.noise_std = self.unit * float(np.sqrt(max(self.size, 0.0) * self.noise))
        diagonal = np.diag(self._inverse)
        left_out = self.weights / diagonal
        expected = np.sqrt(max(self.size, np.finfo(float).tiny) / diagonal)
        self.left_out = self.unit * left_out
        squares = (left_out / expected) ** 2
        self.surprises = surprises(squares, relevance, values if of is None else of)

    def predict(self, features: list[Array]) -> Array:
        """Return the mean, shape (m,), at points of these features, in the response's unit."""
        across = covariance(features, self._features, self.variance)
        return self.centre + self.unit * (across @ self.weights)

    def whitened(self, across: Array) -> Array:
        """Return what the runs tell, shape (n, m), from their covariances with m points, (n, m).

        Its squares, summed over the runs, are what the prior variance shrinks by.
        """
        return np.asarray(solve_triangular(self._lower, across, lower=True))

    def spread(self, features: list[Array], functionals: Array) -> tuple[Array, Array]:
        """Return the standard deviation of sums over points, and what of it is the runs' scatter.

        Both have shape (f,) and are in the response's unit. A sum over points is one over runs,
        each of which scatters independently of the others.

        Parameters
        ----------
        features : list of ndarray, each of shape (k, m)
            The polynomials at the points.
        functionals : ndarray, shape (f, m)
            The weights of every sum.
        """
        inside = covariance(features, features, self.variance)
        across = covariance(self._features, features, self.variance) @ functionals.T
        prior = np.einsum("fm,mn,fn->f", functionals, inside, functionals, optimize=True)
        variance = np.maximum(prior - np.sum(self.whitened(across) ** 2, axis=0), 0.0)
        of_noise = self._noises @ (self._inverse @ across) ** 2
        return self.unit * np.sqrt(self.size * variance), self.unit * np.sqrt(self.size * of_noise)


def surprises(squares: Array, relevance: Array, values: Array) -> Array:
    """Return how far runs are from what others predict, for mean and standard deviation, (2,).

    An error counts in the mean as often as its place occurs, in the deviation times the distance
    from the mean besides: of a response with a heavy tail, what the tail tells.

    Parameters
    ----------
    squares : ndarray, shape (n,)
        Squares of the runs left out over their expectations.
    relevance : ndarray, shape (n,)
        How often places like that of a run occur.
    values : ndarray, shape (n,)
        The response.
    """
    apart = values - np.average(values, weights=relevance)
    weights = np.array([relevance, relevance * apart**2])
    if not weights[1].any():
        weights[1] = relevance
    return np.sqrt(weights @ squares / weights.sum(axis=1))


def with_nugget(matrix: Array, noise: Array | float = 0.0) -> Array:
    """Return a symmetric matrix whose diagonal is raised in place, by `NUGGET` and by noise."""
    matrix[np.diag_indices(len(matrix))] += NUGGET * np.trace(matrix) / len(matrix) + noise
    return matrix


def _learnt(
    features: list[Array], standard: Array, start: Array, shares: Array, noisy: bool
) -> tuple[Array, float]:
    """Return the most probable parameters, by the marginal likelihood and what is expected.

    Shape (d, 3), and the variance of the runs' own scatter, 0 if they do not tell of any.
    """
    count = min(len(standard), MOST_LEARNT)
    features, standard = [feature[:, :count] for feature in features], standard[:count]
    shares = shares[:count]
    middle = np.tile(START, len(features)).ravel()
    expected = np.tile(EXPECTED, len(features)).ravel()
    bounds = [end for _ in features for end in ENDS]

    def loss(flat: Array) -> tuple[float, Array]:
        noise = np.exp(flat[middle.size :])
        value, slope = _misfit(features, standard, flat[: middle.size], noise, shares)
        off = (flat[: middle.size] - middle) / expected
        slope[: middle.size] += off / expected
        return value + 0.5 * float(off @ off), slope

    def optimum(flat: Array, ends: list[tuple[float, float]]) -> Any:
        options = {"maxiter": _ITERATIONS, "maxcor": 20, "ftol": _GAIN}
        return scipy.optimize.minimize(
            loss, flat, jac=True, method="L-BFGS-B", bounds=ends, options=options
        )

    without = optimum(start.ravel(), bounds)
    if not noisy:
        return np.array(without.x).reshape(start.shape), 0.0
    least, first, most = NOISE
    # From the start: what explains the scatter without noise is no way to what does with it.
    both = optimum(np.append(middle, first), [*bounds, (least, most)])
    if both.fun >= without.fun:
        return np.array(without.x).reshape(start.shape), 0.0
    return np.array(both.x[:-1]).reshape(start.shape), float(np.exp(both.x[-1]))


def _misfit(
    features: list[Array], standard: Array, flat: Array, noise: Array, shares: Array
) -> tuple[float, Array]:
    """Return the negative logarithm of the marginal likelihood and its slope.

    In the parameters, shape (3 d,), and in the logarithm of the noise, shape (0,) or (1,).
    """
    parameters = flat.reshape(len(features), -1)
    variance, slopes = variances(parameters, len(features[0]))
    of_axes = factors(features, features, variance)
    product = of_axes[0].copy()
    for factor in of_axes[1:]:
        product *= factor
    try:
        lower = cholesky(with_nugget(product.copy(), noise.sum() * shares), lower=True)
    except np.linalg.LinAlgError:
        return 1e10, np.zeros(flat.size + noise.size)
    weights = cho_solve((lower, True), standard)
    size = max(float(standard @ weights) / len(standard), np.finfo(float).tiny)
    value = 0.5 * len(standard) * np.log(size) + float(np.log(np.diag(lower)).sum())
    # Of the symmetric inverse one half, doubled, gives the same sums as the whole.
    whole = scipy.linalg.lapack.dpotri(lower, lower=True)[0].T
    whole[np.diag_indices(len(whole))] *= 0.5
    whole -= np.outer(0.5 / size * weights, weights)
    gradient = slope_by_axes(features, of_axes, slopes, whole * product)
    of_noise = noise * float(np.diag(whole) @ shares)
    return value, np.append(gradient.ravel(), of_noise)
