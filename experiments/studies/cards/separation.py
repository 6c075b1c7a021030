"""Which problems separate algorithms, and at which budget: computed from the runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import kruskal

from experiments.comparing.paired import SIGNIFICANT
from experiments.comparing.ranks import costs_of
from experiments.studies.cards.hardness import Hardness
from experiments.studies.contest.peers_data import MEASURES, Scores

RANDOM = "random search"
REACHES = 2.0
"""A median IGD of at most so many times the floor reaches the front."""
LEAST_SPREAD = 2.0
"""Factor between the upper and the lower quartile of the algorithms' medians that matters to a
user; the extremes do not count, as one algorithm fails everywhere."""
FEWEST = 4
"""Algorithms below which the quartiles of the medians are their extremes, and nothing is said."""


class Separation(NamedTuple):
    """How far the algorithms lie apart on one problem at one budget, by IGD, random search aside.

    Attributes
    ----------
    problem : str
    evaluations : int
    algorithms : int
        That ran.
    p : float
        Of Kruskal and Wallis's test that all runs are alike.
    spread : float
        Factor between the upper and the lower quartile of the algorithms' medians.
    scatter : float
        Factor between the worst and the best seed, of the median algorithm that has all finite.
    reached : int
        Algorithms whose median IGD is at most `REACHES` times the floor.
    """

    problem: str
    evaluations: int
    algorithms: int
    p: float
    spread: float
    scatter: float
    reached: int

    @property
    def separates(self) -> bool | None:
        """Whether they differ for sure, and by as much as matters; None if too few ran to say."""
        if self.algorithms < FEWEST:
            return None
        return self.p <= SIGNIFICANT and self.spread >= LEAST_SPREAD


def separations(scores: Scores, hardness: dict[str, Hardness]) -> list[Separation]:
    """Return one entry a problem and budget at which at least two algorithms ran."""
    igd = scores.values[MEASURES.index("igd")]
    chosen = [place for place, name in enumerate(scores.algorithms) if name != RANDOM]
    found = []
    for row, problem in enumerate(scores.problems):
        for column, budget in enumerate(scores.budgets):
            ran = [i for i in chosen if np.all(scores.spent[row, i, column] > 0)]
            if len(ran) < 2:
                continue
            values = igd[row, ran, column][None]
            found.append(_separation(problem, budget, values, hardness[problem].floor))
    return found


def _separation(problem: str, budget: int, values: np.ndarray, floor: float) -> Separation:
    costs = costs_of(values, True, ("problems", "algorithms", "seeds"))[0]
    medians = np.median(costs, axis=1)
    finite = costs[np.isfinite(costs).all(axis=1)]
    scatter = float(np.median(finite.max(axis=1) / finite.min(axis=1))) if len(finite) else np.nan
    # A quartile is one of the medians: between a finite one and an infinite one there is none.
    low, high = np.quantile(medians, (0.25, 0.75), method="nearest")
    return Separation(
        problem,
        budget,
        len(costs),
        float(kruskal(*costs).pvalue),
        float(high / low) if np.isfinite(low) else np.nan,
        scatter,
        int(np.sum(medians <= REACHES * floor)),
    )
