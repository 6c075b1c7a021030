"""The swarm to use: elitist, with moves that share the particles by their success."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.repair import NoRepair, Repair
from pymoo.core.sampling import Sampling

from pymoo_hdte.algorithms.base import Swarm, check_problem, particles_at
from pymoo_hdte.algorithms.crowding import crowding_tournaments
from pymoo_hdte.algorithms.dominance import best_front
from pymoo_hdte.algorithms.moves import (
    Attraction,
    Difference,
    Exchange,
    Move,
    SparseMutation,
    nearest_in_objectives,
)
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.success_shares import SuccessShares
from pymoo_hdte.algorithms.survival import Quality, survivors, truncation_of
from pymoo_hdte.checks import InvalidInput, real_number, whole_number

_EVALUATIONS = "n_evaluations"
_MOST_OBJECTIVES = 4
"""With five, both swarms have 1.6 times the IGD+ of NSGA-III on DTLZ2; with four, 1.2 times."""


class ElitistSwarm(Swarm):
    """A swarm that keeps the best of all it has visited, for two or three objectives.

    In a generation every particle makes one of the moves, towards a leader from the best front,
    and a sparse mutation; the best of the old and the new positions are the next swarm, thinned
    out evenly. A move gets more particles the more of them survive. There is nothing to tune and no
    schedule: a run may be stopped or continued at any generation.

    It comes from ideas for AMP-MOPSO, whose published results do not apply to it; parts that seemed
    to gain nothing in tuning, such as inertia, were removed. Not every remaining part is shown to
    help: ``python -m experiments swarm_parts`` measures what each contributes.

    With more objectives nearly all positions are non-dominated, and it falls behind algorithms with
    reference directions: on DTLZ2 its IGD+ is 1.2 times that of NSGA-III with four objectives, 1.6
    times with five and 2.2 times with six, after 10,000 evaluations.

    Parameters
    ----------
    pop_size : int
        Number of particles, at least 2.
    sampling : Sampling, array of shape (pop_size, n_var) or Population of that size, optional
        First positions, within the bounds and in the units of the problem; uniformly random by
        default.
    moves : sequence of Move, optional
        1 to 19 of them; by default `Attraction`, `Exchange` and `Difference`.
    mutation : SparseMutation, optional
        What is added to every step; by default a `SparseMutation`.
    quality : "spread", "hypervolume" or callable
        What decides which solutions of a front stay. An even spread serves IGD and IGD+ on fronts
        without a knee; the dominated hypervolume serves itself, and IGD+ on most fronts, and
        crowds solutions at knees. It counts with two and three objectives; with more, "hypervolume"
        means "spread". A callable takes objectives (n, m) and a size, and returns the rows that
        stay.
    n_offsprings : int, optional
        New positions in a generation, ``pop_size`` by default.
    repair : Repair, optional
        Repair of pymoo for positions before they are evaluated; `RoundingRepair` makes integers.
    reevaluated : float
        Share of every generation, 0 to below 1, that evaluates members of the result again, those
        first that were evaluated least often; a member then has the mean of all its evaluations.
        For objectives or constraints with noise, of which a swarm otherwise keeps lucky draws for
        ever; 0.3 is a good start.
    **kwargs
        Any other argument of `pymoo.core.algorithm.Algorithm`.

    Raises
    ------
    InvalidInput
        As `ParticleSwarm`; for no or too many moves; for a quality that is not known.
    TypeError
        For an argument that does not exist.

    Warns
    -----
    UserWarning
        From ``setup`` for more than four objectives.

    Notes
    -----
    - a leader is the less crowded of two random members of the best front;
    - a position beyond the box is cut to it;
    - how often a solution was evaluated is in its ``data["n_evaluations"]``, if more than once;
    - feasible solutions come before infeasible ones, these by total violation (Deb et al. 2002); a
      solution that is not finite comes last, copies of another one after that;
    - the result of a run is the best front of the swarm, at most ``pop_size`` solutions;
    - callbacks may change the population, which is all that the swarm knows of positions.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> found = minimize(get_problem("zdt1"), ElitistSwarm(), ("n_gen", 40), seed=1)
    >>> bool(len(found.F) > 50 and found.F.min() >= 0.0)
    True
    """

    def __init__(
        self,
        pop_size: int = 100,
        *,
        sampling: Sampling | NDArray | Population | None = None,
        moves: Sequence[Move] | None = None,
        mutation: SparseMutation | None = None,
        quality: Quality = "spread",
        n_offsprings: int | None = None,
        repair: Repair | None = None,
        reevaluated: float = 0.0,
        **kwargs: Any,
    ) -> None:
        super().__init__(pop_size, sampling, **kwargs)
        self.moves = (Attraction(), Exchange(), Difference()) if moves is None else tuple(moves)
        if not 0 < len(self.moves) < 1.0 / SuccessShares.SMALLEST:
            raise InvalidInput("number of moves", len(self.moves), "1 to 19, as each gets a share")
        self.mutation = SparseMutation() if mutation is None else mutation
        self._truncation = truncation_of(quality)
        self.n_offsprings = n_offsprings
        if n_offsprings is not None:
            self.n_offsprings = whole_number("n_offsprings", n_offsprings, at_least=1)
        self.repair = NoRepair() if repair is None else repair
        self.initialization.repair = self.repair
        self.reevaluated = real_number("reevaluated", reevaluated, at_least=0.0, below=1.0)
        self._repeated = Population.empty()

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        self._evaluated(infills)
        self.success = SuccessShares(len(self.moves))
        self.pop = infills

    def _check(self, problem: Problem) -> None:
        check_problem(problem, integers=type(self.repair) is not NoRepair)
        if problem.n_obj > _MOST_OBJECTIVES:
            warnings.warn(
                f"{type(self).__name__} is made for 2 and 3 objectives and falls far behind with "
                f"{problem.n_obj}: take NSGA-III or AGE-MOEA-II",
                UserWarning,
                stacklevel=4,
            )

    def _n_requested(self) -> int:
        started = self.is_initialized and self.n_offsprings is not None
        return self.n_offsprings if started else self.pop_size  # type: ignore[return-value]

    # Callbacks may change the population, so it is read again wherever it is used.
    def _infill(self) -> Population:
        swarm, random_state = self._points(self.pop), self.random_state
        lowest, highest = self.problem.bounds()
        # If a callback changed the length of the population, particles move in turn.
        movers = self._movers(len(swarm))
        X = swarm.X[movers]
        front = self._front(swarm)
        leaders = self._leaders(front) if len(front) else X
        self.chosen = self.success.draw(len(movers), random_state)
        steps = np.empty_like(X)
        for number, move in enumerate(self.moves):
            rows = self.chosen == number
            around = self._around(move, swarm, movers[rows])
            steps[rows] = move(X[rows], leaders[rows], around, random_state)
        exact = np.array([getattr(move, "EXACT", False) for move in self.moves])
        # A particle that stays would be evaluated twice.
        mutated = ~exact[self.chosen] | ~steps.any(axis=1)
        steps[mutated] += self.mutation(steps[mutated], highest - lowest, random_state)
        moved = particles_at(self._within(X, X + steps, swarm))
        if type(self.repair) is not NoRepair:
            moved = self.repair.do(self.problem, moved, random_state=random_state)
        return self._with_repeats(moved) if self.reevaluated else moved

    def _with_repeats(self, moved: Population) -> Population:
        """Return new positions of which the first are those of members of the result."""
        # One at least is new, from which the success of its move is learned.
        n = min(round(self.reevaluated * len(moved)), len(self.opt), len(moved) - 1)
        evaluations = [member.data.get(_EVALUATIONS, 1) for member in self.opt]
        self._repeated = self.opt[np.argsort(evaluations, kind="stable")[:n]]
        self.chosen = self.chosen[n:]
        return Population.merge(particles_at(self._repeated.get("X")), moved[n:]) if n else moved

    def _within(
        self, X: NDArray[np.float64], aims: NDArray[np.float64], swarm: Points
    ) -> NDArray[np.float64]:
        """Return ``aims`` (n, d) in the box, for which particles of a swarm head from ``X``."""
        return np.clip(aims, *self.problem.bounds())

    def _movers(self, n: int) -> NDArray[np.int_]:
        """Return which of ``n`` particles move."""
        if self._n_requested() < min(n, self.pop_size):
            return self.random_state.permutation(n)[: self._n_requested()]
        return np.arange(self._n_requested()) % n

    def _front(self, swarm: Points) -> Points:
        """Return the points that lead."""
        return swarm[best_front(swarm)]

    def _leaders(self, front: Points) -> NDArray[np.float64]:
        """Draw a leader's position for every particle that moves, shape (n, d)."""
        return front.X[crowding_tournaments(front.F, self._n_requested(), self.random_state)]

    def _around(self, move: Move, swarm: Points, rows: NDArray[np.int_]) -> NDArray[np.float64]:
        """Return the positions a move draws from: all, or the neighbours of every row."""
        k = getattr(move, "NEIGHBOURS", None)
        return swarm.X if k is None else swarm.X[nearest_in_objectives(swarm.F, k, rows)]

    def _survivors(self, points: Points) -> NDArray[np.int_]:
        """Return which of the old and the new points make up the next swarm."""
        return survivors(points, self.pop_size, self._truncation)

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        arrived = self._evaluated(infills)
        if len(self._repeated):
            self._replace(averaged(self._repeated, infills))
            arrived = self._points(infills)
        points = self._points(self.pop).followed_by(arrived)
        everyone = Population.merge(self.pop, infills)
        self._note(everyone, points)
        rows = self._survivors(points)
        survived = np.zeros(len(points), dtype=bool)
        survived[rows] = True
        self.success.learn(self.chosen, survived[-len(self.chosen) :])
        self.pop = everyone[rows]

    def _replace(self, means: dict[int, Individual]) -> None:
        """Put individuals in the places of those with other evaluations, given by ``id``."""
        self.pop = replaced(self.pop, means)

    def _note(self, everyone: Population, points: Points) -> None:
        """Take down what a swarm needs of old and new particles, before it chooses."""

    def _set_optimum(self) -> None:
        # pymoo reads the optimum in every generation, even if nothing could be judged so far.
        front = best_front(self._points(self.pop))
        self.opt = self.pop[front if len(front) else [0]]  # type: ignore[index]


def averaged(members: Population, repeats: Population) -> dict[int, Individual]:
    """Give ``repeats`` the means of their members' evaluations and their own; return by member.

    A repeat that is not finite is left out: its evaluation was lost. That of a member may have been
    as well; its repeat then takes its place as it is.
    """
    means = {}
    for member, repeat in zip(members, repeats, strict=False):
        if not _is_finite(repeat):
            continue
        means[id(member)] = repeat
        if _is_finite(member):
            n = member.data.get(_EVALUATIONS, 1)
            for name in ("F", "G", "H"):
                mean = (n * getattr(member, name) + getattr(repeat, name)) / (n + 1)
                setattr(repeat, name, mean)
            repeat.CV = None  # pymoo computes it anew
            repeat.data[_EVALUATIONS] = n + 1
    return means


def _is_finite(individual: Individual) -> bool:
    return all(np.isfinite(getattr(individual, name)).all() for name in ("F", "G", "H"))


def replaced(population: Population, means: dict[int, Individual]) -> Population:
    """Return a population with the ``means`` in the places of members, given by ``id``."""
    return Population([means.get(id(member), member) for member in population])
