"""Effect of a correction on the robust optimum: the old choice evaluated by the new model.

Both models go through the same surrogate, swarm and preferences. A design is a set of factors on
the parameters of the existing drive, which a designer can specify without knowing their true
values. The choice made with the old model is then evaluated with the new one, to compare predicted
and actual performance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia, deviation_degree
from pymoo_hdte.decision.influence import without_influence
from pymoo_hdte.discrepancy._report.optimum import Choice, OptimumShift, Values
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import RobustDTE

SURROGATE_ORDER = 3
"""Order of the paper; with laws at ports it costs a harmonic balance in each of 4^5 runs."""
EVALUATIONS = 5_000
POPULATION = 100


def optimum_shift(before: DriveModel, after: DriveModel, seed: int = 1) -> OptimumShift:
    """Return how the robust optimum moves from one model to another."""
    try:
        old = RobustDTE(before, order=SURROGATE_ORDER)
        new = RobustDTE(after, order=SURROGATE_ORDER)
    except (InvalidInput, ArithmeticError) as error:
        return OptimumShift((), f"One of the models has no robust optimum: {error}")
    fronts = [_front(problem, seed) for problem in (old, new)]
    choices = tuple(_choice(word, old, new, fronts) for word in PREFERENCES)
    method = (
        f"Front of the order-{SURROGATE_ORDER} surrogate of each model, not of the model itself; "
        f"{EVALUATIONS} evaluations by ElitistSwarm"
    )
    return OptimumShift(choices, fronts=tuple(values for _, values in fronts), method=method)


def _front(problem: RobustDTE, seed: int) -> tuple[Values, Values]:
    """Return designs (n, 4) and objectives (n, 2) of a short run."""
    swarm = ElitistSwarm(pop_size=POPULATION)
    result = minimize(problem, swarm, ("n_eval", EVALUATIONS), seed=seed)
    return result.X, result.F


def _choice(
    preference: str, old: RobustDTE, new: RobustDTE, fronts: list[tuple[Values, Values]]
) -> Choice:
    choose = WeightedUtopia(PREFERENCES[preference])
    (old_designs, old_values), (new_designs, new_values) = fronts
    old_row, new_row = choose.do(old_values), choose.do(new_values)
    before, after = old_designs[old_row] / old.nominal, new_designs[new_row] / new.nominal
    # The factors lie in a box that is the same for both; rounding must not lead out of it.
    same = np.clip(before * new.nominal, new.xl, new.xu)
    return Choice(
        preference,
        before=before,
        after=after,
        free_before=_without_influence(old, old_designs[old_row]),
        free_after=_without_influence(new, new_designs[new_row]),
        distance=float(deviation_degree(after[None, :], before)[0]),
        promised=old_values[old_row],
        delivered=new.evaluate(same[None, :])[0],
        reached=new_values[new_row],
    )


def _without_influence(problem: RobustDTE, design: Values) -> NDArray[np.bool_]:
    return without_influence(problem.evaluate, problem.xl, problem.xu, design)
