"""The true Pareto front of a smooth two-objective problem in a box, every disconnected piece.

For a level e of the first objective let g(e) be the least f2 with f1 <= e. The front is the graph
of g where it falls. Each g(e) is a smooth constrained problem, solved by SLSQP with exact gradients
from many starts; sweeps up and down hand solutions to neighbouring levels until nothing improves.
Levels are then halved where neighbours are far apart, which locates the gaps between pieces, and
the pieces are filled evenly in arc length.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.studies.fronts.front_search import FrontSearch, Solution

_LEVELS = 100
_IMPROVEMENT = 1e-9
_GAP = 0.02
"""Neighbours farther apart than this, in normalised objectives, belong to different pieces."""
_SPACING = 0.005
"""Neighbours closer than this need no solution between them before the pieces are filled."""
_GAP_END = 1e-7
"""To this share of the front's width the ends of a gap are located."""


def find_true_front(
    problem: Problem, n_points: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return front (n, 2) and designs (n, n_var), sorted by the first objective.

    One row if a single design is best in both objectives, else at least ``n_points`` rows, even in
    arc length of the normalised objectives along each piece.
    """
    search = FrontSearch(problem, rng)
    first, last = search.lowest(0), search.lowest(1)
    span = last.objectives - first.objectives
    if np.all(np.abs(span) <= 1e-6 * np.abs(first.objectives)):
        return first.objectives[None, :], search.designs(first.cube)[None, :]
    coarse = _sweep(search, first, last)
    knots = _refine(search, falling(coarse), span)
    filled = _fill(search, knots, span, n_points)
    front = np.array([solution.objectives for solution in filled])
    return front, search.designs(np.array([solution.cube for solution in filled]))


def _sweep(search: FrontSearch, first: Solution, last: Solution) -> list[Solution]:
    levels = np.linspace(first.objectives[0], last.objectives[0], _LEVELS)
    best = [first]
    for level in levels[1:]:
        found = search.below(level, [best[-1].cube, *search.starts(level)])
        carried = best[-1]
        better = found is not None and found.objectives[1] < carried.objectives[1]
        best.append(found if found is not None and better else carried)
    if last.objectives[1] < best[-1].objectives[1]:
        best[-1] = last
    improved = True
    while improved:
        improved = False
        neighbours = [(i, i + 1) for i in range(len(best) - 2, -1, -1)]
        neighbours += [(i + 1, i) for i in range(len(best) - 1)]
        for target, source in neighbours:
            found = search.below(levels[target], [best[source].cube])
            gain = best[target].objectives[1] - (found.objectives[1] if found else np.inf)
            if found is not None and gain > _IMPROVEMENT * abs(best[target].objectives[1]):
                best[target], improved = found, True
    return best


def falling(solutions: list[Solution]) -> list[Solution]:
    """Sort by the first objective and leave out what does not lower the second."""
    kept: list[Solution] = []
    for solution in sorted(solutions, key=lambda item: tuple(item.objectives)):
        if not kept or solution.objectives[1] < kept[-1].objectives[1]:
            kept.append(solution)
    return kept


def _distance(one: Solution, other: Solution, span: NDArray[np.float64]) -> float:
    return float(np.hypot(*((other.objectives - one.objectives) / span)))


def _refine(
    search: FrontSearch, knots: list[Solution], span: NDArray[np.float64]
) -> list[Solution]:
    """Halve the levels between distant neighbours until they are close or a gap is located.

    At a gap the solution stops changing below some level, where its branch ends, and another branch
    undercuts it above: halving then closes in on that level, and both ends are knots.
    """
    found = list(knots)
    open_pairs = [(low, low.objectives[0], high) for low, high in pairwise(knots)]
    while open_pairs:
        low, level, high = open_pairs.pop()
        upper = high.objectives[0]
        near = _distance(low, high, span) <= _SPACING
        if near or upper - level <= _GAP_END * span[0]:
            continue
        middle = (level + upper) / 2.0
        starts = [low.cube, high.cube]
        if upper - level > _SPACING * span[0]:
            starts += search.starts(middle)
        between = search.below(middle, starts)
        if between is None or between.objectives[1] >= low.objectives[1] * (1.0 - 1e-12):
            open_pairs.append((low, middle, high))
            continue
        found.append(between)
        open_pairs += [(low, level, between), (between, middle, high)]
    return falling(found)


def _fill(
    search: FrontSearch, knots: list[Solution], span: NDArray[np.float64], n_points: int
) -> list[Solution]:
    """Solve again at levels that are even in arc length along each piece."""
    steps = [_distance(one, other, span) for one, other in pairwise(knots)]
    total = sum(step for step in steps if step <= _GAP)
    filled: list[Solution] = []
    start = 0
    for stop in range(1, len(knots) + 1):
        if stop < len(knots) and steps[stop - 1] <= _GAP:
            continue
        arc = np.concatenate([[0.0], np.cumsum(steps[start : stop - 1])])
        wanted = np.linspace(0.0, arc[-1], int(np.ceil(n_points * arc[-1] / total)) + 1)
        filled += _along(search, knots[start:stop], arc, wanted)
        start = stop
    return falling(filled)


def _along(
    search: FrontSearch,
    piece: list[Solution],
    arc: NDArray[np.float64],
    wanted: NDArray[np.float64],
) -> list[Solution]:
    solutions = [piece[0], piece[-1]]
    for position in wanted[1:-1]:
        right = min(int(np.searchsorted(arc, position)), len(piece) - 1)
        left = right - 1
        share = (position - arc[left]) / (arc[right] - arc[left])
        ends = piece[left], piece[right]
        level = (1.0 - share) * ends[0].objectives[0] + share * ends[1].objectives[0]
        between = (1.0 - share) * ends[0].cube + share * ends[1].cube
        found = search.below(level, [between, ends[0].cube, ends[1].cube])
        if found is not None:
            solutions.append(found)
    return solutions
