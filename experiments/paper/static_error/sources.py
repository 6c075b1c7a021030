"""Virtual prototypes drawn from Table 2, and what the error statistics make of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from experiments.paper.bench.prototypes import draw_prototypes, plant_outliers, repeat_measurements
from experiments.published_values import TABLE_2
from pymoo_hdte.identification import (
    ErrorStatistics,
    detectable_correlation,
    error_statistics,
    find_outliers,
)
from pymoo_hdte.identification.outliers import SIGMAS

SYMBOLS = tuple(TABLE_2)
MEANS = np.array([row.mean_um for row in TABLE_2.values()])
STDS = np.array([row.std_um for row in TABLE_2.values()])

N_PROTOTYPES, N_REPEATS = 20, 10
NOISE_UM = 0.3
"""Of a single reading: the accuracy of the paper's measuring machine."""

N_OUTLIERS, OUTLIER_UM = 26, 2.0
PLANTED_PAIR, PLANTED_CORRELATION = ("e13", "e14"), 0.92
PLANTED_LOGNORMAL, LOG_STD = "e34", 1.2


@dataclass(frozen=True)
class OutlierCount:
    """What one rule found: planted outliers found, good readings lost."""

    found: int
    planted: int
    lost: int
    good: int


def clean_campaign(rng: np.random.Generator) -> ErrorStatistics:
    """Measure independent, normal prototypes as Table 2 describes them."""
    truth = draw_prototypes(MEANS, STDS, N_PROTOTYPES, rng)
    return error_statistics(repeat_measurements(truth, NOISE_UM, N_REPEATS, rng), SYMBOLS)


def spoilt_readings(
    rng: np.random.Generator, skewed: bool = True
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Measure prototypes with a planted correlation, lognormal error and outliers.

    Returns the readings, shape (n_prototypes, n_errors, n_repeats), and where the outliers are.
    """
    matrix = np.eye(len(SYMBOLS))
    i, j = (SYMBOLS.index(symbol) for symbol in PLANTED_PAIR)
    matrix[i, j] = matrix[j, i] = PLANTED_CORRELATION
    truth = draw_prototypes(MEANS, STDS, N_PROTOTYPES, rng, matrix)
    if skewed:
        at = SYMBOLS.index(PLANTED_LOGNORMAL)
        truth[:, at] = MEANS[at] * rng.lognormal(-(LOG_STD**2) / 2.0, LOG_STD, N_PROTOTYPES)
    readings = repeat_measurements(truth, NOISE_UM, N_REPEATS, rng)
    return plant_outliers(readings, N_OUTLIERS, OUTLIER_UM, rng)


def outlier_counts(
    readings: NDArray[np.float64], planted: NDArray[np.bool_]
) -> dict[str, OutlierCount]:
    """Count what the plain 3-sigma rule and the pooled one find."""
    deviation = np.abs(readings - readings.mean(axis=2, keepdims=True))
    plain = deviation > SIGMAS * readings.std(axis=2, ddof=1, keepdims=True)
    rules = {"sigma of the same ten readings": plain, "sigma pooled": find_outliers(readings)}
    return {
        rule: OutlierCount(
            found=int(np.sum(rejected & planted)),
            planted=int(np.sum(planted)),
            lost=int(np.sum(rejected & ~planted)),
            good=int(np.sum(~planted)),
        )
        for rule, rejected in rules.items()
    }


def detections(n_campaigns: int, rng: np.random.Generator) -> tuple[int, int]:
    """Count campaigns in which the planted pair is found, and those with any other pair."""
    pair = tuple(SYMBOLS.index(symbol) for symbol in PLANTED_PAIR)
    found = alarms = 0
    for _ in range(n_campaigns):
        readings, _ = spoilt_readings(rng, skewed=False)
        pairs = error_statistics(readings, SYMBOLS).correlated_pairs
        found += pair in pairs
        alarms += any(other != pair for other in pairs)
    return found, alarms


def power(correlation: float, n_prototypes: int) -> float:
    """Return the probability that a true correlation is significant among all pairs.

    By Fisher's z, to first order; Holm's first step is the one that counts.
    """
    limit = np.arctanh(detectable_correlation(n_prototypes, len(SYMBOLS)))
    return float(norm.sf((limit - np.arctanh(correlation)) * (n_prototypes - 3) ** 0.5))


def prototypes_needed(correlation: float, wanted: float = 0.9) -> int:
    """Return the least number of prototypes that find a true correlation with that power."""
    return next(n for n in range(5, 10_000) if power(correlation, n) >= wanted)
