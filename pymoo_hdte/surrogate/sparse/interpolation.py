"""Interpolation on a downward-closed set that grows one index, and one run, at a time.

The function is known at one point for each index: the nested points of its variables. What an index
adds to the interpolant, its surplus, is the error of the prediction there just before (Gerstner and
Griebel, Computing 71, 2003; Chkifa, Cohen and Schwab, Foundations of Computational Mathematics 14,
2014).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from pymoo_hdte.surrogate.sparse.axes import Axis
from pymoo_hdte.surrogate.sparse.index_set import neighbours, parents
from pymoo_hdte.surrogate.sparse.leja import HIGHEST_DEGREE, hierarchical_basis
from pymoo_hdte.surrogate.sparse.polynomial import SparsePolynomial

Array = NDArray[np.float64]
Index = tuple[int, ...]

ROUGHNESS = 4.0
"""Weight of a surplus for each degree, where values are missing."""


class GrowingInterpolation:
    """The interpolant of r responses, from its first point on.

    Parameters
    ----------
    axes : list of Axis, length d

    Attributes
    ----------
    members : list of tuple of int
        The set, in the order of growth.
    """

    def __init__(self, axes: list[Axis]) -> None:
        self.axes = axes
        self.members: list[Index] = []
        self._points = [axis.points for axis in axes]
        self._tables = [hierarchical_basis(points, points) for points in self._points]
        self._place: dict[Index, int] = {}
        self._surpluses: list[Array] = []
        self._values: list[Array] = []

    @property
    def surpluses(self) -> Array:
        """What each member added, shape (p, r)."""
        return np.array(self._surpluses)

    @property
    def indices(self) -> NDArray[np.int_]:
        """The set, shape (p, d)."""
        return np.array(self.members, dtype=int)

    def point(self, index: Index) -> Array:
        """Return where the function is needed for an index, shape (d,), in -1..1."""
        return np.array([points[k] for points, k in zip(self._points, index, strict=True)])

    def add(self, index: Index, values: Array) -> None:
        """Add an index with the r values of the function at its point, NaN where it failed.

        A failed one adds nothing until `complete` is called.
        """
        surplus = np.array(values, dtype=float)
        self._values.append(surplus.copy())
        if self.members:
            surplus -= self._at_member(index) @ self.surpluses
        surplus = np.where(np.isfinite(surplus), surplus, 0.0)
        self._place[index] = len(self.members)
        self.members.append(index)
        self._surpluses.append(surplus)

    def complete(self) -> None:
        """Give failed points the values that make surpluses of high degree least.

        Their sum of squares is made least, each weighted by `ROUGHNESS` to the power of its degree:
        the polynomial then goes on smoothly where the function is not known.
        """
        values, indices = np.array(self._values), self.indices
        failed = np.flatnonzero(np.isnan(values).any(axis=1))
        if not len(failed):
            return
        matrix = np.ones((len(values), len(values)))
        for j, table in enumerate(self._tables):
            matrix *= table[indices[:, j]][:, indices[:, j]].T
        unknown = np.zeros((len(values), len(failed)))
        unknown[failed, np.arange(len(failed))] = 1.0
        values[failed] = 0.0
        # Members stand in an order in which each is below none before it.
        given, moved = np.split(
            solve_triangular(matrix, np.hstack([values, unknown]), lower=True),
            [values.shape[1]],
            axis=1,
        )
        weight = ROUGHNESS ** indices.sum(axis=1)[:, None].astype(float)
        found = np.linalg.lstsq(weight * moved, -weight * given, rcond=None)[0]
        self._surpluses = list(given + moved @ found)

    def _at_member(self, index: Index) -> Array:
        indices = self.indices
        product = np.ones(len(indices))
        for j, k in enumerate(index):
            product *= self._tables[j][indices[:, j], k]
        return product

    def candidates(self) -> list[Index]:
        """Return the indices that may be added next, the set staying downward-closed."""
        if not self.members:
            return [(0,) * len(self.axes)]
        above = {new for member in self.members for new in neighbours(member)}
        return [
            new
            for new in sorted(above)
            if new not in self._place
            and max(new) <= HIGHEST_DEGREE
            and all(parent in self._place for _, parent in parents(new))
        ]

    def place(self, index: Index) -> int:
        """Return the position of a member."""
        return self._place[index]

    def polynomial(self) -> SparsePolynomial:
        """Return the interpolant in Chebyshev polynomials."""
        return SparsePolynomial.from_hierarchical(self.indices, self.surpluses.T, self._points)
