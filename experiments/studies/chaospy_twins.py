"""Our distributions, moments and Sobol indices computed a second time with chaospy.

chaospy works in standard variables here (theta_s in units of its std, bands as -1 .. 1): in
physical units its orthogonal polynomials lose the digits that a narrow band needs.
"""

from __future__ import annotations

from dataclasses import dataclass

import chaospy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.paper.scatter import theta_s_of
from experiments.paper.shares import scatter_indices
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import SobolIndices, TruncatedNormal, UniformBand


def distribution_of(entry: TruncatedNormal | UniformBand) -> chaospy.Distribution:
    """Return chaospy's distribution of the standard variable of an input, in physical units."""
    low, high = entry.support
    if isinstance(entry, TruncatedNormal):
        return chaospy.TruncNormal(lower=low, upper=high, mu=entry.mean, sigma=entry.std)
    return chaospy.Uniform(low, high)


@dataclass(frozen=True)
class Chaos:
    """An expansion with every product of polynomials up to one degree, orthonormal in chaospy.

    Attributes
    ----------
    expansion : chaospy.ndpoly, length t
    values : ndarray, shape (t, n)
        Of every term at the nodes.
    nodes : ndarray, shape (5, n)
        Gauss nodes in standard variables.
    weights : ndarray, shape (n,)
    """

    expansion: chaospy.ndpoly
    values: NDArray[np.float64]
    nodes: NDArray[np.float64]
    weights: NDArray[np.float64]

    def points(
        self, theta_s: TruncatedNormal, design: ArrayLike, tolerance: float
    ) -> NDArray[np.float64]:
        """Return the nodes in physical units, shape (n, 5), for a design (4,) and its bands."""
        centre = np.concatenate([[theta_s.mean], np.asarray(design)])
        scale = np.concatenate([[theta_s.std], tolerance * np.asarray(design)])
        return centre + scale * self.nodes.T

    def moments(self, values: NDArray[np.float64]) -> tuple[float, float]:
        """Return mean and std of an output from its values (n,) at the nodes."""
        mean = self.weights @ values
        return float(mean), float(np.sqrt(self.weights @ (values - mean) ** 2))

    def indices(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return first and total Sobol indices, shape (2, 5), of the expansion of an output."""
        coefficients = self.values @ (self.weights * values)
        first = chaospy.FirstOrderSobol(self.expansion, coefficients)
        return np.array([first, chaospy.TotalOrderSobol(self.expansion, coefficients)])


def chaos(degree: int, cut: float) -> Chaos:
    """Return the expansion for a normal variable cut at +-``cut`` and four uniform ones."""
    normal = chaospy.TruncNormal(lower=-cut, upper=cut, mu=0.0, sigma=1.0)
    joint = chaospy.J(normal, *[chaospy.Uniform(-1.0, 1.0) for _ in range(4)])
    expansion = chaospy.generate_expansion(degree, joint, cross_truncation=np.inf, normed=True)
    nodes, weights = chaospy.generate_quadrature(degree, joint, rule="gaussian")
    return Chaos(expansion, np.array(expansion(*nodes)), nodes, weights)


@dataclass(frozen=True)
class Comparison:
    """Ours and chaospy's at one design.

    Attributes
    ----------
    ours : SobolIndices
    moments, indices : float
        Largest relative difference of mean and std, largest difference of the indices.
    surrogate_mean, surrogate_std : float
        Relative differences of the surrogate's moments from the drive model's own, both by
        chaospy's quadrature.
    """

    ours: SobolIndices
    moments: float
    indices: float
    surrogate_mean: float
    surrogate_std: float


def compare(twin: Chaos, problem: RobustDTE, design: ArrayLike, tolerance: float) -> Comparison:
    """Compare moments and indices of the DTE at a design (4,) with chaospy's."""
    ours = scatter_indices(problem, design, tolerance)
    points = twin.points(theta_s_of(problem), design, tolerance)
    values = problem.surrogate(points)
    theirs = np.array(twin.moments(values))
    mine = np.array([ours.mean, np.sqrt(ours.variance)])
    by_surrogate = theirs / twin.moments(problem.model.dte_arcsec(points)) - 1.0
    return Comparison(
        ours=ours,
        moments=float(np.abs(mine / theirs - 1.0).max()),
        indices=float(np.abs(twin.indices(values) - [ours.first, ours.total]).max()),
        surrogate_mean=float(by_surrogate[0]),
        surrogate_std=float(by_surrogate[1]),
    )
