"""A robust problem as numbers, for readers in any language: series, bounds, front and checks."""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.core.problem import Problem

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import ExactMoments, latin_hypercube

FORMAT = 1
_CHECKS, _FRONT = 8, 201


def specification(problem: Problem) -> dict[str, Any]:
    """Return what determines a problem whose moments are polynomials, JSON-able.

    Of a design x, with t_j = (2 x_j - lower_j - upper_j) / (upper_j - lower_j), mean and variance
    are sums of ``coefficient * T_a(t_1) * T_b(t_2) * ...`` with Chebyshev's polynomials T_0 = 1,
    T_1(t) = t, T_(k+1)(t) = 2 t T_k(t) - T_(k-1)(t). Coefficients are in the order of the degrees,
    the last one running fastest. The objectives are the mean and the root of the variance.

    Parameters
    ----------
    problem : RobustDTE or other RobustProblem
        Of two objectives, with exact moments.

    Returns
    -------
    dict
        ``format`` (1), ``name``, ``variables``, ``objectives``, ``lower``, ``upper``,
        ``mean_degrees``, ``mean``, ``variance_degrees``, ``variance``, ``check_designs`` and
        ``check_objectives`` (8 designs, row by row), and where a front is known ``front`` and
        ``front_designs`` (201 of its points, row by row). Values are in the problem's units.

    Raises
    ------
    InvalidInput
        For a problem of another kind.

    Examples
    --------
    >>> from pymoo_hdte.problems import get_problem
    >>> len(specification(get_problem("resonant"))["variance"])
    2401
    """
    moments = getattr(problem, "moments", None)
    if not isinstance(moments, ExactMoments) or problem.n_obj != 2:
        allowed = "a problem of mean and standard deviation with exact moments, such as RobustDTE"
        raise InvalidInput("problem", type(problem).__name__, allowed)
    mean, variance = moments.series()
    designs = latin_hypercube(moments.design_box, _CHECKS, 1)
    document = {
        "format": FORMAT,
        "name": problem.name(),
        "variables": list(moments.design_box.names),
        "objectives": list(problem.obj_names),
        "lower": problem.xl.tolist(),
        "upper": problem.xu.tolist(),
        "mean_degrees": [size - 1 for size in mean.shape],
        "mean": mean.ravel().tolist(),
        "variance_degrees": [size - 1 for size in variance.shape],
        "variance": variance.ravel().tolist(),
        "check_designs": designs.ravel().tolist(),
        "check_objectives": problem.evaluate(designs).ravel().tolist(),
    }
    front = problem.pareto_front()
    if front is not None:
        rows = np.linspace(0, len(front) - 1, min(_FRONT, len(front))).round().astype(int)
        document["front"] = front[rows].ravel().tolist()
        document["front_designs"] = problem.pareto_set()[rows].ravel().tolist()
    return document
