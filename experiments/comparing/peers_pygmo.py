"""NSPSO of pygmo, as its users run it: without constraints, which it does not take."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pygmo
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.comparing.peers_pymoo import POPULATION, Offer


class WrappedProblem:
    """A pymoo problem as pygmo sees it."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def fitness(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the objectives of one point."""
        return self.batch_fitness(x)

    def batch_fitness(self, designs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the objectives of points, both one after the other."""
        X = designs.reshape(-1, self.problem.n_var)
        return self.problem.evaluate(X, return_values_of=["F"]).ravel()

    def get_bounds(self) -> tuple[list[float], list[float]]:
        """Return the bounds."""
        return self.problem.xl.tolist(), self.problem.xu.tolist()

    def get_nobj(self) -> int:
        """Return the number of objectives."""
        return self.problem.n_obj


def run_pygmo(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    """Run NSPSO for each budget and return what its population offers.

    Raises
    ------
    RuntimeError
        If another number of evaluations is spent.
    """
    offered = []
    for budget in budgets:
        generations = budget // POPULATION - 1
        nspso = pygmo.nspso(gen=generations, seed=seed)
        nspso.set_bfe(pygmo.bfe())
        algorithm = pygmo.algorithm(nspso)
        swarm = pygmo.population(pygmo.problem(WrappedProblem(problem)), POPULATION, seed=seed)
        evolved = algorithm.evolve(swarm)
        spent = evolved.problem.get_fevals()
        if spent != budget:
            raise RuntimeError(f"NSPSO spent {spent} evaluations, not {budget}")
        offered.append(Offer(evolved.get_f(), spent))
    return offered
