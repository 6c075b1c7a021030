"""Very many responses as few: principal components of the values of a field.

The values of a field, a curve or a spectrum are nearly sums of few patterns. The regressions are
those of the components; every value is their sum, its error that of the components together and
what they leave of it (Blatman and Sudret, ICASP 11, 2011).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.response import (
    COVERAGE,
    COVERAGE_OF_CUT,
    LEAST_SURPRISE,
    Judged,
    ResponseFit,
    fitted,
)
from pymoo_hdte.surrogate._sparse.terms import closed, products

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

FEWER = 4
"""Responses for one component, at least, that make components worth while."""
OF_LOST = 0.3
"""What components may leave of a response, as a share of what its terms may."""


def fitted_together(
    features: list[Array],
    truth: Array,
    relevance: Array,
    judged: Judged,
    lost: float,
    starts: list[Array],
    dense: Callable[[], list[Array]] | None = None,
    process: bool = False,
) -> tuple[Sequence[ResponseFit | PartOfField], list[Array]]:
    """Return the surrogates of all responses, and the parameters of the regressions behind them.

    Parameters
    ----------
    features, relevance, judged, lost, dense, process
        As in `fitted`; components are always polynomials.
    truth : ndarray, shape (n, r)
        The responses.
    starts : list of ndarray
        Parameters to start from, as far as there are any.
    """
    components = _components(truth, OF_LOST * lost)
    values = truth if components is None else components.scores
    found = [*starts, *[None] * values.shape[1]][: values.shape[1]]
    others = (dense, process) if components is None else (None, False)
    fits = [
        fitted(features, column, relevance, judged, lost, start, *others)
        for column, start in zip(values.T, found, strict=True)
    ]
    parameters = [fit.parameters for fit in fits]
    if components is None:
        return fits, parameters
    field = _Field(components, fits)
    return [PartOfField(field, place) for place in range(truth.shape[1])], parameters


@dataclass(frozen=True)
class _Components:
    """Responses as centre plus scores times patterns, plus what is left.

    Attributes
    ----------
    centre : ndarray, shape (r,)
    patterns : ndarray, shape (k, r)
        In the responses' units.
    scores : ndarray, shape (n, k)
    remainder : ndarray, shape (n, r)
    """

    centre: Array
    patterns: Array
    scores: Array
    remainder: Array


def _components(truth: Array, left: float) -> _Components | None:
    """Return the components that leave of every response at most this share of its deviation.

    None if that takes more than one for `FEWER` responses.
    """
    most = truth.shape[1] // FEWER
    if most < 1:
        return None
    centre, unit = truth.mean(axis=0), truth.std(axis=0)
    unit = np.where(unit > 0.0, unit, 1.0)
    standard = (truth - centre) / unit
    u, size, patterns = np.linalg.svd(standard, full_matrices=False)
    for count in range(1, min(most, len(size)) + 1):
        scores = u[:, :count] * size[:count]
        remainder = standard - scores @ patterns[:count]
        if np.all(np.sqrt(np.mean(remainder**2, axis=0)) <= left):
            return _Components(centre, patterns[:count] * unit, scores, remainder * unit)
    return None


class _Field:
    """All responses of a field, from the surrogates of their components."""

    def __init__(self, components: _Components, fits: list[ResponseFit]) -> None:
        self.components, self.fits = components, fits
        self.indices = closed(np.concatenate([fit.indices for fit in fits]))
        places = {tuple(row): place for place, row in enumerate(self.indices.tolist())}
        own = np.zeros((len(fits), len(self.indices)))
        for row, fit in zip(own, fits, strict=True):
            row[[places[tuple(index)] for index in fit.indices.tolist()]] = fit.coefficients
        self.coefficients = components.patterns.T @ own
        self.coefficients[:, 0] += components.centre
        self.left = np.sqrt(np.mean(components.remainder**2, axis=0))
        self._judged: tuple[Judged, tuple[Array, Array, Array]] | None = None

    @cached_property
    def left_out(self) -> Array:
        """Every run minus what the others predict there, shape (n, r)."""
        of_components = np.column_stack([fit.left_out for fit in self.fits])
        return of_components @ self.components.patterns + self.components.remainder

    def errors(self, judged: Judged) -> tuple[Array, Array, Array]:
        """Return scatter and errors of mean and deviation in the responses' units, (v, r) each."""
        if self._judged is None or self._judged[0] is not judged:
            rows = [
                self._at(features, weights)
                for features, weights in zip(judged.features, judged.weights, strict=True)
            ]
            scatter, mean, std = (np.array(column) for column in zip(*rows, strict=True))
            self._judged = judged, (scatter, mean, std)
        return self._judged[1]

    def _at(self, features: list[Array], weights: Array) -> tuple[Array, Array, Array]:
        patterns = self.components.patterns
        kept = np.column_stack(
            [products(features, fit.indices) @ fit.coefficients for fit in self.fits]
        )
        values = kept @ patterns
        deviation = values - weights @ values
        scatter = np.sqrt(weights @ deviation**2)
        unit = np.maximum(scatter, np.finfo(float).tiny ** 0.25)
        functionals = np.vstack([weights, (weights[:, None] * deviation / unit).T])
        squares = np.zeros((2, patterns.shape[1]))
        off = np.zeros_like(kept)
        for k, (fit, pattern) in enumerate(zip(self.fits, patterns, strict=True)):
            if fit.alone:
                share = np.full(len(functionals), np.sqrt(np.mean(fit.left_out**2)))
            else:
                of_mean, of_std = np.maximum(fit.regression.surprises, LEAST_SURPRISE)
                share = COVERAGE * fit.regression.spread(features, functionals)[0]
                share *= np.append(of_mean, np.full(len(share) - 1, of_std))
                off[:, k] = fit.regression.predict(features) - kept[:, k]
            squares += (np.array([np.full(len(pattern), share[0]), share[1:]]) * pattern) ** 2
        cut = off @ patterns
        mean, std = np.sqrt(squares) + self.left
        mean += COVERAGE_OF_CUT * np.abs(weights @ cut)
        whole = np.sqrt(weights @ (deviation + cut - weights @ cut) ** 2)
        std += COVERAGE_OF_CUT * np.abs(whole - scatter)
        noise = np.array([fit.regression.noise_std for fit in self.fits]) ** 2 @ patterns**2
        return scatter, mean, std + np.sqrt(scatter**2 + noise) - scatter


class PartOfField:
    """One response of a field, as `ResponseFit` is for one that stands alone.

    Parameters
    ----------
    field : _Field
    place : int
        Which response it is.

    Attributes
    ----------
    indices, coefficients, left_out
        As in `ResponseFit`.
    """

    def __init__(self, field: _Field, place: int) -> None:
        self._field, self._place = field, place
        self.indices: Indices = field.indices
        self.coefficients: Array = field.coefficients[place]

    @property
    def left_out(self) -> Array:
        """Every run minus what the others predict there, shape (n,)."""
        return self._field.left_out[:, self._place]

    def errors(self, judged: Judged, least: float, counted: bool = False) -> tuple[Array, Array]:
        """Return expected errors of mean and deviation as shares of the scatter, shape (v,) each.

        Parameters
        ----------
        judged : Judged
        least : float
            Scatter below which it counts as this, in the response's unit.
        counted : bool
            Of no effect: what runs scatter by themselves is an error here in any case.
        """
        scatter, mean, std = (part[:, self._place] for part in self._field.errors(judged))
        unit = np.maximum(scatter, least)
        return mean / unit, std / unit
