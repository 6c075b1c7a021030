"""What the sets of a problem are measured against: its true front, or the union of the runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_hdte._comparing.indicators import front_among
from pymoo_hdte._comparing.named import OF_PROBLEMS, problem_named
from pymoo_hdte._comparing.quality import N_POINTS, TrueFront, even_curve
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems.drive_response import OBJECTIVES

MODELS = Setting().problems
"""Drive models on which algorithms are compared, if nothing else is asked for."""


def true_front(model: str) -> NDArray[np.float64]:
    """Return the stored true front of the surrogate of a drive model, shape (n, 2)."""
    front = robust_problem(model).pareto_front()
    if front is None:
        raise RuntimeError(f"no stored front of {model}: run python -m experiments reference_front")
    return front


def reference(problem: str, fronts: Sequence[NDArray[np.float64]]) -> tuple[TrueFront, bool]:
    """Return the problem's true front, or the union of the runs if it gives none.

    Raises
    ------
    InvalidInput
        If the union has no extent either.
    """
    own = true_front(problem) if problem in MODELS else _own_front(problem_named(problem))
    if own is not None:
        return TrueFront(own), True
    union = front_among(np.concatenate(fronts))
    if len(union) < 2 or not np.all(np.ptp(union, axis=0) > 0.0):
        allowed = "a problem with a front of its own, or runs that find two different optima"
        raise InvalidInput(OF_PROBLEMS, problem, allowed)
    return TrueFront(union, in_pieces=False), False


def _own_front(problem: Problem) -> NDArray[np.float64] | None:
    """Return the front that a problem gives of itself, dense where it can be; else None."""
    try:
        front = problem.pareto_front(10 * N_POINTS) if problem.n_obj == 2 else None
    except Exception:
        # A front may take no number of points.
        front = None
    try:
        front = problem.pareto_front() if front is None else front
    except Exception:
        # A stranger's front may fail in any way; some of pymoo's are on a server.
        return None
    if front is None or len(front) < 2 or not np.all(np.ptp(front, axis=0) > 0.0):
        return None
    return even_curve(front) if len(front) > N_POINTS and problem.n_obj == 2 else front


def objective_names(problem: str) -> tuple[str, ...]:
    """Return what the axes of a problem's fronts are called."""
    named = problem_named(problem)
    own = getattr(named, "obj_names", None)
    if own == OBJECTIVES:
        return "mean DTE [arcsec]", "std of DTE [arcsec]"
    return tuple(own or (f"f{1 + i}" for i in range(named.n_obj)))
