"""One run of one algorithm on one benchmark problem, as a job of a campaign."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray

from experiments.campaign import Run
from experiments.contest.peers import CONTESTANTS, SWARM_VARIANTS
from experiments.contest.problems import problem_of
from pymoo_hdte.algorithms.spread import most_spread

FINAL_SIZE = 50


@dataclass(frozen=True)
class ContestRun:
    """One algorithm, one problem, one seed, and the final set at each budget of evaluations."""

    problem: str
    algorithm: str
    seed: int
    budgets: tuple[int, ...]

    @property
    def key(self) -> str:
        """All settings in one name."""
        budgets = "_".join(map(str, self.budgets))
        return f"{self.problem}_{self.algorithm}_{budgets}_seed{self.seed}"

    def execute(self) -> Run:
        """Run, and reduce what is offered to `FINAL_SIZE` in the same way for all.

        Columns are the budget, the evaluations spent and the objectives, rows by budget and rising
        objectives.
        """
        problem = problem_of(self.problem)
        run = (CONTESTANTS | SWARM_VARIANTS)[self.algorithm].run
        started = time.perf_counter()
        offers = run(problem, self.budgets, self.seed)
        seconds = time.perf_counter() - started
        rows = []
        for budget, offer in zip(self.budgets, offers, strict=True):
            front = final_set(offer.F)
            rows.append(np.column_stack([np.tile([budget, offer.spent], (len(front), 1)), front]))
        columns = ("evaluations", "spent", *(f"f{1 + i}" for i in range(problem.n_obj)))
        return Run(columns, np.concatenate(rows), seconds)


def final_set(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return at most `FINAL_SIZE` different, non-dominated rows of ``F`` (n, m), evenly spread."""
    F = F[np.isfinite(F).all(axis=1)]
    if not len(F):
        return F
    front = F[is_nondominated(F)]
    front = front[np.lexsort(front.T[::-1])]
    return front[most_spread(front, FINAL_SIZE)]
