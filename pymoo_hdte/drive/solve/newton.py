"""Newton's method for the harmonic balance: steps of torsion and speed, and how far they go.

Hysteresis enters a step with its memory: the torque of a sticking spring depends on the torsion
where it last slipped. Laws with kinks make full steps cycle between them, so that a step goes as
far as it reduces what the equations leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive.solve.angle_equations import AngleEquations, Values, mean
from pymoo_hdte.drive.solve.steady_motion import Factors, Phasors

Matrix = NDArray[np.float64]

_NEARLY_CONSTANT = 0.02
"""Relative variation of the mesh stiffness up to which a step uses its mean."""
_PARTS = 0.5 ** np.arange(1, 5)
"""Parts of a step that are tried; with 1/16 as the least the fewest of 756 cases were lost."""


_BY_ROW = (
    "torsion", "energy", "distance", "_mesh_slope", "_impedance", "_energy_change", "_left",
    "_viscous", "_level",
)  # fmt: skip


class Place:
    """A torsion and E of all rows, with what the equations leave there.

    E is eliminated: near the steady state it answers to the mesh torque harmonic by harmonic.

    Attributes
    ----------
    torsion, energy : complex ndarray, shape (n, n_harmonics)
    distance : ndarray, shape (n, 1)
        Size, rad, of the torsion that the torques left would cause without their coupling.
    """

    def __init__(self, equations: AngleEquations, torsion: Phasors, energy: Phasors) -> None:
        motion = equations.motion(torsion, energy)
        self.equations, self.torsion, self.energy = equations, torsion, motion.energy
        self._mesh_slope = motion.mesh_slope
        ratio = equations.coefficients.ratio
        operator = equations.input_operator
        loss = mean(motion.output_loss)
        self._impedance, coupling, share = equations.impedance(loss)
        missing, of_output, *_ = equations.residuals(motion)
        self._energy_change = -ratio * missing / operator
        self._energy_change[:, 0] = 0.0
        self._left = (of_output + coupling * self._energy_change) / share
        self._viscous = equations.rate * mean(motion.mesh_damping) - self._impedance
        self._level = mean(motion.mesh_slope)
        of_each = self._left / (np.abs(self._level) + np.abs(self._viscous))
        distance = np.linalg.norm(of_each, axis=1, keepdims=True)
        # A row that has diverged is farther away than any other place.
        self.distance = np.where(np.isnan(distance), np.inf, distance)

    def rows(self, equations: AngleEquations, rows: NDArray[np.int_]) -> Place:
        """Return the place of some of the rows, whose equations are given."""
        some = copy(self)
        some.equations = equations
        for name in _BY_ROW:
            setattr(some, name, getattr(self, name)[rows])
        return some

    def replaced(self, rows: NDArray[np.int_], other: Place, others: NDArray[np.int_]) -> Place:
        """Return the place with other rows, of another place, in place of some rows."""
        both = copy(self)
        for name in _BY_ROW:
            values = getattr(self, name).copy()
            values[rows] = getattr(other, name)[others]
            setattr(both, name, values)
        return both

    def moved(self, change: Phasors, energy_change: Phasors) -> Place:
        """Return the place after a change, at the wanted speed."""
        return Place(self.equations, self.torsion + change, self.energy + energy_change)

    def newton_step(
        self, size: Values, factors: Sequence[Factors | None]
    ) -> tuple[Phasors, Phasors]:
        """Return a step of torsion and E together, at most ``size`` (n, 1) of the torsion.

        It is taken with the given factors of a matrix for each row, or, where these are None, by
        each harmonic for itself.
        """
        change = self._torsion_change(factors)
        # Where a law removes the stiffness, a full step may be far too long.
        longest = np.abs(change).max(axis=1, keepdims=True)
        change *= np.minimum(1.0, size / np.maximum(longest, 1e-300))
        energy_change = self._energy_change.copy()
        operator = self.equations.input_operator
        energy_change[:, 1:] -= ((self._left + self._impedance * change) / operator)[:, 1:]
        # Nor may the speed come near zero on the way.
        largest = np.abs(energy_change).sum(axis=1, keepdims=True)
        slowest = 0.5 * self.energy[:, :1].real
        energy_change *= np.minimum(1.0, slowest / np.maximum(largest, 1e-300))
        return change, energy_change

    def _torsion_change(self, factors: Sequence[Factors | None]) -> Phasors:
        """Return the change of the torsion by the linearised mesh, its memory included."""
        found = stacked(self._left / (self._level + self._viscous))
        real = stacked(self._left)
        # The mean has no imaginary part.
        real[:, self._left.shape[1]] = 0.0
        for row, one in enumerate(factors):
            if one is not None:
                found[row] = scipy.linalg.lapack.dgetrs(*one, real[row])[0]
        return unstacked(found)

    def factors(self, rows: NDArray[np.int_]) -> list[Factors | None]:
        """Return the factors of the `matrix` of some rows; None where there is none."""
        matrices = self.matrix(rows) if rows.size else None
        return [None] * len(rows) if matrices is None else [factored(one) for one in matrices]

    def matrix(self, rows: NDArray[np.int_]) -> Matrix | None:
        """Return the derivative (m, 2 H, 2 H) of what is left of some rows by their torsion.

        None where the mesh is so nearly linear that each harmonic answers for itself.
        """
        equations = self.equations
        if equations.remembers:
            of_rows = equations if len(rows) == len(self.torsion) else equations.rows(rows)
            recall = of_rows.recall_matrix(self.torsion[rows])
        slope, level = self._mesh_slope[rows], self._level[rows]
        varies = np.abs(slope - level) > _NEARLY_CONSTANT * np.abs(level)
        if not (equations.remembers or np.any(varies)):
            return None
        matrix = equations.torus.product_matrix(slope) + multiplication(self._viscous[rows])
        if equations.remembers:
            matrix += recall
        # The mean has no imaginary part: an equation for it must not be missing.
        empty = len(equations.torus.orders)
        matrix[:, empty, empty] = np.abs(matrix[:, 0, 0])
        return matrix


def factored(matrix: Matrix) -> Factors:
    """Return the factors of a matrix (m, m); a singular one leads its row to no number."""
    triangles, pivots, _ = scipy.linalg.lapack.dgetrf(matrix)
    return triangles, pivots


def nearer(at: Place, change: Phasors, energy_change: Phasors, settled: NDArray[np.bool_]) -> Place:
    """Return the place after the longest part of a step that leaves less, the best if none does.

    Rows that have ``settled`` take the whole step.
    """
    there = at.moved(change, energy_change)
    short = np.flatnonzero((there.distance >= at.distance)[:, 0] & ~settled)
    if not short.size:
        return there
    # In one call, as most of the time of a small one goes by before it begins.
    rows, parts = np.tile(short, len(_PARTS)), np.repeat(_PARTS, short.size)[:, None]
    begin = at.rows(at.equations.rows(rows), rows)
    tried = begin.moved(parts * change[rows], parts * energy_change[rows])
    distance = tried.distance.reshape(len(_PARTS), -1)
    less = distance < at.distance[short, 0]
    choice = np.where(less.any(axis=0), less.argmax(axis=0), distance.argmin(axis=0))
    each = np.arange(short.size)
    taken = less.any(axis=0) | (distance[choice, each] < there.distance[short, 0])
    return there.replaced(short[taken], tried, (choice * short.size + each)[taken])


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
