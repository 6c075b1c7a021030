"""Steady state of the full equations, laws at ports included, by harmonic balance over the angle.

The terms of `angle_equations` are evaluated on a grid (`torus`) and brought to zero harmonic by
harmonic (Newton's method; alternating time and frequency, Cameron and Griffin, J. Applied Mechanics
56, 1989); the coupling of speed and torsion is weak and treated by iteration. Hysteresis enters the
step with its memory: the torque of a sticking spring depends on the torsion where it last slipped.
"""

from __future__ import annotations

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive.solve.angle_equations import AngleEquations, TorsionMotion, Values, mean
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.drive.solve.steady_motion import (
    BY_CASE,
    CONSTANT_TORQUE,
    Phasors,
    SpeedLoop,
    SteadyMotion,
)
from pymoo_hdte.drive.solve.torus import (
    Matrices,
    Torus,
    fundamental_orders,
    largest_multiples,
    multiplication,
    shared_torus,
    stacked,
    unstacked,
)

HIGHEST = 8
"""Least number of harmonics of the input turn that are kept."""
STEPS = 50
"""Most steps of Newton's method."""
_WITHOUT_MEMORY = 10
"""Steps before those that include the memory of hysteresis, which cost ten times as much."""
_NEARLY_CONSTANT = 0.02
"""Relative variation of the mesh stiffness up to which Newton's step uses its mean."""
_SHRINKS = 0.9
"""A full step is taken again only where it is shorter than this share of the previous one."""
_LEAST_PART = 0.1
_ROWS_AT_ONCE = 64


def torus_of(coefficients: Coefficients) -> Torus:
    """Return a torus that holds all excited orders with room for their combinations."""
    excited = [float(order) for order in coefficients.error_orders]
    for port, law in coefficients.laws:
        scale = 1.0 / coefficients.ratio if port == "output" else 1.0
        excited += [scale * order for order in law.orders]
    fundamentals = fundamental_orders(excited)
    needed = largest_multiples(fundamentals, excited)
    # A line that modulates the input angle itself has a strong second harmonic over that angle.
    whole = max(HIGHEST, 2 * int(np.ceil(max(excited, default=0.0))) + 1)
    # The first fraction is that of the static error, whose beat the stiffness may modulate.
    fractions = [most + (place == 0) for place, most in enumerate(needed[1:])]
    return shared_torus(fundamentals, (whole, *fractions))


def harmonic_balance(
    coefficients: Coefficients,
    *,
    input_speed: Values | None = None,
    load_torque: Values | None = None,
    motor: SpeedLoop = CONSTANT_TORQUE,
    torus: Torus | None = None,
    tolerance: float = 1e-11,
    start: SteadyMotion | None = None,
    steps: int = STEPS,
) -> SteadyMotion:
    """Return the steady state of the n designs of ``coefficients``, laws at ports included.

    Newton's method on the harmonics over the input angle; the torques are evaluated on a grid
    (alternating time and frequency, Cameron and Griffin, J. Applied Mechanics 56, 1989).

    Parameters
    ----------
    coefficients : Coefficients
        Of n designs.
    input_speed, load_torque : ndarray, shape (n,), optional
        An operating condition for each row, rad/s and N.m, in place of that of ``coefficients``. A
        negative speed is the reverse direction; a load keeps its sense in space.
    motor : SpeedLoop
        Control of the speed; by default a constant torque.
    torus : Torus, optional
        Harmonics that are kept; by default all excited orders and their combinations.
    tolerance : float
        Largest change of the torsion, relative to its size, at which the iteration ends.
    start : SteadyMotion, optional
        Nearby cases, a row each, to begin from; ignored if their torus is another.
    steps : int
        Most steps of Newton's method; a row that would need more has not converged.

    Returns
    -------
    SteadyMotion
        A row a design; one without a steady state is marked as not converged.

    Raises
    ------
    InvalidInput
        If a speed is 0: a drive at rest has no steady state over its angle.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> motion = harmonic_balance(model.coefficients(model.nominal[np.newaxis]))
    >>> peak = motion.spectrum().peak_to_peak(model.sheet.ratio)[0]
    >>> print(f"{np.degrees(peak) * 3600:.1f} arcsec")
    87.0 arcsec
    """
    n = len(coefficients.stiffness)
    speed = np.broadcast_to(coefficients.input_speed if input_speed is None else input_speed, n)
    load = np.broadcast_to(coefficients.load_torque if load_torque is None else load_torque, n)
    if np.any(speed == 0.0):
        raise InvalidInput("input_speed", 0.0, "other than 0")
    torus = torus_of(coefficients) if torus is None else torus
    if start is not None and not np.array_equal(start.torus.orders, torus.orders):
        start = None
    parts = []
    for first in range(0, max(n, 1), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        equations = AngleEquations(coefficients.rows(rows), speed[rows], load[rows], motor, torus)
        solver = _Solver(equations, None if start is None else start.rows(rows))
        # A row that diverges is marked as not converged; its values are meaningless.
        with np.errstate(over="ignore", invalid="ignore"):
            solver.solve(tolerance, steps)
            parts.append(solver.result())
    return SteadyMotion(
        torus, *(np.concatenate([getattr(part, name) for part in parts]) for name in BY_CASE)
    )


def continued_from_neighbours(coefficients: Coefficients, motion: SteadyMotion) -> SteadyMotion:
    """Return the motion of n designs with lost ones solved again from their nearest neighbours.

    A design whose iteration failed from rest, as at a kink of a law or near a resonance, is started
    from the steady state of the design that differs least from it. What fails again stays marked.

    Parameters
    ----------
    coefficients : Coefficients
        Of n designs.
    motion : SteadyMotion
        What `harmonic_balance` found for them.
    """
    lost, kept = np.flatnonzero(~motion.converged), np.flatnonzero(motion.converged)
    if not (lost.size and kept.size):
        return motion
    sizes = np.abs(coefficients.error_phasors).sum(axis=1)
    parts = (coefficients.stiffness, coefficients.input_inertia, coefficients.damping, sizes)
    places = np.log(np.maximum(np.column_stack(parts), 1e-300))
    nearest = kept[scipy.spatial.cKDTree(places[kept]).query(places[lost])[1]]
    again = harmonic_balance(
        coefficients.rows(lost), torus=motion.torus, start=motion.rows(nearest)
    )
    solved = lost[again.converged]
    values = {name: getattr(motion, name).copy() for name in BY_CASE}
    for name, whole in values.items():
        whole[solved] = getattr(again, name)[again.converged]
    return SteadyMotion(torus=motion.torus, **values)


class _Solver:
    """Newton's iteration for one block of rows."""

    def __init__(self, equations: AngleEquations, near: SteadyMotion | None) -> None:
        """Begin from nearby cases that have converged, elsewhere from rest under load."""
        self.equations = equations
        self.converged = np.zeros(len(equations.speed), dtype=bool)
        if near is not None and np.all(near.converged):
            self.torsion, self.energy = near.torsion.copy(), near.energy
        else:
            self.torsion = np.zeros_like(equations.static)
            self.torsion[:, 0] = equations.static_torsion()
            self.energy = np.zeros_like(equations.static)
            self.energy[:, :1] = equations.speed**2 / 2.0
            if near is not None:
                kept = near.converged[:, None]
                self.torsion = np.where(kept, near.torsion, self.torsion)
                self.energy = np.where(kept, near.energy, self.energy)
        if near is not None:
            self.energy = equations.at_wanted_speed(self.energy)

    def solve(self, tolerance: float, steps: int) -> None:
        """Iterate until the torsion converges; rows that do not are marked."""
        equations, left = self.equations, np.arange(len(self.torsion))
        size = np.abs(self.torsion[:, :1]) + np.abs(equations.static).sum(axis=1)[:, None] + 1e-9
        before, part = np.full_like(size, np.inf), np.ones_like(size)
        for step in range(steps):
            torsion, energy = self.torsion[left], self.energy[left]
            if step == _WITHOUT_MEMORY:
                before[left], part[left] = np.inf, 1.0
            recall = equations.recall_matrix(torsion) if step >= _WITHOUT_MEMORY else None
            change, energy_change = _newton_step(equations, torsion, energy, size[left], recall)
            longest = np.abs(change).max(axis=1, keepdims=True)
            part[left] = _part(part[left], longest <= _SHRINKS * before[left])
            before[left] = longest
            self.torsion[left] = torsion + part[left] * change
            self.energy[left] = equations.at_wanted_speed(energy + part[left] * energy_change)
            settled = longest[:, 0] <= tolerance * size[left, 0]
            self.converged[left] = settled
            if np.all(settled):
                break
            # Once half of the rows have converged, only the others are iterated further.
            if 2 * np.sum(settled) >= len(left):
                left = left[~settled]
                equations = self.equations.rows(left)

    def result(self) -> SteadyMotion:
        """Return the steady state as it is now."""
        equations = self.equations
        motion = equations.motion(self.torsion, self.energy)
        torus, coefficients = equations.torus, equations.coefficients
        inertia = np.reshape(coefficients.load_inertia, (-1, 1))
        lead = equations.lead(motion)
        loop_torque = equations.loop_torque(motion, lead)
        constant = equations.input_residual(motion, loop_torque)[:, :1].real
        return SteadyMotion(
            torus=torus,
            transmission_error=equations.static + self.torsion,
            torsion=self.torsion,
            motor_torque=torus.phasors(loop_torque + constant),
            coupling_torque=torus.phasors(equations.load + inertia * motion.output_acceleration),
            lead=lead,
            energy=self.energy,
            converged=self.converged,
        )


def _part(part: Values, shrinks: NDArray[np.bool_]) -> Values:
    """Return the part of a step to take: between kinks, full steps may cycle."""
    longer, shorter = np.minimum(2.0 * part, 1.0), np.maximum(0.5 * part, _LEAST_PART)
    return np.where(shrinks, longer, shorter)


def _newton_step(
    equations: AngleEquations,
    torsion: Phasors,
    energy: Phasors,
    size: Values,
    recall: Matrices | None,
) -> tuple[Phasors, Phasors]:
    """Return a Newton step of torsion and E together, at most ``size`` (n, 1) of the torsion.

    ``recall`` is what laws with a memory add to its matrix.

    E is eliminated: near the steady state it answers to the mesh torque harmonic by harmonic.
    """
    motion = equations.motion(torsion, energy)
    operator = equations.coefficients.ratio * equations.input_operator()
    impedance, coupling, share = equations.impedance(mean(motion.output_loss), operator)
    missing = equations.input_residual(motion, equations.loop_torque(motion))
    energy_change = -equations.coefficients.ratio * missing / operator
    energy_change[:, 0] = 0.0
    right = (equations.output_residual(motion) + coupling * energy_change) / share
    change = _torsion_change(equations, motion, impedance, recall, right)
    # Where a law removes the stiffness, a full step may be far too long.
    longest = np.abs(change).max(axis=1, keepdims=True)
    change *= np.minimum(1.0, size / np.maximum(longest, 1e-300))
    energy_change[:, 1:] -= ((right + impedance * change) / operator)[:, 1:]
    # Nor may the speed come near zero on the way.
    largest = np.abs(energy_change).sum(axis=1, keepdims=True)
    slowest = 0.5 * energy[:, :1].real
    energy_change *= np.minimum(1.0, slowest / np.maximum(largest, 1e-300))
    return change, energy_change


def _torsion_change(
    equations: AngleEquations,
    motion: TorsionMotion,
    impedance: Phasors,
    recall: Matrices | None,
    right: Phasors,
) -> Phasors:
    """Return the change of the torsion by the linearised mesh for the right-hand side ``right``."""
    orders, slope = equations.torus.orders, motion.mesh_slope
    viscous = 1j * orders * equations.speed * mean(motion.mesh_damping) - impedance
    level = mean(slope)
    nearly_constant = np.all(np.abs(slope - level) <= _NEARLY_CONSTANT * np.abs(level))
    if nearly_constant and recall is None:
        return right / (level + viscous)
    matrix = equations.torus.product_matrix(slope) + multiplication(viscous)
    if recall is not None:
        matrix += recall
    # The mean has no imaginary part: an equation for it must not be missing.
    empty = len(orders)
    matrix[:, empty, empty] = np.abs(matrix[:, 0, 0])
    real = stacked(right)
    real[:, empty] = 0.0
    return unstacked(np.asarray(np.linalg.solve(matrix, real[:, :, None])[:, :, 0]))
