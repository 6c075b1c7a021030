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


class TracingEvaluator(Evaluator):
    """Evaluates as pymoo does, and notes each feasible point that none before weakly dominates."""

    def __init__(self) -> None:
        super().__init__()
        self._spent = 0
        self._rows: list[NDArray[np.float64]] = []
        self._front: NDArray[np.float64] | None = None

    @property
    def trace(self) -> NDArray[np.float64]:
        """The points noted so far, shape (k, 1 + m): number of the evaluation, objectives."""
        return np.array(self._rows) if self._rows else np.empty((0, 0))

    def _eval(
        self, problem: Problem, pop: Population, evaluate_values_of: list[Any], **kwargs: Any
    ) -> None:
        super()._eval(problem, pop, evaluate_values_of, **kwargs)
        F, feasible = pop.get("F"), np.ravel(pop.get("feas")).astype(bool)
        front = np.empty((0, F.shape[1])) if self._front is None else self._front
        open_ = feasible & np.isfinite(F).all(axis=1) & ~_dominated(F, front)
        noted: list[NDArray[np.float64]] = []
        for row in np.flatnonzero(open_):
            if not noted or not np.all(np.array(noted) <= F[row], axis=1).any():
                noted.append(F[row])
                self._rows.append(np.concatenate([[self._spent + row + 1], F[row]]))
        if noted:
            union = np.concatenate([front, noted])
            self._front = union[is_nondominated(union)]
        self._spent += len(F)


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
    counts = np.searchsorted(rows[:, 0], at, side="right") if len(rows) else np.zeros_like(at)
    points = truth.normalise(rows[:, 1:]) if len(rows) else np.empty((0, truth.F.shape[1]))
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
