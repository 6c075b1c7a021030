"""Who takes part, by name: those of ``peers``, the compact swarm, and four more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.ctaea import CTAEA
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.algorithm import Algorithm
from pymoo.core.callback import Callback
from pymoo.core.problem import Problem
from pymoo.util.ref_dirs import get_reference_directions

from experiments.comparing.contestants import CONTESTANTS, Contestant, of_jmetal
from experiments.comparing.peers_pymoo import (
    OWN,
    POPULATION,
    PYMOO,
    EndingAGEMOEA2,
    Offer,
    at_budgets,
    run_pymoo,
)
from experiments.studies.suites.coco import StartBox
from experiments.studies.suites.reduced import LESS
from pymoo_hdte._comparing.indicators import front_among
from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.algorithms.compact import size_for

OURS = "CompactSwarm"

KERNELS = 10
"""Of COMO-CMA-ES, each a CMA-ES of its own."""
STEP = 0.2
"""First step size, as a part of the box in which first positions are drawn."""


@cache
def _directions(n_obj: int) -> NDArray[np.float64]:
    return get_reference_directions("energy", n_obj, POPULATION, seed=1)


def _como(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    """Run several CMA-ES that share the hypervolume; return the front of all points evaluated.

    It needs to be told a point that bounds the hypervolume: ``problem.reference`` (2,), the corner
    to which the experiment measures, which no other algorithm here knows.
    """
    # Imported where it is used, because the extra may be absent.
    import comocma

    # Kernels draw from numpy's global generator; nothing else in this process uses it.
    np.random.seed(seed)  # noqa: NPY002
    low, high = problem.start
    bounds = [problem.xl.tolist(), problem.xu.tolist()]
    options = {"bounds": bounds, "verbose": -9, "seed": np.nan, "CMA_stds": high - low}
    places = [np.random.uniform(low, high) for _ in range(KERNELS)]  # noqa: NPY002
    kernels = comocma.get_cmas(places, STEP, inopts=options)
    optimiser = comocma.Sofomore(kernels, reference_point=list(problem.reference))
    fronts, spent, offers = [np.empty((0, 2))], 0, []
    designs = optimiser.ask()
    for budget in budgets:
        while spent + len(designs) <= budget and not optimiser.stop():
            F = problem.evaluate(np.array(designs), return_values_of=["F"])
            fronts.append(F)
            spent += len(designs)
            optimiser.tell(designs, F.tolist())
            designs = optimiser.ask()
        fronts = [front_among(np.concatenate(fronts))]
        offers.append(Offer(fronts[0], spent))
    return offers


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


SIZED = ", sized to the budget, with an archive"


class _Everything(Callback):
    """Keeps the front of all that was evaluated."""

    def __init__(self, n_obj: int) -> None:
        super().__init__()
        self.front = np.empty((0, n_obj))

    def notify(self, algorithm: Algorithm) -> None:
        """Add the new points."""
        new = algorithm.off if algorithm.off is not None else algorithm.pop
        self.front = front_among(np.vstack([self.front, new.get("F")]))


def _sized(
    make: Callable[..., Algorithm], problem: Problem, budgets: Sequence[int], seed: int
) -> list[Offer]:
    """Run a rival with as many individuals as ours has for the budget; offer all that it found."""
    offers = []
    for budget in budgets:
        algorithm, everything = make(pop_size=size_for(budget)), _Everything(problem.n_obj)
        algorithm.callback = everything
        for _ in at_budgets(algorithm, problem, (budget,), seed):
            offers.append(Offer(everything.front, algorithm.evaluator.n_eval))
    return offers


RIVALS: dict[str, Callable[..., Algorithm]] = {
    "NSGA-II": NSGA2,
    "SMS-EMOA": SMSEMOA,
    "AGE-MOEA-II": EndingAGEMOEA2,
}
"""The rivals that are run in both sizes."""

OF_OUR_SIZE: dict[str, Contestant] = {
    name + SIZED: Contestant("pymoo", partial(_sized, make), starts_anew=True)
    for name, make in RIVALS.items()
}
"""The same with as many individuals as ours has, and what they found in all; no constraints."""

PEERS: dict[str, Contestant] = {
    OURS: Contestant("pymoo_hdte", partial(run_pymoo, MADE[OURS]), starts_anew=True),
    **CONTESTANTS,
    "GDE3": Contestant("jmetal", of_jmetal("GDE3")),
    "MOEA/D-DE": Contestant("jmetal", of_jmetal("MOEA/D-DE"), takes_constraints=False),
    "COMO-CMA-ES": Contestant("comocma", _como, takes_constraints=False, two_objectives_only=True),
    "C-TAEA": Contestant("pymoo", partial(run_pymoo, MADE["C-TAEA"])),
}
"""On problems whose first positions may lie anywhere in the box.

Ours starts anew for each budget, because its size follows from that where there are constraints;
without them the shorter run is the beginning of the longer one.
"""

BBOB_PEERS: dict[str, Contestant] = {
    name: Contestant(
        PEERS[name].library,
        partial(run_pymoo, partial(_started, make)),
        starts_anew=PEERS[name].starts_anew and name != OURS,
    )
    for name, make in MADE.items()
} | {
    "COMO-CMA-ES": PEERS["COMO-CMA-ES"],
    **{
        name + SIZED: Contestant(
            "pymoo", partial(_sized, partial(make, sampling=StartBox())), starts_anew=True
        )
        for name, make in RIVALS.items()
    },
}
"""On bbob-biobj, where first positions lie in a part of the box: those that can be told so."""

ON_BBOB: dict[str, Contestant] = BBOB_PEERS | {
    name: Contestant("pymoo_hdte", partial(run_pymoo, partial(_started, make)))
    for name, make in LESS.items()
}
"""Peers on bbob-biobj, and our swarm with a part left out."""
ON_SUITES: dict[str, Contestant] = (PEERS | OF_OUR_SIZE) | {
    name: Contestant("pymoo_hdte", partial(run_pymoo, make), starts_anew=True)
    for name, make in LESS.items()
}
"""The same on the other suites."""


def takes(algorithm: str, problem: Problem) -> bool:
    """Say whether an algorithm takes the problem at all."""
    peer = ON_SUITES[algorithm]
    return (peer.takes_constraints or not problem.has_constraints()) and (
        problem.n_obj == 2 or not peer.two_objectives_only
    )
