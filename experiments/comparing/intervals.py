"""95 % intervals from resampled seeds, of many cases at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

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
    """As `experiments.comparing.statistics.effect_size`, of many cases at once."""
    a, b = (np.moveaxis(x, axis, -1) for x in (first, second))
    difference = a[..., :, np.newaxis] - b[..., np.newaxis, :]
    return 0.5 + 0.5 * np.sign(difference).mean(axis=(-2, -1))


def _ends(
    data: tuple[NDArray[np.float64], ...], statistic: Callable[..., NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = np.full((2, len(data[0])), np.nan)
    complete = np.all([np.isfinite(one).all(axis=1) for one in data], axis=0)
    if complete.any() and data[0].shape[1] > 1:
        found = bootstrap(
            tuple(one[complete] for one in data),
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
        low[complete], high[complete] = found.low, found.high
    return low, high
