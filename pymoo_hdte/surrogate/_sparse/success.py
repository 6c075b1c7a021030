"""Where a function gives a result: the probability of success, given runs some of which failed.

A latent polynomial in the inputs has the same prior as a response (`kernel`), and a run succeeds
with the normal probability of its value there: 0 lies on the boundary, and where failures happen by
chance the polynomial is flat. The posterior is Laplace's (Rasmussen and Williams, Gaussian
Processes for Machine Learning, 2006, algorithms 3.1, 3.2 and 5.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

# Its linear algebra, optimisers and special functions load when they are first used.
import scipy
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.special import log_ndtr, ndtr

from pymoo_hdte.surrogate._sparse.kernel import (
    ENDS,
    EXPECTED,
    START,
    EvenPolynomials,
    factors,
    slope_by_axes,
    variances,
)
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial
from pymoo_hdte.surrogate._sparse.regression import MOST_LEARNT
from pymoo_hdte.surrogate._sparse.terms import (
    closed,
    largest,
    likely_terms,
    prior_of_terms,
    products,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

_SIZE = (np.log(10.0), 2.0)
"""Middle and deviation of the logarithm of the latent variance that is expected; wide, by hand."""
_SIZE_ENDS = (-4.0, 10.0)
_LOST = 0.02
"""Latent norm of the terms that are left out: it changes no probability by 0.01."""
_STEPS = 30
"""Newton steps to the most probable latent values; they converge in some ten."""
_ITERATIONS = 40
DRAWN = 16
"""Polynomials that are drawn from the posterior: a deviation of sixteen is known to 18 %."""
STUDENT_OF_DRAWS = 2.12
"""Deviations of these draws within which 95 % lie: Student's t(16)."""
_BURN_IN, _THINNED = 200, 40
"""Steps of the sampler before the first draw, and from one draw to the next; by hand."""
_MOST_DRAWN = 400
"""Terms of these polynomials, those of the largest prior variance."""


@dataclass(frozen=True)
class Success:
    """The latent polynomial of success, and how well it is known.

    Attributes
    ----------
    polynomial : SparsePolynomial
        One response, dimensionless: a run succeeds with the normal probability of its value.
    draws : SparsePolynomial
        Sixteen polynomials drawn from the posterior, dimensionless; what they differ by is the
        error of whatever is computed with the first one.
    parameters : ndarray, shape (3 d + 1,)
        Of the prior, to start the next fit from.
    """

    polynomial: SparsePolynomial
    draws: SparsePolynomial
    parameters: Array

    def probability(self, points: Array) -> Array:
        """Return the probability of success, shape (n,), at points of -1..1, shape (n, d)."""
        return ndtr(self.polynomial(points)[:, 0])

    def drawn_probabilities(self, points: Array) -> Array:
        """Return that of every draw, shape (16, n)."""
        return ndtr(self.draws(points).T)


def fit_success(
    points: Array,
    good: NDArray[np.bool_],
    polynomials: EvenPolynomials,
    parameters: Array | None = None,
) -> Success:
    """Return the probability of success given which runs did.

    Parameters
    ----------
    points : ndarray, shape (n, d)
        Runs in -1..1.
    good : ndarray of bool, shape (n,)
        Which of them gave a result.
    polynomials : EvenPolynomials
    parameters : ndarray, shape (3 d + 1,), optional
        Where to start learning those of the prior.
    """
    features, sign = polynomials(points), np.where(good, 1.0, -1.0)
    inputs = points.shape[1]
    start = np.append(np.tile(START, inputs), _SIZE[0]) if parameters is None else parameters
    parameters = _learnt(features, sign, start)
    variance, _ = variances(parameters[:-1].reshape(-1, 3), polynomials.degree)
    size = float(np.exp(parameters[-1]))
    # One set of terms for all that follows: the runs know nothing of others.
    drawn = likely_terms(variance, _MOST_DRAWN)
    prior, at_runs = size * prior_of_terms(variance, drawn), products(features, drawn)
    mode = _Mode((at_runs * prior) @ at_runs.T, sign)
    matrices = [polynomials.to_chebyshev()] * inputs

    def polynomial(indices: Indices, coefficients: Array) -> SparsePolynomial:
        return SparsePolynomial.from_triangular(indices, coefficients, matrices)

    coefficients_of_mode = prior * (mode.slope @ at_runs)
    essential = closed(drawn[largest(coefficients_of_mode, _LOST)])
    stays = np.isin(rows_of(drawn), rows_of(essential))
    indices, coefficients = drawn[stays], coefficients_of_mode[stays]
    draws = _posterior_draws(coefficients_of_mode, prior, sign[:, None] * at_runs)
    return Success(polynomial(indices, coefficients[None]), polynomial(drawn, draws), parameters)


def _posterior_draws(start: Array, prior: Array, signed_terms: Array) -> Array:
    """Return coefficients drawn from the posterior, shape (16, p), by elliptical slice sampling.

    Murray, Adams and MacKay, AISTATS 2010. Laplace's posterior is of no use here: far from the
    boundary its likelihood is flat, though the sign there is known.

    Parameters
    ----------
    start : ndarray, shape (p,)
        The most probable coefficients.
    prior : ndarray, shape (p,)
        Their prior variances.
    signed_terms : ndarray, shape (n, p)
        The terms at the runs, times the sign of what was seen there.
    """
    rng = np.random.default_rng(0)
    deviation, draws, now = np.sqrt(prior), [], start
    along = signed_terms @ now
    likelihood = float(log_ndtr(along).sum())
    for step in range(1, _BURN_IN + DRAWN * _THINNED + 1):
        other = deviation * rng.standard_normal(len(start))
        across = signed_terms @ other
        level = likelihood + np.log(rng.random())
        angle = rng.uniform(0.0, 2.0 * np.pi)
        low, high = angle - 2.0 * np.pi, angle
        while True:
            turned = along * np.cos(angle) + across * np.sin(angle)
            likelihood = float(log_ndtr(turned).sum())
            if likelihood > level or high - low < 1e-12:
                break
            low, high = (angle, high) if angle < 0.0 else (low, angle)
            angle = rng.uniform(low, high)
        now, along = now * np.cos(angle) + other * np.sin(angle), turned
        if step > _BURN_IN and not (step - _BURN_IN) % _THINNED:
            draws.append(now)
    return np.array(draws)


def rows_of(indices: Indices) -> Any:
    """Return the rows as entries that can be compared, shape (p,)."""
    return np.ascontiguousarray(indices).view([("", indices.dtype)] * indices.shape[1])[:, 0]


class _Mode:
    """The most probable latent values.

    Attributes
    ----------
    latent, slope, root : ndarray, shape (n,)
        Latent values, the slope of their likelihood, and the root of its negative curvature.
    lower : ndarray, shape (n, n)
        Cholesky factor of I + root K root.
    evidence : float
        Logarithm of the marginal likelihood.
    """

    def __init__(self, matrix: Array, sign: Array) -> None:
        latent = old = np.zeros(len(sign))
        best = -np.inf
        for _ in range(_STEPS):
            slope, curvature, _ = _likelihood(sign, latent)
            root = np.sqrt(curvature)
            lower = cholesky(
                np.eye(len(sign)) + root[:, None] * matrix * root, lower=True, check_finite=False
            )
            aim = curvature * latent + slope
            solved = cho_solve((lower, True), root * (matrix @ aim), check_finite=False)
            step, share = aim - root * solved - old, 1.0
            while True:
                weights = old + share * step
                latent = matrix @ weights
                value = -0.5 * float(weights @ latent) + float(log_ndtr(sign * latent).sum())
                if value >= best or share < 1e-6:
                    break
                share *= 0.5
            old, gain, best = weights, value - best, max(value, best)
            if gain < 1e-8:
                break
        self.latent = latent
        self.slope, curvature, self.third = _likelihood(sign, latent)
        self.root = np.sqrt(curvature)
        self.lower = cholesky(
            np.eye(len(sign)) + self.root[:, None] * matrix * self.root, lower=True
        )
        self.evidence = value - float(np.log(np.diag(self.lower)).sum())


def _likelihood(sign: Array, latent: Array) -> tuple[Array, Array, Array]:
    """Return slope, negative curvature and third derivative of the logarithm of the likelihood."""
    r = sign * latent
    ratio = np.exp(-0.5 * r**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(r))
    curvature = np.maximum(ratio * (r + ratio), 1e-12)
    of_curvature = ratio - (r + 2.0 * ratio) * curvature
    return sign * ratio, curvature, -sign * of_curvature


def _learnt(features: list[Array], sign: Array, start: Array) -> Array:
    """Return the most probable parameters, by the marginal likelihood and what is expected."""
    # Those that failed are rare and say most.
    order = np.argsort(sign, kind="stable")[:MOST_LEARNT]
    features, sign = [feature[:, order] for feature in features], sign[order]
    middle = np.append(np.tile(START, len(features)), _SIZE[0])
    width = np.append(np.tile(EXPECTED, len(features)), _SIZE[1])

    def loss(flat: Array) -> tuple[float, Array]:
        value, slope = _misfit(features, sign, flat)
        off = (flat - middle) / width
        return value + 0.5 * float(off @ off), slope + off / width

    bounds = [*[end for _ in features for end in ENDS], _SIZE_ENDS]
    optimum = scipy.optimize.minimize(
        loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": _ITERATIONS}
    )
    return np.array(optimum.x)


def _misfit(features: list[Array], sign: Array, parameters: Array) -> tuple[float, Array]:
    """Return the negative logarithm of the marginal likelihood and its slope, shape (3 d + 1,)."""
    variance, slopes = variances(parameters[:-1].reshape(-1, 3), len(features[0]))
    of_axes = factors(features, features, variance)
    matrix = float(np.exp(parameters[-1])) * np.prod(of_axes, axis=0)
    try:
        mode = _Mode(matrix, sign)
    except np.linalg.LinAlgError:
        return 1e10, np.zeros_like(parameters)
    root, slope = mode.root, mode.slope
    inner = root[:, None] * cho_solve((mode.lower, True), np.diag(root))
    known = solve_triangular(mode.lower, root[:, None] * matrix, lower=True)
    implicit = 0.5 * (np.diag(matrix) - np.sum(known**2, axis=0)) * mode.third
    implicit = implicit - inner @ (matrix @ implicit)
    outer = 0.5 * (np.outer(slope, slope) - inner)
    outer += 0.5 * (np.outer(implicit, slope) + np.outer(slope, implicit))
    outer *= -matrix
    gradient = slope_by_axes(features, of_axes, slopes, outer)
    return -mode.evidence, np.append(gradient, outer.sum())
