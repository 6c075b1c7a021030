"""Refined fronts: solutions exactly on their level of f1, local optima replaced by better ones.

This settles the last digits: `FrontSearch` may stop beside a level, or at a local optimum that is
as good as the global one to six digits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.studies.fronts.front_search import FrontSearch, Solution
from pymoo_hdte.problems.reference import ReferenceFront

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
        found = self.below(level, starts)
        if found is None:
            return None
        problem = self._problem
        design = on_level(problem, self.designs(found.cube), level)
        return self._solution((design - problem.xl) / self._width)


def without_local_optima(
    problem: Problem, found: ReferenceFront, rng: np.random.Generator
) -> ReferenceFront:
    """Return a front of two objectives after `hand_over`; other rows keep their digits."""
    search = LevelSearch(problem, rng)
    cubes = (found.designs - problem.xl) / (problem.xu - problem.xl)
    before = [Solution(*row) for row in zip(cubes, found.front, strict=True)]
    after = list(before)
    hand_over(search, found.front[:, 0], after)
    front, designs = found.front.copy(), found.designs.copy()
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
            mine, other = solutions[target], solutions[source]
            if np.max(np.abs(mine.cube - other.cube)) <= _FAR:
                continue
            found = search.best(levels[target], [other.cube])
            limit = mine.objectives[1] * (1.0 - _IMPROVEMENT)
            if found is not None and found.objectives[1] < limit:
                solutions[target], improved = found, True


def on_level(problem: Problem, design: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Move a design on to a level of f1, by one Newton step along its slope in the free part.

    Active constraints keep their value to first order.

    SLSQP leaves it beside the level by some 1e-7 of the range of f1 over all designs. That is more
    than it seems: the front is far narrower than that range, and may be steep. A design well below
    its level, as in a gap of the front, stays where it is.
    """
    asked = ["F", "dF", "G", "dG"] if problem.n_ieq_constr else ["F", "dF"]
    values, slopes, *limits = problem.evaluate(design, return_values_of=asked)
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
