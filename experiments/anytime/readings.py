"""Every way to read the six numbers that Table 7 prints, and how close each comes to them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.anytime.data import OF_TABLE_7, Case, Scores
from experiments.anytime.measures import EQUAL, RETURNED, SCALES, Scale
from experiments.published_values import TABLE_7

PRINTED = np.array([[row.igd, row.spacing] for row in TABLE_7.values()])
"""IGD and Spacing of NSGA-II, MOPSO and AMP-MOPSO, shape (3, 2)."""


class Reading(NamedTuple):
    """One way to read Table 7, and the means of our runs in it.

    ``factor`` is by how much our six numbers are off the printed ones: exp of the root mean square
    of the logarithm of their ratios. ``shape_factor`` is the same after all six were multiplied by
    the number that brings them closest: it does not ask for the unit.
    """

    model: str
    moments: str
    scale: Scale
    counted: str
    population: int
    evaluations: int
    means: NDArray[np.float64]
    factor: float
    shape_factor: float

    @property
    def in_order(self) -> bool:
        """Whether NSGA-II, MOPSO and AMP-MOPSO come in the printed order in both indicators."""
        return bool(np.all(np.diff(self.means, axis=0) < 0.0))


def readings(scores: Scores) -> list[Reading]:
    """Return all readings, the closest first; one with a mean that has no value is left out."""
    found = [_reading(scores, *entry) for entry in _ways(scores)]
    return sorted((one for one in found if np.isfinite(one.factor)), key=lambda one: one.factor)


def _ways(scores: Scores) -> Iterable[tuple[str, str, str, int, int, Scale]]:
    settings = product(
        scores.problems(), (RETURNED, EQUAL), scores.populations(), scores.budgets(), SCALES
    )
    for (model, moments), counted, population, budget, scale in settings:
        if Case(model, moments, counted, population, budget, OF_TABLE_7[0]) in scores.values:
            yield model, moments, counted, population, budget, scale


def _reading(
    scores: Scores,
    model: str,
    moments: str,
    counted: str,
    population: int,
    budget: int,
    scale: Scale,
) -> Reading:
    means = np.array(
        [
            [
                _mean(scores.of(case, f"{indicator}_{scale.suffix}"))
                for indicator in ("igd", "spacing")
            ]
            for case in (
                Case(model, moments, counted, population, budget, name) for name in OF_TABLE_7
            )
        ]
    )
    factor, shape_factor = factors(means)
    return Reading(model, moments, scale, counted, population, budget, means, factor, shape_factor)


def factors(means: NDArray[np.float64]) -> tuple[float, float]:
    """Return ``factor`` and ``shape_factor`` of a `Reading` with these means, shape (3, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(means / PRINTED)
    return float(np.exp(np.sqrt(np.mean(logs**2)))), float(np.exp(np.std(logs)))


def _mean(runs: NDArray[np.float64]) -> float:
    """Return the mean of the runs that have a value; a set of two designs has no Spacing."""
    known = runs[np.isfinite(runs)]
    return float(known.mean()) if len(known) else np.nan
