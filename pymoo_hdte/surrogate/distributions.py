"""The two kinds of uncertain input of a robust design study.

Each is described by a standard variable that does not depend on the design: `TruncatedNormal`
*is* the input's value, `UniformBand` multiplies the design's value. Samples of the standard
variable serve every design alike, which is what common random numbers need.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from pymoo_hdte.checks import real_number

# Enough for a normal density cut at ten standard deviations to 1e-15.
_NODES_FOR_NORMAL = 128


@dataclass(frozen=True)
class TruncatedNormal:
    """A noise variable: normal, cut off symmetrically, independent of the design.

    Parameters
    ----------
    mean : float
        Mean, of the normal and of the truncated variable alike.
    std : float
        Standard deviation of the normal *before* the cut, positive. The truncated variable
        scatters less, see `truncated_std`: 0.9866 of it at a cut of 3.
    cut : float
        Values farther than ``cut`` times ``std`` from the mean do not occur; above 0, at most 10
        (beyond, a normal variable is not cut at all within double precision).

    Raises
    ------
    InvalidInput
        If a number is not finite or not in its range.
    """

    mean: float
    std: float
    cut: float = 3.0

    scales_design: ClassVar[bool] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", real_number("mean", self.mean))
        object.__setattr__(self, "std", real_number("std", self.std, above=0.0))
        object.__setattr__(self, "cut", real_number("cut", self.cut, above=0.0, at_most=10.0))

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.mean - self.cut * self.std, self.mean + self.cut * self.std

    @property
    def truncated_std(self) -> float:
        """Standard deviation of the truncated variable, smaller than ``std``."""
        values, weights = self.quadrature(2)
        return float(np.sqrt(weights @ (values - self.mean) ** 2))

    def pdf(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probability density of the truncated variable at ``x``, of any shape."""
        z = (np.asarray(x, dtype=float) - self.mean) / self.std
        inside = np.sqrt(2.0 * np.pi) * self.std * (ndtr(self.cut) - ndtr(-self.cut))
        return np.where(np.abs(z) <= self.cut, np.exp(-0.5 * z**2) / inside, 0.0)

    def quadrature(self, degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return values and weights whose sums are expectations of polynomials up to ``degree``.

        Gauss-Legendre over the support, with the density in the weights; exact to rounding.
        """
        nodes, weights = leggauss(_NODES_FOR_NORMAL + degree)
        z = self.cut * nodes
        weights = weights * np.exp(-0.5 * z**2)
        return self.mean + self.std * z, weights / weights.sum()

    def sample(self, random_state: np.random.Generator, size: int) -> NDArray[np.float64]:
        """Draw ``size`` values, shape (size,), by inversion of the distribution function."""
        low, high = ndtr(-self.cut), ndtr(self.cut)
        z = ndtri(low + (high - low) * random_state.random(size))
        return self.mean + self.std * np.clip(z, -self.cut, self.cut)


@dataclass(frozen=True)
class UniformBand:
    """A design variable with a relative tolerance: u is uniform in u (1 - t) .. u (1 + t).

    The standard variable is the factor, uniform in 1 - t .. 1 + t.

    Parameters
    ----------
    tolerance : float
        t, at least 0 (no scatter) and below 1.

    Raises
    ------
    InvalidInput
        If the tolerance is not finite or not in its range.
    """

    tolerance: float

    scales_design: ClassVar[bool] = True

    def __post_init__(self) -> None:
        tolerance = real_number("tolerance", self.tolerance, at_least=0.0, below=1.0)
        object.__setattr__(self, "tolerance", tolerance)

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest factor."""
        return 1.0 - self.tolerance, 1.0 + self.tolerance

    def quadrature(self, degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return factors and weights whose sums are expectations of polynomials up to ``degree``.

        Gauss-Legendre of just enough nodes.
        """
        # A band of no width is one point: one node keeps its scatter at exactly zero.
        nodes, weights = leggauss(degree // 2 + 1 if self.tolerance else 1)
        return 1.0 + self.tolerance * nodes, weights / weights.sum()

    def sample(self, random_state: np.random.Generator, size: int) -> NDArray[np.float64]:
        """Draw ``size`` factors, shape (size,)."""
        return 1.0 + self.tolerance * (2.0 * random_state.random(size) - 1.0)
