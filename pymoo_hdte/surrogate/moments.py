"""Exact mean and standard deviation of a Chebyshev surrogate over its uncertain inputs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.surrogate.box import Box
from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.inputs import UncertainInput, Uncertainty
from pymoo_hdte.surrogate.many_points import ManyPoints
from pymoo_hdte.surrogate.tensor import (
    TensorPolynomial,
    chebyshev_basis,
    chebyshev_nodes,
    coefficients_from_nodes,
)
from pymoo_hdte.surrogate.threads import ENOUGH_FOR_THREADS


class ExactMoments:
    """Mean and standard deviation as functions of the design, free of sampling error.

    The inputs are independent and the surrogate is a tensor polynomial of degree k_j in each
    variable. Its mean over all scatter is therefore a tensor polynomial of degree k_j in each
    design variable u_j, and its variance one of degree 2 k_j. Both are found once, from their
    values on a Chebyshev grid of designs; evaluating a design sums two short series. They are the
    objectives, Eqs. (29) and (30), mean and deviation, without the paper's sampling.

    Parameters
    ----------
    surrogate : ChebyshevSurrogate
        Polynomial in d variables.
    inputs : sequence of TruncatedNormal or UniformBand, length d
        The scatter of each variable of the surrogate, in its order.
    design_box : Box
        The m designed variables (those with a `UniformBand`) and the range of their designs.

    Attributes
    ----------
    uncertainty : Uncertainty
        The inputs, checked against the boxes.
    surrogate : ChebyshevSurrogate
        As given.

    Raises
    ------
    InvalidInput
        If inputs and names do not match, or if the scatter of some design leaves the box of the
        surrogate.

    Examples
    --------
    >>> box = Box(("x",), np.array([0.5]), np.array([2.5]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0] ** 2, box, 2)
    >>> design_box = Box(("x",), np.array([1.0]), np.array([2.0]))
    >>> mean, std = ExactMoments(surrogate, [UniformBand(0.1)], design_box)(np.array([[1.0]]))
    >>> print(f"{mean[0]:.4f} {std[0]:.4f}")
    1.0033 0.1155
    """

    def __init__(
        self, surrogate: ChebyshevSurrogate, inputs: Sequence[UncertainInput], design_box: Box
    ) -> None:
        self.uncertainty = Uncertainty(surrogate.box, inputs, design_box)
        self.design_box = design_box
        self.surrogate = surrogate
        moments = _moments_on_grid(surrogate.coefficients, self.uncertainty)
        self._polynomial = TensorPolynomial(np.array([coefficients_from_nodes(m) for m in moments]))
        self._derivatives = self._polynomial.derivatives(range(len(design_box)))

    def __call__(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and standard deviation, shape (n,) each, in the surrogate's output unit.

        Parameters
        ----------
        designs : array_like, shape (n, m)
            Design variables in the units of ``design_box``.

        Raises
        ------
        ExtrapolationError
            If a design lies outside ``design_box``.
        InvalidInput
            If ``designs`` is no array of numbers of shape (n, m).
        """
        cube = self.design_box.to_cube(designs).T
        mean, variance = (
            self._polynomial if cube.shape[1] < ENOUGH_FOR_THREADS else self._many_points
        )(cube)
        return mean, _square_root(variance)

    def series(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the coefficients of mean and variance in Chebyshev's polynomials.

        Returns
        -------
        mean : ndarray, shape (k_1 + 1, ..., k_m + 1)
            In the surrogate's output unit. Entry (a, b, ...) belongs to T_a(t_1) T_b(t_2) ..., t
            being the design in the box scaled to -1 ... 1.
        variance : ndarray, shape (2 k_1 + 1, ..., 2 k_m + 1)
            In the square of that unit.
        """
        mean, variance = self._polynomial.coefficients
        return mean[tuple(slice((size + 1) // 2) for size in mean.shape)], variance

    @cached_property
    def _many_points(self) -> ManyPoints:
        return ManyPoints(list(self.series()))

    def gradient(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the gradients of mean and standard deviation, shape (n, m) each.

        In the output's unit per unit of each variable. Where the standard deviation is zero it has
        a kink or is constant; its gradient is then given as zero. Parameters and errors as in
        `__call__`.
        """
        cube = self.design_box.to_cube(designs).T
        std = _square_root(self._polynomial(cube)[1])
        slopes = self._derivatives(cube).reshape(len(self.design_box), 2, -1)
        dmean, dvariance = slopes.transpose(1, 2, 0) / self.design_box.half_width
        return dmean, divide_or_zero(dvariance, 2.0 * std[:, None])


def divide_or_zero(
    numerator: NDArray[np.float64], denominator: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the quotient, and zero where the denominator is zero."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator != 0.0)


def deviation(expansion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation, shape (...), of orthonormal expansions of shape (..., q)."""
    others = expansion[..., 1:]
    return np.sqrt(np.einsum("...q,...q->...", others, others))


def _square_root(variance: NDArray[np.float64]) -> NDArray[np.float64]:
    # Rounding can leave a variance of zero slightly negative.
    return np.sqrt(np.maximum(variance, 0.0))


def _moments_on_grid(
    coefficients: NDArray[np.float64], uncertainty: Uncertainty
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and variance on the Chebyshev grid of designs.

    Variables are integrated out one after the other. After each step the rest is a polynomial whose
    coefficients are random; their mean vector and covariance matrix follow from those of the step
    before by the laws of total mean and total covariance. Nothing large is subtracted, so a small
    variance keeps its digits.
    """
    mean = coefficients.reshape(1, -1)
    covariance = np.broadcast_to(0.0, (1, coefficients.size, coefficients.size))
    for axis, size in enumerate(coefficients.shape):
        means, spread = _basis_moments(uncertainty, axis, size)
        second = spread + means[:, :, None] * means[:, None, :]
        rows, remaining = len(mean), mean.shape[1] // size
        parts = mean.reshape(rows, size, remaining)
        covariances = covariance.reshape(rows, size, remaining, size, remaining)
        total = np.einsum("iab,darbs->dirs", second, covariances)
        total += np.einsum("iab,dar,dbs->dirs", spread, parts, parts, optimize=True)
        mean = np.einsum("ia,dar->dir", means, parts).reshape(-1, remaining)
        covariance = total.reshape(-1, remaining, remaining)
    grid = [2 * coefficients.shape[axis] - 1 for axis in uncertainty.design_axes]
    return mean.reshape(grid), covariance.reshape(grid)


def _basis_moments(
    uncertainty: Uncertainty, axis: int, size: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean (g, size) and covariance (g, size, size) of T_0 .. T_(size-1) of one variable.

    One row for each of its 2 size - 1 Chebyshev nodes if it is designed, a single row if not.
    """
    entry, box = uncertainty.inputs[axis], uncertainty.surrogate_box
    values, weights = entry.quadrature(2 * (size - 1))
    points = values[None]
    if entry.scales_design:
        design_axis = uncertainty.design_axes.index(axis)
        nodes = chebyshev_nodes(2 * size - 1)
        design = uncertainty.design_box
        points = np.outer(
            design.centre[design_axis] + design.half_width[design_axis] * nodes, values
        )
    basis = chebyshev_basis((points - box.centre[axis]) / box.half_width[axis], size)
    means = basis @ weights
    deviation = basis - means[:, :, None]
    return means.T, np.einsum("aiq,biq,q->iab", deviation, deviation, weights)
