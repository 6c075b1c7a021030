"""The compact swarm with all parts that it once had, and with a part left out, by name.

Two parts left it by the rule of `protocol` and stand here only: `Attraction` among its moves, and a
level of violation that counts as none (T. Takahama, S. Sakai 2006), nine tenths of the swarm's
median, which shrinks as the swarm follows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from experiments.contest.reduced_swarms import EqualShares, NoMutation
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange, Move, NeighbourDifference
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep

MOVES: tuple[type[Move], ...] = (Attraction, Exchange, Difference, NeighbourDifference, ModelStep)


class _Whole(CompactSwarm):
    """With all parts."""

    TOLERATED = 0.9
    """Share of the swarm's median violation that counts as none."""
    LEFT_OUT: type[Move] | None = None

    def _plan(self) -> None:
        if not self.is_initialized:
            self.moves = tuple(move() for move in MOVES if move is not self.LEFT_OUT)
        super()._plan()

    def _front(self, swarm: Points) -> Points:
        if np.any(swarm.violation == 0.0):
            return super()._front(_tolerant(swarm, self._level(swarm)))
        return super()._front(swarm)

    def _survivors(self, points: Points) -> NDArray[np.int_]:
        before = points[np.arange(len(points) - len(self.chosen))]
        return super()._survivors(_tolerant(points, self._level(before)))

    def _level(self, swarm: Points) -> float:
        """Return the violation that is tolerated: none once more than half is feasible."""
        level = self.TOLERATED * float(np.median(swarm.violation))
        return level if np.isfinite(level) else 0.0


def _tolerant(points: Points, level: float) -> Points:
    """Return the points with violations up to a level counted as none."""
    return replace(points, violation=np.where(points.violation <= level, 0.0, points.violation))


class _EqualSwarm(_Whole):
    """Without learning which move succeeds."""

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        super()._initialize_advance(infills, **kwargs)
        self.success = EqualShares(len(self.moves))


class _NoGuests(_Whole):
    """Without places for infeasible particles."""

    GUESTS = 0.0


class _NoTolerance(_Whole):
    """Every violation counts."""

    TOLERATED = 0.0


class _OneLeader(_Whole):
    """While nothing is feasible, the least infeasible particle leads all."""

    def _front(self, swarm: Points) -> Points:
        feasible = np.any(swarm.violation == 0.0)
        return super()._front(swarm) if feasible else ElitistSwarm._front(self, swarm)


def _without(left_out: type[Move]) -> Callable[[], Algorithm]:
    """Return what makes the swarm without a move; with constraints it has no models anyway."""

    class Fewer(_Whole):
        LEFT_OUT = left_out

    return Fewer


_OF_ALL: dict[str, Callable[[], Algorithm]] = {
    **{f"without {move.__name__}": _without(move) for move in MOVES if move is not ModelStep},
    "without mutation": lambda: _Whole(mutation=NoMutation()),
    "with equal shares of moves": _EqualSwarm,
}
_OF_PLAIN: dict[str, Callable[[], Algorithm]] = {
    "without ModelStep": _without(ModelStep),
    "with 50 particles": lambda: _Whole(50),
}
_OF_CONSTRAINED: dict[str, Callable[[], Algorithm]] = {
    "without guests": _NoGuests,
    "without tolerance": _NoTolerance,
    "with one leader": _OneLeader,
}
ON_PLAIN, ON_CONSTRAINED = (*_OF_PLAIN, *_OF_ALL), (*_OF_CONSTRAINED, *_OF_ALL)
"""Names of those that lack something which counts without and with constraints."""
WHOLE = "with all parts"
SPREAD = "with quality=spread"


def _for_any(make: Callable[[], Algorithm]) -> Callable[[Problem], Algorithm]:
    return lambda _: make()


LESS: dict[str, Callable[[Problem], Algorithm]] = {
    name: _for_any(make) for name, make in (_OF_PLAIN | _OF_CONSTRAINED | _OF_ALL).items()
} | {WHOLE: lambda _: _Whole(), SPREAD: lambda _: CompactSwarm(quality="spread")}
"""The swarms by name: 50 particles is what it grows to in 10,000 evaluations."""
