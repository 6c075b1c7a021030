"""Error statistics of prototypes: Table 2 and Fig. 4 of the paper, from raw repeated readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betainc
from scipy.stats import shapiro
from scipy.stats import t as student

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.identification.outliers import find_outliers, mean_of_valid, repeatability
from pymoo_hdte.identification.prototypes import NormalSample

SIGNIFICANCE = 0.05
"""Probability of any false alarm in one family of tests (13 normality tests, 78 correlations)."""

FEWEST_PROTOTYPES = 4
"""Below, a correlation has no useful p-value."""

NORMAL, LOGNORMAL, EMPIRICAL = "normal", "lognormal", "empirical"


@dataclass(frozen=True)
class ErrorStatistics:
    """What the readings say of the series, and what may be assumed of it (Table 2 and Fig. 4).

    Attributes
    ----------
    symbols : tuple of str
        Of the errors.
    values : ndarray, shape (n_prototypes, n_errors)
        Mean of the valid readings, in the unit of the readings.
    rejected : ndarray of bool, shape (n_prototypes, n_errors, n_repeats)
        Outliers, see `find_outliers`.
    repeatability : ndarray, shape (n_errors,)
        Standard deviation of repeated readings, in their unit.
    samples : tuple of NormalSample, length n_errors
        Mean and standard deviation over the prototypes, in the unit of the readings.
    shapiro_w, shapiro_p : ndarray, shape (n_errors,)
        Tests of Shapiro and Wilk (Biometrika 52, 1965) over the prototypes, dimensionless; p before
        adjustment.
    correlation, correlation_p : ndarray, shape (n_errors, n_errors)
        Pearson's, dimensionless, with two-sided p before adjustment (1 on the diagonal).

    Notes
    -----
    Families of tests are adjusted by Holm's method (Scand. J. Statist. 6, 1979) to a probability of
    0.05 of any false alarm.

    Examples
    --------
    >>> readings = np.random.default_rng(1).normal(10.0, 1.0, (12, 2, 5))
    >>> found = error_statistics(readings, ("e_1", "e_2"))
    >>> found.independent, found.correlated_pairs
    (True, ())
    """

    symbols: tuple[str, ...]
    values: NDArray[np.float64]
    rejected: NDArray[np.bool_]
    repeatability: NDArray[np.float64]
    samples: tuple[NormalSample, ...]
    shapiro_w: NDArray[np.float64]
    shapiro_p: NDArray[np.float64]
    correlation: NDArray[np.float64]
    correlation_p: NDArray[np.float64]

    @property
    def marginals(self) -> tuple[str, ...]:
        """Distribution to sample each error from: normal, else lognormal, else empirical.

        An error is not normal if its Shapiro-Wilk test says so after Holm's adjustment for all
        errors. It is lognormal then if its logarithm passes the same test.
        """
        adjusted = holm(self.shapiro_p)
        return tuple(
            NORMAL if p >= SIGNIFICANCE else _other_marginal(column)
            for p, column in zip(adjusted, self.values.T, strict=True)
        )

    @property
    def correlated_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs whose correlation is significant after Holm's adjustment for all pairs.

        As places (i, j), i below j, in `symbols`.
        """
        rows, columns = np.triu_indices(len(self.symbols), 1)
        significant = holm(self.correlation_p[rows, columns]) < SIGNIFICANCE
        return tuple(
            (int(i), int(j)) for i, j in zip(rows[significant], columns[significant], strict=True)
        )

    @property
    def independent(self) -> bool:
        """Whether no correlation is significant, which is not yet a proof of independence."""
        return not self.correlated_pairs

    def advice(self) -> tuple[str, ...]:
        """Say, a sentence each, where normality or independence fails and what to use instead."""
        sentences = []
        for symbol, marginal in zip(self.symbols, self.marginals, strict=True):
            if marginal == LOGNORMAL:
                sentences.append(f"{symbol} is not normal, its logarithm is: draw it lognormal.")
            elif marginal == EMPIRICAL:
                sentences.append(
                    f"{symbol} is neither normal nor lognormal: resample the measured prototypes, "
                    "and distrust the interval of its standard deviation."
                )
        for i, j in self.correlated_pairs:
            sentences.append(
                f"{self.symbols[i]} and {self.symbols[j]} are correlated "
                f"({self.correlation[i, j]:+.2f}): draw the errors jointly with the measured "
                "correlation matrix."
            )
        if self.independent and len(self.symbols) > 1:
            limit = detectable_correlation(len(self.values), len(self.symbols))
            sentences.append(
                f"No correlation is significant, but {len(self.values)} prototypes cannot show one "
                f"below {limit:.2f}: independence remains an assumption."
            )
        return tuple(sentences)


def error_statistics(measurements: ArrayLike, symbols: Sequence[str]) -> ErrorStatistics:
    """Reject outliers, average, test, and summarise (Section 2.1 of the paper).

    Parameters
    ----------
    measurements : array_like, shape (n_prototypes, n_errors, n_repeats)
        Raw readings in one unit; the statistics come in the same unit.
    symbols : sequence of str, length n_errors
        Different names.

    Returns
    -------
    ErrorStatistics

    Raises
    ------
    InvalidInput
        For fewer than four prototypes, what `find_outliers` refuses, symbols that do not fit, or
        an error that does not vary over the prototypes.

    Examples
    --------
    >>> readings = np.random.default_rng(1).normal(10.0, 1.0, (12, 2, 5))
    >>> error_statistics(readings, ("e_1", "e_2")).values.shape
    (12, 2)
    """
    readings = finite_array("measurements", measurements, (None, None, None))
    if len(readings) < FEWEST_PROTOTYPES:
        allowed = f"at least {FEWEST_PROTOTYPES}"
        raise InvalidInput("number of prototypes", len(readings), allowed)
    symbols = tuple(symbols)
    if len(set(symbols)) != readings.shape[1] or len(symbols) != readings.shape[1]:
        raise InvalidInput("symbols", symbols, f"{readings.shape[1]} different names")
    rejected = find_outliers(readings)
    values = mean_of_valid(readings, rejected)
    for symbol, column in zip(symbols, values.T, strict=True):
        if np.ptp(column) == 0.0:
            raise InvalidInput(f"values of {symbol}", float(column[0]), "prototypes that differ")
    tests = [shapiro(column) for column in values.T]
    correlation, correlation_p = _pearson(values)
    return ErrorStatistics(
        symbols=symbols,
        values=values,
        rejected=rejected,
        repeatability=repeatability(readings, rejected),
        samples=tuple(NormalSample.of(column) for column in values.T),
        shapiro_w=np.array([test.statistic for test in tests]),
        shapiro_p=np.array([test.pvalue for test in tests]),
        correlation=correlation,
        correlation_p=correlation_p,
    )


def detectable_correlation(n_prototypes: int, n_errors: int) -> float:
    """Return the least size of a correlation that is significant if it is the largest of all pairs.

    By Student's test with Holm's adjustment (Scand. J. Statist. 6, 1979).

    Parameters
    ----------
    n_prototypes : int
        At least 3.
    n_errors : int
        At least 2; they make n_errors (n_errors - 1) / 2 pairs.

    Returns
    -------
    float
        Dimensionless, between 0 and 1.

    Examples
    --------
    >>> print(f"{detectable_correlation(20, 4):.2f}")
    0.57
    """
    pairs = n_errors * (n_errors - 1) / 2
    freedom = n_prototypes - 2
    critical = float(student.isf(SIGNIFICANCE / pairs / 2.0, freedom))
    return critical / (freedom + critical**2) ** 0.5


def holm(p_values: ArrayLike) -> NDArray[np.float64]:
    """Adjust p-values (m,) for m tests made at once (Holm, Scand. J. Statist. 6, 1979)."""
    p = np.asarray(p_values, dtype=float)
    order = np.argsort(p, kind="stable")
    stepped = np.maximum.accumulate(p[order] * np.arange(p.size, 0, -1))
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(1.0, stepped)
    return adjusted


def _other_marginal(values: NDArray[np.float64]) -> str:
    lognormal = np.all(values > 0.0) and shapiro(np.log(values)).pvalue >= SIGNIFICANCE
    return LOGNORMAL if lognormal else EMPIRICAL


def _pearson(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    correlation = np.atleast_2d(np.corrcoef(values, rowvar=False))
    # Without correlation r^2 has a beta distribution, which is Student's test in other words.
    unexplained = np.clip(1.0 - correlation**2, 0.0, 1.0)
    p = betainc((len(values) - 2) / 2.0, 0.5, unexplained)
    np.fill_diagonal(p, 1.0)
    return correlation, p
