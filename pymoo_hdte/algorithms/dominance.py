"""Constrained Pareto dominance: feasible before infeasible, then objectives or violation.

Reference: K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, "A fast and elitist multiobjective genetic
algorithm: NSGA-II", IEEE Transactions on Evolutionary Computation 6 (2002) 182-197, section VI.
"""

from __future__ import annotations

import numpy as np
from moocore import is_nondominated, pareto_rank
from numpy.typing import NDArray

from pymoo_hdte.algorithms.points import Points


def dominates(first: Points, second: Points) -> NDArray[np.bool_]:
    """Say row by row whether ``first`` dominates ``second``; shape (n,)."""
    no_worse = (first.F <= second.F).all(axis=1)
    better_somewhere = (first.F < second.F).any(axis=1)
    both_feasible = (first.violation == 0) & (second.violation == 0)
    return (first.violation < second.violation) | (both_feasible & no_worse & better_somewhere)


def constrained_ranks(points: Points) -> NDArray[np.int_]:
    """Rank points by constrained non-dominated sorting, the best front being 1; shape (n,).

    Infeasible points rank after all feasible ones, by violation; equal violations share a rank.
    """
    feasible = points.violation == 0
    ranks = np.empty(len(points), dtype=int)
    if feasible.any():
        ranks[feasible] = 1 + pareto_rank(points.F[feasible])
    if not feasible.all():
        _, order = np.unique(points.violation[~feasible], return_inverse=True)
        ranks[~feasible] = ranks[feasible].max(initial=0) + 1 + order
    return ranks


def best_front(points: Points) -> NDArray[np.int_]:
    """Return the rows worth keeping: the feasible front, else the one least infeasible point.

    Among points with equal objectives (or least violation) the first stays. The answer is empty
    if no point can be judged.
    """
    feasible = np.flatnonzero(points.violation == 0)
    if len(feasible):
        return feasible[is_nondominated(points.F[feasible])]
    judged = np.flatnonzero(np.isfinite(points.violation))
    return judged[[points.violation[judged].argmin()]] if len(judged) else judged
