"""The memory of a particle: the best position it has visited."""

from __future__ import annotations

import numpy as np

from pymoo_hdte.algorithms.dominance import dominates
from pymoo_hdte.algorithms.points import Points


def updated_personal_best(
    best: Points, visited: Points, random_state: np.random.Generator
) -> Points:
    """Return the personal bests (n rows) after a visit to new points, row for row.

    The dominating one of the two stays. If neither dominates, a fair coin decides, as in
    C. A. Coello Coello, G. T. Pulido, M. S. Lechuga, "Handling multiple objectives with particle
    swarm optimization", IEEE Transactions on Evolutionary Computation 8 (2004) 256-279.
    """
    coin = random_state.random(len(best)) < 0.5
    replace = dominates(visited, best) | (coin & ~dominates(best, visited))
    return best.replaced_by(visited, replace)
