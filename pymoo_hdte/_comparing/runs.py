"""One run of one algorithm on one robust design problem, as a job of a campaign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.algorithm import Algorithm
from pymoo.optimize import minimize

from pymoo_hdte._comparing.trace import TracingEvaluator
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.algorithms import (
    AMOPSO,
    AMPMOPSO,
    MOPSO,
    MPMOPSO,
    FirstStepWithinBounds,
    VelocityWithinBounds,
)
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.algorithms.velocity import InitialVelocity
from pymoo_hdte.problems import RobustDTE

FINAL_SIZE = 50
"""Most designs of a final set: the size of the paper's archive."""

ALGORITHMS: dict[str, Callable[[int, int], Algorithm]] = {
    "NSGA-II": lambda population, _: NSGA2(pop_size=population),
    "MOPSO": lambda population, size: MOPSO(pop_size=population, archive_size=size),
    "A-MOPSO": lambda population, size: AMOPSO(pop_size=population, archive_size=size),
    "MP-MOPSO": lambda population, size: MPMOPSO(pop_size=population, archive_size=size),
    "AMP-MOPSO": lambda population, size: AMPMOPSO(pop_size=population, archive_size=size),
}
"""How each algorithm is made from the size of its population and of its final set."""

AS_PRINTED, FIRST_STEP = "within the bounds", "first step within the bounds"
VELOCITIES: dict[str, type[InitialVelocity]] = {
    AS_PRINTED: VelocityWithinBounds,
    FIRST_STEP: FirstStepWithinBounds,
}
"""Laws of the first velocities: the paper's, which the swarms take by default, and another."""


@cache
def robust_problem(model: str) -> RobustDTE:
    """Return the robust problem on the drive model of that name, built once per process."""
    return RobustDTE(model=model)


def final_rows(F: NDArray[np.float64], size: int = FINAL_SIZE) -> NDArray[np.int_]:
    """Return which rows of ``F`` (n, m) a set of at most ``size`` keeps, by rising objectives.

    More are thinned by crowding, in the same way for all algorithms.
    """
    rows = least_crowded(F, size)
    return rows[np.lexsort(F[rows].T[::-1])]


@dataclass(frozen=True)
class OptimisationRun:
    """One algorithm, one problem, one seed; defaults are the budget of Section 5.1."""

    model: str
    algorithm: str
    seed: int
    population: int = 100
    generations: int = 100
    final_size: int = FINAL_SIZE

    @property
    def key(self) -> str:
        """All settings in one name."""
        budget = f"{self.population}x{self.generations}_final{self.final_size}"
        return f"{self.model}_{self.algorithm}_{budget}_seed{self.seed}"

    def execute(self) -> Run:
        """Optimise, and reduce what is found to ``final_size`` designs in the same way for all.

        Columns are the design variables and the objectives, rows by rising first objective.
        """
        problem = robust_problem(self.model)
        algorithm = ALGORITHMS[self.algorithm](self.population, self.final_size)
        evaluator = TracingEvaluator()
        budget = ("n_gen", self.generations)
        ended = minimize(problem, algorithm, budget, seed=self.seed, evaluator=evaluator)
        spent = ended.algorithm.evaluator.n_eval
        if spent != self.population * self.generations:
            raise RuntimeError(f"{self.key} spent {spent} evaluations: no fair comparison")
        X, F = ended.opt.get("X", "F")
        rows = final_rows(F, self.final_size)
        columns = (*problem.var_names, *problem.obj_names)
        values = np.hstack([X[rows], F[rows]])
        return Run(columns, values, ended.exec_time, trace=evaluator.trace)
