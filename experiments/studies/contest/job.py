"""One run of one algorithm on one benchmark problem, as a job of a campaign."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from experiments.comparing.indicators import front_among
from experiments.runner.campaign import Run
from experiments.studies.contest.contestants import EVERYONE
from experiments.studies.contest.problems import problem_of

EVALUATIONS, SPENT = "evaluations", "spent"
"""Columns of a run, before those of the objectives."""


@dataclass(frozen=True)
class ContestRun:
    """One algorithm, one problem, one seed, and the set it offers at each budget of evaluations."""

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
        """Run, and return the front of what is offered.

        Columns are the budget, the evaluations spent and the objectives, rows by budget and rising
        objectives. A budget at which nothing feasible is offered has one row without objectives.
        """
        problem = problem_of(self.problem)
        run = EVERYONE[self.algorithm].run
        started = time.perf_counter()
        offers = run(problem, self.budgets, self.seed)
        seconds = time.perf_counter() - started
        rows = []
        for budget, offer in zip(self.budgets, offers, strict=True):
            front = front_among(offer.F)
            if not len(front):
                front = np.full((1, problem.n_obj), np.nan)
            rows.append(np.column_stack([np.tile([budget, offer.spent], (len(front), 1)), front]))
        columns = (EVALUATIONS, SPENT, *(f"f{1 + i}" for i in range(problem.n_obj)))
        return Run(columns, np.concatenate(rows), seconds)
