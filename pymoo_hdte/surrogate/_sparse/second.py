"""Other surrogates of a response than a polynomial of it: of its logarithm or logit, or a process.

A response that spans decades is often smooth in its logarithm, one between 0 and 1 in its logit;
one with kinks is followed better by a rougher process. Which serves best is told by the runs left
out. What serves is then sampled densely, which costs no run, and a polynomial of it is fitted: so
its moments are exact and everything else stays as it is. What the polynomial loses is part of the
stated error.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

# Its special functions load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.regression import Regression, surprises

Array = NDArray[np.float64]


class Surrogate(Protocol):
    """What stands behind a fit: `Regression`, or one of this module."""

    left_out: Array
    surprises: Array
    noise_std: float

    def predict(self, features: list[Array]) -> Array:
        """Return the response, shape (m,), at points of these features."""

    def spread(self, features: list[Array], functionals: Array) -> tuple[Array, Array]:
        """Return the standard deviation of sums over points, and what of it is the runs' scatter.

        Both have shape (f,).
        """


@dataclass(frozen=True)
class Link:
    """An increasing function of a response, its inverse, and the inverse's slope."""

    name: str
    forth: Callable[[Array], Array]
    back: Callable[[Array], Array]
    slope: Callable[[Array], Array]


def _logit_slope(h: Array) -> Array:
    share = scipy.special.expit(h)
    return np.asarray(share * (1.0 - share))


LOG = Link("log", np.log, np.exp, np.exp)
NEGATIVE_LOG = Link("-log(-y)", lambda y: -np.log(-y), lambda h: -np.exp(-h), lambda h: np.exp(-h))
LOGIT = Link(
    "logit",
    lambda y: np.asarray(scipy.special.logit(y)),
    lambda h: np.asarray(scipy.special.expit(h)),
    _logit_slope,
)


def links_for(values: Array) -> list[Link]:
    """Return the links that the values of a response allow."""
    low, high = float(values.min()), float(values.max())
    if low == high:
        return []
    links = [LOG] if low > 0.0 else [NEGATIVE_LOG] if high < 0.0 else []
    return [*links, LOGIT] if low > 0.0 and high < 1.0 else links


class Linked:
    """The surrogate of a response by that of its link; errors by the slope of the inverse.

    Parameters
    ----------
    features : list of ndarray, each of shape (k, n)
        The polynomials of every axis at the runs.
    values : ndarray, shape (n,)
        The response there.
    relevance : ndarray, shape (n,)
        As in `Regression`.
    link : Link
    """

    def __init__(self, features: list[Array], values: Array, relevance: Array, link: Link) -> None:
        self._link = link
        h = link.forth(values)
        self._regression = Regression(features, h, relevance, of=values)
        self.surprises = self._regression.surprises
        self.left_out: Array = values - link.back(h - self._regression.left_out)
        slope = float(np.sqrt(np.mean(link.slope(h) ** 2)))
        self.noise_std = self._regression.noise_std * slope

    def predict(self, features: list[Array]) -> Array:
        """Return the response, shape (m,), at points of these features."""
        return self._link.back(self._regression.predict(features))

    def spread(self, features: list[Array], functionals: Array) -> tuple[Array, Array]:
        """Return both standard deviations of sums over points, shape (f,) each."""
        slope = self._link.slope(self._regression.predict(features))
        return self._regression.spread(features, functionals * slope)


class Process:
    """A normal process with a Matern covariance, of `scikit-learn` (Gaussian process regression).

    Its realisations have one derivative, or none for ``smoothness`` 0.5; parameters as in `Linked`.

    Raises
    ------
    ImportError
        If scikit-learn is not installed (extra ``process``).
    """

    def __init__(self, features: list[Array], values: Array, relevance: Array) -> None:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor, kernels

        points = _points(features)
        self._centre, self._unit = float(values.mean()), float(values.std()) or 1.0
        d = points.shape[1]
        kernel = kernels.ConstantKernel(1.0, (1e-3, 1e4)) * kernels.Matern(
            np.full(d, 1.0), (0.05, 100.0), nu=1.5
        ) + kernels.WhiteKernel(1e-6, (1e-10, 1.0))
        self._model = GaussianProcessRegressor(kernel, alpha=0.0)
        with warnings.catch_warnings():
            # A length at its bound says that an input has no influence.
            warnings.simplefilter("ignore", ConvergenceWarning)
            self._model.fit(points, (values - self._centre) / self._unit)
        self._covariance: Any = self._model.kernel_.k1
        noise = float(self._model.kernel_.k2.noise_level)
        self.noise_std = self._unit * float(np.sqrt(noise))
        lower = self._model.L_
        inverse = scipy.linalg.cho_solve((lower, True), np.eye(len(values)))
        diagonal = np.diag(inverse)
        self.left_out: Array = self._unit * self._model.alpha_ / diagonal
        squares = (self._model.alpha_ / diagonal) ** 2 * diagonal
        self.surprises = surprises(squares, relevance, values)
        self._runs, self._inverse, self._noise = points, inverse, noise

    def predict(self, features: list[Array]) -> Array:
        """Return the response, shape (m,), at points of these features."""
        across = self._covariance(_points(features), self._runs)
        return self._centre + self._unit * np.asarray(across @ self._model.alpha_)

    def spread(self, features: list[Array], functionals: Array) -> tuple[Array, Array]:
        """Return both standard deviations of sums over points, shape (f,) each."""
        points = _points(features)
        inside = self._covariance(points)
        across = self._covariance(self._runs, points) @ functionals.T
        prior = np.einsum("fm,mn,fn->f", functionals, inside, functionals, optimize=True)
        known = scipy.linalg.solve_triangular(self._model.L_, across, lower=True)
        variance = np.maximum(prior - np.sum(known**2, axis=0), 0.0)
        of_noise = self._noise * np.sum((self._inverse @ across) ** 2, axis=0)
        return self._unit * np.sqrt(variance), self._unit * np.sqrt(of_noise)


def _points(features: list[Array]) -> Array:
    """Return the points in -1..1, shape (n, d): the first polynomial is sqrt(3) z."""
    return np.column_stack([feature[0] for feature in features]) / 3.0**0.5


def better(
    features: list[Array],
    values: Array,
    relevance: Array,
    plain: Regression,
    process: bool,
) -> Linked | Process | None:
    """Return another surrogate if it predicts the runs left out better by more than chance.

    The logarithm of a mean square of n independent errors is known to sqrt(2 / n); two of these
    make a difference.

    Parameters
    ----------
    features, values, relevance
        As in `Linked`.
    plain : Regression
        That of the response itself.
    process : bool
        Whether to try a `Process`.
    """

    def off(surrogate: Regression | Linked | Process) -> float:
        size = np.average(surrogate.left_out**2, weights=relevance)
        return float(np.log(max(size, np.finfo(float).tiny)))

    others: list[Linked | Process] = [
        Linked(features, values, relevance, link) for link in links_for(values)
    ]
    if process and _has_scikit_learn():
        others.append(Process(features, values, relevance))
    best = min(others, key=off, default=None)
    if best is None or off(best) > off(plain) - 2.0 * np.sqrt(2.0 / len(values)):
        return None
    return best


def _has_scikit_learn() -> bool:
    try:
        import sklearn.gaussian_process  # noqa: F401
    except ImportError:
        return False
    return True
