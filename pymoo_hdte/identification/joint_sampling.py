"""Sampling of errors from measured statistics, also where not normal or not independent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr
from scipy.stats import truncnorm

from pymoo_hdte.checks import whole_number
from pymoo_hdte.drive.static_error import TRUNCATION
from pymoo_hdte.identification.error_samples import EMPIRICAL, LOGNORMAL, ErrorStatistics
from pymoo_hdte.identification.prototypes import NormalSample


def draw_errors(
    statistics: ErrorStatistics, n_samples: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw virtual prototypes from measured error statistics.

    Each error follows its `ErrorStatistics.marginals`, normal and lognormal ones truncated at three
    standard deviations. If any correlation is significant, all errors are tied by a Gaussian copula
    (Nelsen, An Introduction to Copulas, Springer 2006) with the measured correlation matrix;
    otherwise they are independent, as in Section 2.1.

    Parameters
    ----------
    statistics : ErrorStatistics
        Of measured prototypes.
    n_samples : int
        Number of virtual prototypes, at least 1.
    rng : numpy.random.Generator
        Source of the randomness.

    Returns
    -------
    ndarray, shape (n_samples, n_errors)
        In the unit of the readings.

    Raises
    ------
    InvalidInput
        If ``n_samples`` is below 1.

    Examples
    --------
    >>> readings = np.random.default_rng(1).normal(10.0, 1.0, (12, 2, 5))
    >>> found = error_statistics(readings, ("e_1", "e_2"))
    >>> draw_errors(found, 1000, np.random.default_rng(2)).shape
    (1000, 2)
    """
    n_samples = whole_number("n_samples", n_samples, 1)
    n_errors = len(statistics.symbols)
    matrix = np.eye(n_errors) if statistics.independent else statistics.correlation
    scores = rng.multivariate_normal(np.zeros(n_errors), matrix, n_samples, method="eigh")
    columns = zip(statistics.marginals, statistics.values.T, ndtr(scores).T, strict=True)
    return np.stack([_quantiles(*column) for column in columns], axis=1)


def _quantiles(
    marginal: str, values: NDArray[np.float64], probability: NDArray[np.float64]
) -> NDArray[np.float64]:
    if marginal == EMPIRICAL:
        return np.quantile(values, probability, method="inverted_cdf")
    standard = truncnorm.ppf(probability, -TRUNCATION, TRUNCATION)
    if marginal == LOGNORMAL:
        logarithm = NormalSample.of(np.log(values))
        return np.exp(logarithm.mean + logarithm.std * standard)
    sample = NormalSample.of(values)
    return sample.mean + sample.std * standard
