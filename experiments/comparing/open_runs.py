"""One run of any algorithm on any problem, as a job of a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
from moocore import is_nondominated
from pymoo.optimize import minimize

from experiments.comparing.named import algorithm_named, problem_named
from experiments.comparing.runs import FINAL_SIZE, final_rows
from experiments.runner.campaign import Run

SPENT = "evaluations"


@dataclass(frozen=True)
class OpenRun:
    """One algorithm, one problem, one seed and a budget, all by name.

    ``source`` identifies the files of a stranger's problem or algorithm, see `named.source_of`, so
    that a changed file is not taken for the one that made a stored run.
    """

    problem: str
    algorithm: str
    seed: int
    population: int
    evaluations: int
    source: str = ""

    @property
    def key(self) -> str:
        """All settings in one name."""
        names = f"{self.problem}_{self.algorithm}".replace(":", "..")
        budget = f"pop{self.population}_{self.evaluations}_final{FINAL_SIZE}"
        return "_".join(filter(None, (names, budget, f"seed{self.seed}", self.source)))

    def execute(self) -> Run:
        """Optimise, and reduce what is found to `FINAL_SIZE` designs in the same way for all.

        Columns are the evaluations spent, the design variables and the objectives, rows by rising
        objectives. Where nothing feasible is found, one row holds the evaluations alone.
        """
        problem = problem_named(self.problem)
        algorithm = algorithm_named(self.algorithm, self.population, self.problem)
        with seeded_default_rng(self.seed):
            found = minimize(problem, algorithm, ("n_eval", self.evaluations), seed=self.seed)
        spent = found.algorithm.evaluator.n_eval
        columns = (SPENT, *(f"x{1 + i}" for i in range(problem.n_var)))
        columns += tuple(f"f{1 + i}" for i in range(problem.n_obj))
        X, F = np.empty((0, problem.n_var)), np.empty((0, problem.n_obj))
        # Without a feasible design, the optimum is the least infeasible one and F is None.
        if found.F is not None:
            X, F = found.opt.get("X", "F")
            sound = np.isfinite(F).all(axis=1)
            X, F = X[sound], F[sound]
        if not len(F):
            nothing = np.full((1, len(columns)), np.nan)
            nothing[0, 0] = spent
            return Run(columns, nothing, found.exec_time)
        best = is_nondominated(F, keep_weakly=True)
        X, F = X[best], F[best]
        kept = final_rows(F)
        rows = np.hstack([np.full((len(kept), 1), spent), X[kept], F[kept]])
        return Run(columns, rows, found.exec_time)


@contextmanager
def seeded_default_rng(seed: int) -> Iterator[None]:
    """Seed the generators that pymoo's MOPSO_CD and CMOPSO make without a seed.

    Both truncate their archive with ``numpy.random.default_rng(None)``, so that the same seed would
    not give the same run.
    """
    original = np.random.default_rng
    children = np.random.SeedSequence(seed)

    def seeded(given: Any = None) -> np.random.Generator:
        return original(children.spawn(1)[0] if given is None else given)

    with patch.object(np.random, "default_rng", seeded):
        yield
