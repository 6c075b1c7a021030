"""The compact swarm with a part left out, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from experiments.contest.reduced_swarms import EqualShares, NoMutation
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange, Move, NeighbourDifference
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep

MOVES: tuple[type[Move], ...] = (Attraction, Exchange, Difference, NeighbourDifference, ModelStep)


class _EqualSwarm(CompactSwarm):
    """Without learning which move succeeds."""

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        super()._initialize_advance(infills, **kwargs)
        self.success = EqualShares(len(self.moves))


class _NoGuests(CompactSwarm):
    """Without places for infeasible particles."""

    GUESTS = 0.0


class _NoTolerance(CompactSwarm):
    """Every violation counts."""

    TOLERATED = 0.0


class _OneLeader(CompactSwarm):
    """While nothing is feasible, the least infeasible particle leads all."""

    def _front(self, swarm: Points) -> Points:
        feasible = np.any(swarm.violation == 0.0)
        return super()._front(swarm) if feasible else ElitistSwarm._front(self, swarm)


def _without(left_out: type[Move]) -> Callable[[], Algorithm]:
    """Return what makes the swarm without a move; with constraints it has no models anyway."""

    class Fewer(CompactSwarm):
        def _plan(self) -> None:
            super()._plan()
            self.moves = tuple(move for move in self.moves if not isinstance(move, left_out))

    return Fewer


_OF_ALL: dict[str, Callable[[], Algorithm]] = {
    **{f"without {move.__name__}": _without(move) for move in MOVES if move is not ModelStep},
    "without mutation": lambda: CompactSwarm(mutation=NoMutation()),
    "with equal shares of moves": _EqualSwarm,
}
_OF_PLAIN: dict[str, Callable[[], Algorithm]] = {
    "without ModelStep": _without(ModelStep),
    "with 50 particles": lambda: CompactSwarm(50),
}
_OF_CONSTRAINED: dict[str, Callable[[], Algorithm]] = {
    "without guests": _NoGuests,
    "without tolerance": _NoTolerance,
    "with one leader": _OneLeader,
}
ON_PLAIN, ON_CONSTRAINED = (*_OF_PLAIN, *_OF_ALL), (*_OF_CONSTRAINED, *_OF_ALL)
"""Names of those that lack something which counts without and with constraints."""
SPREAD = "with quality=spread"


def _for_any(make: Callable[[], Algorithm]) -> Callable[[Problem], Algorithm]:
    return lambda _: make()


LESS: dict[str, Callable[[Problem], Algorithm]] = {
    name: _for_any(make) for name, make in (_OF_PLAIN | _OF_CONSTRAINED | _OF_ALL).items()
} | {SPREAD: lambda _: CompactSwarm(quality="spread")}
"""The swarms by name: 50 particles is what it grows to in 10,000 evaluations."""
