"""NSPSO of pygmo, as its users run it: without constraints, which it does not take."""

from __future__ import annotations

from collections.abc import Sequence

import pygmo
from pymoo.core.problem import Problem

from experiments.comparing.peers_pymoo import POPULATION, Offer
from pymoo_hdte.problems.adapters import PygmoProblem


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
        swarm = pygmo.population(pygmo.problem(PygmoProblem(problem)), POPULATION, seed=seed)
        evolved = algorithm.evolve(swarm)
        spent = evolved.problem.get_fevals()
        if spent != budget:
            raise RuntimeError(f"NSPSO spent {spent} evaluations, not {budget}")
        offered.append(Offer(evolved.get_f(), spent))
    return offered
