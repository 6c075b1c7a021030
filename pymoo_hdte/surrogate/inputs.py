"""The two kinds of uncertain input of a robust design study.

Each is described by a standard variable that does not depend on the design: `TruncatedNormal`
*is* the input's value, `UniformBand` multiplies the design's value. The same samples of the
standard variable serve all designs (common random numbers).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

# Its special functions load when they are first used.
import scipy
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.surrogate.box import Box, ExtrapolationError

# Enough for a normal density cut at ten standard deviations to 1e-15.
_NODES_FOR_NORMAL = 128


@dataclass(frozen=True)
class TruncatedNormal:
    """A noise variable: normal, cut off symmetrically, independent of the design (Section 2.1).

    Parameters
    ----------
    mean : float
        Mean, of the normal and of the truncated variable alike, in the variable's own unit.
    std : float
        Standard deviation of the normal *before* the cut, positive, in the same unit. The truncated
        variable scatters less, see `truncated_std`: 0.9866 of it at a cut of 3.
    cut : float
        Dimensionless: values farther than ``cut`` times ``std`` from the mean do not occur; above
        0, at most 10 (beyond, a normal variable is not cut at all within double precision).

    Attributes
    ----------
    scales_design : bool
        False: the standard variable is the input's value itself.

    Raises
    ------
    InvalidInput
        If a number is not finite or not in its range.

    Examples
    --------
    >>> noise = TruncatedNormal(10.0, 1.0)
    >>> nodes, weights = noise.quadrature(8)
    >>> print(f"{weights @ nodes:.6f} {noise.truncated_std:.3f}")
    10.000000 0.987
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
        """Smallest and largest value, in the variable's unit."""
        return self.mean - self.cut * self.std, self.mean + self.cut * self.std

    @property
    def truncated_std(self) -> float:
        """Standard deviation of the truncated variable, smaller than ``std`` and in its unit."""
        values, weights = self.quadrature(2)
        return float(np.sqrt(weights @ (values - self.mean) ** 2))

    def pdf(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probability density of the truncated variable, in 1 over its unit.

        It has the shape of ``x``, which may be any shape, e.g. (n,), in the variable's unit.
        """
        z = (np.asarray(x, dtype=float) - self.mean) / self.std
        low, high = scipy.special.ndtr([-self.cut, self.cut])
        inside = np.sqrt(2.0 * np.pi) * self.std * (high - low)
        return np.where(np.abs(z) <= self.cut, np.exp(-0.5 * z**2) / inside, 0.0)

    def quadrature(self, degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return values and weights whose sums are expectations of polynomials up to ``degree``.

        Gauss-Legendre over the support, with the density in the weights; exact to rounding.

        Returns
        -------
        values : ndarray, shape (q,)
            In the variable's unit.
        weights : ndarray, shape (q,)
            Dimensionless; they sum to 1.
        """
        nodes, weights = leggauss(_NODES_FOR_NORMAL + degree)
        z = self.cut * nodes
        weights = weights * np.exp(-0.5 * z**2)
        return self.mean + self.std * z, weights / weights.sum()

    def sample(self, random_state: np.random.Generator, size: int) -> NDArray[np.float64]:
        """Draw values by inversion of the distribution function.

        Parameters
        ----------
        random_state : numpy.random.Generator
            Source of the randomness.
        size : int
            Number of values.

        Returns
        -------
        ndarray, shape (size,)
            In the variable's unit.
        """
        low, high = scipy.special.ndtr([-self.cut, self.cut])
        z = scipy.special.ndtri(low + (high - low) * random_state.random(size))
        return self.mean + self.std * np.clip(z, -self.cut, self.cut)


@dataclass(frozen=True)
class UniformBand:
    """A design variable with a relative tolerance: u is uniform in u (1 - t) .. u (1 + t).

    The standard variable is the factor, uniform in 1 - t .. 1 + t (Sections 2.3 and 5.1).

    Parameters
    ----------
    tolerance : float
        t, relative: at least 0 (no scatter) and below 1.

    Attributes
    ----------
    scales_design : bool
        True: the standard variable multiplies the design's value.

    Raises
    ------
    InvalidInput
        If the tolerance is not finite or not in its range.

    Examples
    --------
    >>> UniformBand(0.05).scales_design
    True
    """

    tolerance: float

    scales_design: ClassVar[bool] = True

    def __post_init__(self) -> None:
        tolerance = real_number("tolerance", self.tolerance, at_least=0.0, below=1.0)
        object.__setattr__(self, "tolerance", tolerance)

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest factor, dimensionless."""
        return 1.0 - self.tolerance, 1.0 + self.tolerance

    def quadrature(self, degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return factors and weights whose sums are expectations of polynomials up to ``degree``.

        Gauss-Legendre of just enough nodes.

        Returns
        -------
        factors, weights : ndarray, shape (q,)
            Dimensionless; the weights sum to 1.
        """
        # A band of no width is one point: one node keeps its scatter at exactly zero.
        nodes, weights = leggauss(degree // 2 + 1 if self.tolerance else 1)
        return 1.0 + self.tolerance * nodes, weights / weights.sum()

    def sample(self, random_state: np.random.Generator, size: int) -> NDArray[np.float64]:
        """Draw factors.

        Parameters
        ----------
        random_state : numpy.random.Generator
            Source of the randomness.
        size : int
            Number of factors.

        Returns
        -------
        ndarray, shape (size,)
            Dimensionless.
        """
        return 1.0 + self.tolerance * (2.0 * random_state.random(size) - 1.0)


UncertainInput = TruncatedNormal | UniformBand


class Uncertainty:
    """The uncertain inputs of a surrogate, checked against its box.

    Parameters
    ----------
    surrogate_box : Box
        All d variables of the surrogate.
    inputs : sequence of TruncatedNormal or UniformBand, length d
        One for each variable, in the surrogate's order.
    design_box : Box
        The m variables that have a `UniformBand`, in the surrogate's order.

    Raises
    ------
    InvalidInput
        If the inputs or names do not match, or if a design in ``design_box`` or a noise variable
        can reach a value outside the surrogate's box.
    """

    def __init__(
        self, surrogate_box: Box, inputs: Sequence[UncertainInput], design_box: Box
    ) -> None:
        self.surrogate_box = surrogate_box
        self.inputs = tuple(inputs)
        self.design_box = design_box
        if len(self.inputs) != len(surrogate_box):
            raise InvalidInput("number of inputs", len(self.inputs), str(len(surrogate_box)))
        for name, entry in zip(surrogate_box.names, self.inputs, strict=True):
            if not isinstance(entry, UncertainInput):
                raise InvalidInput(f"input {name!r}", entry, "a TruncatedNormal or a UniformBand")
        self.design_axes = tuple(
            axis for axis, entry in enumerate(self.inputs) if entry.scales_design
        )
        designed = tuple(surrogate_box.names[axis] for axis in self.design_axes)
        if design_box.names != designed:
            raise InvalidInput("names of the design box", design_box.names, str(designed))
        self._check_support()

    def reachable(self) -> NDArray[np.float64]:
        """Return the smallest and largest value of every variable over all designs, (2, d)."""
        extremes = np.array([entry.support for entry in self.inputs]).T
        bounds = zip(self.design_axes, self.design_box.lower, self.design_box.upper, strict=True)
        for axis, low, high in bounds:
            corners = np.outer((low, high), extremes[:, axis])
            extremes[:, axis] = corners.min(), corners.max()
        return extremes

    def _check_support(self) -> None:
        try:
            self.surrogate_box.check_inside(self.reachable())
        except ExtrapolationError as error:
            raise InvalidInput(
                f"{error.field} over the design box and its scatter",
                error.value,
                f"the surrogate's interval, {error.allowed.partition(' (')[0]}",
            ) from None
