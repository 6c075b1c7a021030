"""What an algorithm offers when a budget is spent, and how one is run from budget to budget."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem

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
