"""Newton's method for the harmonic balance: steps of torsion and speed, and how far they go.

Hysteresis enters a step with its memory: the torque of a sticking spring depends on the torsion
where it last slipped. Laws with kinks make full steps cycle between them, so that a step goes as
far as it reduces what the equations leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.angle_equations import AngleEquations, Values, mean
from pymoo_hdte.drive._solve.linear_systems import (
    Iterated,
    Linearised,
    LinearSystem,
    factored,
    stacked,
    unstacked,
)
from pymoo_hdte.drive._solve.steady_motion import Phasors

_NEARLY_CONSTANT = 0.02
"""Relative variation of the mesh stiffness up to which a step uses its mean."""
_OF_A_MATRIX = 300
"""Most harmonics of several beats for which steps are taken with whole matrices.

Without them a verdict with 230 of two beats took as long as with them, a screening with 298 of
three twice as long; a solution with 689 of three a sixth of the time, with 1607 a twentieth.
"""
_PARTS = 0.5 ** np.arange(1, 5)
"""Parts of a step that are tried; with 1/16 as the least the fewest of 756 cases were lost."""


_BY_ROW = (
    "torsion", "energy", "distance", "_mesh_slope", "_impedance", "_energy_change", "_residual",
    "_viscous", "_level",
)  # fmt: skip


class Place:
    """A torsion and E of all rows, with what the equations leave there.

    E is eliminated: near the steady state it answers to the mesh torque harmonic by harmonic, and
    where it is prescribed not at all.

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
        if equations.prescribed:
            self._energy_change[:] = 0.0
        self._residual = (of_output + coupling * self._energy_change) / share
        self._viscous = equations.rate * mean(motion.mesh_damping) - self._impedance
        self._level = mean(motion.mesh_slope)
        of_each = self._residual / (np.abs(self._level) + np.abs(self._viscous))
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

    def replaced(
        self, rows: NDArray[np.int_], source: Place, source_rows: NDArray[np.int_]
    ) -> Place:
        """Return this place with some rows taken over from another place."""
        merged = copy(self)
        for name in _BY_ROW:
            values = getattr(self, name).copy()
            values[rows] = getattr(source, name)[source_rows]
            setattr(merged, name, values)
        return merged

    def moved(self, change: Phasors, energy_change: Phasors) -> Place:
        """Return the place after a change, at the wanted speed."""
        return Place(self.equations, self.torsion + change, self.energy + energy_change)

    def newton_step(
        self, size: Values, systems: Sequence[LinearSystem | None]
    ) -> tuple[Phasors, Phasors]:
        """Return a step of torsion and E together, at most ``size`` (n, 1) of the torsion.

        It is taken with the given linear system of each row, or, where this is None, by each
        harmonic for itself.
        """
        change = self._torsion_change(systems)
        # Where a law removes the stiffness, a full step may be far too long.
        longest = np.abs(change).max(axis=1, keepdims=True)
        change *= np.minimum(1.0, size / np.maximum(longest, 1e-300))
        energy_change = self._energy_change.copy()
        if self.equations.prescribed:
            return change, energy_change
        operator = self.equations.input_operator
        energy_change[:, 1:] -= ((self._residual + self._impedance * change) / operator)[:, 1:]
        # Nor may the speed come near zero on the way.
        largest = np.abs(energy_change).sum(axis=1, keepdims=True)
        slowest = 0.5 * self.energy[:, :1].real
        energy_change *= np.minimum(1.0, slowest / np.maximum(largest, 1e-300))
        return change, energy_change

    def _torsion_change(self, systems: Sequence[LinearSystem | None]) -> Phasors:
        """Return the change of the torsion by the linearised mesh, its memory included."""
        change = stacked(self._residual / (self._level + self._viscous))
        real = stacked(self._residual)
        # The mean has no imaginary part.
        real[:, self._residual.shape[1]] = 0.0
        for row, system in enumerate(systems):
            if system is not None:
                change[row] = system.solve(real[row])
        return unstacked(change)

    def systems(self, rows: NDArray[np.int_]) -> list[LinearSystem | None]:
        """Return the linear systems of steps of some rows; None where there is none.

        Where the mesh is so nearly linear that each harmonic answers for itself, none is needed.
        """
        if not rows.size:
            return []
        equations, slope, level = self.equations, self._mesh_slope[rows], self._level[rows]
        recollection = None
        if equations.remembers:
            of_rows = equations if len(rows) == len(self.torsion) else equations.rows(rows)
            recollection = of_rows.recollection(self.torsion[rows])
        varies = np.abs(slope - level) > _NEARLY_CONSTANT * np.abs(level)
        if recollection is None and not np.any(varies):
            return [None] * len(rows)
        torus = equations.torus
        linearised = Linearised(torus, slope, self._viscous[rows], recollection)
        if len(torus.orders) <= _OF_A_MATRIX or len(torus.of_core) == len(torus.orders):
            return [factored(matrix) for matrix in linearised.matrix()]
        cores = linearised.core().matrix()
        return [Iterated(linearised.row(n), factored(core)) for n, core in enumerate(cores)]


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
    indices = np.arange(short.size)
    taken = less.any(axis=0) | (distance[choice, indices] < there.distance[short, 0])
    return there.replaced(short[taken], tried, (choice * short.size + indices)[taken])
