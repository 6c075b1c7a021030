"""Two algorithms at every population and budget: who is ahead, by how much, how surely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.paper.anytime.data import Contested, Scores, cases
from experiments.paper.anytime.measures import NORMALISED, RAW, RETURNED, TRUE, Scale
from pymoo_hdte._comparing.indicators import smaller_is_better
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.statistics import a12_intervals, holm, wilcoxon_p

COMPARED = {
    "igd": f"igd_{Scale(TRUE, RAW).suffix}",
    "spacing": f"spacing_{Scale(TRUE, RAW).suffix}",
    "hypervolume": f"hypervolume_{Scale(TRUE, NORMALISED).suffix}",
}
"""The measures by which algorithms are compared; the readings have the others."""


class Duel(NamedTuple):
    """One algorithm against a rival on the same seeds, at one population and budget.

    ``ratio`` is that of the means, ours to theirs. ``better`` is A12, the probability that a run
    of ours beats one of theirs, and ``low`` to ``high`` its interval from resampled seeds; ``p``
    is Wilcoxon's after Holm's correction over everything that was compared with it. Values are NaN
    where a run has none, as a set of two designs has no Spacing.
    """

    population: int
    evaluations: int
    rival: str
    ratio: float
    better: float
    low: float
    high: float
    p: float

    @property
    def ahead(self) -> int:
        """1 if ours is better beyond chance, -1 if worse, else 0."""
        return int(np.sign(self.better - 0.5)) if self.p < SIGNIFICANT else 0


def duels(
    scores: Scores,
    contested: Contested,
    ours: str,
    rivals: Sequence[str],
    indicator: str,
    counted: str = RETURNED,
) -> list[Duel]:
    """Set ``ours`` against each rival at every population and budget by one of `COMPARED`.

    ``counted`` says which designs of a set are.
    """
    where, first, second = [], [], []
    for population, budget, (own, *others) in cases(scores, contested, [ours, *rivals], counted):
        for rival in others:
            where.append((population, budget, rival.algorithm))
            first.append(scores.of(own, COMPARED[indicator]))
            second.append(scores.of(rival, COMPARED[indicator]))
    a, b = np.array(first), np.array(second)
    sign = -1.0 if smaller_is_better(indicator) else 1.0
    better, low, high = a12_intervals(sign * a, sign * b).T.tolist()
    ratio = a.mean(axis=1) / b.mean(axis=1)
    p = _corrected([wilcoxon_p(x, y) for x, y in zip(a, b, strict=True)])
    return [
        Duel(*place, float(ratio[i]), better[i], low[i], high[i], float(p[i]))
        for i, place in enumerate(where)
    ]


def _corrected(p: Sequence[float]) -> NDArray[np.float64]:
    """Return the p-values after Holm's correction over those that have a value."""
    corrected, known = np.array(p), np.isfinite(p)
    corrected[known] = holm(corrected[known])
    return corrected
