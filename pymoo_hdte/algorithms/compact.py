"""The swarm for few evaluations: it starts small and grows, beside an archive of all it found."""

from __future__ import annotations

import copy
import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.core.result import Result
from pymoo.core.sampling import Sampling

from pymoo_hdte.algorithms.archive import FrontArchive
from pymoo_hdte.algorithms.base import twin
from pymoo_hdte.algorithms.dominance import best_front
from pymoo_hdte.algorithms.elitist import ElitistSwarm, replaced
from pymoo_hdte.algorithms.horizon import evaluation_limit
from pymoo_hdte.algorithms.moves import Exchange, Move, NeighbourDifference
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.algorithms.survival import Quality
from pymoo_hdte.checks import whole_number

SMALLEST, LARGEST = 10, 100
"""Smallest and largest number of particles of a swarm that grows."""
_AT_ONCE = 10
"""Generations after which what they found enters the archive of all."""


def size_for(evaluations: float) -> int:
    """Return half the square root of a number of evaluations, within 10 and 100 particles.

    Particles and generations then grow alike: 11 particles after 500 evaluations, 22 after 2,000,
    50 after 10,000 and 79 after 25,000.
    """
    return round(min(max(math.sqrt(min(evaluations, 1e9)) / 2.0, SMALLEST), LARGEST))


def evaluations_of(generations: int) -> int:
    """Return the evaluations of a number of generations of a swarm that grows."""
    spent = 0
    for _ in range(generations):
        spent += size_for(spent)
    return spent


class CompactSwarm(ElitistSwarm):
    """An `ElitistSwarm` that starts small and grows, and whose result does not depend on its size.

    A small swarm comes near the front with few evaluations, a large one spreads along it. As the
    size follows from the evaluations made so far, no budget has to be known: a run may be stopped
    or continued at any time. All that it finds is offered to two archives: the result, which
    `quality` thins out in every generation, and `archive_all`. Of the moves of `ElitistSwarm` it
    has `Exchange`; with it go a move among neighbours, `NeighbourDifference` (after Li, Zhang
    2009), and one by quadratic models of the objectives, `ModelStep`, for variables that depend on
    each other.

    Parameters
    ----------
    pop_size : int, optional
        Number of particles, at least 2, which stays if it is given here or by an array or a
        Population as ``sampling``. By default half the square root of the number of evaluations
        made so far, within 10 and 100; with constraints, of the number that the termination
        allows, from the beginning (100 if it names none), because a few particles would settle on
        one side of an infeasible gap.
    n_result : int
        Largest number of solutions in the result, at least 1.
    n_archive : int
        Largest number of solutions that `archive_all` remembers, at least ``n_result``; a thousand
        cost some tenths of a millisecond a generation.
    quality : "spread", "hypervolume" or callable
        As of `ElitistSwarm`, for the swarm and for the result.
    sampling, moves, **kwargs
        As of `ElitistSwarm`; by default `Exchange`, `NeighbourDifference` and `ModelStep`.

    Raises
    ------
    InvalidInput
        As `ElitistSwarm`, and for sizes that are not allowed.
    TypeError
        For an argument that does not exist.

    Warns
    -----
    UserWarning
        From ``setup`` for more than four objectives, and for a number of generations as the limit
        of a swarm that grows: its generations are small, so that 100 of them are 1,217 evaluations.
    RuntimeWarning
        If no solution could be judged, for want of finite objectives and constraints; the result
        is empty then.

    Notes
    -----
    - as long as nothing is feasible, the less infeasible half of the swarm leads, and half of the
      variables that would pass a bound stop on the way to it, so that a feasible region near a
      bound is approached by ever smaller steps;
    - the result is feasible as pymoo defines it, with equalities met to 1e-4;
    - the models know objectives only: with constraints they led away from feasible regions (MW:
      feasible in 26 of 29 runs in place of 29), so that `ModelStep` is not among the moves there
      unless ``moves`` names it;
    - the models are solved by BLAS, so that the same seed gives the same bytes on the same kind of
      processor with the same number of its threads;
    - archives and models know what was evaluated: a callback that changes the problem has to
      evaluate the individuals of `archive_all` and of ``opt`` again, and the models forget the old
      problem in a thousand evaluations.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> found = minimize(get_problem("zdt1"), CompactSwarm(), ("n_eval", 1000), seed=1).F
    >>> 20 <= len(found) <= 100
    True
    """

    def __init__(
        self,
        pop_size: int | None = None,
        *,
        n_result: int = 100,
        n_archive: int = 1000,
        quality: Quality = "hypervolume",
        sampling: Sampling | NDArray | Population | None = None,
        moves: tuple[Move, ...] | None = None,
        **kwargs: Any,
    ) -> None:
        if pop_size is None and isinstance(sampling, np.ndarray):
            pop_size = len(sampling)
        self._by_problem = moves is None
        if moves is None:
            moves = (Exchange(), NeighbourDifference(), ModelStep())
        size = LARGEST if pop_size is None else pop_size
        super().__init__(size, sampling=sampling, moves=moves, quality=quality, **kwargs)
        self._by_budget, self._grows, self._spent = pop_size is None, False, 0
        self.n_result = whole_number("n_result", n_result, at_least=1)
        self.n_archive = whole_number("n_archive", n_archive, at_least=self.n_result)
        # Thinning out a thousand takes longer than a generation: a quarter at once makes it rare.
        self._front_archive = FrontArchive(
            self.n_archive, most_spread, thinned_to=1 + 3 * self.n_archive // 4
        )
        self._offered = FrontArchive(self.n_result, self._truncation)
        self._waiting: list[Population] = []

    def _plan(self) -> None:
        if self.is_initialized:
            return
        constrained = self.problem.has_constraints()
        self._grows = self._by_budget and not constrained
        if self._by_budget:
            allowed = evaluation_limit(self.termination) if constrained else 0.0
            self.pop_size = size_for(allowed)
        n_gen = getattr(self.termination, "n_max_gen", None)
        if self._grows and n_gen is not None:
            warnings.warn(
                f"{n_gen} generations of a {type(self).__name__} are {evaluations_of(n_gen)} "
                "evaluations, since it starts small and grows: stop by ('n_eval', n)",
                UserWarning,
                stacklevel=4,
            )
        if self._by_problem and constrained:
            self.moves = tuple(move for move in self.moves if not isinstance(move, ModelStep))

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        super()._initialize_advance(infills, **kwargs)
        self._learners = [move for move in self.moves if isinstance(move, ModelStep)]
        lowest, highest = self.problem.bounds()
        points = self._points(self.pop)
        for move in self._learners:
            move.forget(highest - lowest)
            move.learn(points)
        self._spent = len(points)
        self._remember(self.pop, points)

    def _replace(self, means: dict[int, Individual]) -> None:
        super()._replace(means)
        for archive in (self._offered, self._front_archive):
            archive.members = replaced(archive.members, means)
        self._waiting = [replaced(waiting, means) for waiting in self._waiting]

    def _note(self, everyone: Population, points: Points) -> None:
        self._spent += self._n_requested()
        if self._grows:
            self.pop_size = size_for(self._spent)
        for move in self._learners:
            move.learn(points[-len(self.chosen) :])
        # Callbacks may have put in individuals that nobody asked for.
        self._remember(everyone, points)

    def _remember(self, population: Population, points: Points) -> None:
        front = best_front(points)
        self._offered.update(population[front], self.problem.has_constraints())
        if len(front):
            self._waiting.append(population[front])
        if len(self._waiting) == _AT_ONCE:
            self._enter(self._front_archive)
            self._waiting = []

    def _enter(self, archive: FrontArchive) -> None:
        """Offer to an archive what waits for it."""
        if self._waiting:
            waiting = Population.merge(Population.empty(), Population.empty(), *self._waiting)
            archive.update(waiting, self.problem.has_constraints())

    def _within(
        self, X: NDArray[np.float64], aims: NDArray[np.float64], swarm: Points
    ) -> NDArray[np.float64]:
        cut = super()._within(X, aims, swarm)
        if np.any(swarm.violation == 0.0):
            return cut
        # What is feasible may lie along a bound and be thinner than any step of the mutation.
        beyond = np.nonzero(cut != aims)
        shares = 2.0 * self.random_state.random(len(beyond[0]))
        stops = X[beyond] + shares * (cut[beyond] - X[beyond])
        cut[beyond] = np.where(shares < 1.0, stops, cut[beyond])
        return super()._within(X, cut, swarm)  # a stop may be off by a rounding

    def _front(self, swarm: Points) -> Points:
        if np.any(swarm.violation == 0.0):
            return super()._front(swarm)
        judged = swarm[np.flatnonzero(np.isfinite(swarm.violation))]
        return judged[np.argsort(judged.violation, kind="stable")[: max(1, len(judged) // 2)]]

    def __deepcopy__(self, memo: dict[int, Any]) -> CompactSwarm:
        """Return a copy with particles of its own, which shares arrays and what is archived.

        A history has a copy for every generation, and there are more of them than in other swarms.
        """
        own = [self.pop, self.opt, self._offered.members, *self._waiting]
        for particle in self._front_archive.members:
            memo[id(particle)] = particle
        for population in own:
            for particle in () if population is None else population.tolist():
                if memo.get(id(particle), particle) is particle:
                    memo[id(particle)] = twin(particle)
        other = object.__new__(type(self))
        memo[id(self)] = other
        other.__dict__ |= copy.deepcopy(self.__dict__, memo)
        return other

    def archive_all(self) -> Population:
        """Return all non-dominated feasible solutions found, at most ``n_archive``, thinned out."""
        archive = copy.copy(self._front_archive)
        self._enter(archive)
        return archive.members.copy()

    def _set_optimum(self) -> None:
        if len(self._offered):
            self.opt = self._offered.members.copy()
        else:
            super()._set_optimum()

    def result(self) -> Result:
        """Return the result, empty if nothing could be judged."""
        result = super().result()
        if self.opt is not None and not np.isfinite(self._points(self.opt).violation).any():
            reason = "no objective was finite, or no constraint: the result is empty"
            warnings.warn(reason, RuntimeWarning, 2)
            result.opt = result.X = result.F = result.CV = result.G = result.H = None
        return result
