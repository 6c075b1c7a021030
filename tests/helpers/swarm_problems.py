"""Small problems for swarms, and what their runs are compared by."""

import hashlib

import numpy as np
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem


class Parabolas(Problem):
    """Squared distances from two points; counts the rows it evaluates."""

    def __init__(self, **kwargs):
        super().__init__(**{"n_var": 3, "n_obj": 2, "xl": -1.0, "xu": 2.0, **kwargs})
        self.n_rows = 0

    def _evaluate(self, X, out, *args, **kwargs):
        self.n_rows += len(X)
        out["F"] = np.column_stack([(X**2).sum(axis=1), ((X - 1.0) ** 2).sum(axis=1)])


class Bowl(Parabolas):
    """One objective, twice."""

    def _evaluate(self, X, out, *args, **kwargs):
        out["F"] = np.repeat((X**2).sum(axis=1, keepdims=True), 2, axis=1)


class Cliff(Parabolas):
    """Not a number on part of the box."""

    def __init__(self, edge):
        super().__init__()
        self.edge = edge

    def _evaluate(self, X, out, *args, **kwargs):
        super()._evaluate(X, out)
        out["F"][X[:, 0] < self.edge] = np.nan


class Unreachable(Parabolas):
    """Never feasible; least infeasible at the lower corner."""

    def __init__(self):
        super().__init__(n_ieq_constr=1)

    def _evaluate(self, X, out, *args, **kwargs):
        super()._evaluate(X, out)
        out["G"] = 1.0 + (X + 1.0).sum(axis=1, keepdims=True)


def run(algorithm, problem="zdt1", n_gen=30, seed=1, **kwargs):
    problem = get_problem(problem) if isinstance(problem, str) else problem
    return minimize(problem, algorithm, ("n_gen", n_gen), seed=seed, **kwargs)


def digest(result):
    return hashlib.sha256(result.X.tobytes() + result.F.tobytes()).hexdigest()


def assert_clean_front(result):
    no_worse = (result.F[:, np.newaxis] <= result.F).all(axis=2)
    np.testing.assert_array_equal(no_worse, np.eye(len(result.F), dtype=bool))
