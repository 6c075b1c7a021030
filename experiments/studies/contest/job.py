"""One run of one algorithm on one benchmark problem, as a job of a campaign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from experiments.comparing.contestants import EVALUATIONS, SPENT, ContestantRun
from experiments.comparing.indicators import front_among
from experiments.runner.campaign import Run
from experiments.studies.contest.problems import problem_of
from experiments.studies.contest.reduced_swarms import EVERYONE


@dataclass(frozen=True)
class ContestRun(ContestantRun):
    """A run on a problem of the contest, which keeps the sets that are offered."""

    def execute(self) -> Run:
        """Run, and return the front of what is offered.

        Columns are the budget, the evaluations spent and the objectives, rows by budget and rising
        objectives. A budget at which nothing feasible is offered has one row without objectives.
        """
        problem = problem_of(self.problem)
        offers, seconds = self.offers(EVERYONE[self.algorithm], problem)
        rows = []
        for budget, offer in offers:
            front = front_among(offer.F)
            if not len(front):
                front = np.full((1, problem.n_obj), np.nan)
            rows.append(np.column_stack([np.tile([budget, offer.spent], (len(front), 1)), front]))
        columns = (EVALUATIONS, SPENT, *(f"f{1 + i}" for i in range(problem.n_obj)))
        return Run(columns, np.concatenate(rows), seconds)
