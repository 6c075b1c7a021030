"""Noise of the runs that a surrogate is fitted to, and what it does to what is read off it.

The paper's surrogate interpolates 1,024 solver runs, the nodes. Where each run carries an error of
its own, independent and of standard deviation s, the surrogate holds a noise polynomial. A mean is
a linear functional of the values at the nodes, a standard deviation one to first order, so that
their errors have the covariance s^2 G G^T, G being the derivatives by the 1,024 values. Designs
near each other read nearly the same noise; designs at other ends of the box do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, reduce

import numpy as np
from numpy.typing import NDArray

from experiments.paper.calibrating.ladder import WIDE
from experiments.paper.calibrating.predictions import BAND, ORDER, uncertain_box
from experiments.paper.inference.moments import (
    DESIGNS,
    SECOND,
    TensorSurrogate,
    normal_rule,
    place,
    uniform_rule,
)
from experiments.paper.node_faults import share_of_noise
from experiments.paper.scatter import Rule
from experiments.published_values import TABLE_5, TABLE_9
from pymoo_hdte.drive import PARAMETERS
from pymoo_hdte.surrogate.tensor import chebyshev_basis, chebyshev_nodes, coefficients_from_nodes

Averages = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Of one axis at n designs, see `cardinal_averages`: (n, 4) and (n, 4, 4)."""
SIZE = ORDER + 1
"""Nodes on each of the five axes."""
ROLLING = PARAMETERS.index("B_in")
"""The axis that the DTE does not depend on. Its noise does, node by node."""


LARGEST = TABLE_5[ORDER].rmse_arcsec / (1.0 + share_of_noise(ORDER)) ** 0.5
"""Greatest node noise that Table 5 allows, arcsec: it makes up the whole RMSE of order 3, to which
the nodes contribute `share_of_noise` and the test points, runs of the same solver, 1."""


def growth_of_rmse() -> float:
    """Return the greatest ratio of the RMSE of order 4 to that of order 3, noise being of one size.

    That of pure noise: whatever a smooth response adds falls with the order.
    """
    return float(((1.0 + share_of_noise(4)) / (1.0 + share_of_noise(3))) ** 0.5)


@dataclass(frozen=True)
class Influence:
    """Moments of n designs, and their derivatives by the values at the nodes.

    Means and standard deviations (n,), arcsec; derivatives (n, 1024) each, dimensionless.
    """

    means: NDArray[np.float64]
    stds: NDArray[np.float64]
    of_means: NDArray[np.float64]
    of_stds: NDArray[np.float64]


def cardinal_averages(points: NDArray[np.float64], weights: NDArray[np.float64]) -> Averages:
    """Return averages over points (.., q) of the cube under weights (q,).

    Of the cardinal functions l_j, shape (.., 4), and of their products l_i l_j, (.., 4, 4).
    """
    values = np.moveaxis(chebyshev_basis(points, SIZE), 0, -1) @ _cardinal()
    averages = np.einsum("q,...qj->...j", weights, values)
    return averages, np.einsum("q,...qi,...qj->...ij", weights, values, values)


@cache
def _cardinal() -> NDArray[np.float64]:
    """Return the Chebyshev coefficients of the cardinal functions, shape (4, 4), one a column."""
    return np.column_stack([coefficients_from_nodes(row) for row in np.eye(SIZE)])


def influence(axes: Sequence[Averages], values: NDArray[np.float64]) -> Influence:
    """Return moments of n designs and their derivatives.

    Parameters
    ----------
    axes : sequence of five averages
        `cardinal_averages` of n designs, (n, 4) and (n, 4, 4), in the order of `PARAMETERS`.
    values : ndarray, shape (4, 4, 4, 4)
        DTE at the nodes in all variables but B_in, arcsec.
    """
    moving = [axis for place, axis in enumerate(axes) if place != ROLLING]
    averages = [average for average, _ in moving]
    of_means = _outer(averages)
    flat = of_means.reshape(len(of_means), -1)
    means = flat @ values.ravel()
    products = np.broadcast_to(values, of_means.shape)
    for number, (_, second) in enumerate(moving):
        moved = np.moveaxis(products, number + 1, -1)
        rolled = np.einsum("nij,n...j->n...i", second, moved)
        products = np.moveaxis(rolled, -1, number + 1)
    squares = products.reshape(len(means), -1) @ values.ravel()
    stds = np.sqrt(np.maximum(squares - means**2, 0.0))
    spread = np.expand_dims(means, (1, 2, 3, 4)) * of_means
    of_stds = (products - spread) / np.expand_dims(stds, (1, 2, 3, 4))
    rolling = axes[ROLLING][0]
    return Influence(means, stds, _with_rolling(of_means, rolling), _with_rolling(of_stds, rolling))


def _outer(factors: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the products of d factors, shape (n, 4) each, at all nodes: (n, 4, .., 4)."""
    return reduce(lambda share, right: np.einsum("n...i,nj->n...ij", share, right), factors)


def _with_rolling(moving: NDArray[np.float64], rolling: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return derivatives at all 1,024 nodes, from those in four variables and factors of B_in."""
    five = np.einsum("nabcd,ne->nabced", moving, rolling)
    return five.reshape(len(moving), -1)


def node_values(surrogate: TensorSurrogate) -> NDArray[np.float64]:
    """Return what the surrogate was fitted to, arcsec, shape (4, 4, 4, 4)."""
    nodes = chebyshev_nodes(SIZE)
    box = surrogate.box
    axes = [centre + half * nodes for centre, half in zip(box.centre, box.half_width, strict=True)]
    return surrogate.on_grid(axes)


def published_influence(surrogate: TensorSurrogate, bands: str) -> NDArray[np.float64]:
    """Return the derivatives of the nine fitted numbers by the values at the nodes, (9, 1024).

    In the order of `likelihood.FITTED`: means and standard deviations of `DESIGNS`, and the
    standard deviation over the box of Table 5.
    """
    values = node_values(surrogate)
    names = [place(surrogate.model, name) for name in DESIGNS]
    designs = np.array([_with_b_in(surrogate, name) for name in DESIGNS])
    tolerances = np.array([BAND[band][bands] for _, band in names])
    moments = influence(_design_axes(surrogate, designs, tolerances), values)
    box = influence(_box_axes(surrogate, bands), values)
    return np.vstack([moments.of_means, moments.of_stds, box.of_stds])


def grid_influence(
    surrogate: TensorSurrogate, designs: NDArray[np.float64], tolerance: float
) -> Influence:
    """Return `Influence` of designs (K, J_in, B_in, B_fc), shape (n, 4)."""
    axes = _design_axes(surrogate, designs, np.full(len(designs), tolerance))
    return influence(axes, node_values(surrogate))


def _with_b_in(surrogate: TensorSurrogate, name: str) -> NDArray[np.float64]:
    if name == "initial":
        return np.asarray(surrogate.model.nominal[1:])
    return np.array(TABLE_9[name])


def _design_axes(
    surrogate: TensorSurrogate, designs: NDArray[np.float64], tolerances: NDArray[np.float64]
) -> list[Averages]:
    """Return averages over the scatter of n designs (K, J_in, B_in, B_fc), shape (n, 4)."""
    box = uncertain_box(surrogate.model, WIDE)
    theta_s, weights = _theta_s(surrogate)
    centred = (theta_s - box.centre[0]) / box.half_width[0]
    axes = [cardinal_averages(np.tile(centred, (len(designs), 1)), weights)]
    nodes, weights = uniform_rule(SECOND)
    factors = 1.0 + tolerances[:, None] * nodes
    for axis in range(1, len(PARAMETERS)):
        points = designs[:, axis - 1, None] * factors
        axes.append(cardinal_averages((points - box.centre[axis]) / box.half_width[axis], weights))
    return axes


def _theta_s(surrogate: TensorSurrogate) -> Rule:
    rule = normal_rule(SECOND)
    return surrogate.theta_s(rule), rule[1]


def _box_axes(surrogate: TensorSurrogate, bands: str) -> list[Averages]:
    """Return averages over the box of Table 5, as one design."""
    box, tested = uncertain_box(surrogate.model, WIDE), uncertain_box(surrogate.model, bands)
    nodes, weights = uniform_rule(SECOND)
    points = tested.centre[:, None] + tested.half_width[:, None] * nodes
    centred = (points - box.centre[:, None]) / box.half_width[:, None]
    return [cardinal_averages(row[None], weights) for row in centred]
