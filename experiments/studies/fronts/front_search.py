"""The search behind true fronts: least f2 below a level of f1, by SLSQP from many starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from scipy.optimize import Bounds, NonlinearConstraint, minimize
from scipy.stats import qmc

_SAMPLES = 2**16
_STARTS = 8
_ROUGH = {"ftol": 1e-6, "maxiter": 40}
_FINE = {"ftol": 1e-12, "maxiter": 100}
_SLACK = 1e-7
"""SLSQP may end this far above a level, in units of the sampled range of f1."""
_FLAT = 1e-4
"""A variable that moves the objectives less than this, end to end, in units of their range, leaves
SLSQP no slope to follow; its ends are tried."""
_INSIDE = 1e-8
"""Constraints (allowed up to 0) are kept below 0 by this, since SLSQP ends a little beside them."""


@dataclass(frozen=True)
class Solution:
    """A design in the unit cube and its objectives."""

    cube: NDArray[np.float64]
    objectives: NDArray[np.float64]


class FrontSearch:
    """Solves for g(e) and keeps what it needs to do so well.

    Parameters
    ----------
    problem : Problem
        Two smooth objectives with ``dF``, box bounds; smooth inequality constraints of the size of
        1 with ``dG``, if any.
    rng : numpy.random.Generator
        Scrambles the Sobol points that the starts come from.
    """

    def __init__(self, problem: Problem, rng: np.random.Generator) -> None:
        self._problem = problem
        self._width = problem.xu - problem.xl
        self._bounds = Bounds(np.zeros(problem.n_var), np.ones(problem.n_var))
        cubes = qmc.Sobol(problem.n_var, rng=rng).random(_SAMPLES)
        sample, limits = problem.evaluate(self.designs(cubes), return_values_of=["F", "G"])
        allowed = np.all(limits <= 0.0, axis=1)
        self._cubes, self._sample = cubes[allowed], sample[allowed]
        self._scale = np.ptp(self._sample, axis=0)
        self._last: tuple[bytes, tuple[NDArray[np.float64], ...]] = (b"", ())
        self._limits = [
            NonlinearConstraint(
                lambda cube: self._evaluate(cube)[2],
                -np.inf,
                -_INSIDE,
                jac=lambda cube: self._evaluate(cube)[3],
            )
        ][: problem.n_ieq_constr]

    def designs(self, cube: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map points of the unit cube to designs."""
        return self._problem.xl + np.clip(cube, 0.0, 1.0) * self._width

    def _evaluate(self, cube: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        # SLSQP asks for value and slope of objective and constraint at the same point in turn.
        key = cube.tobytes()
        if key != self._last[0]:
            names = ["F", "dF", "G", "dG"] if self._limits else ["F", "dF"]
            values, slopes, *limits = self._problem.evaluate(
                self.designs(cube), return_values_of=names
            )
            scaled = [values / self._scale, slopes * self._width / self._scale[:, None]]
            if limits:
                scaled += [limits[0], limits[1] * self._width]
            self._last = key, tuple(scaled)
        return self._last[1]

    def _excess(self, cube: NDArray[np.float64]) -> float:
        """Return by how much the worst constraint is violated, 0 if none is."""
        return max(0.0, float(np.max(self._evaluate(cube)[2]))) if self._limits else 0.0

    def lowest(self, objective: int) -> Solution:
        """Return the global minimum of one objective, ties broken by the other."""
        weights = np.full(2, 1e-7)
        weights[objective] = 1.0
        order = np.argsort(self._sample[:, objective])[: 4 * _STARTS]

        def weighted(cube: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
            values, slopes = self._evaluate(cube)[:2]
            return float(weights @ values), weights @ slopes

        starts = self._cubes[order]
        ends = [self._minimise(weighted, start, _FINE, *self._limits) for start in starts]
        ends = [end for end in ends if not self._excess(end)]
        return self._solution(min(ends, key=lambda cube: weighted(cube)[0]))

    def below(self, level: float, starts: list[NDArray[np.float64]]) -> Solution | None:
        """Return the best solution with f1 <= level from these starts, or None if none got there.

        All starts are followed roughly, the better half of what they reach to the end.
        """
        on_f1 = NonlinearConstraint(
            lambda cube: self._evaluate(cube)[0][0],
            -np.inf,
            level / self._scale[0],
            jac=lambda cube: self._evaluate(cube)[1][0][None, :],
        )
        limits = [on_f1, *self._limits]

        def second(cube: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
            values, slopes = self._evaluate(cube)[:2]
            return float(values[1]), slopes[1]

        def merit(cube: NDArray[np.float64]) -> float:
            lowest, highest = self._evaluate(cube)[0]
            above = max(lowest - level / self._scale[0], 0.0)
            return float(highest + 1e3 * (above + self._excess(cube)))

        rough = [self._minimise(second, start, _ROUGH, *limits) for start in starts]
        rough.sort(key=merit)
        better = rough[: max(1, len(rough) // 2)]
        ended = [self._minimise(second, x, _FINE, *limits) for x in better]
        best = min(ended, key=merit)
        flat = [end for end in _ends(best) if abs(merit(end) - merit(best)) < _FLAT]
        ended += [self._minimise(second, x, _FINE, *limits) for x in flat]
        fine = [self._solution(x) for x in ended if not self._excess(x)]
        slack = level + _SLACK * self._scale[0]
        feasible = [solution for solution in fine if solution.objectives[0] <= slack]
        return min(feasible, key=lambda solution: solution.objectives[1], default=None)

    def _minimise(
        self,
        function: Callable[[NDArray[np.float64]], tuple[float, NDArray[np.float64]]],
        start: NDArray[np.float64],
        options: dict[str, float],
        *constraints: NonlinearConstraint,
    ) -> NDArray[np.float64]:
        result = minimize(
            function,
            start,
            jac=True,
            bounds=self._bounds,
            constraints=constraints,
            method="SLSQP",
            options=options,
        )
        return np.clip(result.x, 0.0, 1.0)

    def starts(self, level: float) -> list[NDArray[np.float64]]:
        """Return sampled designs below the level with small f2, far apart from each other."""
        order = np.argsort(np.where(self._sample[:, 0] <= level, self._sample[:, 1], np.inf))
        chosen: list[NDArray[np.float64]] = []
        for index in order[: 60 * _STARTS]:
            cube = self._cubes[index]
            if all(np.max(np.abs(cube - rival)) > 0.15 for rival in chosen):
                chosen.append(cube)
            if len(chosen) == _STARTS:
                break
        return chosen

    def _solution(self, cube: NDArray[np.float64]) -> Solution:
        return Solution(cube, self._problem.evaluate(self.designs(cube), return_values_of=["F"]))


def _ends(cube: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return copies of a design with one variable at either end of its range."""
    copies = []
    for variable in range(len(cube)):
        for end in (0.0, 1.0):
            moved = cube.copy()
            moved[variable] = end
            copies.append(moved)
    return copies


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
    start, end = search.lowest(0), search.lowest(1)
    span = end.objectives - start.objectives
    if np.all(np.abs(span) <= 1e-6 * np.abs(start.objectives)):
        return start.objectives[None, :], search.designs(start.cube)[None, :]
    coarse = _sweep(search, start, end)
    knots = _refine(search, falling(coarse), span)
    filled = _fill(search, knots, span, n_points)
    front = np.array([solution.objectives for solution in filled])
    return front, search.designs(np.array([solution.cube for solution in filled]))


def _sweep(search: FrontSearch, start: Solution, end: Solution) -> list[Solution]:
    levels = np.linspace(start.objectives[0], end.objectives[0], _LEVELS)
    best = [start]
    for level in levels[1:]:
        solution = search.below(level, [best[-1].cube, *search.starts(level)])
        carried = best[-1]
        better = solution is not None and solution.objectives[1] < carried.objectives[1]
        best.append(solution if solution is not None and better else carried)
    if end.objectives[1] < best[-1].objectives[1]:
        best[-1] = end
    improved = True
    while improved:
        improved = False
        neighbours = [(i, i + 1) for i in range(len(best) - 2, -1, -1)]
        neighbours += [(i + 1, i) for i in range(len(best) - 1)]
        for target, source in neighbours:
            solution = search.below(levels[target], [best[source].cube])
            gain = best[target].objectives[1] - (solution.objectives[1] if solution else np.inf)
            if solution is not None and gain > _IMPROVEMENT * abs(best[target].objectives[1]):
                best[target], improved = solution, True
    return best


def falling(solutions: list[Solution]) -> list[Solution]:
    """Sort by the first objective and leave out what does not lower the second."""
    kept: list[Solution] = []
    for solution in sorted(solutions, key=lambda item: tuple(item.objectives)):
        if not kept or solution.objectives[1] < kept[-1].objectives[1]:
            kept.append(solution)
    return kept


def _distance(point: Solution, rival: Solution, span: NDArray[np.float64]) -> float:
    return float(np.hypot(*((rival.objectives - point.objectives) / span)))


def _refine(
    search: FrontSearch, knots: list[Solution], span: NDArray[np.float64]
) -> list[Solution]:
    """Halve the levels between distant neighbours until they are close or a gap is located.

    At a gap the solution stops changing below some level, where its branch ends, and another branch
    undercuts it above: halving then closes in on that level, and both ends are knots.
    """
    points = list(knots)
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
        points.append(between)
        open_pairs += [(low, level, between), (between, middle, high)]
    return falling(points)


def _fill(
    search: FrontSearch, knots: list[Solution], span: NDArray[np.float64], n_points: int
) -> list[Solution]:
    """Solve again at levels that are even in arc length along each piece."""
    steps = [_distance(lower, upper, span) for lower, upper in pairwise(knots)]
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
        solution = search.below(level, [between, ends[0].cube, ends[1].cube])
        if solution is not None:
            solutions.append(solution)
    return solutions
