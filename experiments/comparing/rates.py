"""Rates, medians and means with 95 % intervals, and the state of a score that they give.

A score is held against a demand by its 95 % interval (`Estimate.state`). Whether a stated coverage
is contradicted is another question: `at_least` answers that, and shows nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, quantile_test
from scipy.stats import t as student

from experiments.runner.result import MISSED, NOT_SHOWN, SHOWN, significant

SIGNIFICANCE = 0.01


@dataclass(frozen=True)
class Estimate:
    """A rate, a median or a mean of ``n`` cases with its 95 % interval."""

    value: float
    low: float
    high: float
    n: int

    def state(self, required: float, *, at_least: bool = True) -> str:
        """Return which of `SCORE_STATES` this is; without cases, nothing is shown.

        Parameters
        ----------
        required : float
            What must be reached, or must not be exceeded.
        at_least : bool
            Whether more is better.
        """
        if at_least:
            return state_of(not self.value < required, shown=self.low >= required)
        return state_of(not self.value > required, shown=self.high <= required)

    @property
    def in_words(self) -> str:
        """Value and interval in brackets, with three digits."""
        value, low, high = (significant(end, 3) for end in (self.value, self.low, self.high))
        return f"{value} ({low} to {high})"


def state_of(met: bool, *, shown: bool) -> str:
    """Return the state of a score that meets its demand, or does so beyond chance."""
    if not met:
        return MISSED
    return SHOWN if shown else NOT_SHOWN


def rate(successes: int, trials: int) -> Estimate:
    """Return a share with the interval of Clopper and Pearson; from 0 to 1 without trials."""
    if trials == 0:
        return Estimate(np.nan, 0.0, 1.0, 0)
    interval = binomtest(int(successes), trials).proportion_ci(method="exact")
    return Estimate(successes / trials, float(interval.low), float(interval.high), trials)


def median(values: Iterable[float | None]) -> Estimate:
    """Return the median of the values that there are; its interval is between two of them.

    Ends are infinite where too few values leave one open.
    """
    known = np.array([value for value in values if value is not None])
    if not known.size:
        return Estimate(np.nan, -np.inf, np.inf, 0)
    interval = quantile_test(known).confidence_interval()
    low = interval.low if np.isfinite(interval.low) else -np.inf
    high = interval.high if np.isfinite(interval.high) else np.inf
    return Estimate(float(np.median(known)), float(low), float(high), len(known))


def mean(values: Sequence[float]) -> Estimate:
    """Return the mean with Student's interval; of one value or none, that is unbounded."""
    count = len(values)
    if count < 2:
        return Estimate(values[0] if count else np.nan, -np.inf, np.inf, count)
    middle = float(np.mean(values))
    reach = float(student.ppf(0.975, count - 1) * np.std(values, ddof=1) / np.sqrt(count))
    return Estimate(middle, middle - reach, middle + reach, count)


def at_least(successes: int, trials: int, rate: float) -> bool:
    """Whether a one-sided exact binomial test at 1 % keeps a true rate of at least ``rate``."""
    return rate_p(successes, trials, rate) >= SIGNIFICANCE


def rate_p(successes: int, trials: int, rate: float) -> float:
    """Return the probability of so few successes, or fewer, if the true rate is ``rate``."""
    return float(binomtest(int(successes), trials, rate, "less").pvalue)
