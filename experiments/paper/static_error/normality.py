"""Shapiro-Wilk tests backwards: the sample size that a printed W and p belong to."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm, shapiro

SMALLEST, LARGEST = 12, 2000
"""Sample sizes for which the calibration below holds."""


def shapiro_p(w: float, n: float) -> float:
    """Return the p-value of the statistic ``w`` of ``n`` values, 12 <= n <= 2000.

    ln(1 - W) is about normal, with mean and standard deviation fitted to simulations (Royston,
    Applied Statistics 44, 1995, algorithm AS R94); SciPy uses the same fit but takes data only.
    """
    x = np.log(n)
    mean = -1.5861 - 0.31082 * x - 0.083751 * x**2 + 0.0038915 * x**3
    std = np.exp(-0.4803 - 0.082676 * x + 0.0030302 * x**2)
    return float(norm.sf((np.log1p(-w) - mean) / std))


def possible_sizes(w: float, p: float, half_digit: float = 5e-4) -> tuple[int, int]:
    """Return the least and greatest sample size that a printed pair ``w``, ``p`` allows.

    Both are known to ``half_digit``; p falls with n at fixed W.
    """
    low, high = w - half_digit, w + half_digit
    sizes = [
        n
        for n in range(SMALLEST, LARGEST + 1)
        if shapiro_p(low, n) <= p + half_digit and shapiro_p(high, n) >= p - half_digit
    ]
    return sizes[0], sizes[-1]


def implied_size(w: float, p: float) -> float:
    """Return the sample size at which the statistic ``w`` has the p-value ``p``, no whole number.

    Raises
    ------
    ValueError
        If there is none between 12 and 2000.
    """
    return float(brentq(lambda n: shapiro_p(w, n) - p, SMALLEST, LARGEST))


def pooled_rejection_rate(noise: float, n_trials: int, rng: np.random.Generator) -> float:
    """Return how often the test at 5 % rejects 20 x 10 pooled readings of a normal error.

    ``noise`` is the standard deviation of a reading in those of the prototypes. Ten readings of one
    prototype are no independent values, so the rate is not 5 %.
    """
    prototypes = rng.standard_normal((n_trials, 20, 1))
    readings = prototypes + noise * rng.standard_normal((n_trials, 20, 10))
    return float(np.mean([shapiro(trial.ravel()).pvalue < 0.05 for trial in readings]))
