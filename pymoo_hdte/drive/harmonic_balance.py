"""Steady state of the full equations, laws at ports included, by harmonic balance over the angle.

The independent variable is the input angle alpha, not time: static error, stiffness and periodic
laws are then exactly periodic, although the input speed w fluctuates. Unknown are the torsion
d(alpha) and E(alpha) = w^2 / 2, with which th_in'' = E' and th_d'' = 2 E th_d'' + E' th_d' (primes
on the right: by alpha), so that

    J_in E' + B_in w + f_in + T (1/N - r th_s') = T_motor
    J_out (E'/N - 2 E th_d'' - E' th_d') + B_out (w/N - w th_d') + f_out - T = -T_L
    T = k d + c w d' + f_mesh,    th_d = th_s + d

The mean of 1/w is that of the wanted speed. Terms are evaluated on a grid (`torus`) and brought to
zero harmonic by harmonic (Newton's method; alternating time and frequency, Cameron and Griffin,
J. Applied Mechanics 56, 1989); what couples speed and torsion is weak and followed by iteration.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive.balance import BY_CASE, CONSTANT_TORQUE, Balance, Phasors, SpeedLoop
from pymoo_hdte.drive.coefficients import Coefficients
from pymoo_hdte.drive.laws import PortState, Response
from pymoo_hdte.drive.torus import (
    Torus,
    fundamental_orders,
    largest_multiples,
    multiplication,
    stacked,
    unstacked,
)

HIGHEST = 8
"""Least number of harmonics of the input turn that are kept."""
_STEPS = 40
_STATIC_STEPS = 8
_NEARLY_CONSTANT = 0.02
"""Variation of the mesh stiffness, relative, up to which its mean serves in Newton's step."""
_ROWS_AT_ONCE = 64

Values = NDArray[np.float64]


def torus_of(coefficients: Coefficients) -> Torus:
    """Return a torus that holds all excited orders with room for their combinations."""
    excited = [float(order) for order in coefficients.error_orders]
    for port, law in coefficients.laws:
        scale = 1.0 / coefficients.ratio if port == "output" else 1.0
        excited += [scale * order for order in law.orders]
    fundamentals = fundamental_orders(excited)
    needed = largest_multiples(fundamentals, excited)
    # A line that the input angle itself shakes has a strong second harmonic over that angle.
    whole = max(HIGHEST, 2 * int(np.ceil(max(excited, default=0.0))) + 1)
    # The first fraction is that of the static error, whose beat the stiffness may modulate.
    fractions = [most + (place == 0) for place, most in enumerate(needed[1:])]
    return Torus(fundamentals, (whole, *fractions))


def harmonic_balance(
    coefficients: Coefficients,
    *,
    input_speed: Values | None = None,
    load_torque: Values | None = None,
    motor: SpeedLoop = CONSTANT_TORQUE,
    torus: Torus | None = None,
    tolerance: float = 1e-11,
    start: Balance | None = None,
) -> Balance:
    """Return the steady state of the n designs of ``coefficients``.

    Parameters
    ----------
    coefficients : Coefficients
    input_speed, load_torque : ndarray, shape (n,), optional
        An operating condition for each row, rad/s and N.m, in place of that of ``coefficients``.
    motor : SpeedLoop
    torus : Torus, optional
        By default that of `torus_of`.
    tolerance : float
        Largest change of the torsion, relative to its size, at which the iteration ends.
    start : Balance, optional
        Nearby cases, a row each, to begin from; ignored if their torus is another.
    """
    n = len(coefficients.stiffness)
    speed = np.broadcast_to(coefficients.input_speed if input_speed is None else input_speed, n)
    load = np.broadcast_to(coefficients.load_torque if load_torque is None else load_torque, n)
    torus = torus_of(coefficients) if torus is None else torus
    parts = []
    for first in range(0, max(n, 1), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        solver = _Solver(coefficients.rows(rows), speed[rows], load[rows], motor, torus)
        if start is not None and np.array_equal(start.torus.orders, torus.orders):
            solver.begin(start.rows(rows))
        parts.append(solver.solve(tolerance))
    return Balance(
        torus, *(np.concatenate([getattr(part, name) for part in parts]) for name in BY_CASE)
    )


class _Solver:
    """Newton's iteration for one block of rows."""

    def __init__(
        self,
        coefficients: Coefficients,
        speed: Values,
        load: Values,
        motor: SpeedLoop,
        torus: Torus,
    ) -> None:
        self.coefficients, self.motor, self.torus = coefficients, motor, torus
        self.speed, self.load = speed[:, None], load[:, None]
        self.output_inertia = np.reshape(coefficients.output_inertia, (-1, 1))
        self.output_damping = np.reshape(coefficients.output_damping, (-1, 1))
        n, size = len(speed), len(torus.orders)
        self.static = np.zeros((n, size), dtype=complex)
        for order, phasor in zip(
            coefficients.error_orders, coefficients.error_phasors.T, strict=True
        ):
            place, conjugate = torus.place(float(order))
            self.static[:, place] += phasor.conj() if conjugate else phasor
        self.static_slope = torus.signal(torus.derivative(self.static))
        angle = 2.0 * torus.phase(1.0) + coefficients.stiffness_phase
        self.varying = 1.0 + coefficients.stiffness_depth * np.cos(angle)
        self.torsion = np.zeros((n, size), dtype=complex)
        self.torsion[:, 0] = self._static_torsion(coefficients.torque_at(speed, load))
        self.energy = np.zeros((n, size), dtype=complex)
        self.energy[:, 0] = speed**2 / 2.0
        self.constant = np.zeros((n, 1))

    def begin(self, near: Balance) -> None:
        """Begin from nearby cases that have converged."""
        kept = near.converged[:, None]
        self.torsion = np.where(kept, near.torsion, self.torsion)
        shape = near.energy / near.energy[:, :1]
        self.energy = np.where(kept, shape * self.energy[:, :1], self.energy)

    def solve(self, tolerance: float) -> Balance:
        """Iterate until the torsion stands still; rows that never do are marked."""
        self.size = np.abs(self.torsion[:, :1]) + np.abs(self.static).sum(axis=1)[:, None] + 1e-9
        converged = np.zeros(len(self.size), dtype=bool)
        for _ in range(_STEPS):
            change = self._step()
            converged = np.abs(change).max(axis=1) <= tolerance * self.size[:, 0]
            if np.all(converged):
                break
        return self._result(converged)

    def _static_torsion(self, torque: Values) -> Values:
        """Return a mean torsion to begin with, shape (n,): that which holds ``torque`` at rest."""
        stiffness = self.coefficients.stiffness
        found = torque / stiffness
        if not any(port == "mesh" for port, _ in self.coefficients.laws):
            return found
        still = np.zeros((len(found), self.torus.size))
        for _ in range(_STATIC_STEPS):
            position = np.broadcast_to(found[:, None], still.shape)
            added = _mean(self._laws("mesh", position, still).torque)[:, 0]
            found = found + (torque - stiffness * found - added) / stiffness
        return found

    def _motion(self) -> None:
        """Put the present torsion and speed on the grid, with the torques that follow."""
        torus, coefficients = self.torus, self.coefficients
        self.angular_speed = np.sqrt(2.0 * np.maximum(torus.signal(self.energy), 1e-12))
        self.energy_slope = torus.signal(torus.derivative(self.energy))
        error = self.static + self.torsion
        self.error_slope = torus.signal(torus.derivative(error))
        error_curvature = torus.signal(torus.derivative(torus.derivative(error)))
        self.output_acceleration = (
            self.energy_slope / coefficients.ratio
            - self.angular_speed**2 * error_curvature
            - self.energy_slope * self.error_slope
        )
        self.output_speed = self.angular_speed * (1.0 / coefficients.ratio - self.error_slope)
        position = torus.signal(self.torsion)
        rate = self.angular_speed * torus.signal(torus.derivative(self.torsion))
        stiffness = coefficients.stiffness[:, None]
        damping = coefficients.damping[:, None]
        added = self._laws("mesh", position, rate)
        self.mesh_slope = stiffness * self.varying + added.slope
        self.mesh_damping = damping + added.damping
        self.mesh_torque = stiffness * self.varying * position + damping * rate + added.torque

    def _laws(self, port: str, position: Values, speed: Values) -> Response:
        """Return the sum of the laws at a port."""
        torus = self.torus
        # The output's own small fluctuation is left out of the angle its periodic laws follow.
        slower = self.coefficients.ratio if port == "output" else 1.0

        def phase(order: float) -> Values:
            return torus.phase(order / slower)

        stiffness = self.coefficients.stiffness[:, None]
        state = PortState(position, speed, phase, stiffness, torus.path, torus.back)
        total = Response(np.zeros_like(speed))
        for place, law in self.coefficients.laws:
            if place == port:
                one = law.respond(state)
                total = Response(
                    total.torque + one.torque,
                    total.slope + one.slope,
                    total.damping + one.damping,
                )
        return total

    def _step(self) -> Phasors:
        """Take one Newton step in speed and torsion together; return the change of the torsion.

        E is eliminated: near the steady state it answers to the mesh torque harmonic by harmonic.
        """
        self._motion()
        coefficients, torus = self.coefficients, self.torus
        input_residual, self.constant = self._input_residual()
        friction = self._laws("output", np.zeros_like(self.output_speed), self.output_speed)
        output_residual = torus.phasors(
            self.output_inertia * self.output_acceleration
            + self.output_damping * self.output_speed
            + friction.torque
            - self.mesh_torque
            + self.load
        )
        operator = coefficients.ratio * self._input_operator()
        impedance, coupling, share = self._impedance(_mean(friction.damping), operator)
        energy_change = -coefficients.ratio * input_residual / operator
        energy_change[:, 0] = 0.0
        right = (output_residual + coupling * energy_change) / share
        change = self._solve(impedance, right)
        # Where a law takes the stiffness away, a full step may lead far off.
        longest = np.abs(change).max(axis=1, keepdims=True)
        change *= np.minimum(1.0, self.size / np.maximum(longest, 1e-300))
        energy_change[:, 1:] -= ((right + impedance * change) / operator)[:, 1:]
        # Nor may the speed come near zero on the way.
        largest = np.abs(energy_change).sum(axis=1, keepdims=True)
        slowest = 0.5 * self.energy[:, :1].real
        energy_change *= np.minimum(1.0, slowest / np.maximum(largest, 1e-300))
        self.torsion = self.torsion + change
        self.energy = self.energy + energy_change
        angular_speed = np.sqrt(2.0 * np.maximum(torus.signal(self.energy), 1e-12))
        self.energy = self.energy * (self.speed * _mean(1.0 / angular_speed)) ** 2
        return change

    def _solve(self, impedance: Phasors, right: Phasors) -> Phasors:
        """Return the change of the torsion that the linearised mesh answers ``right`` with."""
        torus = self.torus
        slope = np.broadcast_to(self.mesh_slope, self.mesh_torque.shape)
        viscous = 1j * torus.orders * self.speed * _mean(self.mesh_damping) - impedance
        mean = _mean(slope)
        if np.all(np.abs(slope - mean) <= _NEARLY_CONSTANT * np.abs(mean)):
            return right / (mean + viscous)
        matrix = torus.product_matrix(slope) + multiplication(viscous)
        # The mean has no imaginary part: an equation for it must not be missing.
        empty = len(torus.orders)
        matrix[:, empty, empty] = np.abs(matrix[:, 0, 0])
        real = stacked(right)
        real[:, empty] = 0.0
        return unstacked(np.asarray(np.linalg.solve(matrix, real[:, :, None])[:, :, 0]))

    def _impedance(self, friction: Values, operator: Phasors) -> tuple[Phasors, Phasors, Phasors]:
        """Return mesh torque per transmission error P of the free inertias, C, and 1 + C / (N A).

        C is the output's torque per unit of E, A the motor's (`_input_operator`).
        """
        coefficients = self.coefficients
        frequency = self.torus.orders * self.speed
        damping = self.output_damping + friction
        inertia = self.output_inertia
        output = inertia * frequency**2 - 1j * frequency * damping
        coupling = (1j * self.torus.orders * inertia + damping / self.speed) / coefficients.ratio
        share = 1.0 + coupling / operator
        share[:, 0] = 1.0
        return output / share, coupling, share

    def _input_operator(self) -> Phasors:
        """Return A, motor torque per unit of E of the free input, linear in E; 1 for the mean."""
        coefficients, motor = self.coefficients, self.motor
        orders = np.where(self.torus.orders == 0.0, 1.0, self.torus.orders)
        damping = coefficients.input_damping[:, None] + motor.proportional
        operator = (
            1j * orders * coefficients.input_inertia[:, None]
            + damping / self.speed
            + motor.integral / (1j * orders * self.speed**2)
        )
        operator[:, 0] = 1.0
        return operator

    def _input_residual(self) -> tuple[Phasors, Values]:
        """Return what is left of the first equation, and its mean: the motor's constant torque."""
        coefficients = self.coefficients
        reaction = coefficients.reaction * self.static_slope
        friction = self._laws("input", np.zeros_like(self.angular_speed), self.angular_speed)
        resisting = (
            coefficients.input_inertia[:, None] * self.energy_slope
            + coefficients.input_damping[:, None] * self.angular_speed
            + friction.torque
            + self.mesh_torque * (1.0 / coefficients.ratio - reaction)
        )
        residual = self.torus.phasors(resisting - self._loop_torque())
        return residual, residual[:, :1].real

    def _lead(self) -> Phasors:
        """Return alpha - Omega t."""
        return -self.torus.integral(self.torus.phasors(self.speed / self.angular_speed))

    def _loop_torque(self) -> Values:
        """Return the motor's torque but for its constant."""
        motor = self.motor
        if motor == CONSTANT_TORQUE:
            return np.zeros_like(self.angular_speed)
        # The integral of w_set - w is Omega t - alpha.
        late = -self.torus.signal(self._lead())
        return motor.proportional * (self.speed - self.angular_speed) + motor.integral * late

    def _result(self, converged: NDArray[np.bool_]) -> Balance:
        self._motion()
        torus = self.torus
        inertia = np.reshape(self.coefficients.load_inertia, (-1, 1))
        return Balance(
            torus=torus,
            transmission_error=self.static + self.torsion,
            torsion=self.torsion,
            motor_torque=torus.phasors(self._loop_torque() + self.constant),
            coupling_torque=torus.phasors(self.load + inertia * self.output_acceleration),
            lead=self._lead(),
            energy=self.energy,
            converged=converged,
        )


def _mean(values: Values | float) -> Values:
    """Return the mean over the grid, shape (n, 1)."""
    return np.atleast_2d(np.mean(np.atleast_2d(values), axis=1)).T
