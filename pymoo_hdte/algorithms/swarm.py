"""The particle swarm as a pymoo algorithm, put together from exchangeable parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.individual import Individual
from pymoo.core.population import Population
from pymoo.core.sampling import Sampling

from pymoo_hdte.algorithms.archive import LeaderArchive
from pymoo_hdte.algorithms.base import Swarm, particles_at
from pymoo_hdte.algorithms.dominance import best_front, constrained_ranks, dominates
from pymoo_hdte.algorithms.horizon import generation_limit
from pymoo_hdte.algorithms.inertia import InertiaWeight
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.pyramid import Hierarchy
from pymoo_hdte.algorithms.velocity import InitialVelocity, VelocityWithinBounds
from pymoo_hdte.checks import finite_array, whole_number


class ParticleSwarm(Swarm):
    """Multi-objective particle swarm with an external archive, whose strategies are parts.

    One generation moves every particle,
    V = w V + c1 r1 (own best - X) + c2 r2 (leader - X), X = X + V + mutation, cut to the box,
    with w from ``inertia``, and c1, c2 and the mutation from ``hierarchy``. The result of a run
    (``res.F``) is the archive (paper, Section 5.1).

    Parameters
    ----------
    inertia : InertiaWeight
        Rule for w.
    hierarchy : Hierarchy
        Rule for c1, c2 and the mutation.
    initial_velocity : InitialVelocity, optional
        Law of the first velocities, within the bounds of the positions by default
        (`VelocityWithinBounds`).
    pop_size : int
        Number of particles N_p, at least 2.
    archive_size : int
        Capacity A_size of the archive, at least 2.
    n_max_gen : int, optional
        Number of generations G_max that schedules count on if the termination is not ``n_gen``.
        Without it, the limit of the termination on evaluations or generations serves (1000
        generations with pymoo's default termination and 100 particles), and 1000 with a warning if
        there is none, as with a time. It is fixed at ``setup``.
    sampling : Sampling, array of shape (pop_size, n_var) or Population of that size, optional
        First positions, within the bounds and in the units of the problem; uniformly random by
        default.
    **kwargs
        Any other argument of `pymoo.core.algorithm.Algorithm`.

    Raises
    ------
    InvalidInput
        From the constructor for a size that is not allowed; from ``setup`` for a problem with
        integer, binary or mixed variables, without finite bounds or with one objective; from
        ``ask`` for first positions or velocities that do not fit.
    TypeError
        For an argument that does not exist.

    Notes
    -----
    What the paper (Section 5.1) leaves open follows common practice; the page on the paper's
    numbers sets every printed statement beside the choice made here:

    - generation 1 is the initial sample; the move from generation t to t + 1 uses t in the
      schedules, the archive of generation t and the Pareto ranks of the swarm at generation t;
    - r1 and r2 are drawn for every particle and every dimension (Kennedy, Eberhart 1995);
    - a leader is drawn for every particle: the less crowded of two random members of the archive
      (SMPSO: Nebro et al. 2009), and the particle's own best while the archive is empty;
    - a position cut to the box keeps its velocity, and no velocity is clamped;
    - where neither the old nor the new personal best dominates, a fair coin decides (Coello Coello,
      Pulido, Lechuga 2004);
    - duplicates are solutions of equal objectives; the oldest stays;
    - crowding distances are scaled by the ranges of the front being cut, and of equal distances the
      oldest leaves;
    - feasible solutions come before infeasible ones, these by total violation, in personal bests,
      archive and ranks (Deb et al. 2002); a solution that is not finite comes last.

    Callbacks may change the population: velocity and own best travel with an individual (as ``V``
    and ``best`` of its data), and one put in enters the archive, with zero velocity. Leaders and
    own bests that have left the population keep their values if the problem changes; a callback
    must evaluate ``leaders.members`` and the ``best`` again as well. Within pymoo's
    `AdaptiveEpsilonConstraintHandling` the swarm runs, but hardly returns from violations that were
    allowed at first: on TNK, AMP-MOPSO then finds nothing feasible, while it finds a front without
    that wrapper.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> swarm = ParticleSwarm(LinearDecrease(), Pyramid(), pop_size=50)
    >>> minimize(get_problem("zdt1"), swarm, ("n_gen", 20), seed=1).F.shape[1]
    2
    """

    def __init__(
        self,
        inertia: InertiaWeight,
        hierarchy: Hierarchy,
        *,
        initial_velocity: InitialVelocity | None = None,
        pop_size: int = 100,
        archive_size: int = 50,
        n_max_gen: int | None = None,
        sampling: Sampling | NDArray | Population | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(pop_size, sampling, **kwargs)
        self.archive_size = whole_number("archive_size", archive_size, at_least=2)
        if n_max_gen is not None:
            n_max_gen = whole_number("n_max_gen", n_max_gen, at_least=1)
        self.n_max_gen = n_max_gen
        self.inertia = inertia
        self.hierarchy = hierarchy
        self.initial_velocity = initial_velocity or VelocityWithinBounds()

    def _plan(self) -> None:
        self.generations = generation_limit(self.termination, self.pop_size, self.n_max_gen)

    def _initialize_infill(self) -> Population:
        particles = super()._initialize_infill()
        X, (lowest, highest) = particles.get("X"), self.problem.bounds()
        V = self.initial_velocity(X, lowest, highest, self.random_state)
        V = finite_array("what initial_velocity returns", V, X.shape)
        return self._flying(particles, V, [None] * self.pop_size)

    def _flying(
        self, particles: Population, V: NDArray[np.float64], best: Sequence[Individual | None]
    ) -> Population:
        """Give particles velocities and own bests, None if themselves, to travel in their data."""
        for particle, velocity, own_best in zip(particles.tolist(), V, best, strict=True):
            particle.data |= {"V": velocity.copy(), "best": own_best}
        self._requested = particles
        return particles

    def _evaluated(self, infills: Population | None) -> Points:
        points = super()._evaluated(infills)
        for reported, requested in zip(infills.tolist(), self._requested.tolist(), strict=True):  # type: ignore[union-attr]
            # New individuals made from a particle's arrays lack its velocity and own best.
            if "V" not in reported.data:
                reported.data |= {"V": requested.data["V"], "best": requested.data["best"]}
        return points

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        points = self._evaluated(infills)
        self.leaders = self._empty_archive()
        self._settle(infills, points)

    def _empty_archive(self) -> LeaderArchive:
        # pymoo adds to `self.archive` by itself and truncates it with an unseeded generator.
        return LeaderArchive(self.archive_size, self.problem.n_var, self.problem.n_obj)

    def _infill(self) -> Population:
        self._admit_newcomers()
        # If a callback changed the length of the population, particles move in turn.
        particles = self.pop[np.arange(self.pop_size) % len(self.pop)]
        swarm, random_state = self._points(particles), self.random_state
        lowest, highest = self.problem.bounds()
        progress = min(1.0, (self.n_iter - 1) / self.generations)
        ranks = constrained_ranks(swarm)

        best = personal_bests(particles)
        own = np.array([individual.X for individual in best.tolist()])
        leader = self.leaders.draw(self.pop_size, random_state) if len(self.leaders) else own
        w = self.inertia(progress, self.leaders.points.F)
        c1, c2 = self.hierarchy.acceleration(ranks)
        r1, r2 = random_state.random((2, *swarm.X.shape))
        at_rest = np.zeros(swarm.X.shape[1])
        velocity = np.array([particle.data.get("V", at_rest) for particle in particles.tolist()])
        V = (
            w * velocity
            + c1[:, np.newaxis] * r1 * (own - swarm.X)
            + c2[:, np.newaxis] * r2 * (leader - swarm.X)
        )
        mutation = self.hierarchy.mutation(ranks, progress, highest - lowest, random_state)
        X = np.clip(swarm.X + V + mutation, lowest, highest)
        return self._flying(particles_at(X), V, best.tolist())

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        points = self._evaluated(infills)
        best = self._points(personal_bests(infills))
        improved = improves(best, points, self.random_state)
        for particle in infills[improved]:  # type: ignore[index]
            particle.data["best"] = None
        self._settle(infills, points)

    def _settle(self, infills: Population, points: Points) -> None:
        # A copy: individuals of the population not in `self.off` were put in by callbacks.
        self.pop = infills.copy()
        former, self.leaders = self.leaders.members, self._empty_archive()
        if len(former):
            # Compared again: callbacks may re-evaluate, constraint handling may grow stricter.
            infills = Population.merge(former, infills)
            points = self._points(former).followed_by(points)
        self.leaders.update(infills, points)

    def _admit_newcomers(self) -> None:
        known = set(map(id, self.off))
        newcomers = [particle for particle in self.pop.tolist() if id(particle) not in known]
        if newcomers:
            population = Population(newcomers)
            self.leaders.update(population, self._points(population))

    def _set_optimum(self) -> None:
        # pymoo reads the optimum in every generation, even if nothing could be judged so far.
        best = self.leaders.members
        if len(best):
            best = best[best_front(self._points(best))]
        self.opt = best if len(best) else self.pop[:1]


def personal_bests(particles: Population) -> Population:
    """Return the best individual that each particle carries in its data, itself by default."""
    return Population([particle.data.get("best") or particle for particle in particles.tolist()])


def improves(best: Points, visited: Points, random_state: np.random.Generator) -> NDArray[np.bool_]:
    """Say row by row whether a visited point becomes the personal best; shape (n,).

    The dominating one of the two stays. If neither dominates, a fair coin decides, as in
    C. A. Coello Coello, G. T. Pulido, M. S. Lechuga, "Handling multiple objectives with particle
    swarm optimization", IEEE Transactions on Evolutionary Computation 8 (2004) 256-279.
    """
    coin = random_state.random(len(best)) < 0.5
    return dominates(visited, best) | (coin & ~dominates(best, visited))
