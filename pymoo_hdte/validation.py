"""Prediction against measurement: the measures of the paper's validation (Section 4)."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import t

from pymoo_hdte.checks import finite_array
from pymoo_hdte.surrogate import Accuracy, accuracy

__all__ = ["CONFIDENCE", "ValidationMetrics", "validation_metrics"]

CONFIDENCE = 0.95
"""Level of the interval of the mean error, dimensionless.

Examples
--------
>>> CONFIDENCE
0.95
"""


@dataclass(frozen=True)
class ValidationMetrics(Accuracy):
    """Error measures of predictions held against measurements (Section 4, Table 6).

    Those of `pymoo_hdte.surrogate.Accuracy`, and the mean error with its interval.

    Examples
    --------
    >>> validation_metrics([10.0, 11.0, 12.2], [10.0, 11.0, 12.0]).n
    3
    """

    mean_error: float
    """Mean of predicted minus measured, in the output's unit: negative if predictions are low."""
    mean_error_interval: tuple[float, float]
    """95 % confidence interval of the mean error, in the output's unit, by Student's t."""
    n: int
    """Number of measurements."""


def validation_metrics(predicted: ArrayLike, measured: ArrayLike) -> ValidationMetrics:
    """Compare predictions with measurements, by the measures and conventions of Section 4.

    The interval is that of normal, independent errors: mean -+ t(0.975, n - 1) s / sqrt(n), s with
    n - 1 in its denominator. That is the paper's convention: its mean error -7.761, RMSE 7.968
    and n = 5 give the interval [-10.265, -5.257] that it prints to within rounding, and a
    denominator n does not. R2 is 1 minus the residual over the total sum of squares of the
    *measured* values, and relative errors refer to them too.

    Parameters
    ----------
    predicted, measured : array_like, shape (n,)
        Finite, of one unit; the measured values must not be zero (relative errors) nor all equal
        (R2).

    Returns
    -------
    ValidationMetrics

    Raises
    ------
    InvalidInput
        If shapes differ or values are not as described.

    Examples
    --------
    >>> found = validation_metrics([10.0, 11.0, 12.2], [10.0, 11.0, 12.0])
    >>> print(f"{found.mean_error:.3f} {found.r2:.2f}")
    0.067 0.98
    """
    truth = finite_array("measured", measured, (None,))
    measures = accuracy(predicted, truth)
    errors = np.asarray(predicted, dtype=float) - truth
    n, mean = len(errors), float(errors.mean())
    half_width = t.ppf(0.5 + CONFIDENCE / 2.0, n - 1) * errors.std(ddof=1) / np.sqrt(n)
    interval = (float(mean - half_width), float(mean + half_width))
    return ValidationMetrics(**asdict(measures), mean_error=mean, mean_error_interval=interval, n=n)
