"""A pymoo problem as jMetalPy sees it; apart, since its base class is jMetalPy's."""

from __future__ import annotations

import numpy as np
from jmetal.core.problem import FloatProblem
from jmetal.core.solution import FloatSolution
from pymoo.core.problem import Problem

from pymoo_hdte.checks import InvalidInput


class JMetalProblem(FloatProblem):
    """A pymoo problem as jMetalPy sees it.

    Attributes
    ----------
    evaluations : int
        Points evaluated so far.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__()
        if problem.n_eq_constr:
            raise InvalidInput("n_eq_constr of problem", problem.n_eq_constr, "0 for jMetalPy")
        self.problem = problem
        self.evaluations = 0
        self.lower_bound, self.upper_bound = problem.xl.tolist(), problem.xu.tolist()
        self.directions = [self.MINIMIZE] * problem.n_obj

    def number_of_objectives(self) -> int:
        """Return the number of objectives."""
        return self.problem.n_obj

    def number_of_constraints(self) -> int:
        """Return the number of inequality constraints."""
        return self.problem.n_ieq_constr

    def name(self) -> str:
        """Return the name of the problem."""
        return self.problem.name()

    def evaluate(self, solution: FloatSolution) -> FloatSolution:
        """Evaluate one solution."""
        return self.evaluate_all([solution])[0]

    def evaluate_all(self, solutions: list[FloatSolution]) -> list[FloatSolution]:
        """Fill in objectives and constraints of all at once."""
        self.evaluations += len(solutions)
        X = np.array([solution.variables for solution in solutions])
        F, G = self.problem.evaluate(X, return_values_of=["F", "G"])
        for solution, f, g in zip(solutions, F, G, strict=True):
            solution.objectives = f.tolist()
            solution.constraints = (-g).tolist()
        return solutions
