"""The true front of `RobustDTETolerance`, on its surrogate: one of two objectives per tolerance.

The cost depends on the tolerance alone. At a given cost the problem is therefore one of two
objectives in four variables, and the front is the union of those at all costs, less the points that
a cheaper tolerance dominates.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from tqdm import tqdm

from experiments.studies.fronts.agreement import disagreement
from experiments.studies.fronts.front_search import FrontSearch
from experiments.studies.fronts.level_search import LevelSearch, hand_over
from experiments.studies.fronts.true_front import falling
from pymoo_hdte.problems import RobustDTETolerance
from pymoo_hdte.problems.reference import ReferenceFront
from pymoo_hdte.problems.robust_dte_tolerance import PAPERS_TOLERANCE

TOLERANCES = 40
POINTS = 50
"""On the front at each tolerance."""

_COARSE_POINTS = 30
_FINE_GRID = 1000
_DECIMALS = 6


def find_tolerance_front(problem: RobustDTETolerance, rng: np.random.Generator) -> ReferenceFront:
    """Return the front, sorted by tolerance and then by mean."""
    designs = []
    for tolerance in tqdm(_even_tolerances(problem), desc="tolerances", leave=False):
        at_tolerance = problem.at_tolerance(float(tolerance))
        chosen = front_designs(at_tolerance, POINTS, rng)
        designs.append(np.column_stack([chosen, np.full(len(chosen), tolerance)]))
    together = np.vstack(designs)
    front = problem.evaluate(together)
    kept = np.sort(NonDominatedSorting().do(front, only_non_dominated_front=True))
    return ReferenceFront(front[kept], together[kept])


def tolerance_disagreement(
    problem: RobustDTETolerance, found: ReferenceFront, other: ReferenceFront
) -> float:
    """Return the largest `disagreement` at any tolerance, as a share of the width of the front."""
    width = np.ptp(found.front, axis=0)[:2]
    return max(
        disagreement(
            problem.at_tolerance(float(tolerance)),
            _at(found, tolerance),
            _at(other, tolerance),
            width,
        )
        for tolerance in np.unique(found.designs[:, -1])
    )


def _at(found: ReferenceFront, tolerance: float) -> ReferenceFront:
    rows = found.designs[:, -1] == tolerance
    return ReferenceFront(found.front[rows, :2], found.designs[rows, :-1])


def _even_tolerances(problem: RobustDTETolerance) -> NDArray[np.float64]:
    """Return tolerances between which both ends of the front move equally far on average.

    Distances are in normalised objectives, for the designs that are best at the middle tolerance.
    The nearest to the paper's tolerance is the paper's.
    """
    grid = np.linspace(problem.xl[-1], problem.xu[-1], _FINE_GRID)
    search = FrontSearch(problem.at_tolerance(float(np.median(grid))), np.random.default_rng(0))
    ends = search.designs(np.array([search.lowest(objective).cube for objective in (0, 1)]))
    designs = [np.column_stack([np.tile(end, (_FINE_GRID, 1)), grid]) for end in ends]
    paths = np.array([problem.evaluate(path) for path in designs])
    width = np.ptp(paths, axis=(0, 1))
    steps = np.linalg.norm(np.diff(paths, axis=1) / width, axis=2).sum(axis=0)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.interp(np.linspace(0.0, arc[-1], TOLERANCES), arc, grid)
    even[np.argmin(np.abs(even - PAPERS_TOLERANCE))] = PAPERS_TOLERANCE
    return np.round(even, _DECIMALS)


def front_designs(problem: Problem, n_points: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the designs of a front of two objectives, about even in arc length.

    Gaps are part of that length, so that their ends are known to one step.
    """
    search = LevelSearch(problem, rng)
    first, last = search.lowest(0), search.lowest(1)
    coarse = [first]
    for level in np.linspace(first.objectives[0], last.objectives[0], _COARSE_POINTS)[1:-1]:
        coarse.append(search.best(level, [coarse[-1].cube, *search.starts(level)]) or coarse[-1])
    coarse = falling([*coarse, last])
    values = np.array([solution.objectives for solution in coarse])
    steps = np.diff(values, axis=0) / np.ptp(values, axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    levels = np.interp(np.linspace(0.0, arc[-1], n_points), arc, values[:, 0])
    solutions = [first]
    for level in levels[1:-1]:
        right = int(np.searchsorted(values[:, 0], level))
        ends = coarse[right - 1].cube, coarse[right].cube
        starts = [solutions[-1].cube, (ends[0] + ends[1]) / 2.0, *ends]
        solutions.append(search.best(level, starts) or solutions[-1])
    solutions.append(last)
    hand_over(search, levels, solutions)
    return search.designs(np.array([solution.cube for solution in falling(solutions)]))
