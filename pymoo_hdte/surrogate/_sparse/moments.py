"""Exact mean and standard deviation of a sparse polynomial, and its expansion around designs.

Around each design the polynomial is written anew in polynomials that are orthonormal under the
scatter (polynomial chaos, Xiu and Karniadakis, SIAM J. Scientific Computing 24, 2002). Its first
coefficient is the mean, the squares of all others add up to the variance: it is never negative,
and nothing large is subtracted.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.polynomial.chebyshev import chebder
from numpy.typing import NDArray

from pymoo_hdte._compilation import COMPILES
from pymoo_hdte._unchanging import Unchanging
from pymoo_hdte.surrogate._sparse.axes import Axis
from pymoo_hdte.surrogate._sparse.index_set import AxisMap
from pymoo_hdte.surrogate._sparse.many_designs import ManyDesigns
from pymoo_hdte.surrogate._sparse.measures import Measure, OrthonormalPolynomials
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial
from pymoo_hdte.surrogate.moments import deviation, divide_or_zero
from pymoo_hdte.surrogate.tensor import chebyshev_basis
from pymoo_hdte.surrogate.threads import ENOUGH_FOR_THREADS, ENOUGH_TO_COMPILE, in_blocks

Array = NDArray[np.float64]

_AT_ONCE = 2**18
"""Numbers in one array: more exceed the processor's cache, fewer cost numpy overhead."""


class SparseMoments(Unchanging):
    """The expansion of r responses around a design, and their moments.

    Parameters
    ----------
    polynomial : SparsePolynomial
        Polynomial in d variables.
    axes : sequence of Axis, length d
        Their coordinates and scatter; m of them, one or more, have designs.
    measures : list of Measure, length d, optional
        Measures of the scatter, in place of the whole measure of each axis.

    Attributes
    ----------
    indices : ndarray of int, shape (q, d)
        Degrees of the expansion's terms in the scatter of each variable; the first is 0.
    orthonormal : list of OrthonormalPolynomials, length d
        Orthonormal polynomials under the scatter of each variable.
    """

    def __init__(
        self,
        polynomial: SparsePolynomial,
        axes: list[Axis],
        measures: list[Measure] | None = None,
    ) -> None:
        self.axes = axes
        measures = [axis.measure for axis in axes] if measures is None else measures
        self.designed = [j for j, axis in enumerate(axes) if axis.designed]
        self.orthonormal = [
            OrthonormalPolynomials(measure, degree)
            for measure, degree in zip(measures, polynomial.degrees, strict=True)
        ]
        indices, coefficients = polynomial.indices, polynomial.coefficients[None]
        for j in (j for j, axis in enumerate(axes) if not axis.designed):
            step = AxisMap(indices, j, self.orthonormal[j].size)
            matrix, _ = self._matrices(j, step.columns, None)
            indices, coefficients = step.result, step.forward(coefficients, matrix)
        self._coefficients, self._steps = coefficients, []
        for j in self.designed:
            step = AxisMap(indices, j, self.orthonormal[j].size)
            self._steps.append(step)
            indices = step.result
        order = np.lexsort(indices.T[::-1])
        self._order, self.indices = order, indices[order]
        largest = max(step.size for step in self._steps)
        self._at_once = max(1, _AT_ONCE // (largest * coefficients.shape[1]))

    def expansion(self, designs: Array) -> Array:
        """Return the coefficients around designs of shape (n, m), shape (n, r, q)."""
        parts = [self._stages(designs[block])[-1] for block in self._blocks(len(designs))]
        return np.concatenate(parts)[..., self._order]

    def __call__(self, designs: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation, shape (n, r) each, in the responses' units."""
        if COMPILES and len(designs) >= ENOUGH_TO_COMPILE:
            return self._many_moments(designs)
        expansion = self.expansion(designs)
        return expansion[..., 0], deviation(expansion)

    def _many_moments(self, designs: Array) -> tuple[Array, Array]:
        moments = self._many_designs
        mean, std = np.empty((2, len(designs), self._coefficients.shape[1]))

        def fill(block: slice) -> None:
            around = [
                self.axes[j].around(column)[:2]
                for j, column in zip(self.designed, designs[block].T, strict=True)
            ]
            offsets, factors = np.moveaxis(np.array(around), 1, 0)
            mean[block], std[block] = moments(offsets, factors)

        in_blocks(fill, len(designs), ENOUGH_FOR_THREADS)
        return mean, std

    @cached_property
    def _many_designs(self) -> ManyDesigns:
        families = [self.orthonormal[j] for j in self.designed]
        return ManyDesigns(self._coefficients[0], self._steps, families)

    def pulled_back(self, designs: Array, weights: Array) -> Array:
        """Return the gradient in the design of sums over the expansion, shape (n, r, m).

        Parameters
        ----------
        designs : ndarray, shape (n, m)
        weights : ndarray, shape (n, r, q)
            Derivatives of some number of each response in the coefficients of its expansion.
        """
        gradient = np.zeros((len(designs), weights.shape[1], len(self.designed)))
        unsorted = np.empty_like(weights)
        unsorted[..., self._order] = weights
        for block in self._blocks(len(designs)):
            stages, back = self._stages(designs[block]), unsorted[block]
            for place in reversed(range(len(self._steps))):
                step, axis = self._steps[place], self.designed[place]
                matrix, slope = self._matrices(axis, step.columns, designs[block, place])
                of_matrix = step.of_matrix(back, stages[place])
                gradient[block, :, place] = np.einsum("nrlk,nlk->nr", of_matrix, slope)
                back = step.backward(back, matrix, stages[place].shape[-1])
        return gradient

    def divided_variance(self, expansion: Array) -> tuple[float, Array, Array]:
        """Return the variance of an expansion of shape (q,), and what of it is due to each input.

        First the shares of the inputs alone, then those in which they take part, shape (d,) each.
        """
        squares = expansion[1:] ** 2
        variance = float(squares.sum())
        shares = divide_or_zero(squares, np.full_like(squares, variance))
        takes_part = self.indices[1:] > 0
        alone = takes_part.sum(axis=1) == 1
        return variance, shares * alone @ takes_part, shares @ takes_part

    def basis(self, scatter: Array) -> Array:
        """Return the expansion's polynomials at values of all s, shape (n, d), as (n, q)."""
        product = np.ones((len(scatter), len(self.indices)))
        for j, family in enumerate(self.orthonormal):
            if family.size > 1:
                product *= family(scatter[:, j]).T[:, self.indices[:, j]]
        return product

    def _blocks(self, n: int) -> Iterator[slice]:
        return (slice(start, start + self._at_once) for start in range(0, n, self._at_once))

    def _stages(self, designs: Array) -> list[Array]:
        """Return the coefficients with 0, 1, .. m designed variables expanded."""
        stages = [self._coefficients]
        for place, step in enumerate(self._steps):
            axis = self.designed[place]
            matrix, _ = self._matrices(axis, step.columns, designs[:, place])
            stages.append(step.forward(stages[-1], matrix))
        return stages

    def _matrices(self, j: int, columns: int, designs: Array | None) -> tuple[Array, Array]:
        """Return what changes T_k(A + B s) into the orthonormal p_l(s), and its slope.

        Both have shape (n, rows, columns), with n = 1 for noise.
        """
        axis, family = self.axes[j], self.orthonormal[j]
        offset, factor, d_offset, d_factor = axis.around(designs)
        z = offset[:, None] + factor[:, None] * family.nodes
        basis = chebyshev_basis(z, columns)
        rule = (family(family.nodes) * family.weights).T
        matrix = np.einsum("knq,ql->nlk", basis, rule, optimize=True)
        slopes = np.zeros_like(basis)
        if columns > 1:
            derivative = chebder(np.eye(columns))
            slopes = np.tensordot(derivative, basis[: len(derivative)], axes=(0, 0))
        slopes *= d_offset[:, None] + d_factor[:, None] * family.nodes
        return matrix, np.einsum("knq,ql->nlk", slopes, rule, optimize=True)
