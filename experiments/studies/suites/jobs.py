"""Runs on suites, as jobs of a campaign."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from moocore import hypervolume
from numpy.typing import NDArray
from pymoo.indicators.igd_plus import IGDPlus

from experiments.comparing.contestants import EVALUATIONS, SPENT, ContestantRun
from experiments.studies.suites.coco import MARKS, BbobProblem, shares_of_run
from experiments.studies.suites.peers import ON_BBOB, ON_SUITES
from experiments.studies.suites.problems import box_of, front_of, problem_of
from pymoo_hdte._comparing.indicators import CORNER, front_among
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.algorithms.hypervolume import most_hypervolume

FINAL_SIZE = 100
"""Most solutions that are judged: the population of all who have one."""
MEASURES = ("hypervolume", "igd_plus", "solutions")


@dataclass(frozen=True)
class SuiteRun(ContestantRun):
    """A run on a problem of a suite, which keeps what its sets are worth."""

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"suite_{super().key}"

    def execute(self) -> Run:
        """Run; columns are the budget, the evaluations spent and `MEASURES`, a row a budget."""
        problem = problem_of(self.problem)
        offers, seconds = self.offers(ON_SUITES[self.algorithm], problem)
        rows = [[budget, offer.spent, *measured(self.problem, offer.F)] for budget, offer in offers]
        return Run((EVALUATIONS, SPENT, *MEASURES), np.array(rows, dtype=float), seconds)


def measured(name: str, F: NDArray[np.float64]) -> tuple[float, float, int]:
    """Return hypervolume, IGD+ and number of solutions of the front of a set ``F`` (n, m).

    Objectives are normalised by `box_of`; the hypervolume counts up to 1.1 in each. More than
    `FINAL_SIZE` are thinned out by what they add to the hypervolume. IGD+ is NaN where no front is
    known, and infinite for an empty set.
    """
    front = front_among(F)
    ideal, nadir = box_of(name)
    scaled = (front - ideal) / (nadir - ideal)
    scaled = scaled[most_hypervolume(scaled, FINAL_SIZE, keep_ends=False)]
    inside = scaled[np.all(scaled < CORNER, axis=1)]
    volume = float(hypervolume(inside, ref=[CORNER] * len(ideal))) if len(inside) else 0.0
    true = front_of(name)
    if true is None:
        return volume, np.nan, len(scaled)
    distance = float(IGDPlus((true - ideal) / (nadir - ideal))(scaled)) if len(scaled) else np.inf
    return volume, distance, len(scaled)


@dataclass(frozen=True)
class BbobRun:
    """One algorithm on one problem of bbob-biobj, every evaluation counted.

    ``told`` is the budget that its termination names.
    """

    function: int
    dimension: int
    instance: int
    algorithm: str
    told: int
    seed: int = 1

    @property
    def key(self) -> str:
        """All settings in one name."""
        problem = f"bbob_f{self.function}_d{self.dimension}_i{self.instance}"
        return f"{problem}_{self.algorithm.replace(' ', '-')}_{self.told}_seed{self.seed}"

    def execute(self) -> Run:
        """Run; columns are the number of evaluations and the share of targets reached by then."""
        run = ON_BBOB[self.algorithm].run
        # Instances are runs of their own, as for COCO: the same first positions would link them.
        seed = 1000 * self.seed + self.instance

        def spend(problem: BbobProblem) -> None:
            run(problem, (self.told,), seed)

        started = time.perf_counter()
        shares = shares_of_run(self.function, self.dimension, self.instance, spend)
        seconds = time.perf_counter() - started
        marks = [mark for mark in MARKS if mark <= self.told]
        values = np.column_stack([marks, shares[: len(marks)]]).astype(float)
        return Run(("evaluations", "share"), values, seconds)
