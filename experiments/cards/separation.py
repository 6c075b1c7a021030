"""Which problems separate algorithms, and at which budget: computed from the runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import kruskal

from experiments.cards.hardness import Hardness
from experiments.comparison.ranks import costs_of
from experiments.contest.peers_data import MEASURES, Scores

RANDOM = "random search"
SURE = 0.01
"""Largest p-value of Kruskal and Wallis's test at which the algorithms differ."""
REACHES = 2.0
"""A median IGD of at most so many times the floor reaches the front."""
LEAST_SHARE = 0.25
"""Of the algorithms, on either side: that reach the front, and that do not."""


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
        Factor between the medians of the worst and the best.
    scatter : float
        Factor between the worst and the best seed, of the median algorithm.
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
    def separates(self) -> bool:
        """Whether they differ for sure, and a good share reaches the front while another fails."""
        fewer = min(self.reached, self.algorithms - self.reached)
        return self.p <= SURE and fewer >= LEAST_SHARE * self.algorithms


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
    with np.errstate(invalid="ignore"):
        scatter = float(np.median(costs.max(axis=1) / costs.min(axis=1)))
    return Separation(
        problem,
        budget,
        len(costs),
        float(kruskal(*costs).pvalue),
        float(medians.max() / medians.min()),
        scatter,
        int(np.sum(medians <= REACHES * floor)),
    )
