"""Steady state of the full equations, laws at ports included, by harmonic balance over the angle.

The terms of `angle_equations` are evaluated on a grid (`torus`) and brought to zero harmonic by
harmonic (`newton`; alternating time and frequency, Cameron and Griffin, J. Applied Mechanics 56,
1989); the coupling of speed and torsion is weak and treated by iteration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive._solve.angle_equations import AngleEquations, Values
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.fundamentals import fundamental_orders, largest_multiples
from pymoo_hdte.drive._solve.linear_systems import LinearSystem
from pymoo_hdte.drive._solve.newton import Place, nearer
from pymoo_hdte.drive._solve.steady_motion import (
    BY_CASE,
    CONSTANT_TORQUE,
    Phasors,
    SpeedLoop,
    SteadyMotion,
    Tangents,
)
from pymoo_hdte.drive._solve.torus import Torus, shared_torus
from pymoo_hdte.effects.law import OUTPUT_SHAFT

HIGHEST = 8
"""Least number of harmonics of the input turn that are kept."""
STEPS = 50
"""Most steps of Newton's method."""
_PATIENCE = 15
"""Steps without halving what is left, after which a row counts as lost.

Of 353,000 cases that converged in twelve campaigns of the virtual rig, 21 waited for longer; of 180
that were lost, three in four. Each step had a matrix of its own then.
"""
_ROWS_AT_ONCE = 64
"""Rows solved together; of little effect on the time."""
_SHRINKS = 0.1
"""Share of a step to which the next has to shrink for a nearby case's system to serve further."""


def torus_of(coefficients: Coefficients) -> Torus:
    """Return a torus that holds all excited orders with room for their combinations."""
    excited = [float(order) for order in coefficients.error_orders]
    excited += coefficients.further_orders
    for port, law in coefficients.laws:
        scale = 1.0 / coefficients.ratio if port in OUTPUT_SHAFT else 1.0
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
    tangents: bool = False,
    lead: Phasors | None = None,
) -> SteadyMotion:
    """Return the steady state of the n designs of ``coefficients``, laws at ports included.

    Newton's method on the harmonics over the input angle; the torques are evaluated on a grid
    (alternating time and frequency, Cameron and Griffin, J. Applied Mechanics 56, 1989).

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs.
    input_speed, load_torque : ndarray, shape (n,), optional
        An operating condition for each row, rad/s and N.m, in place of that of ``coefficients``. A
        negative speed is the reverse direction; a load keeps its sense in space.
    motor : SpeedLoop
        Control of the speed; by default a constant torque.
    torus : Torus, optional
        Harmonics that are kept; by default all excited orders and their combinations.
    tolerance : float
        Largest change of the torsion, and of the energy, relative to their sizes, at which the
        iteration ends.
    start : SteadyMotion, optional
        Nearby cases, a row each, to begin from.
    steps : int
        Most steps of Newton's method; a row that would need more, or that does not halve what is
        left in fifteen of them, has not converged.
    tangents : bool
        Whether the result is to serve as ``start`` of cases that take steps with its matrices as
        long as these shrink fast; it then holds all that it was found from.
    lead : complex ndarray, shape (n, n_harmonics), optional
        Motion of the input, if it is known: alpha - Omega t at the orders of ``torus``, rad. The
        motor's torque is then the one that this motion takes, whatever its loop does.

    Returns
    -------
    SteadyMotion
        A row a design; one without a steady state is marked as not converged.

    Raises
    ------
    InvalidInput
        If a speed is 0: a drive at rest has no steady state over its angle; if ``lead`` has another
        shape.

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
    coefficients = coefficients.at_loads(load)
    torus = torus_of(coefficients) if torus is None else torus
    if lead is not None and lead.shape != (n, len(torus.orders)):
        raise InvalidInput("lead", lead.shape, f"of shape {(n, len(torus.orders))}")
    start = None if start is None else start.on(torus)
    solvers = []
    for begin in range(0, max(n, 1), _ROWS_AT_ONCE):
        rows = slice(begin, begin + _ROWS_AT_ONCE)
        known = None if lead is None else lead[rows]
        equations = AngleEquations(
            coefficients.rows(rows), speed[rows], load[rows], motor, torus, known
        )
        solver = _Solver(equations, None if start is None else start.rows(rows))
        # A row that diverges is marked as not converged; its values are meaningless.
        with np.errstate(over="ignore", invalid="ignore"):
            solver.solve(tolerance, steps, _systems(start, rows, len(equations.speed)))
        solvers.append(solver)
    parts = [solver.result() for solver in solvers]
    values = [np.concatenate([getattr(part, name) for part in parts]) for name in BY_CASE]
    solved_tangents = Tangents(_Solved(solvers).systems, np.arange(n)) if tangents else None
    return SteadyMotion(torus, *values, tangents=solved_tangents)


def _systems(start: SteadyMotion | None, rows: slice, count: int) -> list[LinearSystem | None]:
    """Return the linear system of the case from which each row begins; None without one."""
    if start is None or start.tangents is None:
        return [None] * count
    ended = start.converged[rows]
    known_systems = iter(start.tangents.rows(rows).rows(ended).systems())
    return [next(known_systems) if good else None for good in ended]


def continued_from_neighbours(coefficients: Coefficients, motion: SteadyMotion) -> SteadyMotion:
    """Return the motion of n designs with lost ones solved again from their nearest neighbours.

    Those are the designs that differ least; see `continued_from_nearest`.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs.
    motion : SteadyMotion
        What `harmonic_balance` found for them.
    """
    sizes = np.abs(coefficients.error_phasors).sum(axis=1)
    parts = (coefficients.stiffness, coefficients.input_inertia, coefficients.damping, sizes)
    places = np.log(np.maximum(np.column_stack(parts), 1e-300))
    return continued_from_nearest(coefficients, motion, places)


def continued_from_nearest(
    coefficients: Coefficients,
    motion: SteadyMotion,
    places: Values,
    *,
    input_speed: Values | None = None,
    load_torque: Values | None = None,
) -> SteadyMotion:
    """Return the motion of n cases with lost ones solved again from the nearest that was found.

    A case whose iteration failed from rest, as at a kink of a law or near a resonance, is started
    from the steady state of the nearest one. What fails again stays marked.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n cases.
    motion : SteadyMotion
        What `harmonic_balance` found for them.
    places : ndarray, shape (n, k)
        Where each case is, in units in which distances compare.
    input_speed, load_torque : ndarray, shape (n,), optional
        As `harmonic_balance` had them.
    """
    lost, converged = np.flatnonzero(~motion.converged), np.flatnonzero(motion.converged)
    if not (lost.size and converged.size):
        return motion
    nearest = converged[scipy.spatial.cKDTree(places[converged]).query(places[lost])[1]]
    again = harmonic_balance(
        coefficients.rows(lost),
        input_speed=None if input_speed is None else input_speed[lost],
        load_torque=None if load_torque is None else load_torque[lost],
        torus=motion.torus,
        start=motion.rows(nearest),
    )
    solved = lost[again.converged]
    values = {name: getattr(motion, name).copy() for name in BY_CASE}
    for name, whole in values.items():
        whole[solved] = getattr(again, name)[again.converged]
    return SteadyMotion(torus=motion.torus, **values)


class _Solver:
    """Newton's iteration for one block of rows."""

    def __init__(self, equations: AngleEquations, neighbour: SteadyMotion | None) -> None:
        """Begin from nearby cases that have converged, elsewhere from rest under load."""
        self.equations = equations
        self.converged = np.zeros(len(equations.speed), dtype=bool)
        if neighbour is not None and np.all(neighbour.converged):
            self.torsion, self.energy = neighbour.torsion.copy(), neighbour.energy.copy()
        else:
            self.torsion = np.zeros_like(equations.static)
            self.torsion[:, 0] = equations.static_torsion()
            self.energy = equations.energy.copy()
            if neighbour is not None:
                known = neighbour.converged[:, None]
                self.torsion = np.where(known, neighbour.torsion, self.torsion)
                self.energy = np.where(known, neighbour.energy, self.energy)
        if equations.prescribed:
            self.energy = equations.energy.copy()

    def solve(self, tolerance: float, steps: int, systems: list[LinearSystem | None]) -> None:
        """Iterate until the torsion converges; rows that do not are marked.

        Steps are taken with the ``systems`` of nearby cases as long as they shrink fast.
        """
        equations, open_rows = self.equations, np.arange(len(self.torsion))
        size = np.abs(self.torsion[:, :1]) + np.abs(equations.static).sum(axis=1)[:, None] + 1e-9
        size = size + equations.torsion_by_load()
        at = Place(equations, self.torsion, self.energy)
        before, least = np.full(len(open_rows), np.inf), np.full(len(open_rows), np.inf)
        distance, waited = at.distance[:, 0], np.zeros(len(open_rows), dtype=int)
        for _ in range(steps):
            own = np.array([system is None for system in systems], dtype=bool)
            missing = np.flatnonzero(own)
            for row, system in zip(missing, at.systems(missing), strict=True):
                systems[row] = system
            # A friction may wind up the drive by many times what holds it at the start.
            most = np.maximum(size[open_rows], np.abs(at.torsion[:, :1]))
            change, energy_change = at.newton_step(most, systems)
            longest = np.abs(change).max(axis=1)
            shrinks = longest <= _SHRINKS * before
            # With the system of another place a short step alone does not tell that it has arrived.
            settled = (longest <= tolerance * size[open_rows, 0]) & (shrinks | own)
            # The speed may answer more than the torsion, as to a strong ripple at a low speed.
            slower = np.abs(energy_change).max(axis=1)
            settled &= slower <= tolerance * np.abs(at.energy[:, 0])
            self.converged[open_rows] = settled
            if np.all(settled):
                self.torsion[open_rows] = at.torsion + change
                self.energy[open_rows] = at.energy + energy_change
                break
            at = nearer(at, change, energy_change, settled)
            self.torsion[open_rows], self.energy[open_rows] = at.torsion, at.energy
            before = longest
            distance, was = at.distance[:, 0], distance
            nearer_by_far = distance <= _SHRINKS * was
            serves = np.where(own, nearer_by_far, shrinks)
            systems = [system if ok else None for system, ok in zip(systems, serves, strict=True)]
            halved = distance <= least / 2.0
            least = np.where(halved, distance, least)
            waited = np.where(halved, 0, waited + 1)
            lost = ~settled & (waited >= _PATIENCE)
            if np.all(settled | lost):
                break
            # A lost row leaves at once, so that none is found for the company that it is in. Once
            # half of the rows have settled, only the others are iterated further.
            if np.any(lost) or 2 * np.sum(settled) >= len(open_rows):
                indices = np.flatnonzero(~(settled | lost))
                open_rows, before, systems = (
                    open_rows[indices],
                    before[indices],
                    [systems[index] for index in indices],
                )
                least, waited, distance = least[indices], waited[indices], distance[indices]
                equations = self.equations.rows(open_rows)
                at = at.rows(equations, indices)

    def systems(self, rows: NDArray[np.int_]) -> list[LinearSystem | None]:
        """Return the linear systems of Newton's method of some rows as they are now."""
        equations = self.equations.rows(rows)
        return Place(equations, self.torsion[rows], self.energy[rows]).systems(np.arange(len(rows)))

    def result(self) -> SteadyMotion:
        """Return the steady state as it is now."""
        equations = self.equations
        motion = equations.motion(self.torsion, self.energy)
        inertia = np.reshape(equations.coefficients.load_inertia, (-1, 1))
        coupling = (
            equations.load
            + inertia * motion.output_acceleration
            + equations.of_loose_loads(motion)
            + motion.of_load
        )
        brake = equations.brake_torque(motion)
        slower = equations.speed - motion.angular_speed
        missing, _, lead, others = equations.residuals(motion, slower, coupling, brake)
        motor_torque = missing
        if not equations.prescribed:
            # The motor's torque is that of its loop, with a constant.
            loop = equations.motor
            motor_torque = loop.proportional * others[0] - loop.integral * lead
            motor_torque[:, :1] += missing[:, :1].real
        return SteadyMotion(
            torus=equations.torus,
            transmission_error=equations.static + self.torsion,
            torsion=self.torsion,
            motor_torque=motor_torque,
            coupling_torque=others[1],
            brake_torque=others[2],
            lead=lead,
            energy=motion.energy,
            slower=others[0],
            slopes=equations.slopes(motion),
            converged=self.converged,
        )


@dataclass(frozen=True)
class _Solved:
    """Blocks of rows that have been solved."""

    solvers: Sequence[_Solver]

    def systems(self, places: NDArray[np.int_]) -> Sequence[LinearSystem | None]:
        """Return the linear systems at some rows, in rising order."""
        of_blocks = places // _ROWS_AT_ONCE
        systems = [
            system
            for block, solver in enumerate(self.solvers)
            if np.any(of_blocks == block)
            for system in solver.systems(places[of_blocks == block] % _ROWS_AT_ONCE)
        ]
        return [None] * len(places) if None in systems else systems
