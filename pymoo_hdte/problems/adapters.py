"""Problems of pymoo as other libraries take them; each library is needed only where it is named.

All of them minimise. Points, objectives and constraints are in the units of the problem.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

if TYPE_CHECKING:
    import platypus
    from jmetal.core.problem import FloatProblem

Values = NDArray[np.float64]


class PygmoProblem:
    """A user-defined problem of pygmo: ``pygmo.problem(PygmoProblem(problem))``.

    A fitness vector has objectives, equalities and inequalities, which hold up to 0, in that order.
    Algorithms of pygmo that evaluate whole populations find ``batch_fitness``.

    Parameters
    ----------
    problem : Problem
        A pymoo problem with real variables and finite bounds.

    Examples
    --------
    >>> from pymoo_hdte.problems import get_problem
    >>> PygmoProblem(get_problem("toy")).get_nobj()
    2
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def fitness(self, x: Values) -> Values:
        """Return the fitness vector of one point (n_var,)."""
        return self.batch_fitness(np.asarray(x, dtype=float))

    def batch_fitness(self, designs: Values) -> Values:
        """Return the fitness vectors of points, both one after the other in one array."""
        X = designs.reshape(-1, self.problem.n_var)
        F, H, G = self.problem.evaluate(X, return_values_of=["F", "H", "G"])
        return np.column_stack([F, H, G]).ravel()

    def get_bounds(self) -> tuple[list[float], list[float]]:
        """Return lower and upper bounds."""
        return self.problem.xl.tolist(), self.problem.xu.tolist()

    def get_nobj(self) -> int:
        """Return the number of objectives."""
        return self.problem.n_obj

    def get_nec(self) -> int:
        """Return the number of equalities."""
        return self.problem.n_eq_constr

    def get_nic(self) -> int:
        """Return the number of inequalities."""
        return self.problem.n_ieq_constr

    def get_name(self) -> str:
        """Return the name of the problem."""
        return self.problem.name()


def to_jmetal(problem: Problem) -> FloatProblem:
    """Return a problem of jMetalPy, whose inequalities are violated below 0 there.

    Parameters
    ----------
    problem : Problem
        A pymoo problem with real variables, finite bounds and no equalities.

    Raises
    ------
    ModuleNotFoundError
        If jMetalPy is not installed (``pip install jmetalpy``).
    """
    from pymoo_hdte.problems._jmetal import JMetalProblem

    return JMetalProblem(problem)


def to_platypus(problem: Problem) -> platypus.Problem:
    """Return a problem of Platypus.

    Parameters
    ----------
    problem : Problem
        A pymoo problem with real variables and finite bounds.

    Raises
    ------
    ModuleNotFoundError
        If Platypus is not installed (``pip install platypus-opt``).
    """
    import platypus

    evaluate = PygmoProblem(problem)
    n_obj, n_eq = problem.n_obj, problem.n_eq_constr

    def function(variables: list[float]) -> Any:
        fitness = evaluate.fitness(np.array(variables)).tolist()
        return (fitness[:n_obj], fitness[n_obj:]) if len(fitness) > n_obj else fitness

    n_constraints = n_eq + problem.n_ieq_constr
    other = platypus.Problem(problem.n_var, n_obj, n_constraints, function=function)
    other.types[:] = [platypus.Real(*bounds) for bounds in zip(problem.xl, problem.xu, strict=True)]
    if n_constraints:
        other.constraints[:] = ["==0"] * n_eq + ["<=0"] * problem.n_ieq_constr
    return other


def to_callable(problem: Problem) -> Callable[[Mapping[str, float]], dict[str, float]]:
    """Return a function from values by name to objectives by name, as Ax and others call one.

    Variables are called as ``problem.var_names`` or ``x1``, ``x2`` ..., objectives as
    ``problem.obj_names`` or ``f1``, ``f2`` ... For BoTorch, which hands over whole tensors,
    ``problem.evaluate(X.numpy())`` is the function, its sign turned, since BoTorch maximises.

    Parameters
    ----------
    problem : Problem
        A pymoo problem; constraints are called ``g1`` ..., up to 0 if they hold, and ``h1`` ...

    Examples
    --------
    >>> from pymoo_hdte.problems import get_problem
    >>> problem = get_problem("resonant")
    >>> list(to_callable(problem)(dict(zip(problem.var_names, problem.nominal))))
    ['mean_dte_arcsec', 'std_dte_arcsec']
    """
    variables = _names(problem, "var_names", "x", problem.n_var)
    results = [
        *_names(problem, "obj_names", "f", problem.n_obj),
        *(f"h{number + 1}" for number in range(problem.n_eq_constr)),
        *(f"g{number + 1}" for number in range(problem.n_ieq_constr)),
    ]
    evaluate = PygmoProblem(problem)

    def function(values: Mapping[str, float]) -> dict[str, float]:
        fitness = evaluate.fitness(np.array([values[name] for name in variables], dtype=float))
        return dict(zip(results, fitness.tolist(), strict=True))

    return function


def _names(problem: Problem, attribute: str, letter: str, count: int) -> list[str]:
    usual = [f"{letter}{number + 1}" for number in range(count)]
    return list(getattr(problem, attribute, usual))
