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

from experiments.studies.fronts.front_search import FrontSearch, Solution, falling
from pymoo_hdte.problems import RobustDTETolerance
from pymoo_hdte.problems.reference import ReferenceFront
from pymoo_hdte.problems.robust_dte_tolerance import PAPERS_TOLERANCE

_BESIDE = 1e-6
"""A design closer to its level than this, relatively, is meant to be on it."""
_FAR = 0.1
"""Distance of neighbours, as a share of the search space in some variable."""
_IMPROVEMENT = 1e-10
_ACTIVE = 1e-6
"""A constraint closer than this to 0 holds a design."""


class LevelSearch(FrontSearch):
    """A search whose solutions lie on their levels exactly."""

    def best(self, level: float, starts: list[NDArray[np.float64]]) -> Solution | None:
        """Return what `below` finds from these starts, moved on to the level."""
        solutions = self.below(level, starts)
        if solutions is None:
            return None
        problem = self._problem
        design = on_level(problem, self.designs(solutions.cube), level)
        return self._solution((design - problem.xl) / self._width)


def without_local_optima(
    problem: Problem, computed: ReferenceFront, rng: np.random.Generator
) -> ReferenceFront:
    """Return a front of two objectives after `hand_over`; other rows keep their digits."""
    search = LevelSearch(problem, rng)
    cubes = (computed.designs - problem.xl) / (problem.xu - problem.xl)
    before = [Solution(*row) for row in zip(cubes, computed.front, strict=True)]
    after = list(before)
    hand_over(search, computed.front[:, 0], after)
    front, designs = computed.front.copy(), computed.designs.copy()
    for row, (old, new) in enumerate(zip(before, after, strict=True)):
        if new is not old:
            front[row], designs[row] = new.objectives, search.designs(new.cube)
    return ReferenceFront(front, designs)


def hand_over(search: LevelSearch, levels: NDArray[np.float64], solutions: list[Solution]) -> None:
    """Start each inner level from its neighbours' solutions until nothing improves.

    Only neighbours far apart are tried: one of them may be a local optimum.
    """
    inner = range(1, len(solutions) - 1)
    neighbours = [(i, i + 1) for i in reversed(inner)] + [(i, i - 1) for i in inner]
    improved = True
    while improved:
        improved = False
        for target, source in neighbours:
            mine, neighbour = solutions[target], solutions[source]
            if np.max(np.abs(mine.cube - neighbour.cube)) <= _FAR:
                continue
            solution = search.best(levels[target], [neighbour.cube])
            limit = mine.objectives[1] * (1.0 - _IMPROVEMENT)
            if solution is not None and solution.objectives[1] < limit:
                solutions[target], improved = solution, True


def on_level(problem: Problem, design: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Move a design on to a level of f1, by one Newton step along its slope in the free part.

    Active constraints keep their value to first order.

    SLSQP leaves it beside the level by some 1e-7 of the range of f1 over all designs. That is more
    than it seems: the front is far narrower than that range, and may be steep. A design well below
    its level, as in a gap of the front, stays where it is.
    """
    names = ["F", "dF", "G", "dG"] if problem.n_ieq_constr else ["F", "dF"]
    values, slopes, *limits = problem.evaluate(design, return_values_of=names)
    width = problem.xu - problem.xl
    free = (design > problem.xl) & (design < problem.xu)
    slope = np.where(free, slopes[0] * width, 0.0)
    rounding = 1e-20 * (slope @ slope)
    if limits:
        slope = _along(slope, np.where(free, limits[1] * width, 0.0)[limits[0] > -_ACTIVE])
    length = slope @ slope
    missing = level - values[0]
    if length <= rounding or missing > _BESIDE * abs(level):
        return design
    step = missing / length * slope
    return np.clip(design + step * width, problem.xl, problem.xu)


def _along(slope: NDArray[np.float64], of_limits: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the part of a slope (n_var,) that leaves constraints of slopes (m, n_var) alone."""
    weights, *_ = np.linalg.lstsq(of_limits.T, slope, rcond=None)
    return slope - weights @ of_limits


def disagreement(
    problem: Problem, computed: ReferenceFront, stored: ReferenceFront, width: NDArray[np.float64]
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
    left_end, right_end = (
        computed.front[0, 0] - stored.front[0, 0],
        computed.front[-1, 1] - stored.front[-1, 1],
    )
    levels = computed.front[1:-1, 0]
    again = _second_objective_at(problem, levels, stored.designs)
    between = np.max(np.abs(again - computed.front[1:-1, 1]), initial=0.0)
    return float(max(abs(left_end) / width[0], abs(right_end) / width[1], between / width[1]))


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
            solution = search.best(level, [start])
            if solution is not None:
                values[row] = min(values[row], solution.objectives[1])
    return values


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
    rows = np.sort(NonDominatedSorting().do(front, only_non_dominated_front=True))
    return ReferenceFront(front[rows], together[rows])


def tolerance_disagreement(
    problem: RobustDTETolerance, computed: ReferenceFront, stored: ReferenceFront
) -> float:
    """Return the largest `disagreement` at any tolerance, as a share of the width of the front."""
    width = np.ptp(computed.front, axis=0)[:2]
    return max(
        disagreement(
            problem.at_tolerance(float(tolerance)),
            _at(computed, tolerance),
            _at(stored, tolerance),
            width,
        )
        for tolerance in np.unique(computed.designs[:, -1])
    )


def _at(computed: ReferenceFront, tolerance: float) -> ReferenceFront:
    rows = computed.designs[:, -1] == tolerance
    return ReferenceFront(computed.front[rows, :2], computed.designs[rows, :-1])


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
    start, end = search.lowest(0), search.lowest(1)
    coarse = [start]
    for level in np.linspace(start.objectives[0], end.objectives[0], _COARSE_POINTS)[1:-1]:
        coarse.append(search.best(level, [coarse[-1].cube, *search.starts(level)]) or coarse[-1])
    coarse = falling([*coarse, end])
    values = np.array([solution.objectives for solution in coarse])
    steps = np.diff(values, axis=0) / np.ptp(values, axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    levels = np.interp(np.linspace(0.0, arc[-1], n_points), arc, values[:, 0])
    solutions = [start]
    for level in levels[1:-1]:
        right = int(np.searchsorted(values[:, 0], level))
        ends = coarse[right - 1].cube, coarse[right].cube
        starts = [solutions[-1].cube, (ends[0] + ends[1]) / 2.0, *ends]
        solutions.append(search.best(level, starts) or solutions[-1])
    solutions.append(end)
    hand_over(search, levels, solutions)
    return search.designs(np.array([solution.cube for solution in falling(solutions)]))
