"""Moments of a rung through the paper's surrogate of order 3, from values on tensor grids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from experiments.paper.calibrating.ladder import WIDE
from experiments.paper.calibrating.predictions import BAND, ORDER, VARIABLES, uncertain_box
from experiments.paper.inference.rungs import COLUMNS, Rung, dte_arcsec
from experiments.paper.scatter import Rule, gauss_rule, tensor_rule
from experiments.published_values import TABLE_9
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.surrogate import Box, TruncatedNormal
from pymoo_hdte.surrogate.tensor import chebyshev_basis, chebyshev_nodes, coefficients_from_nodes


@dataclass(frozen=True)
class JointValues:
    """Values of d designs at q common nodes, shape (d, q), and the weights of the nodes, (q,).

    The weights sum to 1, and the rule is exact for products of four values.
    """

    values: NDArray[np.float64]
    weights: NDArray[np.float64]

    @property
    def means(self) -> NDArray[np.float64]:
        """Expectations, shape (d,)."""
        return self.values @ self.weights

    @property
    def deviations(self) -> NDArray[np.float64]:
        """Values less their expectation, shape (d, q)."""
        return self.values - self.means[:, None]

    @property
    def stds(self) -> NDArray[np.float64]:
        """Standard deviations, shape (d,)."""
        return np.asarray(np.sqrt(self.deviations**2 @ self.weights))


def sampling_covariance(
    joint: JointValues, n_samples: int, draws: Sequence[int]
) -> NDArray[np.float64]:
    """Return the covariance of the d sample means and d sample standard deviations, (2 d, 2 d).

    To first order in 1/N the sample mean errs by the average of f - mu, and the sample standard
    deviation by that of ((f - mu)^2 - sigma^2) / (2 sigma). The covariance of these influences over
    N is that of the statistics: second moments for two means, third for a mean and a standard
    deviation, fourth for two standard deviations.

    Parameters
    ----------
    joint : JointValues
        Of the d designs.
    n_samples : int
        N, of each design.
    draws : sequence of int, length d
        Designs with the same number share their random numbers; others are independent.

    Returns
    -------
    ndarray, shape (2 d, 2 d)
        In the square of the unit of the values.
    """
    deviations, stds = joint.deviations, joint.stds
    spread = (deviations**2 - stds[:, None] ** 2) / (2.0 * stds[:, None])
    influence = np.vstack([deviations, spread])
    covariance = (influence * joint.weights) @ influence.T / n_samples
    shared = np.tile(draws, 2)
    return np.where(shared[:, None] == shared[None, :], covariance, 0.0)


DESIGNS = ("initial", *TABLE_9)
"""In the order in which their moments stand."""
FOURTH = 2 * ORDER + 1
"""Nodes of a Gauss rule that is exact for the fourth power of the surrogate."""
SECOND = ORDER + 1
"""Nodes of one that is exact for its square."""


@dataclass(frozen=True)
class TensorSurrogate:
    """The polynomial in (theta_s, K, J_in, B_fc), arcsec: coefficients (4, 4, 4, 4) on a box."""

    model: DriveModel
    box: Box
    coefficients: NDArray[np.float64]

    @classmethod
    def fit(
        cls, rung: Rung, parameters: dict[str, float], order: int = ORDER, bands: str = WIDE
    ) -> TensorSurrogate:
        """Interpolate the DTE of a rung; the box is that of `surrogate_moments` (see there)."""
        model = rung.model(parameters)
        five = uncertain_box(model, bands)
        box = Box(VARIABLES, five.lower[COLUMNS], five.upper[COLUMNS])
        size = order + 1
        grid = np.meshgrid(*[chebyshev_nodes(size)] * len(box), indexing="ij")
        nodes = box.from_cube(np.stack(grid, axis=-1).reshape(-1, len(box)))
        values = dte_arcsec(rung, parameters, nodes).reshape((size,) * len(box))
        return cls(model, box, coefficients_from_nodes(values))

    def on_grid(self, axes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the values at all combinations of values (n_j,) of each variable, (n_1, ..)."""
        values = self.coefficients
        for axis, points in enumerate(axes):
            centred = (points - self.box.centre[axis]) / self.box.half_width[axis]
            basis = chebyshev_basis(centred, values.shape[0])
            # The contracted axis leaves at the front, the new one comes last.
            values = np.tensordot(values, basis, axes=(0, 0))
        return values

    def theta_s(self, rule: Rule) -> NDArray[np.float64]:
        """Return values of theta_s at the nodes of a standard normal rule, rad."""
        return self.model.nominal[0] + self.model.kinematic_error.std * rule[0]

    def joint(self, bands: str) -> JointValues:
        """Return the values of `DESIGNS` at common nodes, exact up to fourth moments."""
        normal, uniform = normal_rule(FOURTH), uniform_rule(FOURTH)
        rows = []
        for name in DESIGNS:
            design, band = place(self.model, name)
            factors = 1.0 + BAND[band][bands] * uniform[0]
            axes = [self.theta_s(normal), *(value * factors for value in design)]
            rows.append(self.on_grid(axes).ravel())
        return JointValues(np.array(rows), tensor_rule([normal, *[uniform] * 3])[1])

    def box_std(self, bands: str) -> float:
        """Return the standard deviation over the box of Table 5, uniform, arcsec."""
        five = uncertain_box(self.model, bands)
        uniform = uniform_rule(SECOND)
        axes = [five.centre[axis] + five.half_width[axis] * uniform[0] for axis in COLUMNS]
        values, weights = self.on_grid(axes).ravel(), tensor_rule([uniform] * 4)[1]
        return float(np.sqrt(weights @ (values - weights @ values) ** 2))

    def on_designs(
        self, designs: Sequence[NDArray[np.float64]], tolerance: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and std at all combinations of K, J_in and B_fc, (n_1, n_2, n_3) each."""
        normal, uniform = normal_rule(SECOND), uniform_rule(SECOND)
        factors = 1.0 + tolerance * uniform[0]
        axes = [np.outer(values, factors).ravel() for values in designs]
        values = self.on_grid([self.theta_s(normal), *axes])
        mean, square = self._averaged(values), self._averaged(values**2)
        return mean, np.sqrt(np.maximum(square - mean**2, 0.0))

    @staticmethod
    def _averaged(values: NDArray[np.float64]) -> NDArray[np.float64]:
        weights = uniform_rule(SECOND)[1]
        values = np.tensordot(normal_rule(SECOND)[1], values, axes=(0, 0))
        for _ in range(3):
            blocks = values.reshape(-1, SECOND, *values.shape[1:])
            values = np.moveaxis(np.tensordot(weights, blocks, axes=(0, 1)), 0, -1)
        return values


def place(model: DriveModel, name: str) -> tuple[NDArray[np.float64], str]:
    """Return (K, J_in, B_fc) of one of `DESIGNS`, and which band it has."""
    if name == "initial":
        return model.nominal[COLUMNS[1:]], "initial"
    values = np.array([0.0, *TABLE_9[name]])
    return values[COLUMNS[1:]], "optimum"


@cache
def normal_rule(n: int) -> Rule:
    """Return n Gauss nodes of the standard normal cut at 3."""
    return gauss_rule(TruncatedNormal(0.0, 1.0).quadrature(2 * n), n)


@cache
def uniform_rule(n: int) -> Rule:
    """Return n Gauss nodes of the uniform distribution on -1 .. 1."""
    nodes, weights = leggauss(n)
    return nodes, weights / 2.0
