"""COMO-CMA-ES: several CMA-ES that share the hypervolume among them; two objectives, a box."""

from __future__ import annotations

from collections.abc import Sequence

import comocma
import numpy as np
from pymoo.core.problem import Problem

from experiments.comparison.indicators import front_among
from experiments.contest.offer import Offer

KERNELS = 10
STEP = 0.2
"""First step size, as a part of the box in which first positions are drawn."""


def run_como(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    """Run once and return the front of all evaluated points at each budget.

    It needs to be told a point that bounds the hypervolume: ``problem.reference`` (2,), the corner
    to which the experiment measures, which no other algorithm here knows.
    """
    # Kernels draw from numpy's global generator; nothing else in this process uses it.
    np.random.seed(seed)  # noqa: NPY002
    low, high = problem.start
    bounds = [problem.xl.tolist(), problem.xu.tolist()]
    options = {"bounds": bounds, "verbose": -9, "seed": np.nan, "CMA_stds": high - low}
    places = [np.random.uniform(low, high) for _ in range(KERNELS)]  # noqa: NPY002
    kernels = comocma.get_cmas(places, STEP, inopts=options)
    optimiser = comocma.Sofomore(kernels, reference_point=list(problem.reference))
    found, spent, offers = [np.empty((0, 2))], 0, []
    asked = optimiser.ask()
    for budget in budgets:
        while spent + len(asked) <= budget and not optimiser.stop():
            F = problem.evaluate(np.array(asked), return_values_of=["F"])
            found.append(F)
            spent += len(asked)
            optimiser.tell(asked, F.tolist())
            asked = optimiser.ask()
        found = [front_among(np.concatenate(found))]
        offers.append(Offer(found[0], spent))
    return offers
