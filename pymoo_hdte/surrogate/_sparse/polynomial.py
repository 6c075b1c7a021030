"""Polynomials in many variables whose Chebyshev coefficients live on a sparse set of degrees."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.index_set import AxisMap
from pymoo_hdte.surrogate.tensor import chebyshev_basis

_AT_ONCE = 2**18
"""Numbers in one array: more exceed a processor's cache."""


class SparsePolynomial:
    """Several Chebyshev series on the cube [-1, 1]^d over one downward-closed set of degrees.

    Parameters
    ----------
    indices : ndarray of int, shape (p, d)
        Degrees of the terms.
    coefficients : ndarray, shape (r, p)
        Coefficients of r responses, in their units.
    """

    def __init__(self, indices: NDArray[np.int_], coefficients: NDArray[np.float64]) -> None:
        self.indices = np.array(indices)
        self.coefficients = np.array(coefficients, dtype=float)
        for array in (self.indices, self.coefficients):
            array.flags.writeable = False

    @classmethod
    def from_triangular(
        cls,
        indices: NDArray[np.int_],
        coefficients: NDArray[np.float64],
        matrices: list[NDArray[np.float64]],
    ) -> SparsePolynomial:
        """Return the polynomial with these coefficients in another basis that keeps degrees.

        Parameters
        ----------
        indices : ndarray of int, shape (p, d)
            A downward-closed set.
        coefficients : ndarray, shape (r, p)
        matrices : list of ndarray
            For every variable, column j holds the polynomial of degree j in T_0, T_1, ..
        """
        changed = coefficients[None]
        for axis, matrix in enumerate(matrices):
            columns = int(indices[:, axis].max()) + 1
            step = AxisMap(indices, axis, columns)
            changed = step.forward(changed, matrix[None, :columns, :columns])
        return cls(indices, changed[0])

    @property
    def degrees(self) -> tuple[int, ...]:
        """Highest degree in each variable."""
        return tuple(self.indices.max(axis=0).tolist())

    def __call__(self, cube: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values, shape (n, r), at points of shape (n, d) of the cube."""
        values = np.empty((len(cube), len(self.coefficients)))
        step = max(1, _AT_ONCE // len(self.indices))
        for start in range(0, len(cube), step):
            block = slice(start, start + step)
            values[block] = (self.coefficients @ self._products(cube[block].T)).T
        return values

    @cached_property
    def _factors(self) -> list[tuple[NDArray[np.int_], ...]]:
        """For each axis: terms whose last variable it is, the same without it, and its degrees."""
        places = {tuple(row): place for place, row in enumerate(self.indices.tolist())}
        last_axis = np.max(np.where(self.indices > 0, np.arange(self.indices.shape[1]), -1), axis=1)
        factors: list[tuple[NDArray[np.int_], ...]] = []
        for axis in range(self.indices.shape[1]):
            terms = np.flatnonzero(last_axis == axis)
            without = self.indices[terms]
            without[:, axis] = 0
            before = np.array([places[tuple(row)] for row in without.tolist()], dtype=int)
            factors.append((terms, before, self.indices[terms, axis]))
        return factors

    def _products(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the terms, shape (p, n), each from the one without its last variable."""
        product = np.ones((len(self.indices), x.shape[1]))
        for z, degree, (terms, before, degrees) in zip(x, self.degrees, self._factors, strict=True):
            product[terms] = product[before] * chebyshev_basis(z, degree + 1)[degrees]
        return product
