"""True fronts of the benchmark problems: in closed form, stored, or as a solver found them.

Those of `RobustDTE` are the fronts of its surrogate, which are not those of the drive model.

Sources: ZDT and DTLZ (Deb, Thiele, Laumanns, Zitzler 2005) as pymoo has them; WFG (Huband,
Hingston, Barone, While 2006, shapes of section VIII with all distance parameters at their optimum);
OSY and TNK (Deb 2001, section 8.3).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.util.ref_dirs import get_reference_directions
from scipy.optimize import minimize

from experiments.runner.committed import DATA
from experiments.studies.contest.problems import EVERY, problem_of
from pymoo_hdte._comparing.quality import N_POINTS, even_curve

_PARTITIONS = 99

WELDED_BEAM = DATA / "front_welded_beam.csv"


def wfg_front(number: int) -> NDArray[np.float64]:
    """Return the front of a WFG problem with two objectives, shape (n, 2)."""
    t = np.linspace(0.0, 1.0, 20 * N_POINTS)
    quarter = t * np.pi / 2.0
    if number == 1:
        mixed = 1.0 - t - np.cos(10.0 * np.pi * t + np.pi / 2.0) / (10.0 * np.pi)
        shape = np.column_stack([1.0 - np.cos(quarter), mixed])
    elif number == 2:
        shape = np.column_stack([1.0 - np.cos(quarter), 1.0 - t * np.cos(5.0 * np.pi * t) ** 2])
    elif number == 3:
        shape = np.column_stack([t, 1.0 - t])
    else:
        shape = np.column_stack([np.sin(quarter), np.cos(quarter)])
    return even_curve(shape * np.array([2.0, 4.0]))


def dtlz_front(number: int) -> NDArray[np.float64]:
    """Return the front of DTLZ1, 2 or 7 with three objectives, shape (n, 3)."""
    if number == 7:
        one_side = np.linspace(0.0, 1.0, 200)
        x, second = (grid.ravel() for grid in np.meshgrid(one_side, one_side))
        bumps = sum(f / 2.0 * (1.0 + np.sin(3.0 * np.pi * f)) for f in (x, second))
        front = np.column_stack([x, second, 2.0 * (3.0 - bumps)])
        return front[is_nondominated(front)]
    directions = get_reference_directions("das-dennis", 3, n_partitions=_PARTITIONS)
    if number == 1:
        return 0.5 * directions
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def tnk_front() -> NDArray[np.float64]:
    """Return the front of TNK, part of the curve r^2 = 1 + 0.1 cos(16 phi), shape (n, 2)."""
    angle = np.linspace(0.0, np.pi / 2.0, 100 * N_POINTS)
    radius = np.sqrt(1.0 + 0.1 * np.cos(16.0 * angle))
    curve = radius[:, np.newaxis] * np.column_stack([np.cos(angle), np.sin(angle)])
    inside = np.sum((curve - 0.5) ** 2, axis=1) <= 0.5
    return even_curve(curve[inside])


def osy_front(problem: Problem) -> NDArray[np.float64]:
    """Return the front of OSY from the five parts of its Pareto set, shape (n, 2)."""
    t = np.linspace(0.0, 1.0, 4 * N_POINTS)
    ones, none = np.ones_like(t), np.zeros_like(t)
    x1 = 4.0556 + 0.9444 * t
    parts = [
        [5 * ones, ones, 1 + 4 * t, none, 5 * ones, none],
        [5 * ones, ones, 1 + 4 * t, none, ones, none],
        [x1, (x1 - 2) / 3, ones, none, ones, none],
        [none, 2 * ones, 1 + 2.7321 * t, none, ones, none],
        [t, 2 - t, ones, none, ones, none],
    ]
    designs = np.hstack([np.array(part) for part in parts]).T
    F, G = problem.evaluate(designs, return_values_of=["F", "G"])
    return even_curve(F[np.all(G <= 1e-9, axis=1)])


def srn_front(problem: Problem) -> NDArray[np.float64]:
    """Return the front of SRN, shape (n, 2).

    The set has three parts: x_1 = -2.5 between the two constraints, and a stretch along either of
    them, which pymoo's front leaves out. On the circle it ends where f_2 is least.
    """
    t = np.linspace(0.0, 1.0, 10 * N_POINTS)
    edge = np.sqrt(15.0**2 - 2.5**2)
    line = np.column_stack([-2.5 + 5.0 * t, (7.5 + 5.0 * t) / 3.0])
    middle = np.column_stack([np.full_like(t, -2.5), 2.5 + (edge - 2.5) * t])
    turn = np.arcsin(2.5 / 15.0) + (np.pi / 4.0) * t
    circle = 15.0 * np.column_stack([-np.sin(turn), np.cos(turn)])
    return even_curve(problem.evaluate(np.vstack([line, middle, circle]), return_values_of=["F"]))


def welded_beam_front() -> NDArray[np.float64]:
    """Return the front of the welded beam, shape (n, 2): stored, as `follow_welded_beam` gives it.

    No closed form is known.
    """
    return even_curve(np.loadtxt(WELDED_BEAM, delimiter=",", skiprows=1))


def follow_welded_beam(problem: Problem, levels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return least cost at falling stiffness, shape (n, 2), for rising deflections ``levels``.

    SLSQP starts from the last solution and from random ones, and what is better stays.

    Raises
    ------
    ArithmeticError
        If no start leads to a feasible beam.
    """
    rng = np.random.default_rng(1)
    width = problem.xu - problem.xl
    best, points = (problem.xl + problem.xu) / 2.0, []
    for level in levels:
        starts = [best, *(problem.xl + rng.random((5, problem.n_var)) * width)]
        costs = [_least_cost(problem, level, start) for start in starts]
        cost, best = min(costs, key=lambda entry: entry[0])
        if not np.isfinite(cost):
            raise ArithmeticError(f"no feasible beam of deflection {level}")
        points.append(problem.evaluate(best, return_values_of=["F"]))
    return np.array(points)


def _least_cost(
    problem: Problem, level: float, start: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    def cost(x: NDArray[np.float64]) -> float:
        return problem.evaluate(x, return_values_of=["F"])[0]

    def slack(x: NDArray[np.float64]) -> NDArray[np.float64]:
        F, G = problem.evaluate(x, return_values_of=["F", "G"])
        return np.append(-G, 1.0 - F[1] / level)

    result = minimize(
        cost,
        start,
        method="SLSQP",
        bounds=list(zip(problem.xl, problem.xu, strict=True)),
        constraints={"type": "ineq", "fun": slack},
        options={"ftol": 1e-10, "maxiter": 200},
    )
    x = np.clip(result.x, problem.xl, problem.xu)
    return (float(result.fun) if np.min(slack(x)) > -1e-7 else np.inf), x


@cache
def front_of(name: str) -> NDArray[np.float64]:
    """Return the true front (n, m) of the benchmark of that name, found once per process."""
    return _front(name, problem_of(name))


def _front(name: str, problem: Problem) -> NDArray[np.float64]:
    match EVERY[name].family, name:
        case "DTLZ", _:
            return dtlz_front(int(name[-1]))
        case "WFG", _:
            return wfg_front(int(name[-1]))
        case _, "TNK":
            return tnk_front()
        case _, "SRN":
            return srn_front(problem)
        case _, "OSY":
            return osy_front(problem)
        case _, "WeldedBeam":
            return welded_beam_front()
        case "RobustDTE" | "constrained RobustDTE" | "toy twin", _:
            return problem.pareto_front()
    return even_curve(problem.pareto_front(10 * N_POINTS))
