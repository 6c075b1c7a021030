"""The particle swarm as a pymoo algorithm, put together from exchangeable parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.sampling import Sampling

from pymoo_hdte.algorithms.archive import LeaderArchive
from pymoo_hdte.algorithms.base import Swarm, particles_at
from pymoo_hdte.algorithms.dominance import constrained_ranks
from pymoo_hdte.algorithms.horizon import generation_limit
from pymoo_hdte.algorithms.inertia import InertiaWeight
from pymoo_hdte.algorithms.personal_best import updated_personal_best
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.pyramid import Hierarchy
from pymoo_hdte.checks import whole_number


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
    pop_size : int
        Number of particles N_p, at least 2.
    archive_size : int
        Capacity A_size of the archive, at least 2.
    n_max_gen : int, optional
        Number of generations G_max that schedules count on if the termination is not ``n_gen``.
        Without it, the limit of the termination on evaluations or generations serves (1000
        generations with pymoo's default termination and 100 particles). It is fixed at ``setup``.
    sampling : Sampling, array of shape (pop_size, n_var) or Population of that size, optional
        First positions, within the bounds and in the units of the problem; uniformly random by
        default.
    **kwargs
        Any other argument of `pymoo.core.algorithm.Algorithm`.

    Raises
    ------
    InvalidInput
        From the constructor for a size that is not allowed; from ``setup`` for a problem with
        integer, binary or mixed variables, without finite bounds or with one objective, or if
        nothing tells G_max; from ``ask`` for first positions that do not fit.
    TypeError
        For an argument that does not exist.

    Notes
    -----
    What the paper (Section 5.1) leaves open is settled as the field does:

    - generation 1 is the initial sample; the move from generation t to t + 1 uses t in the
      schedules, the archive of generation t and the Pareto ranks of the swarm at generation t;
    - r1 and r2 are drawn for every particle and every dimension (Kennedy, Eberhart 1995);
    - a leader is drawn for every particle: the less crowded of two random members of the archive
      (SMPSO: Nebro et al. 2009), and the particle's own best while the archive is empty;
    - first velocities are uniform such that the first step would end within the box (SPSO 2011:
      Clerc 2012); a velocity drawn from the box of the positions itself would depend on the origin;
    - a position cut to the box keeps its velocity, and no velocity is clamped;
    - where neither the old nor the new personal best dominates, a fair coin decides (Coello Coello,
      Pulido, Lechuga 2004);
    - duplicates are solutions of equal objectives; the oldest stays;
    - crowding distances are scaled by the ranges of the front being cut, and of equal distances the
      oldest leaves;
    - feasible solutions come before infeasible ones, these by total violation, in personal bests,
      archive and ranks (Deb et al. 2002); a solution that is not finite comes last.
    """

    def __init__(
        self,
        inertia: InertiaWeight,
        hierarchy: Hierarchy,
        *,
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

    def _setup(self, problem: Problem, **kwargs: Any) -> None:
        super()._setup(problem, **kwargs)
        self.generations = generation_limit(self.termination, self.pop_size, self.n_max_gen)
        # pymoo adds to `self.archive` by itself and truncates it with an unseeded generator.
        self.leaders = LeaderArchive(self.archive_size, problem.n_var, problem.n_obj)

    def _initialize_infill(self) -> Population:
        particles = super()._initialize_infill()
        X = particles.get("X")
        lowest, highest = self.problem.bounds()
        self.next_velocity = self.random_state.uniform(lowest - X, highest - X)
        particles.set("V", self.next_velocity)
        return particles

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        self.personal_best = self._evaluated(infills)
        self._settle(infills, self.personal_best)

    def _infill(self) -> Population:
        swarm, random_state = self.swarm, self.random_state
        lowest, highest = self.problem.bounds()
        progress = min(1.0, (self.n_iter - 1) / self.generations)
        ranks = constrained_ranks(swarm)

        own = self.personal_best.X
        leader = self.leaders.draw(self.pop_size, random_state) if len(self.leaders) else own
        w = self.inertia(progress, self.leaders.points.F)
        c1, c2 = self.hierarchy.acceleration(ranks)
        r1, r2 = random_state.random((2, *swarm.X.shape))
        V = (
            w * self.velocity
            + c1[:, np.newaxis] * r1 * (own - swarm.X)
            + c2[:, np.newaxis] * r2 * (leader - swarm.X)
        )
        mutation = self.hierarchy.mutation(ranks, progress, highest - lowest, random_state)
        self.next_velocity = V
        particles = particles_at(np.clip(swarm.X + V + mutation, lowest, highest))
        for particle, velocity in zip(particles, V, strict=True):
            particle.data["V"] = velocity.copy()
        return particles

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        points = self._evaluated(infills)
        self.personal_best = updated_personal_best(self.personal_best, points, self.random_state)
        self._settle(infills, points)

    def _settle(self, infills: Population, points: Points) -> None:
        self.pop, self.swarm, self.velocity = infills, points, self.next_velocity
        self.leaders.update(infills, points)

    def _set_optimum(self) -> None:
        # pymoo reads the optimum in every generation, even if nothing could be judged so far.
        self.opt = self.leaders.members if len(self.leaders) else self.pop[:1]
