"""Published numbers that no fit has seen, and whether a rung's drives are stable."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from experiments.paper.calibrating.predictions import N_TEST
from experiments.paper.inference.likelihood import BAND, box_axes
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.node_noise import share_of_noise
from experiments.paper.inference.rungs import COLUMNS, Rung, dte_arcsec, is_stable
from experiments.published_values import TABLE_6
from pymoo_hdte.surrogate import ChebyshevSurrogate, latin_hypercube
from pymoo_hdte.units import ARCSEC

DESIGNS_PER_AXIS = 25
"""Of K, J_in and B_fc: of 15,625 designs the share that dominates an optimum is known to 1 %."""


def surrogate_rmse(
    rung: Rung, parameters: dict[str, float], order: int, node_noise: float = 0.0
) -> float:
    """Return the RMSE of Table 5, arcsec, as the calibration predicts it.

    Noise of the runs, arcsec, adds that of the nodes and that of the test points in squares.
    """
    fitted = TensorSurrogate.fit(rung, parameters, order, rung.candidate.bands)
    surrogate = ChebyshevSurrogate(fitted.box, fitted.coefficients)
    points = latin_hypercube(fitted.box, N_TEST, 1)
    error = surrogate(points) - dte_arcsec(rung, parameters, points)
    noise = node_noise**2 * (1.0 + share_of_noise(order))
    return float(np.sqrt(np.mean(error**2) + noise))


def prototypes(rung: Rung, parameters: dict[str, float]) -> NDArray[np.float64]:
    """Return the DTE of the five prototypes of Table 6, arcsec, shape (5,)."""
    rows = np.array([[row.theta_s_arcsec * ARCSEC, *row.design] for row in TABLE_6.values()])
    return dte_arcsec(rung, parameters, rows[:, COLUMNS])


def dominating_shares(rung: Rung, parameters: dict[str, float]) -> NDArray[np.float64]:
    """Return the share of the box's designs that dominate each of the three optima, shape (3,)."""
    surrogate = TensorSurrogate.fit(rung, parameters)
    joint = surrogate.joint(rung.candidate.bands)
    optima = np.column_stack([joint.means, joint.stds])[1:]
    mean, std = surrogate.on_designs(box_axes(surrogate, DESIGNS_PER_AXIS), BAND)
    objectives = np.stack([mean, std], axis=-1).reshape(-1, 1, 2)
    return np.asarray(np.mean(np.all(objectives < optima, axis=2), axis=0))


def stable(rung: Rung, parameters: dict[str, float]) -> bool:
    """Return whether the drives at the corners of the surrogate's box and inside have no growth."""
    box = TensorSurrogate.fit(rung, parameters).box
    corners = np.array(list(product(*zip(box.lower, box.centre, box.upper, strict=True))))
    return bool(np.all(is_stable(rung, parameters, corners)))
