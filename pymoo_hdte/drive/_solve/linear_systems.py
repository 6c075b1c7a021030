"""Linear systems of Newton's method: a factored matrix, or an iteration led by a smaller one.

A system stands for the derivative of what a balance leaves by the harmonics of the torsion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from pymoo_hdte.drive._solve.recursion import Recollection
from pymoo_hdte.drive._solve.torus import Torus

Phasors = NDArray[np.complex128]
Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]

_RESIDUAL = 1e-5
"""Share of the right side that an iteration may leave: so steps shrink faster than they have to to
go on with the system of another place (to a tenth)."""
_WORTH = 6
"""Unknowns for each product with a signal from which on the factored matrix has cost less: beside a
hysteresis one of 256 unknowns took as long as 36 products, one of 426 as long as 70."""
_LARGEST = 1500
"""Most unknowns of a matrix that takes the place of an iteration: 18 MB for each record."""
_MOST = (40, 5)
"""Directions kept by an iteration until it restarts, and the largest number of restarts."""


class LinearSystem(Protocol):
    """A derivative by the real parts of H harmonics and their imaginary parts."""

    def solve(self, right: Vector) -> Vector:
        """Return the unknowns (2 H,) for a right side (2 H,)."""
        ...


@dataclass(frozen=True, eq=False)
class Factored:
    """A matrix (2 H, 2 H) as the product of triangles, and the order of its rows."""

    triangles: Matrix
    pivots: NDArray[np.int_]

    def solve(self, right: Vector) -> Vector:
        """Return the unknowns (2 H,) for a right side (2 H,)."""
        unknowns: Vector = scipy.linalg.lapack.dgetrs(self.triangles, self.pivots, right)[0]
        return unknowns


def factored(matrix: Matrix) -> Factored:
    """Return the factors of a matrix (m, m); a singular one leads its row to no number."""
    triangles, pivots, _ = scipy.linalg.lapack.dgetrf(matrix)
    return Factored(triangles, pivots)


class Linearised(NamedTuple):
    """A balance linearised by the torsion of n rows.

    Attributes
    ----------
    torus : Torus
    slope : ndarray, shape (n, G)
        Slope of the torque by the torsion on the grid.
    viscous : ndarray of complex, shape (n, H)
        Factor by which each harmonic is multiplied besides.
    recollection : Recollection, optional
        How the torque depends on the torsion elsewhere.
    """

    torus: Torus
    slope: NDArray[np.float64]
    viscous: Phasors
    recollection: Recollection | None

    def matrix(self) -> Matrix:
        """Return the matrices (n, 2 H, 2 H)."""
        matrix = self.torus.product_matrix(self.slope) + multiplication(self.viscous)
        if self.recollection is not None:
            matrix += self.torus.recall_matrix(self.recollection)
        # The mean has no imaginary part: an equation for it must not be missing.
        empty = len(self.torus.orders)
        matrix[:, empty, empty] = np.abs(matrix[:, 0, 0])
        return matrix

    def core(self) -> Linearised:
        """Return the linearisation among the harmonics of one beat at a time."""
        viscous = self.viscous[:, self.torus.of_core]
        return Linearised(self.torus.core, self.slope, viscous, self.recollection)

    def row(self, row: int) -> Linearised:
        """Return one of the rows."""
        at, recollection = slice(row, row + 1), self.recollection
        memory = None if recollection is None else recollection.rows(at)
        return Linearised(self.torus, self.slope[at], self.viscous[at], memory)


class Iterated:
    """One row of `Linearised`, solved by products with single signals (GMRES).

    Saad and Schultz, SIAM J. Scientific and Statistical Computing 7 (1986). It is led by the
    factored matrix of the harmonics of one beat at a time; each of the others stands alone there.
    """

    def __init__(self, row: Linearised, core: Factored) -> None:
        self._row, self._core = row, core
        self._alone = float(np.mean(row.slope)) + row.viscous[0]
        self._core_places = np.concatenate(
            [row.torus.of_core, row.torus.of_core + len(self._alone)]
        )
        self._whole: Factored | None = None
        self._products = 0

    def solve(self, right: Vector) -> Vector:
        """Return the unknowns (2 H,) for a right side (2 H,) without imaginary part of the mean.

        By the whole matrix where the iteration does not end, as a poor step could be taken for one
        that has arrived, and where it has cost as much before: derivatives by all values of a fit
        are found with the same system.
        """
        if not np.isfinite(np.linalg.norm(right)):
            return np.full_like(right, np.nan)
        if self._whole is None:
            size, (restart, most) = len(right), _MOST
            whole = LinearOperator((size, size), matvec=self._times, dtype=float)
            preconditioner = LinearOperator((size, size), matvec=self._precondition, dtype=float)
            unknowns, failed = gmres(
                whole, right, rtol=_RESIDUAL, restart=restart, maxiter=most, M=preconditioner
            )
            worth = _WORTH * self._products > size <= _LARGEST
            if not failed and not worth:
                return np.asarray(unknowns)
            self._whole = factored(self._row.matrix()[0])
        return self._whole.solve(right)

    def _times(self, values: Vector) -> Vector:
        """Return the product of the derivative and values (2 H,)."""
        self._products += 1
        row, torus = self._row, self._row.torus
        phasors = unstacked(values[np.newaxis])
        signal = torus.signal(phasors)
        torque = row.slope * signal
        if row.recollection is not None:
            torque += row.recollection.of_signals(signal.T).T
        return stacked(torus.phasors(torque) + row.viscous * phasors)[0]

    def _precondition(self, values: Vector) -> Vector:
        """Return an approximation of `solve`."""
        unknowns = stacked(unstacked(values) / self._alone)
        unknowns[self._core_places] = self._core.solve(values[self._core_places])
        return unknowns


def stacked(phasors: Phasors) -> NDArray[np.float64]:
    """Return real and imaginary parts side by side, shape (n, 2 H)."""
    return np.concatenate([phasors.real, phasors.imag], axis=-1)


def unstacked(values: NDArray[np.float64]) -> Phasors:
    """Undo `stacked`."""
    half = values.shape[-1] // 2
    return values[..., :half] + 1j * values[..., half:]


def multiplication(factor: Phasors) -> NDArray[np.float64]:
    """Return the real matrices, (n, 2 H, 2 H), that multiply each harmonic by its ``factor``."""
    n, size = factor.shape
    matrix = np.zeros((n, 2 * size, 2 * size))
    place = np.arange(size)
    matrix[:, place, place] = matrix[:, place + size, place + size] = factor.real
    matrix[:, place, place + size] = -factor.imag
    matrix[:, place + size, place] = factor.imag
    return matrix
