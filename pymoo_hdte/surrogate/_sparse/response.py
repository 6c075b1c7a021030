"""The surrogate of one response: its terms, and what mean and deviation are off by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Its linear algebra loads when it is first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.kernel import EvenPolynomials
from pymoo_hdte.surrogate._sparse.regression import Regression, with_nugget
from pymoo_hdte.surrogate._sparse.second import Linked, Process, Surrogate, better
from pymoo_hdte.surrogate._sparse.terms import (
    closed,
    largest,
    likely_terms,
    prior_of_terms,
    products,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

COVERAGE = 4.0
"""Expected errors within which 95 % of the designs lie.

2 for a normal error at one design; those of many designs belong to one function, are large or small
together, and larger towards corners. With 3, 91 % of 40 designs of the borehole with a scatter of
5 % were covered. Chosen on that and the six functions that `experiments robust` names.
"""
COVERAGE_OF_DRAWS = 2.0
"""The same of what runs of a random simulator scatter: a sum of independent draws is normal.

Noise of a mesh is none: its errors belong to one function, too.
"""
COVERAGE_OF_CUT = 1.96
"""The same of what terms left out change, which is known: normal over the designs."""
LEAST_SURPRISE = 0.3
"""Runs that are predicted better than expected make errors smaller by no more than this factor."""
LOST = 0.05
"""Largest share of the accuracy that terms left out may cost."""
EXACT = 1e-3
"""Ratio of errors at runs left out below which few terms, fitted alone, replace the regression.

They are chosen by all runs, so that their own error is told too small; polynomials of low degree
give ratios of 1e-6 and less.
"""
LEAST_JUDGED = 1e-2
"""Scatter below which errors of two surrogates are compared as if it were this.

As a share of the response's deviation over all runs.
"""
LOST_CONVERTED, OF_ITS_ERROR = 4.0, 0.1
"""What terms left out of such a polynomial may lose: so many times `LOST`, or this of its error.

That error is the median of the runs left out: what is off at a peak is no reason to lose as much
elsewhere. With the root mean square, a corner peak took 370 runs for what it takes 150 for. Moments
lose a fifth of it, which is part of the stated error.
"""
MOST_CONVERTED = 1500
"""Terms that are looked at where another surrogate is made a polynomial."""
LEARNT_FROM = 1000
"""Points from which these terms are learnt; all points tell their coefficients."""
MOST_FITTED = 0.4
"""Largest number of such terms as a share of the runs."""


@dataclass(frozen=True)
class Judged:
    """Where errors are judged: designs and draws of the scatter around each.

    Attributes
    ----------
    weights : ndarray, shape (v, k)
        Weights of the draws; they sum to 1 at each design.
    features : list of list of ndarray
        The polynomials at the draws, by design and axis.
    """

    weights: Array
    features: list[list[Array]]

    @classmethod
    def at(cls, points: Array, weights: Array, polynomials: EvenPolynomials) -> Judged:
        """Return it with these polynomials at points of shape (v, k, d)."""
        together = polynomials(points.reshape(-1, points.shape[-1]))
        parts = [np.split(table, len(points), axis=1) for table in together]
        return cls(weights, [list(group) for group in zip(*parts, strict=True)])


@dataclass(frozen=True)
class ResponseFit:
    """The surrogate of one response.

    Attributes
    ----------
    regression : Regression, Linked or Process
        With which errors are estimated.
    parameters : ndarray, shape (d, 3)
        Of the regression of the response itself, from which that of more runs starts.
    indices : ndarray of int, shape (p, d)
        Degrees of the terms, a downward-closed set.
    coefficients : ndarray, shape (p,)
        Coefficients of the orthonormal polynomials, in the response's unit.
    left_out : ndarray, shape (n,)
        Every run minus what the others predict there.
    alone : bool
        Whether the terms are fitted alone, without the prior.
    """

    regression: Surrogate
    parameters: Array
    indices: Indices
    coefficients: Array
    left_out: Array
    alone: bool

    @property
    def plain(self) -> bool:
        """Whether it is a polynomial of the response itself."""
        return isinstance(self.regression, Regression)

    def errors(self, judged: Judged, least: float, counted: bool = False) -> tuple[Array, Array]:
        """Return expected errors of mean and deviation as shares of the scatter, shape (v,) each.

        Parameters
        ----------
        judged : Judged
        least : float
            Scatter below which it counts as this, in the response's unit.
        counted : bool
            Whether what runs scatter by themselves is counted elsewhere.
        """
        errors = []
        for features, weights in zip(judged.features, judged.weights, strict=True):
            values = products(features, self.indices) @ self.coefficients
            deviation = values - weights @ values
            scatter = max(_std(values, weights), least)
            if self.alone:
                share = float(np.sqrt(np.mean(self.left_out**2))) / scatter
                errors.append((share, share))
                continue
            whole = self.regression.predict(features)
            functionals = np.array([weights, weights * deviation / scatter])
            expected, by_noise = self.regression.spread(features, functionals)
            expected = COVERAGE * np.sqrt(np.maximum(expected**2 - by_noise**2, 0.0))
            expected = np.hypot(expected, (COVERAGE_OF_DRAWS if counted else COVERAGE) * by_noise)
            expected = expected * np.maximum(self.regression.surprises, LEAST_SURPRISE)
            changes = weights @ (whole - values), _std(whole, weights) - _std(values, weights)
            expected = expected + COVERAGE_OF_CUT * np.abs(changes)
            # What runs scatter by themselves may as well be a part of the response.
            if not counted:
                expected[1] += np.hypot(scatter, self.regression.noise_std) - scatter
            errors.append(tuple(expected / scatter))
        mean, std = np.array(errors).T
        return mean, std


def fitted(
    features: list[Array],
    values: Array,
    relevance: Array,
    judged: Judged,
    lost: float,
    start: Array | None,
    dense: Callable[[], list[Array]] | None = None,
    process: bool = False,
) -> ResponseFit:
    """Return the surrogate of one response.

    Parameters
    ----------
    features : list of ndarray
        Features of the runs.
    values : ndarray, shape (n,)
        The response there.
    relevance : ndarray, shape (n,)
        How much every run counts in the estimated errors.
    judged : Judged
    lost : float
        Largest change by terms left out, as a share of the least scatter.
    start : ndarray, shape (d, 3), or None
        Parameters of the regression to start from.
    dense : callable, optional
        Returns features of very many points, at which other surrogates of the response are made a
        polynomial; without it, there are no others.
    process : bool
        Whether a normal process is tried.
    """
    regression = Regression(features, values, relevance, start)
    plain = _plain(features, values, regression, judged, lost)
    left_out = float(np.sqrt(np.mean(regression.left_out**2)))
    if plain.alone or dense is None or left_out <= lost * float(np.std(values)):
        return plain
    other = better(features, values, relevance, regression, process)
    if other is None:
        return plain
    converted = _converted(other, regression.parameters, dense(), judged, lost)
    # A polynomial may follow it less well than it follows the response.
    least = LEAST_JUDGED * float(np.std(values))

    def error(fit: ResponseFit) -> float:
        return float(np.max(np.sqrt(np.mean(np.square(fit.errors(judged, least)), axis=1))))

    return min((plain, converted), key=error)


def _plain(
    features: list[Array],
    values: Array,
    regression: Regression,
    judged: Judged,
    lost: float,
) -> ResponseFit:
    """Return the most probable polynomial of the response itself."""
    scatters = [
        _std(regression.predict(features), weights)
        for features, weights in zip(judged.features, judged.weights, strict=True)
    ]
    looked_at = likely_terms(regression.variance)
    coefficients = _posterior(regression, features, looked_at)
    essential = largest(coefficients, lost * float(np.quantile(scatters, 0.1)))
    alone = _alone(features, values, looked_at, coefficients, regression)
    if alone is not None:
        return alone
    indices = closed(looked_at[essential])
    return ResponseFit(
        regression,
        regression.parameters,
        indices,
        _posterior(regression, features, indices),
        regression.left_out,
        alone=False,
    )


def _converted(
    surrogate: Linked | Process,
    parameters: Array,
    dense: list[Array],
    judged: Judged,
    lost: float,
) -> ResponseFit:
    """Return a polynomial of another surrogate."""
    values = surrogate.predict(dense)
    some = [feature[:, :LEARNT_FROM] for feature in dense]
    regression = Regression(
        some, values[:LEARNT_FROM], np.ones(LEARNT_FROM), parameters, noisy=False
    )
    scatters = [
        _std(surrogate.predict(features), weights)
        for features, weights in zip(judged.features, judged.weights, strict=True)
    ]
    looked_at = likely_terms(regression.variance, MOST_CONVERTED)
    coefficients = _posterior(regression, some, looked_at)
    own_error = float(np.median(np.abs(surrogate.left_out)))
    lost = max(LOST_CONVERTED * lost * float(np.quantile(scatters, 0.1)), OF_ITS_ERROR * own_error)
    indices = closed(looked_at[largest(coefficients, lost)])
    # The regression tells which terms there are. Its own coefficients are differences of very
    # large numbers, for the points are many more than the terms.
    terms = products(dense, indices)
    normal = with_nugget(terms.T @ terms)
    own = scipy.linalg.solve(normal, terms.T @ values, assume_a="pos")
    return ResponseFit(surrogate, parameters, indices, own, surrogate.left_out, alone=False)


def _std(values: Array, weights: Array) -> float:
    return float(np.sqrt(weights @ (values - weights @ values) ** 2))


def _posterior(regression: Regression, features: list[Array], indices: Indices) -> Array:
    prior = prior_of_terms(regression.variance, indices)
    posterior = regression.unit * prior * (regression.weights @ products(features, indices))
    posterior[0] += regression.centre
    return posterior


def _alone(
    features: list[Array],
    values: Array,
    indices: Indices,
    coefficients: Array,
    regression: Regression,
) -> ResponseFit | None:
    """Return a fit of the leading terms alone if it is far better, else None."""
    order = np.argsort(-np.abs(coefficients), kind="stable")
    rms = EXACT * float(np.sqrt(np.mean(regression.left_out**2)))
    best = None
    count = 1
    while count <= MOST_FITTED * len(values):
        chosen = closed(indices[order[:count]])
        count = max(count + 1, int(1.25 * count))
        if len(chosen) > MOST_FITTED * len(values):
            break
        q, r = np.linalg.qr(products(features, chosen))
        if np.min(np.abs(np.diag(r))) < 1e-8 * np.max(np.abs(np.diag(r))):
            continue
        solution = np.linalg.solve(r, q.T @ values)
        leverage = np.minimum(np.sum(q**2, axis=1), 1.0 - 1e-12)
        left_out = (values - q @ (q.T @ values)) / (1.0 - leverage)
        if (error := float(np.sqrt(np.mean(left_out**2)))) < rms:
            fit = ResponseFit(
                *(regression, regression.parameters, chosen, solution, left_out), alone=True
            )
            best, rms = fit, error
    return best
