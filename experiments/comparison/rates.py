"""Rates judged with their uncertainty."""

from __future__ import annotations

from scipy.stats import binomtest

SIGNIFICANCE = 0.01


def at_least(successes: int, trials: int, rate: float) -> bool:
    """Whether a one-sided exact binomial test at 1 % keeps a true rate of at least ``rate``."""
    return rate_p(successes, trials, rate) >= SIGNIFICANCE


def rate_p(successes: int, trials: int, rate: float) -> float:
    """Return the probability of so few successes, or fewer, if the true rate is ``rate``."""
    return float(binomtest(int(successes), trials, rate, "less").pvalue)
