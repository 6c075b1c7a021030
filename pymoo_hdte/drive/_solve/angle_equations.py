"""The full equations of motion, laws at ports included, over the input angle instead of time.

Static error, stiffness and periodic laws are exactly periodic in the input angle alpha, although
the input speed w fluctuates. Unknown are the torsion d(alpha) and E(alpha) = w^2 / 2, with which
th_in'' = E' and th_d'' = 2 E th_d'' + E' th_d' (primes on the right: by alpha), so that

    J_in E' + B_in w + f_in + T (1/N - r th_s') = T_motor
    J_out (E'/N - 2 E th_d'' - E' th_d') + B_out (w/N - w th_d') + f_out + f_load - T = -T_L
    T = k d + c w d' + f_mesh,    th_d = th_s + d

The mean of 1/w is that of the wanted speed, whose sign w has: a drive may turn either way.

Where the motion of the input is prescribed, by its lead(alpha) = alpha - Omega t, E is known from
w = Omega / (1 - lead'), and the first equation gives the motor's torque (inverse dynamics).
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.recursion import Recollection
from pymoo_hdte.drive._solve.steady_motion import CONSTANT_TORQUE, Phasors, SpeedLoop
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.law import Memory, PortState, Response

_STATIC_STEPS = 8
_BY_ROW = (
    "speed", "load", "output_inertia", "output_damping", "static", "energy", "_static_error",
    "_static_slope",
    "_stiffness", "_backward", "_share_of_mesh", "rate", "input_operator",
)  # fmt: skip
"""Attributes of `AngleEquations` with a row per case; the last three are computed on demand."""

Values = NDArray[np.float64]

_NO_LAW = Response(np.zeros((1, 1)))
_SLOWEST = 1e-3
"""Least relative change of time with the angle: an input that turned back has no speed over it."""


@dataclass(frozen=True)
class TorsionMotion:
    """A torsion and a speed on the grid of the torus, with the resulting torques; arrays (n, G).

    ``energy`` are the harmonics of E, (n, n_harmonics). ``mesh_slope`` and ``mesh_damping`` are the
    derivatives of ``mesh_torque`` by torsion and by its rate, ``output_loss`` that of
    ``output_friction`` by speed, both of the laws at output and load together. ``of_load`` is the
    part of those at the load, and ``of_brake`` of what drives or brakes there. What is the same on
    the whole grid, or of no law, may have one column or row, or be a number.
    """

    energy: Phasors
    angular_speed: Values
    energy_slope: Values
    output_speed: Values
    output_acceleration: Values
    mesh_torque: Values
    mesh_slope: Values
    mesh_damping: Values
    output_friction: Values
    output_loss: Values
    of_load: Values
    of_brake: Values


class AngleEquations:
    """The equations of n rows, each at a speed (rad/s, either sign) and a load (N.m) of its own.

    Attributes
    ----------
    prescribed : bool
        Whether the motion of the input is given, so that the motor follows no loop.
    energy : complex ndarray, shape (n, n_harmonics)
        E as prescribed, otherwise that of the mean speed, from which to begin.
    """

    def __init__(
        self,
        coefficients: Coefficients,
        speed: Values,
        load: Values,
        motor: SpeedLoop,
        torus: Torus,
        lead: Phasors | None = None,
    ) -> None:
        self.prescribed = lead is not None
        motor = CONSTANT_TORQUE if self.prescribed else motor
        self.coefficients, self.motor, self.torus = coefficients, motor, torus
        self.speed, self.load = speed[:, None], load[:, None]
        self.output_inertia, self.output_damping = (
            np.broadcast_to(np.reshape(value, (-1, 1)), self.speed.shape)
            for value in (coefficients.output_inertia, coefficients.output_damping)
        )
        self.static = np.zeros((len(speed), len(torus.orders)), dtype=complex)
        for order, phasor in zip(
            coefficients.error_orders, coefficients.error_phasors.T, strict=True
        ):
            place, conjugate = torus.place(float(order))
            self.static[:, place] += phasor.conj() if conjugate else phasor
        self._static_error = torus.signal(self.static)
        self.energy = np.zeros_like(self.static)
        if lead is None:
            self.energy[:, :1] = self.speed**2 / 2.0
        else:
            longer = np.maximum(1.0 - torus.signal(torus.derivative(lead)), _SLOWEST)
            self.energy = torus.phasors((self.speed / longer) ** 2 / 2.0)
        self._static_slope = torus.signal(torus.derivative(self.static))
        angle = 2.0 * torus.phase(1.0) + coefficients.stiffness_phase
        varying = 1.0 + coefficients.stiffness_depth * np.cos(angle)
        self._stiffness = coefficients.stiffness[:, None] * varying
        self._backward = speed < 0.0

    def rows(self, rows: NDArray[np.int_]) -> AngleEquations:
        """Return the equations of some of the rows."""
        some = copy(self)
        some.coefficients = self.coefficients.rows(rows)
        vars(some).update((name, vars(self)[name][rows]) for name in _BY_ROW if name in vars(self))
        vars(some).pop("_of_inertia", None)
        return some

    def static_torsion(self) -> Values:
        """Return the mean torsion, shape (n,), that holds load and bearing friction at rest."""
        stiffness = self.coefficients.stiffness
        torque = self.coefficients.torque_at(self.speed[:, 0], self.load[:, 0])
        torsion = torque / stiffness
        if not any(port == "mesh" for port, _ in self.coefficients.laws):
            return torsion
        still = np.zeros((len(torsion), self.torus.size))
        for _ in range(_STATIC_STEPS):
            position = np.broadcast_to(torsion[:, None], still.shape)
            added = mean(self._laws("mesh", position, still).torque)[:, 0]
            torsion = torsion + (torque - stiffness * torsion - added) / stiffness
        return torsion

    def torsion_by_load(self) -> Values:
        """Return the largest torsion, shape (n, 1), by which laws at the load twist the mesh."""
        speed = np.broadcast_to(self.speed / self.coefficients.ratio, (len(self.speed), 1))
        torque = self._of_output("load", speed, np.zeros_like(speed)).torque
        return np.abs(torque).max(axis=1, keepdims=True) / self.coefficients.stiffness[:, None]

    def motion(self, torsion: Phasors, energy: Phasors) -> TorsionMotion:
        """Evaluate torsion and E on the grid, with the resulting torques.

        E is scaled such that the mean of 1/w is that of the wanted speed.
        """
        torus, coefficients = self.torus, self.coefficients
        slope, error = torus.derivative(torsion), self.static + torsion
        curvature = torus.derivative(torus.derivative(error))
        phasors = (energy, torus.derivative(energy), torsion, slope, curvature)
        # In one call: most of the time of a small one goes by before it begins.
        signals = torus.signal(np.concatenate(phasors)).reshape(len(phasors), -1, torus.size)
        energy_there, energy_slope, position, slope_there, error_curvature = signals
        angular_speed = np.copysign(np.sqrt(2.0 * np.maximum(energy_there, 1e-12)), self.speed)
        faster = self.speed * mean(1.0 / angular_speed)
        angular_speed *= faster
        energy_slope *= faster**2
        error_slope = self._static_slope + slope_there
        output_acceleration = (
            energy_slope / coefficients.ratio
            - angular_speed**2 * error_curvature
            - energy_slope * error_slope
        )
        output_speed = angular_speed * (1.0 / coefficients.ratio - error_slope)
        rate = angular_speed * slope_there
        stiffness, damping = self._stiffness, coefficients.damping[:, None]
        mesh = self._laws("mesh", position, rate)
        lag = self._static_error + position
        at_load = self._of_output("load", output_speed, lag)
        output = added(self._of_output("output", output_speed, lag), at_load)
        return TorsionMotion(
            energy=energy * faster**2,
            angular_speed=angular_speed,
            energy_slope=energy_slope,
            output_speed=output_speed,
            output_acceleration=output_acceleration,
            mesh_torque=stiffness * position + damping * rate + mesh.torque,
            mesh_slope=np.broadcast_to(stiffness + mesh.slope, position.shape),
            mesh_damping=damping + np.asarray(mesh.damping),
            output_friction=output.torque,
            output_loss=np.asarray(output.damping),
            of_load=np.asarray(at_load.torque),
            of_brake=np.asarray(self._of_output("load", output_speed, lag, driving=True).torque),
        )

    def _of_output(
        self, port: str, speed: Values, lag: Values, *, driving: bool = False
    ) -> Response:
        """Return the sum of the laws at a port that turns with the output, ``lag`` behind alpha/N.

        The grid knows angles up to whole turns only, and so no position. With ``driving`` only laws
        of what drives or brakes the port count.
        """
        position = np.full_like(speed, np.nan)
        return self._laws(port, position, speed, lag=lag, driving=driving)

    def _laws(
        self,
        port: str,
        position: Values,
        speed: Values,
        load: Values | None = None,
        *,
        lag: Values | None = None,
        driving: bool = False,
    ) -> Response:
        """Return the sum of the laws at a port, which passes on ``load`` besides them.

        What the mesh passes on is the load itself: a damping that followed the torque that
        accelerates inertias would rectify it.
        """
        laws = [
            law
            for place, law in self.coefficients.laws
            if place == port and (law.drives or not driving)
        ]
        if not laws:
            return _NO_LAW

        def phase(order: float) -> Values:
            if lag is None:
                return self.torus.phase(order)
            return np.asarray(self.torus.phase(order / self.coefficients.ratio) - order * lag)

        stiffness = self.coefficients.stiffness[:, None]
        load = self.load if port in ("mesh", "load") else load
        warmth = np.reshape(self.coefficients.temperature, (-1, 1))
        around = (self._path, self._back)
        elapsed = np.reshape(self.coefficients.elapsed, (-1, 1))
        state = PortState(
            position, speed, phase, stiffness, *around, load, warmth, recurs=True, elapsed=elapsed
        )
        return reduce(added, (law.respond(state) for law in laws))

    def _path(self, values: Values) -> Values:
        """Return grid values in the order in which a row passes them, for two passages."""
        along = self.torus.path(values)
        return np.where(self._backward[:, None], along[:, ::-1], along)

    def _back(self, along: Values) -> Values:
        """Return the second passage of values along `_path` on the grid."""
        second = along[:, self.torus.size :]
        second = np.where(self._backward[:, None], second[:, ::-1], second)
        return self.torus.back(np.hstack([second, second]))

    @property
    def remembers(self) -> bool:
        """Tell whether a law has memory: its torque depends on the torsion elsewhere."""
        return any(law.states for _, law in self.coefficients.laws)

    def recollection(self, torsion: Phasors) -> Recollection:
        """Return how the mesh torque depends on the torsion elsewhere, by laws with memory.

        It is added to the torque by ``mesh_slope``.
        """
        memories = [cast(Memory, law) for _, law in self.coefficients.laws if law.states]
        along = self._path(self.torus.signal(torsion))
        every = np.tile(np.arange(self.torus.size, dtype=float), (len(along), 1))
        places = self._path(every)[:, : self.torus.size].astype(int)
        retained, gained = zip(*(law.recall(along) for law in memories), strict=True)
        return Recollection(np.concatenate(retained), np.concatenate(gained), places)

    def residuals(
        self, motion: TorsionMotion, *others: Values
    ) -> tuple[Phasors, Phasors, Phasors, list[Phasors]]:
        """Return the residuals of both equations, N.m, and the lead of the input, rad.

        The lead is alpha - Omega t, minus the integral of the speed that is missing. The mean of
        the first equation is the motor's constant. Beside these the harmonics of ``others``, values
        on the grid (n, G).
        """
        delivered = self.delivered(motion)
        of_load = (
            self.output_inertia * motion.output_acceleration
            + self.of_loose_loads(motion)
            + delivered
            - motion.mesh_torque
        )
        slower = self.speed / motion.angular_speed
        signals = (self._of_input(motion, delivered), of_load, slower, *others)
        # In one call, as in `motion`.
        phasors = self.torus.phasors(np.concatenate(signals)).reshape(
            len(signals), *self.static.shape
        )
        lead = -self.torus.integral(phasors[2])
        return phasors[0] + self.motor.integral * lead, phasors[1], lead, list(phasors[3:])

    def of_loose_loads(self, motion: TorsionMotion) -> Values | float:
        """Return the torque of loads that are not rigidly coupled, beyond that of the inertia.

        An inertia in a clutch follows as at the mean speed: the input's fluctuation is small.
        """
        rates, torus = [motion.output_acceleration], self.torus
        total: Values | float = 0.0
        if self.coefficients.is_loose:
            inertia = self.coefficients.loose_inertia(torus.orders * self.speed)
            total = torus.signal(torus.phasors(rates[0]) * inertia)
        for _ in range(max((k for k, _ in self.coefficients.load_rates), default=0)):
            slope = torus.signal(torus.derivative(torus.phasors(rates[-1])))
            rates.append(motion.angular_speed * slope)
        return total + sum(size * rates[k] for k, size in self.coefficients.load_rates)

    def delivered(self, motion: TorsionMotion) -> Values:
        """Return the torque, N.m, that the output passes on to load, bearings and laws there."""
        return self.output_damping * motion.output_speed + motion.output_friction + self.load

    def brake_torque(self, motion: TorsionMotion) -> Values:
        """Return the torque between load inertia and brake: T_L and what the brake adds, N.m."""
        return self.load + motion.of_brake + np.zeros_like(motion.output_speed)

    def _of_input(self, motion: TorsionMotion, delivered: Values) -> Values:
        """Return the residual of the first equation on the grid, without the lead's share."""
        coefficients, friction = self.coefficients, self._input_friction(motion, delivered)
        return np.asarray(
            coefficients.input_inertia[:, None] * motion.energy_slope
            + coefficients.input_damping[:, None] * motion.angular_speed
            + friction.torque
            + motion.mesh_torque * self._share_of_mesh
            - self.motor.proportional * (self.speed - motion.angular_speed)
        )

    def _input_friction(self, motion: TorsionMotion, delivered: Values) -> Response:
        still = np.zeros_like(motion.angular_speed)
        return self._laws("input", still, motion.angular_speed, delivered / self.coefficients.ratio)

    def slopes(self, motion: TorsionMotion) -> Values:
        """Return mean derivatives of torques, shape (n, 4).

        Of the mesh by torsion (N.m/rad) and by its rate, of friction at the output and at the input
        by speed (N.m.s/rad), bearings included.
        """
        friction = np.asarray(self._input_friction(motion, self.delivered(motion)).damping)
        parts = (
            mean(motion.mesh_slope),
            mean(motion.mesh_damping),
            self.output_damping + mean(motion.output_loss),
            self.coefficients.input_damping[:, None] + mean(friction),
        )
        return np.hstack([np.broadcast_to(part, self.speed.shape) for part in parts])

    @cached_property
    def _share_of_mesh(self) -> Values:
        """Torque at the input for each N.m of the mesh, on the grid."""
        coefficients = self.coefficients
        return np.asarray(1.0 / coefficients.ratio - coefficients.reaction * self._static_slope)

    @cached_property
    def rate(self) -> Phasors:
        """Angular frequency of each harmonic, times 1j, shape (n, n_harmonics)."""
        return np.asarray(1j * self.torus.orders * self.speed)

    @cached_property
    def input_operator(self) -> Phasors:
        """N A: A, motor torque per unit of E of the free input, linear in E; N at the mean."""
        coefficients, motor = self.coefficients, self.motor
        orders = np.where(self.torus.orders == 0.0, 1.0, self.torus.orders)
        damping = coefficients.input_damping[:, None] + motor.proportional
        operator = (
            1j * orders * coefficients.input_inertia[:, None]
            + damping / self.speed
            + motor.integral / (1j * orders * self.speed**2)
        )
        operator[:, 0] = 1.0
        return coefficients.ratio * operator

    def impedance(self, friction: Values) -> tuple[Phasors, Phasors, Phasors]:
        """Return mesh torque per transmission error P of the free inertias, C, and 1 + C / (N A).

        C is the output's torque per unit of E, N A that of the motor (`input_operator`);
        ``friction`` is the damping (n, 1) of the laws at the output.
        """
        damping = self.output_damping + friction
        of_inertia, coupling = self._of_inertia
        output = of_inertia - self.rate * damping
        coupling = coupling + damping / (self.speed * self.coefficients.ratio)
        share = 1.0 + coupling / self.input_operator
        share[:, 0] = 1.0
        if self.prescribed:
            share[:] = 1.0
        return output / share, coupling, share

    @cached_property
    def _of_inertia(self) -> tuple[Phasors, Phasors]:
        """Contributions of the inertia to P (before it is shared) and to C of `impedance`."""
        frequency = self.torus.orders * self.speed
        rates = self.coefficients.load_rates
        inertia = self.output_inertia + self.coefficients.loose_inertia(frequency)
        inertia = inertia + sum(size * self.rate**k for k, size in rates)
        return inertia * frequency**2, 1j * self.torus.orders * inertia / self.coefficients.ratio


def added(response: Response, other: Response) -> Response:
    """Return the sum of two responses."""
    return Response(
        response.torque + other.torque,
        response.slope + other.slope,
        response.damping + other.damping,
    )


def mean(values: Values | float) -> Values:
    """Return the mean over the grid, shape (n, 1), of values that may be the same on all of it."""
    there = np.atleast_2d(values)
    points = there.shape[1]
    return there if points == 1 else np.asarray(there.sum(axis=1, keepdims=True) / points)
