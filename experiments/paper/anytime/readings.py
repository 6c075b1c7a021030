"""Every way to read the six numbers that Table 7 prints, and how close each comes to them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.paper.anytime.data import OF_TABLE_7, Case, Contested, Scores
from experiments.paper.anytime.measures import EQUAL, RETURNED, SCALES, Scale
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.statistics import mean_of_known, paired_interval

PRINTED = np.array([[row.igd, row.spacing] for row in TABLE_7.values()])
"""IGD and Spacing of NSGA-II, MOPSO and AMP-MOPSO, shape (3, 2)."""


class Reading(NamedTuple):
    """One way to read Table 7, and our runs in it.

    Attributes
    ----------
    contested, scale, counted, population, evaluations
        The way.
    runs : ndarray, shape (3, 2, seeds)
        IGD and Spacing of NSGA-II, MOPSO and AMP-MOPSO.
    means : ndarray, shape (3, 2)
        Of the runs that have a value; a set of two designs has no Spacing.
    factor : float
        By how much our six means are off the printed ones: exp of the root mean square of the
        logarithm of their ratios.
    shape_factor : float
        The same after all six were multiplied by the number that brings them closest: it does not
        ask for the unit.
    """

    contested: Contested
    scale: Scale
    counted: str
    population: int
    evaluations: int
    runs: NDArray[np.float64]
    means: NDArray[np.float64]
    factor: float
    shape_factor: float

    @property
    def in_order(self) -> bool:
        """Whether NSGA-II, MOPSO and AMP-MOPSO come in the printed order in both indicators."""
        return bool(np.all(np.diff(self.means, axis=0) < 0.0))

    def factor_interval(self) -> tuple[float, float]:
        """Return the interval of the factor from resampled seeds; NaN if a run has no value."""

        def factor(*runs: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
            means = np.stack([path.mean(axis=axis) for path in runs], axis=-1)
            return np.exp(np.sqrt(np.mean(np.log(means / PRINTED.ravel()) ** 2, axis=-1)))

        return paired_interval(self.runs.reshape(PRINTED.size, -1), factor)


def readings(scores: Scores) -> list[Reading]:
    """Return all readings, the closest first; one with a mean that has no value is left out."""
    judged = [_reading(scores, *entry) for entry in _ways(scores)]
    return sorted(
        (finding for finding in judged if np.isfinite(finding.factor)),
        key=lambda finding: finding.factor,
    )


def _ways(scores: Scores) -> Iterable[tuple[Contested, str, int, int, Scale]]:
    settings = product(
        scores.contested(), (RETURNED, EQUAL), scores.populations(), scores.budgets(), SCALES
    )
    for contested, counted, population, budget, scale in settings:
        if Case(*contested, counted, population, budget, OF_TABLE_7[0]) in scores.values:
            yield contested, counted, population, budget, scale


def _reading(
    scores: Scores,
    contested: Contested,
    counted: str,
    population: int,
    budget: int,
    scale: Scale,
) -> Reading:
    measures = [f"{indicator}_{scale.suffix}" for indicator in ("igd", "spacing")]
    who = [Case(*contested, counted, population, budget, name) for name in OF_TABLE_7]
    runs = np.array([[scores.of(case, measure) for measure in measures] for case in who])
    means = mean_of_known(runs)
    way = contested, scale, counted, population, budget
    return Reading(*way, runs, means, *factors(means))


def factors(means: NDArray[np.float64]) -> tuple[float, float]:
    """Return ``factor`` and ``shape_factor`` of a `Reading` with these means, shape (3, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(means / PRINTED)
    return float(np.exp(np.sqrt(np.mean(logs**2)))), float(np.exp(np.std(logs)))
