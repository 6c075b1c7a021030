"""How good a set of solutions is, measured as on the problem cards."""

from __future__ import annotations

from numpy.typing import ArrayLike
from pymoo.core.problem import Problem

from pymoo_hdte._comparing.indicators import Indicators, IndicatorsAgainst, front_among
from pymoo_hdte._comparing.runs import FINAL_SIZE
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.checks import InvalidInput, finite_array, whole_number
from pymoo_hdte.problems import get_problem

__all__ = ["score"]


def score(problem: Problem | str, F: ArrayLike, size: int = FINAL_SIZE) -> Indicators:
    """Return IGD, IGD+, hypervolume and Spacing of the non-dominated part of a set.

    Objectives are normalised by ideal and nadir point of the problem's front; the hypervolume
    counts up to 1.1 in each. More than ``size`` points are thinned out evenly first, as in SPEA2,
    so that nobody wins by returning more of them.

    Parameters
    ----------
    problem : Problem or str
        A problem with a front, or its name for `get_problem`.
    F : array_like, shape (n, m)
        Objectives of feasible solutions, in the units of the problem.
    size : int
        Most points that count, at least 1.

    Raises
    ------
    InvalidInput
        There is no problem of that name, the problem knows no front, an objective is not finite,
        or ``size`` is no whole number of at least 1.

    Examples
    --------
    >>> from pymoo_hdte.problems import get_problem
    >>> round(score("toy", get_problem("toy").pareto_front()).igd, 4)
    0.008
    """
    problem = get_problem(problem) if isinstance(problem, str) else problem
    front = problem.pareto_front()
    if front is None:
        raise InvalidInput("problem", problem.name(), "a problem with a front of its own")
    size = whole_number("size", size, at_least=1)
    points = front_among(finite_array("F", F, (None, problem.n_obj)))
    return IndicatorsAgainst(front)(points[most_spread(points, size)])
