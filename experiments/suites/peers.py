"""Who takes part, by name: those of ``peers``, the compact swarm, and four more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.ctaea import CTAEA
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.util.ref_dirs import get_reference_directions

from experiments.contest.contestants import CONTESTANTS, Contestant, of_jmetal
from experiments.contest.offer import POPULATION, Offer
from experiments.contest.peers_pymoo import OWN, PYMOO, run_pymoo
from experiments.suites.coco import StartBox
from pymoo_hdte.algorithms import CompactSwarm

OURS = "CompactSwarm"


@cache
def _directions(n_obj: int) -> NDArray[np.float64]:
    return get_reference_directions("energy", n_obj, POPULATION, seed=1)


def _como(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    # Imported where it is used, because the extra may be absent.
    from experiments.contest.peers_como import run_como

    return run_como(problem, budgets, seed)


MADE: dict[str, Callable[[Problem], Algorithm]] = {
    OURS: lambda _: CompactSwarm(),
    **{name: make for name, (make, _) in OWN.items()},
    **PYMOO,
    "C-TAEA": lambda problem: CTAEA(_directions(problem.n_obj)),
}
"""Those that come with pymoo's interface, which can be told where to start."""


def _started(make: Callable[[Problem], Algorithm], problem: Problem) -> Algorithm:
    """Make an algorithm that starts in the box ``start`` of the problem."""
    algorithm = make(problem)
    algorithm.initialization.sampling = StartBox()
    return algorithm


PEERS: dict[str, Contestant] = {
    OURS: Contestant("pymoo_hdte", partial(run_pymoo, MADE[OURS]), starts_anew=True),
    **CONTESTANTS,
    "GDE3": Contestant("jmetal", of_jmetal("GDE3")),
    "MOEA/D-DE": Contestant("jmetal", of_jmetal("MOEA/D-DE"), takes_constraints=False),
    "COMO-CMA-ES": Contestant("comocma", _como, takes_constraints=False, two_objectives_only=True),
    "C-TAEA": Contestant("pymoo", partial(run_pymoo, MADE["C-TAEA"])),
}
"""On problems whose first positions may lie anywhere in the box."""

BBOB_PEERS: dict[str, Contestant] = {
    name: Contestant(
        PEERS[name].library,
        partial(run_pymoo, partial(_started, make)),
        starts_anew=PEERS[name].starts_anew,
    )
    for name, make in MADE.items()
} | {"COMO-CMA-ES": PEERS["COMO-CMA-ES"]}
"""On bbob-biobj, where first positions lie in a part of the box: those that can be told so."""


def takes(algorithm: str, problem: Problem) -> bool:
    """Say whether an algorithm takes the problem at all."""
    peer = PEERS[algorithm]
    return (peer.takes_constraints or not problem.has_constraints()) and (
        problem.n_obj == 2 or not peer.two_objectives_only
    )
