"""Moves of an elitist swarm: where a particle steps from where it is.

In an elitist swarm a particle's position is its own best, so that the cognitive term of the
classical swarm is zero. The pull of a leader remains, here in three forms that suit different
landscapes: scaled, exact, and along differences of particles; a fourth move knows neighbours only.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Move(Protocol):
    """A rule for the steps of particles."""

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps, shape (n, d).

        Parameters
        ----------
        X : (n, d) array
            Positions of the particles that move.
        leaders : (n, d) array
            The leader of each.
        swarm : (N, d) array
            Positions of all particles; (n, k, d) those of the nearest k of each, if the move has
            an attribute ``NEIGHBOURS``, which is k.
        random_state : numpy.random.Generator
            Source of random numbers.
        """
        ...


class Attraction:
    """The social pull of a particle swarm, in half of the variables.

    A step is c r (leader - X) with c = 1.5 and r uniform in [0, 1] for every variable, so that it
    may pass the leader; a variable takes part with probability 0.5 (a whole move would disturb what
    is already right).
    """

    STRENGTH = 1.5
    TAKES_PART = 0.5

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps (n, d)."""
        pull = self.STRENGTH * random_state.random(X.shape) * (leaders - X)
        return np.where(random_state.random(X.shape) < self.TAKES_PART, pull, 0.0)


class Exchange:
    """Half of the variables take the leader's value unchanged.

    This suits good values in separate valleys, where values between two of them are bad. It is the
    exemplar of J. J. Liang, A. K. Qin, P. N. Suganthan, S. Baskar, "Comprehensive learning particle
    swarm optimizer for global optimization of multimodal functions", IEEE Transactions on
    Evolutionary Computation 10 (2006) 281-295, with a full step to it.
    """

    TAKES_PART = 0.5

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps (n, d)."""
        return np.where(random_state.random(X.shape) < self.TAKES_PART, leaders - X, 0.0)


class Difference:
    """All variables together, along the leader's direction and the difference of two particles.

    A step is c r (leader - X) + 0.5 (X_a - X_b) with c = 1.5, one uniform r a particle and a, b
    drawn from the swarm. Unlike the other moves it does not depend on the coordinate axes, which
    suits problems whose variables interact (differential evolution, "current to best": K. Price, R.
    Storn, J. Lampinen, "Differential Evolution", Springer 2005).
    """

    STRENGTH = 1.5
    SCALE = 0.5

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps (n, d)."""
        first, second = random_state.integers(len(swarm), size=(2, len(X)))
        pull = self.STRENGTH * random_state.random((len(X), 1)) * (leaders - X)
        return pull + self.SCALE * (swarm[first] - swarm[second])


class NeighbourDifference:
    """Towards a neighbour, and along the difference of two others, in all variables together.

    A step is F (X_a - X_b) + r (X_c - X) with r uniform in [0, 1] and F uniform in [0.2, 1], one of
    each a particle, and a, b, c drawn from the ``NEIGHBOURS`` that are nearest in objectives. Near
    the front the positions of neighbours follow the set of optimal positions, so that their
    differences have the size and the directions that are still useful there. The move turns with
    the coordinate axes. Differences among neighbours: H. Li, Q. Zhang, "Multiobjective optimization
    problems with complicated Pareto sets, MOEA/D and NSGA-II", IEEE Transactions on Evolutionary
    Computation 13 (2009) 284-302.
    """

    NEIGHBOURS = 12
    SMALLEST, LARGEST = 0.2, 1.0

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps (n, d); ``swarm`` (n, k, d) has the neighbours of each particle."""
        n, k, _ = swarm.shape
        a, b, c = random_state.integers(k, size=(3, n))
        rows = np.arange(n)
        scale = random_state.uniform(self.SMALLEST, self.LARGEST, size=(n, 1))
        pull = random_state.random((n, 1)) * (swarm[rows, c] - X)
        return scale * (swarm[rows, a] - swarm[rows, b]) + pull


class SparseMutation:
    """Normal steps of random length in few variables.

    Each variable changes with probability 0.5 / d, at least one in a particle that would stay
    where it is. The standard deviation is span 10^-u with u uniform in [0.3, 2.3] for every
    particle: from half of the box to half a percent of it, at all times, so that no schedule is
    needed.
    """

    RATE = 0.5
    LARGEST_EXPONENT, SMALLEST_EXPONENT = -0.3, -2.3

    def __call__(
        self,
        steps: NDArray[np.float64],
        span: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return what to add to the ``steps`` (n, d) in a box of widths ``span`` (d,)."""
        n, d = steps.shape
        struck = random_state.random((n, d)) < self.RATE / d
        still = np.flatnonzero(~(struck.any(axis=1) | steps.any(axis=1)))
        struck[still, random_state.integers(d, size=len(still))] = True
        rows, columns = np.nonzero(struck)
        exponents = random_state.uniform(self.SMALLEST_EXPONENT, self.LARGEST_EXPONENT, size=(n,))
        mutation = np.zeros((n, d))
        size = 10.0 ** exponents[rows] * span[columns]
        mutation[rows, columns] = size * random_state.standard_normal(len(rows))
        return mutation


def nearest_in_objectives(
    F: NDArray[np.float64], k: int, rows: NDArray[np.int_]
) -> NDArray[np.int_]:
    """Return for some ``rows`` of objectives ``F`` (n, m) the ``k`` nearest others, all if fewer.

    A single row is its own neighbour.

    Distances are Euclidean, in objectives scaled by their ranges; rows that are not finite lie
    together, one range beyond the largest values.
    """
    good = np.isfinite(F).all(axis=1)
    scaled = np.full(F.shape, 2.0)
    if good.any():
        lowest, span = F[good].min(axis=0), np.ptp(F[good], axis=0)
        scaled[good] = (F[good] - lowest) / np.where(span > 0.0, span, 1.0)
    distance = ((scaled[rows, np.newaxis] - scaled) ** 2).sum(axis=2)
    distance[np.arange(len(rows)), rows] = np.inf
    k = max(1, min(k, len(F) - 1))
    return np.argpartition(distance, k - 1, axis=1)[:, :k]
