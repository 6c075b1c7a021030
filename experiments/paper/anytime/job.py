"""One algorithm, population and seed at every budget, as a job of a campaign."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.comparing.peers_pymoo import at_budgets
from experiments.paper.anytime.moments import problem_with
from pymoo_hdte._comparing.indicators import front_among
from pymoo_hdte._comparing.runs import (
    ALGORITHMS,
    AS_PRINTED,
    FINAL_SIZE,
    VELOCITIES,
    final_rows,
    robust_problem,
)
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.algorithms import ParticleSwarm
from pymoo_hdte.algorithms.crowding import least_crowded

UNSCHEDULED = ("NSGA-II", "A-MOPSO")
"""Move alike whatever their budget; the others count on their number of generations."""
COLUMNS = ("evaluations", "mean", "std", "exact_mean", "exact_std")


@dataclass(frozen=True)
class AnytimeRun:
    """One algorithm on one problem with one seed, and what it returns at each budget.

    An algorithm that follows a schedule begins anew for every budget, because a run of 200
    evaluations is not the beginning of one of 10,000. The budgets ascend and are multiples of the
    population. ``velocity`` is one of `VELOCITIES`; what is no swarm has none.
    """

    model: str
    moments: str
    algorithm: str
    population: int
    seed: int
    budgets: tuple[int, ...]
    velocity: str = AS_PRINTED

    @property
    def key(self) -> str:
        """All settings in one name."""
        budgets = "_".join(map(str, self.budgets))
        law = "_first_step" if self.velocity != AS_PRINTED else ""
        problem = f"{self.model}_{self.moments}{law}"
        return f"{problem}_{self.algorithm}_pop{self.population}_{budgets}_seed{self.seed}"

    def execute(self) -> Run:
        """Return the sets, thinned to `FINAL_SIZE` as in Table 7.

        Columns are the budget, the objectives as the run saw them and as they are with exact
        moments, rows by budget and rising first objective.
        """
        together = self.algorithm in UNSCHEDULED
        runs = [self.budgets] if together else [(budget,) for budget in self.budgets]
        started = time.perf_counter()
        stages = [stage for budgets in runs for stage in self._stages(budgets)]
        seconds = time.perf_counter() - started
        rows = []
        for budget, (X, F) in zip(self.budgets, stages, strict=True):
            kept = final_rows(F)
            exact = robust_problem(self.model).evaluate(X[kept])
            rows.append(np.column_stack([np.full(len(kept), budget), F[kept], exact]))
        return Run(COLUMNS, np.concatenate(rows), seconds)

    def _stages(
        self, budgets: tuple[int, ...]
    ) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield the designs and objectives that one run holds at each of its budgets."""
        problem: Problem = problem_with(self.model, self.moments, self.seed)
        algorithm = ALGORITHMS[self.algorithm](self.population, FINAL_SIZE)
        if isinstance(algorithm, ParticleSwarm):
            algorithm.initial_velocity = VELOCITIES[self.velocity]()
        for budget, _ in at_budgets(algorithm, problem, budgets, self.seed):
            spent = algorithm.evaluator.n_eval
            if spent != budget:
                raise RuntimeError(f"{self.key} spent {spent} of {budget}: no fair comparison")
            yield algorithm.opt.get("X", "F")


def sets_of(run: Run, budget: int, most: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the set of at most ``most`` designs at a budget, as seen and as it is, (n, 2) each.

    What is dominated in the exact moments has left the second.
    """
    rows = run.values[run.values[:, 0] == budget]
    rows = rows[least_crowded(rows[:, 1:3], most)]
    return rows[:, 1:3], front_among(rows[:, 3:5])
