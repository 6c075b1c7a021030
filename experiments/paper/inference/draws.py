"""Means and standard deviations of several designs under common random numbers, exactly.

The DTE of a design is a polynomial of standard variables (theta_s, and a factor in each band) that
are the same for all designs. Its values at the nodes of one quadrature rule therefore give, beside
the moments of every design, the covariance of what N common draws would estimate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
