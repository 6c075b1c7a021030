"""The design that a rung would have one choose: its front over the box, and three preferences."""

from __future__ import annotations

import numpy as np

from experiments.paper.inference.likelihood import BAND, box_axes
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.rungs import COLUMNS, Rung
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia

DESIGNS_PER_AXIS = 17
"""Of K, J_in and B_fc: steps of 3 % of the nominal value."""
OUTCOMES = ("mean", "std", "K", "J_in", "B_fc")
OPTIMA = tuple(f"{outcome}_{name}" for name in PREFERENCES for outcome in OUTCOMES)


def optima(rung: Rung, parameters: dict[str, float], n: int = DESIGNS_PER_AXIS) -> dict[str, float]:
    """Return mean and std, arcsec, and design, as shares of the nominal one, of each preference.

    Named as `OPTIMA`; chosen from the non-dominated of n^3 designs of the paper's box, B_in being
    without influence.
    """
    surrogate = TensorSurrogate.fit(rung, parameters)
    axes = box_axes(surrogate, n)
    objectives = np.column_stack([part.ravel() for part in surrogate.on_designs(axes, BAND)])
    order = np.lexsort((objectives[:, 1], objectives[:, 0]))
    lowest = np.minimum.accumulate(objectives[order, 1])
    front = order[np.concatenate([[True], objectives[order[1:], 1] < lowest[:-1]])]
    nominal = surrogate.model.nominal[COLUMNS[1:]]
    shares = [values / value for values, value in zip(axes, nominal, strict=True)]
    grid = np.stack(np.meshgrid(*shares, indexing="ij"), axis=-1).reshape(-1, 3)
    found = []
    for weights in PREFERENCES.values():
        chosen = front[WeightedUtopia(weights).do(objectives[front])]
        found += [*objectives[chosen], *grid[chosen]]
    return dict(zip(OPTIMA, map(float, found), strict=True))
