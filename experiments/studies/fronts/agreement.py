"""How far two independent searches for one front of two objectives agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.studies.fronts.level_search import LevelSearch
from pymoo_hdte.problems.reference import ReferenceFront


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
    search = LevelSearch(problem, np.random.default_rng(0))
    firsts = problem.evaluate(designs, return_values_of=["F"])[:, 0]
    cubes = (designs - problem.xl) / (problem.xu - problem.xl)
    values = np.full(len(levels), np.inf)
    for row, level in enumerate(levels):
        nearest = int(np.searchsorted(firsts, level).clip(1, len(firsts) - 1))
        between = (cubes[nearest - 1] + cubes[nearest]) / 2.0
        # One by one, since together only the starts that look best early are followed to the end.
        for start in (cubes[nearest - 1], between, cubes[nearest]):
            found = search.best(level, [start])
            if found is not None:
                values[row] = min(values[row], found.objectives[1])
    return values
