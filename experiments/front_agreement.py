"""How far two independent searches for one front of two objectives agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.true_front import FrontSearch
from pymoo_hdte.problems.reference import ReferenceFront

_BESIDE = 1e-6
"""A design closer to its level than this, relatively, is meant to be on it."""


def disagreement(
    problem: Problem, found: ReferenceFront, other: ReferenceFront, width: NDArray[np.float64]
) -> float:
    """Return the largest difference of two searches as a share of the width.

    It is taken in f1 and f2 at the ends, and in f2 at every level of f1 that the first has found.

    Parameters
    ----------
    problem : Problem
        Two objectives with ``dF``.
    found, other : ReferenceFront
        Sorted by f1; only the designs of the second are asked.
    width : ndarray, shape (2,)
        One unit of each objective.
    """
    first, last = found.front[0, 0] - other.front[0, 0], found.front[-1, 1] - other.front[-1, 1]
    levels = found.front[1:-1, 0]
    again = _second_objective_at(problem, levels, other.designs)
    between = np.max(np.abs(again - found.front[1:-1, 1]), initial=0.0)
    return float(max(abs(first) / width[0], abs(last) / width[1], between / width[1]))


def _second_objective_at(
    problem: Problem, levels: NDArray[np.float64], designs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the least f2 at these levels of f1, shape (n,), found from the designs of a front."""
    search = FrontSearch(problem, np.random.default_rng(0))
    firsts = problem.evaluate(designs)[:, 0]
    cubes = (designs - problem.xl) / (problem.xu - problem.xl)
    values = np.full(len(levels), np.inf)
    for row, level in enumerate(levels):
        nearest = int(np.searchsorted(firsts, level).clip(1, len(firsts) - 1))
        between = (cubes[nearest - 1] + cubes[nearest]) / 2.0
        # One by one, since together only the starts that look best early are followed to the end.
        for start in (cubes[nearest - 1], between, cubes[nearest]):
            found = search.below(level, [start])
            if found is not None:
                design = on_level(problem, search.designs(found.cube), level)
                values[row] = min(values[row], problem.evaluate(design)[1])
    return values


def on_level(problem: Problem, design: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Move a design on to a level of f1, by one Newton step along its slope in the free part.

    SLSQP leaves it beside the level by some 1e-7 of the range of f1 over all designs. That is more
    than it seems: the front is far narrower than that range, and may be steep. A design well below
    its level, as in a gap of the front, stays where it is.
    """
    values, slopes = problem.evaluate(design, return_values_of=["F", "dF"])
    width = problem.xu - problem.xl
    free = (design > problem.xl) & (design < problem.xu)
    slope = np.where(free, slopes[0] * width, 0.0)
    length = slope @ slope
    missing = level - values[0]
    if length == 0.0 or missing > _BESIDE * abs(level):
        return design
    step = missing / length * slope
    return np.clip(design + step * width, problem.xl, problem.xu)
