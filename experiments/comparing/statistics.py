"""Statistics that compare algorithms over the same seeds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import wilcoxon

from pymoo_hdte.identification.error_samples import holm

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

    Pairs that are equal carry no sign and are dropped; if all are equal, p is 1. The result is NaN
    where a run has no value.
    """
    difference = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
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
