"""Algorithms of pymoo and of this package, as their users run them, by a budget of evaluations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.age2 import AGEMOEA2
from pymoo.algorithms.moo.cmopso import CMOPSO
from pymoo.algorithms.moo.mopso_cd import MOPSO_CD
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.util.ref_dirs import get_reference_directions

from pymoo_hdte._comparing.named import seeded_default_rng
from pymoo_hdte.algorithms import AMPMOPSO, ElitistSwarm, FirstStepWithinBounds

POPULATION = 100
"""Population of every algorithm that has one."""


class Offer(NamedTuple):
    """Objectives (n, m) of the feasible set an algorithm holds, and the evaluations it has spent.

    It spends less than its budget if a generation does not divide it, or if it broke off.
    """

    F: NDArray[np.float64]
    spent: int


def at_budgets(
    algorithm: Algorithm, problem: Problem, budgets: Sequence[int], seed: int
) -> Iterator[tuple[int, Algorithm]]:
    """Run an algorithm of pymoo once; yield every ascending budget with it when that is spent.

    A budget counts the evaluations that pymoo's evaluator was asked for, in whole generations that
    do not exceed it.
    """
    algorithm.setup(problem, termination=("n_eval", budgets[-1]), seed=seed)
    for budget in budgets:
        while algorithm.has_next() and algorithm.evaluator.n_eval + algorithm.pop_size <= budget:
            algorithm.next()
        yield budget, algorithm


_PARTITIONS = {2: 99, 3: 12}
"""Partitions of the directions of NSGA-III: 100 directions for two objectives, 91 for three."""


def _nsga3(problem: Problem) -> Algorithm:
    directions = get_reference_directions(
        "das-dennis", problem.n_obj, n_partitions=_PARTITIONS[problem.n_obj]
    )
    return NSGA3(directions)


class EndingAGEMOEA2(AGEMOEA2):
    """Ends where pymoo 0.6.2 divides by zero, because its front is degenerate.

    So does a run that finds no new design; what it held counts.
    """

    def next(self) -> None:
        """Make one generation."""
        try:
            super().next()
        except ZeroDivisionError:
            self.termination.force_termination = True


PYMOO: dict[str, Callable[[Problem], Algorithm]] = {
    "NSGA-II": lambda _: NSGA2(pop_size=POPULATION),
    "NSGA-III": _nsga3,
    "SMS-EMOA": lambda _: SMSEMOA(pop_size=POPULATION),
    "AGE-MOEA-II": lambda _: EndingAGEMOEA2(pop_size=POPULATION),
    "MOPSO-CD": lambda _: MOPSO_CD(pop_size=POPULATION),
    "CMOPSO": lambda _: CMOPSO(pop_size=POPULATION),
}
"""Peers of pymoo by name, with its defaults beside the size of the population."""


def _amp_mopso(_: Problem) -> Algorithm:
    """Return the paper's swarm with first velocities that do not depend on a problem's origin.

    Under the printed law the boxes of the benchmark would decide how it starts.
    """
    law = FirstStepWithinBounds()
    return AMPMOPSO(pop_size=POPULATION, archive_size=POPULATION, initial_velocity=law)


OWN: dict[str, tuple[Callable[[Problem], Algorithm], bool]] = {
    "AMP-MOPSO": (_amp_mopso, True),
    "ElitistSwarm": (lambda _: ElitistSwarm(pop_size=POPULATION), False),
}
"""Algorithms of this package by name, and whether they count on the number of generations."""


def run_pymoo(
    make: Callable[[Problem], Algorithm], problem: Problem, budgets: Sequence[int], seed: int
) -> list[Offer]:
    """Run an algorithm once and return what it offers at every budget, see `at_budgets`."""
    with seeded_default_rng(seed):
        return [
            Offer(_feasible(algorithm, problem), algorithm.evaluator.n_eval)
            for _, algorithm in at_budgets(make(problem), problem, budgets, seed)
        ]


def _feasible(algorithm: Algorithm, problem: Problem) -> NDArray[np.float64]:
    """Return F (n, m) of the feasible part of what the algorithm holds to be best."""
    best = algorithm.opt
    if best is None or len(best) == 0:
        return np.empty((0, problem.n_obj))
    X, F = best.get("X", "F")
    if not problem.has_constraints():
        return F
    # Some keep no violations: what is offered is judged by the problem itself.
    return F[np.all(problem.evaluate(X, return_values_of=["G"]) <= 0.0, axis=1)]
