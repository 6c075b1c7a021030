"""Variants of the elitist swarm for its ablation: one part removed, changed or added."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from experiments.comparing.contestants import CONTESTANTS, Contestant
from experiments.comparing.peers_pymoo import run_pymoo
from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.algorithms.dominance import best_front
from pymoo_hdte.algorithms.inertia import normalised_entropy
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange, SparseMutation
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.success_shares import SuccessShares

GRID_DIVISIONS = 32


class EqualShares(SuccessShares):
    """All moves alike, whatever their success."""

    def learn(self, moves: NDArray[np.int_], survived: NDArray[np.bool_]) -> None:
        """Keep the shares as they are."""


class EqualSwarm(ElitistSwarm):
    """Without learning which move succeeds."""

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        super()._initialize_advance(infills, **kwargs)
        self.success = EqualShares(len(self.moves))


class AnyLeaderSwarm(ElitistSwarm):
    """Leaders drawn from the best front without regard to crowding."""

    def _leaders(self, front: Points) -> NDArray[np.float64]:
        return front.X[self.random_state.integers(len(front), size=self.pop_size)]


class OneSizeMutation(SparseMutation):
    """A tenth of the box as the one standard deviation."""

    LARGEST_EXPONENT = SMALLEST_EXPONENT = -1.0


class NoMutation(SparseMutation):
    """Leave every particle to its move."""

    def __call__(
        self,
        steps: NDArray[np.float64],
        span: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return zeros (n, d)."""
        return np.zeros_like(steps)


class WholeAttraction(Attraction):
    """The pull of a classical swarm: in all variables."""

    TAKES_PART = 1.0


class ConstantInertiaSwarm(ElitistSwarm):
    """With 0.3 of the last step of every survivor added to its next, where a move touches it."""

    def _weight(self) -> float:
        return 0.3

    def _infill(self) -> Population:
        before = self._points(self.pop).X
        still = np.zeros(before.shape[1])
        steps = np.array([particle.data.get("step", still) for particle in self.pop])  # type: ignore[union-attr]
        particles = super()._infill()
        moved = np.array([particle.X for particle in particles])
        carried = np.where(moved != before, self._weight() * steps, 0.0)
        X = np.clip(moved + carried, *self.problem.bounds())
        particles.set("X", X)
        particles.set("step", X - before)
        return particles


class EntropyInertiaSwarm(ConstantInertiaSwarm):
    """The same, weighted by 0.1 + 0.4 (1 - S), S being the normalised entropy of the best front."""

    def _weight(self) -> float:
        swarm = self._points(self.pop)
        front = swarm.F[best_front(swarm)]
        return 0.1 + 0.4 * (1.0 - normalised_entropy(front, GRID_DIVISIONS))


REDUCED: dict[str, Callable[[Problem], ElitistSwarm]] = {
    "without attraction": lambda _: ElitistSwarm(moves=(Exchange(), Difference())),
    "without exchange": lambda _: ElitistSwarm(moves=(Attraction(), Difference())),
    "without difference": lambda _: ElitistSwarm(moves=(Attraction(), Exchange())),
    "equal shares of moves": lambda _: EqualSwarm(),
    "without mutation": lambda _: ElitistSwarm(mutation=NoMutation()),
    "mutation of one size": lambda _: ElitistSwarm(mutation=OneSizeMutation()),
    "crowding truncation": lambda _: ElitistSwarm(quality=least_crowded),
    "leaders at random": lambda _: AnyLeaderSwarm(),
    "attraction in all variables": lambda _: ElitistSwarm(
        moves=(WholeAttraction(), Exchange(), Difference())
    ),
    "with constant inertia": lambda _: ConstantInertiaSwarm(),
    "with entropy inertia": lambda _: EntropyInertiaSwarm(),
}
"""Variants by what is missing, changed or added; all with 100 particles."""

SWARM_VARIANTS = {
    name: Contestant("pymoo_hdte", partial(run_pymoo, make)) for name, make in REDUCED.items()
}
"""They compete with the whole swarm alone."""

EVERYONE = CONTESTANTS | SWARM_VARIANTS
