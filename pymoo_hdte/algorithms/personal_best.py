"""The memory of a particle: the best position it has visited."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.core.population import Population

from pymoo_hdte.algorithms.dominance import dominates
from pymoo_hdte.algorithms.points import Points


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
