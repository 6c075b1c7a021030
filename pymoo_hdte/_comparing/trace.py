"""What a run has found after every evaluation: the points that nothing before them dominated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from moocore import hypervolume, is_nondominated
from numpy.typing import ArrayLike, NDArray
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from pymoo_hdte._comparing.indicators import CORNER
from pymoo_hdte._comparing.quality import TrueFront

PER_DECADE = 20
"""Budgets a decade at which a run is measured, as COCO has them."""


_BLOCK = 256
"""Points that are compared with each other at once."""


class TracingEvaluator(Evaluator):
    """Evaluates as pymoo does, and keeps the objectives of all feasible points in their order."""

    def __init__(self) -> None:
        super().__init__()
        self._objectives: list[NDArray[np.float64]] = []

    @property
    def trace(self) -> NDArray[np.float64]:
        """The feasible points that nothing before them weakly dominates, shape (k, 1 + m).

        Number of the evaluation, objectives. It is computed here, so that no run takes longer.
        """
        return improvements(np.concatenate(self._objectives))

    def _eval(
        self, problem: Problem, pop: Population, evaluate_values_of: list[Any], **kwargs: Any
    ) -> None:
        super()._eval(problem, pop, evaluate_values_of, **kwargs)
        F = pop.get("F")
        if problem.has_constraints():
            F = np.where(pop.get("feas")[:, None], F, np.nan)
        self._objectives.append(F)


def improvements(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows of ``F`` (n, m) that no earlier one weakly dominates, after their numbers.

    Rows that are not finite, such as those of infeasible points, count for nothing.
    """
    found, front = [np.empty((0, 1 + F.shape[1]))], np.empty((0, F.shape[1]))
    for start in range(0, len(F), _BLOCK):
        rows = start + np.flatnonzero(np.isfinite(F[start : start + _BLOCK]).all(axis=1))
        rows = rows[~_dominated(F[rows], front)]
        points = F[rows]
        # What an earlier point dominates, whatever dominates that one dominates as well.
        new = ~np.tril(np.all(points[None] <= points[:, None], axis=2), -1).any(axis=1)
        found.append(np.column_stack([rows[new] + 1.0, points[new]]))
        front = np.concatenate([front, points[new]])
        front = front[is_nondominated(front)] if len(front) else front
    return np.concatenate(found)


def _dominated(F: NDArray[np.float64], front: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points a front (k, m) dominates, or holds already."""
    return np.all(front[None] <= F[:, None], axis=2).any(axis=1)


def budgets(evaluations: int) -> NDArray[np.int_]:
    """Return the budgets up to a number of evaluations at which a run is measured, ascending."""
    steps = np.arange(np.floor(PER_DECADE * np.log10(evaluations)) + 1.0) / PER_DECADE
    return np.unique(np.append(np.floor(10.0**steps), evaluations).astype(int))


def hypervolumes(trace: ArrayLike, truth: TrueFront, at: ArrayLike) -> NDArray[np.float64]:
    """Return the hypervolume of all that a run had found after each budget.

    Parameters
    ----------
    trace : array_like, shape (k, 1 + m)
        Of `TracingEvaluator`; k may be 0.
    truth : TrueFront
        Normalises the objectives.
    at : array_like, shape (b,)
        Ascending budgets.

    Returns
    -------
    ndarray, shape (b,)
        In normalised objectives, up to `indicators.CORNER`.
    """
    rows = np.asarray(trace, dtype=float)
    counts, points = np.searchsorted(rows[:, 0], at, side="right"), truth.normalise(rows[:, 1:])
    corner = np.full(truth.F.shape[1], CORNER)
    # Budgets between which nothing better was found share a value.
    different, place = np.unique(counts, return_inverse=True)
    values = [hypervolume(points[:n], ref=corner) if n else 0.0 for n in different]
    return np.array(values, dtype=float)[place]


TARGETS = 10.0 ** np.linspace(-0.1, -3.0, 30)
"""Shares that may be missing of the hypervolume of the reference front.

A tenth of a decade apart, as COCO's. They end above the 0.0007 that 1,000 even points lack of the
hypervolume of a straight front of two objectives: below, the reference front is no measure.
"""


class Profile(NamedTuple):
    """Shares of targets reached (b,) by ascending budgets (b,), over all runs of an algorithm."""

    budgets: NDArray[np.int_]
    shares: NDArray[np.float64]


def profile(traces: Sequence[tuple[NDArray[np.float64], TrueFront]], evaluations: int) -> Profile:
    """Return the empirical distribution of the budgets at which runs reach `TARGETS`.

    Parameters
    ----------
    traces : sequence of (ndarray, TrueFront)
        Of every run, with the reference front of its problem.
    evaluations : int
        Largest budget.
    """
    at = budgets(evaluations)
    reached = np.zeros(len(at))
    for trace, truth in traces:
        missing = 1.0 - hypervolumes(trace, truth, at) / truth.hypervolume
        reached += (missing[:, None] <= TARGETS).mean(axis=1)
    return Profile(at, reached / len(traces))
