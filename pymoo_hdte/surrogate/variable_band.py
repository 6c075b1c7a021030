"""Exact mean and standard deviation where the width of the band is itself a design variable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import prod

import numpy as np
from numpy.polynomial.chebyshev import chebder
from numpy.polynomial.legendre import leggauss, legvander
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.surrogate.box import Box
from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.inputs import TruncatedNormal, UncertainInput, Uncertainty, UniformBand
from pymoo_hdte.surrogate.moments import deviation, divide_or_zero
from pymoo_hdte.surrogate.tensor import chebyshev_basis, to_orthonormal

_AT_ONCE = 2**15
"""Numbers in one array: more exceed the processor's cache, fewer cost numpy overhead."""

Arrays = list[NDArray[np.float64]]


class VariableBandMoments:
    """Mean and standard deviation as functions of design and tolerance, free of sampling error.

    A designed variable is x = u (1 + t s) with s uniform in -1..1 and one tolerance t for all. At
    every (u, t) the surrogate is written anew in polynomials that are orthonormal under the
    scatter: Legendre's in each s, others in the noise. This is a polynomial chaos expansion (Xiu
    and Karniadakis, SIAM J. Scientific Computing 24, 2002) of finite degree, hence exact. Its first
    coefficient is the mean, and the squares of all others add up to the variance; nothing large is
    subtracted. `ExactMoments` is faster where t is fixed.

    Parameters
    ----------
    surrogate : ChebyshevSurrogate
        Polynomial in d variables.
    noise : mapping of str to TruncatedNormal
        The variables of the surrogate that are not designed, by name.
    design_box : Box
        The m other variables of the surrogate, in its order, and last the tolerance t.

    Raises
    ------
    InvalidInput
        If names do not match, the tolerance can leave 0 < t < 1, or the widest scatter of some
        design leaves the box of the surrogate.

    Examples
    --------
    >>> problem = RobustDTETolerance()
    >>> isinstance(problem.moments, VariableBandMoments)
    True
    """

    def __init__(
        self,
        surrogate: ChebyshevSurrogate,
        noise: Mapping[str, TruncatedNormal],
        design_box: Box,
    ) -> None:
        names = surrogate.box.names
        for name in noise:
            if name not in names:
                raise InvalidInput("name of a noise variable", name, f"one of {', '.join(names)}")
        real_number(design_box.names[-1], design_box.lower[-1], above=0.0)
        widest = UniformBand(float(design_box.upper[-1]))
        inputs: list[UncertainInput] = [noise.get(name, widest) for name in names]
        designs = Box(design_box.names[:-1], design_box.lower[:-1], design_box.upper[:-1])
        uncertainty = Uncertainty(surrogate.box, inputs, designs)
        self.design_box = design_box
        self.surrogate = surrogate
        axes = list(uncertainty.design_axes)
        self._centre = surrogate.box.centre[axes]
        self._half_width = surrogate.box.half_width[axes]
        self._coefficients = _with_noise_expanded(surrogate.coefficients, uncertainty)
        self._rules = [_legendre_rule(surrogate.coefficients.shape[axis]) for axis in axes]

    def __call__(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and standard deviation, shape (n,) each, in the surrogate's output unit.

        Parameters
        ----------
        designs : array_like, shape (n, m + 1)
            Design variables and tolerance in the units of ``design_box``.

        Raises
        ------
        ExtrapolationError
            If a design lies outside ``design_box``.
        InvalidInput
            If ``designs`` is no array of numbers of shape (n, m + 1).
        """
        points = self._inside(designs)
        mean, std = np.empty((2, len(points)))
        for block in self._blocks(len(points)):
            rows = [values for values, _, _ in self._rows(points[block])]
            expansion = self._expand(rows)[-1]
            mean[block], std[block] = expansion[:, 0], deviation(expansion)
        return mean, std

    def gradient(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the gradients of mean and standard deviation, shape (n, m + 1) each.

        In the output's unit per unit of each variable. The gradient of a standard deviation of zero
        is given as zero. Parameters and errors as in `__call__`.
        """
        points = self._inside(designs)
        dmean, dstd = np.empty((2, *points.shape))
        for block in self._blocks(len(points)):
            rows = list(self._rows(points[block]))
            stages = self._expand([values for values, _, _ in rows])
            of_mean, others = np.zeros_like(stages[-1]), stages[-1].copy()
            of_mean[:, 0], others[:, 0] = 1.0, 0.0
            std = deviation(stages[-1])[:, None]
            dmean[block] = _pulled_back(of_mean, stages, rows)
            dstd[block] = divide_or_zero(_pulled_back(others, stages, rows), std)
        return dmean, dstd

    def _inside(self, designs: ArrayLike) -> NDArray[np.float64]:
        self.design_box.check_inside(designs)
        return np.asarray(designs, dtype=float)

    def _blocks(self, n: int) -> Iterator[slice]:
        step = max(1, _AT_ONCE // self._coefficients.size)
        return (slice(start, start + step) for start in range(0, n, step))

    def _rows(self, points: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.float64], ...]]:
        """Yield, variable by variable, what changes T_i(x) into Legendre polynomials of s.

        Three arrays of shape (n, size, size): the coefficient of the normalised P_l in T_i at
        ``[:, i, l]``, its slope in the design u and its slope in the tolerance t.
        """
        tolerance = points[:, -1:]
        for axis, (nodes, rule) in enumerate(self._rules):
            design = points[:, axis, None]
            factor = 1.0 + tolerance * nodes
            x = (design * factor - self._centre[axis]) / self._half_width[axis]
            basis = chebyshev_basis(x, len(nodes))
            derivative = chebder(np.eye(len(nodes)))
            slope = np.tensordot(derivative, basis[: len(derivative)], axes=(0, 0))
            slope /= self._half_width[axis]
            parts = basis, slope * factor, slope * (design * nodes)
            yield tuple(part.transpose(1, 0, 2) @ rule for part in parts)

    def _expand(self, rows: Arrays) -> Arrays:
        """Return the coefficients with 0, 1, .. m variables expanded, shape (n or 1, size) each.

        A step takes the leading variable away and puts its expansion last, so that every stage
        begins with the variable to expand next, and the last stage with the constant.
        """
        stages = [self._coefficients.reshape(1, -1)]
        for values in rows:
            leading = stages[-1].reshape(len(stages[-1]), values.shape[1], -1)
            stages.append((leading.transpose(0, 2, 1) @ values).reshape(len(values), -1))
        return stages


def _legendre_rule(size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return nodes s, shape (size,), and the matrix from values there to coefficients.

    Column l gives the coefficient of the l-th Legendre polynomial, normalised for s uniform in
    -1..1; exact for polynomials of degree below ``size``.
    """
    nodes, weights = leggauss(size)
    normalised = legvander(nodes, size - 1) * np.sqrt(2.0 * np.arange(size) + 1.0)
    return nodes, normalised * (weights[:, None] / 2.0)


def _pulled_back(
    weights: NDArray[np.float64],
    stages: Arrays,
    rows: list[tuple[NDArray[np.float64], ...]],
) -> NDArray[np.float64]:
    """Return the gradient of the last stage, summed with these weights, shape (n, m + 1).

    Weights (n, size) of a stage turn into those of the stage before (reverse differentiation).
    """
    gradient = np.zeros((len(weights), len(rows) + 1))
    for axis in reversed(range(len(rows))):
        values, by_design, by_tolerance = rows[axis]
        size = values.shape[1]
        after = weights.reshape(len(weights), -1, size)
        before = stages[axis].reshape(len(stages[axis]), size, -1)
        of_rows = before @ after
        gradient[:, axis] = np.einsum("nil,nil->n", of_rows, by_design)
        gradient[:, -1] += np.einsum("nil,nil->n", of_rows, by_tolerance)
        weights = (values @ after.transpose(0, 2, 1)).reshape(len(weights), -1)
    return gradient


def _with_noise_expanded(
    coefficients: NDArray[np.float64], uncertainty: Uncertainty
) -> NDArray[np.float64]:
    """Return the coefficients (p_1, .., p_m, noise): designed variables first, noise flattened.

    In each noise variable they belong to polynomials that are orthonormal under its distribution,
    the constant first.
    """
    noise_axes = [axis for axis, entry in enumerate(uncertainty.inputs) if not entry.scales_design]
    box = uncertainty.surrogate_box
    for axis in noise_axes:
        size = coefficients.shape[axis]
        values, weights = uncertainty.inputs[axis].quadrature(2 * (size - 1))
        cube = (values - box.centre[axis]) / box.half_width[axis]
        change = to_orthonormal(cube, weights, size)
        coefficients = np.moveaxis(np.tensordot(change, coefficients, (1, axis)), 0, axis)
    designed = [coefficients.shape[axis] for axis in uncertainty.design_axes]
    ordered = coefficients.transpose(*uncertainty.design_axes, *noise_axes)
    return ordered.reshape(*designed, prod(ordered.shape[len(designed) :]))
