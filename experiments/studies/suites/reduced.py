"""The compact swarm with all parts that it once had, and with some of them left out, by name.

These left it: `Attraction` among its moves; a level of violation that counts as
none (T. Takahama, S. Sakai 2006), nine tenths of the swarm's median, which shrinks as the swarm
follows; a fifth of the places for infeasible particles, the guests; `Difference`. What it does on
the way to a bound while nothing is feasible came later, so that these swarms have it not.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from experiments.studies.contest.reduced_swarms import EqualShares, NoMutation
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.hypervolume import most_hypervolume
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange, Move, NeighbourDifference
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep
from pymoo_hdte.algorithms.survival import survivors

MOVES: dict[str, type[Move]] = {
    move.__name__: move
    for move in (Attraction, Exchange, Difference, NeighbourDifference, ModelStep)
}
SHRINKING = partial(most_hypervolume, keep_ends=False)
"""The truncation of the time, which may lose the ends of a front of three objectives."""
TOLERANCE, GUESTS, LEADERS, SHARES = "tolerance", "guests", "several leaders", "learned shares"
MUTATION = "mutation"


class _Whole(CompactSwarm):
    """With all parts but those that it lacks, by name."""

    TOLERATED = 0.9
    """Share of the swarm's median violation that counts as none."""
    INVITED = 0.2
    """Share of the swarm's places for infeasible particles."""

    def __init__(
        self, pop_size: int | None = None, *, lacks: Collection[str] = (), **kwargs: Any
    ) -> None:
        moves = tuple(move() for name, move in MOVES.items() if name not in lacks)
        mutation = NoMutation() if MUTATION in lacks else None
        super().__init__(pop_size, moves=moves, mutation=mutation, quality=SHRINKING, **kwargs)
        # The moves are those of any user, who names none: with constraints without models.
        self._by_problem = True
        self.lacks = frozenset(lacks)
        if GUESTS in lacks:
            self.INVITED = 0.0
        if TOLERANCE in lacks:
            self.TOLERATED = 0.0

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        super()._initialize_advance(infills, **kwargs)
        if SHARES in self.lacks:
            self.success = EqualShares(len(self.moves))

    def _within(
        self, X: NDArray[np.float64], aims: NDArray[np.float64], swarm: Points
    ) -> NDArray[np.float64]:
        return ElitistSwarm._within(self, X, aims, swarm)

    def _front(self, swarm: Points) -> Points:
        if np.any(swarm.violation == 0.0):
            return super()._front(_tolerant(swarm, self._level(swarm)))
        if LEADERS in self.lacks:
            # While nothing is feasible, the least infeasible particle leads all.
            return ElitistSwarm._front(self, swarm)
        return super()._front(swarm)

    def _survivors(self, points: Points) -> NDArray[np.int_]:
        before = points[np.arange(len(points) - len(self.chosen))]
        points = _tolerant(points, self._level(before))
        # A callback may have left few particles: not all of them are guests.
        invited = guests(points, min(int(self.INVITED * self.pop_size), len(points) - 1))
        others = np.delete(np.arange(len(points)), invited)
        rows = survivors(points[others], self.pop_size - len(invited), self._truncation)
        return np.sort(np.concatenate([invited, others[rows]]))

    def _level(self, swarm: Points) -> float:
        """Return the violation that is tolerated: none once more than half is feasible."""
        level = self.TOLERATED * float(np.median(swarm.violation))
        return level if np.isfinite(level) else 0.0


def _tolerant(points: Points, level: float) -> Points:
    """Return the points with violations up to a level counted as none."""
    return replace(points, violation=np.where(points.violation <= level, 0.0, points.violation))


def guests(points: Points, size: int) -> NDArray[np.int_]:
    """Return at most ``size`` infeasible rows, ascending: the best in objectives and violation.

    Violation counts as a further objective, so that points stay that cross an infeasible region, or
    that come from different sides as long as nothing is feasible (H. K. Singh, A. Isaacs, T. Ray,
    W. Smith, "Infeasibility driven evolutionary algorithm (IDEA) for engineering design
    optimization", AI 2008: Advances in Artificial Intelligence, 104-115).
    """
    rows = np.flatnonzero((points.violation > 0.0) & np.isfinite(points.violation))
    if not len(rows) or size < 1:
        return rows[:0]
    keys = np.column_stack([points.F[rows], points.violation[rows]])
    free = Points(points.X[rows], keys, np.zeros(len(rows)))
    return rows[survivors(free, size)]


def _without(*lacks: str) -> Callable[[Problem], Algorithm]:
    return lambda _: _Whole(lacks=lacks)


_OF_ALL = {
    **{f"without {move}": move for move in MOVES if move != ModelStep.__name__},
    "without mutation": MUTATION,
    "with equal shares of moves": SHARES,
}
_OF_CONSTRAINED = {
    "without guests": GUESTS,
    "without tolerance": TOLERANCE,
    "with one leader": LEADERS,
}
_OF_PLAIN = {"without ModelStep": ModelStep.__name__}
LACKED = _OF_PLAIN | _OF_CONSTRAINED | _OF_ALL
"""The part that is left out alone, by the name of the swarm that lacks it."""
GROWTH = "with 50 particles"
"""Which is what the swarm grows to in 10,000 evaluations."""
ALONE = ("without ModelStep", GROWTH, *_OF_CONSTRAINED, *_OF_ALL)
"""Names of the swarms that lack one part."""
ON_PLAIN, ON_CONSTRAINED = (
    ("without ModelStep", GROWTH, *_OF_ALL),
    (*_OF_CONSTRAINED, *_OF_ALL),
)
"""Those that lack something which counts without constraints, and with them.

`ModelStep` counts on problems without constraints only.
"""
WHOLE = "with all parts"
SPREAD = "with quality=spread"

LESS: dict[str, Callable[[Problem], Algorithm]] = {
    **{name: _without(part) for name, part in LACKED.items()},
    GROWTH: lambda _: _Whole(50),
    WHOLE: lambda _: _Whole(),
    SPREAD: lambda _: CompactSwarm(quality="spread"),
}
"""The swarms by name."""
