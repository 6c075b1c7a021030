"""SMPSO, OMOPSO, GDE3 and MOEA/D-DE of jMetalPy, as its users run them."""

from __future__ import annotations

import logging
import random
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jmetal.algorithm.multiobjective.gde3 import GDE3
from jmetal.algorithm.multiobjective.moead import MOEAD
from jmetal.algorithm.multiobjective.omopso import OMOPSO
from jmetal.algorithm.multiobjective.smpso import SMPSO
from jmetal.core.observer import Observer
from jmetal.core.solution import FloatSolution
from jmetal.operator.crossover import DifferentialEvolutionCrossover
from jmetal.operator.mutation import NonUniformMutation, PolynomialMutation, UniformMutation
from jmetal.util.aggregation_function import Tschebycheff
from jmetal.util.archive import CrowdingDistanceArchive
from jmetal.util.comparator import DominanceComparator, DominanceWithConstraintsComparator
from jmetal.util.evaluator import Evaluator
from jmetal.util.observable import DefaultObservable
from jmetal.util.termination_criterion import StoppingByEvaluations
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.util.ref_dirs import get_reference_directions

from experiments.comparing.peers_pymoo import POPULATION, Offer
from pymoo_hdte.problems._jmetal import JMetalProblem

logging.getLogger("jmetal.core.algorithm").setLevel(logging.WARNING)

EPSILON = 0.0075
"""Of OMOPSO's archive, in objectives as they are: the value in jMetalPy's examples.

It decides which solutions are offered, not how the swarm moves.
"""


class BatchEvaluator(Evaluator):
    """Evaluates a whole swarm at once."""

    def evaluate(
        self, solution_list: list[FloatSolution], problem: JMetalProblem
    ) -> list[FloatSolution]:
        """Fill in objectives and constraints."""
        return problem.evaluate_all(solution_list)


class _Snapshots(Observer):
    """Keeps what the algorithm offers when a budget is spent."""

    def __init__(self, budgets: Sequence[int]) -> None:
        self.budgets = budgets
        self.offered: list[Offer] = []

    def update(self, *args: Any, **kwargs: Any) -> None:
        if kwargs["EVALUATIONS"] in self.budgets:
            F = _feasible(kwargs["SOLUTIONS"])
            self.offered.append(Offer(F, kwargs["EVALUATIONS"]))


def run_jmetal(name: str, problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    """Run one of them once and return what it offers at every budget.

    Budgets are multiples of the population; OMOPSO's mutation shrinks until the largest is spent.

    Raises
    ------
    RuntimeError
        If another number of evaluations is spent.
    """
    # jMetalPy draws from the generators of the modules; nothing else in this process uses them.
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002
    wrapped = JMetalProblem(problem)
    makers = {"SMPSO": _smpso, "OMOPSO": _omopso, "GDE3": _gde3, "MOEA/D-DE": _moead_de}
    make = makers[name]
    algorithm = make(wrapped, budgets[-1])
    snapshots = _Snapshots(budgets)
    algorithm.observable = DefaultObservable()
    algorithm.observable.register(algorithm.termination_criterion)
    algorithm.observable.register(snapshots)
    algorithm.run()
    if wrapped.evaluations != budgets[-1] or len(snapshots.offered) != len(budgets):
        raise RuntimeError(f"{name} spent {wrapped.evaluations} evaluations, not {budgets[-1]}")
    return snapshots.offered


def _dominance(problem: JMetalProblem) -> DominanceComparator:
    if problem.number_of_constraints():
        return DominanceWithConstraintsComparator()
    return DominanceComparator()


def _smpso(problem: JMetalProblem, budget: int) -> SMPSO:
    return SMPSO(
        problem=problem,
        swarm_size=POPULATION,
        mutation=PolynomialMutation(1.0 / problem.number_of_variables(), 20),
        leaders=CrowdingDistanceArchive(POPULATION, _dominance(problem)),
        dominance_comparator=_dominance(problem),
        termination_criterion=StoppingByEvaluations(budget),
        swarm_evaluator=BatchEvaluator(),
    )


def _omopso(problem: JMetalProblem, budget: int) -> OMOPSO:
    rate = 1.0 / problem.number_of_variables()
    return OMOPSO(
        problem=problem,
        swarm_size=POPULATION,
        epsilon=EPSILON,
        uniform_mutation=UniformMutation(rate, 0.5),
        non_uniform_mutation=NonUniformMutation(rate, 0.5, budget // POPULATION),
        leaders=CrowdingDistanceArchive(POPULATION, _dominance(problem)),
        termination_criterion=StoppingByEvaluations(budget),
        swarm_evaluator=BatchEvaluator(),
    )


def _gde3(problem: JMetalProblem, budget: int) -> GDE3:
    return GDE3(
        problem=problem,
        population_size=POPULATION,
        cr=0.5,
        f=0.5,
        termination_criterion=StoppingByEvaluations(budget),
        population_evaluator=BatchEvaluator(),
        dominance_comparator=_dominance(problem),
    )


@cache
def _weights(objectives: int) -> NDArray[np.float64]:
    return get_reference_directions("energy", objectives, POPULATION, seed=1)


def _moead_de(problem: JMetalProblem, budget: int) -> MOEAD:
    """Return MOEA/D with differential evolution, settings of Li and Zhang (2009)."""
    objectives = problem.number_of_objectives()
    with tempfile.TemporaryDirectory() as folder:
        if objectives > 2:
            # jMetalPy reads the weights from a file of this name; those of two it makes itself.
            np.savetxt(Path(folder) / f"W{objectives}D_{POPULATION}.dat", _weights(objectives))
        return MOEAD(
            problem=problem,
            population_size=POPULATION,
            mutation=PolynomialMutation(1.0 / problem.number_of_variables(), 20),
            crossover=DifferentialEvolutionCrossover(CR=1.0, F=0.5, K=0.5),
            aggregation_function=Tschebycheff(objectives),
            neighbor_size=20,
            neighbourhood_selection_probability=0.9,
            max_number_of_replaced_solutions=2,
            weight_files_path=folder,
            termination_criterion=StoppingByEvaluations(budget),
            population_evaluator=BatchEvaluator(),
        )


def _feasible(solutions: list[FloatSolution]) -> NDArray[np.float64]:
    feasible = [s.objectives for s in solutions if all(value >= 0.0 for value in s.constraints)]
    return np.array(feasible).reshape(-1, len(solutions[0].objectives))
