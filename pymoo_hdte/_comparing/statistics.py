"""Statistics that compare algorithms over the same seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, bootstrap, quantile_test, wilcoxon
from scipy.stats import t as student

from pymoo_hdte._runner.result import MISSED, NOT_SHOWN, SHOWN, significant
from pymoo_hdte.identification.error_samples import holm

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


RESAMPLES = 1000
LEVEL = 0.95
_AT_ONCE = 50
"""Resamples of A12 held in memory: each compares all pairs of seeds of every case."""


def mean_intervals(runs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return mean and both ends of its interval, shape (cases, 3), of runs (cases, seeds).

    Runs without a value do not count in the mean, but leave no interval (NaN).
    """
    ends = _ends((runs,), lambda x, axis: x.mean(axis=axis))
    return np.column_stack([mean_of_known(runs), *ends])


def mean_of_known(runs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the means over the last axis of what has a value; NaN where nothing has."""
    known = np.isfinite(runs)
    means = np.full(runs.shape[:-1], np.nan)
    total = np.where(known, runs, 0.0).sum(axis=-1)
    return np.divide(total, known.sum(axis=-1), out=means, where=known.any(axis=-1))


def paired_interval(
    runs: NDArray[np.float64], statistic: Callable[..., NDArray[np.float64]]
) -> tuple[float, float]:
    """Return the interval of a statistic of several samples (samples, seeds), paired by seed.

    ``statistic`` takes each sample as one argument, and the axis of the seeds.
    """
    low, high = _ends(tuple(runs[:, np.newaxis]), statistic)
    return float(low[0]), float(high[0])


def a12_intervals(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return A12 and both ends of its interval, shape (cases, 3), of runs (cases, seeds) each.

    The runs are paired by their seeds, and resampled in pairs. A case in which a run has no value
    has no A12 either (NaN).
    """
    return np.column_stack([_a12(first, second, -1), *_ends((first, second), _a12)])


def _a12(first: NDArray[np.float64], second: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """As `pymoo_hdte._comparing.statistics.effect_size`, of many cases at once."""
    a, b = (np.moveaxis(x, axis, -1) for x in (first, second))
    difference = a[..., :, np.newaxis] - b[..., np.newaxis, :]
    return 0.5 + 0.5 * np.sign(difference).mean(axis=(-2, -1))


def _ends(
    data: tuple[NDArray[np.float64], ...], statistic: Callable[..., NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = np.full((2, len(data[0])), np.nan)
    complete = np.all([np.isfinite(sample).all(axis=1) for sample in data], axis=0)
    if complete.any() and data[0].shape[1] > 1:
        interval = bootstrap(
            tuple(sample[complete] for sample in data),
            statistic,
            axis=1,
            paired=len(data) > 1,
            n_resamples=RESAMPLES,
            batch=_AT_ONCE,
            confidence_level=LEVEL,
            method="percentile",
            # The same resamples everywhere: no table depends on what was made before it.
            rng=np.random.default_rng(1),
        ).confidence_interval
        low[complete], high[complete] = interval.low, interval.high
    return low, high


__all__ = ["Summary", "effect_size", "holm", "summary", "wilcoxon_p"]


class Summary(NamedTuple):
    """Mean, median and sample standard deviation of the runs of one algorithm."""

    mean: float
    median: float
    std: float


def summary(values: ArrayLike) -> Summary:
    """Summarise the runs ``values`` (n,); a single run has no standard deviation (NaN)."""
    runs = np.asarray(values, dtype=float)
    std = float(runs.std(ddof=1)) if runs.size > 1 else float("nan")
    return Summary(float(runs.mean()), float(np.median(runs)), std)


def wilcoxon_p(first: ArrayLike, second: ArrayLike) -> float:
    """Two-sided p-value of the Wilcoxon signed-rank test on paired runs (n,) and (n,).

    Pairs that are equal, infinite ones too, carry no sign and are dropped; if all are equal, p is
    1. The result is NaN where a run has no value.
    """
    a, b = _floats(first), _floats(second)
    difference = np.subtract(a, b, where=a != b, out=np.zeros(a.shape))
    if np.isnan(difference).any():
        return float("nan")
    differing = difference[difference != 0.0]
    if not len(differing):
        return 1.0
    return float(wilcoxon(differing).pvalue)


def effect_size(first: ArrayLike, second: ArrayLike) -> float:
    """A12, the probability that a run of ``first`` exceeds one of ``second``, ties counted half.

    0.5 means no difference (Vargha and Delaney, J. Educ. Behav. Stat. 25, 2000). Runs without a
    value (NaN) do not count; without any, the effect is NaN.
    """
    a, b = (values[~np.isnan(values)] for values in map(_floats, (first, second)))
    if not len(a) or not len(b):
        return float("nan")
    higher, equal = a[:, None] > b[None, :], a[:, None] == b[None, :]
    return float(np.mean(higher + 0.5 * equal))


def _floats(values: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(values, dtype=float)
