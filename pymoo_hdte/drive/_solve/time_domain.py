"""Eq. (9) integrated from rest, torque-driven: the reference for the steady state.

The state is (th_in, th_in', th_d, th_d') with th_d = th_in / N - th_out, so that the transmission
error, a part in 10^4 of the angles, is integrated to its own precision; then the states of laws
with memory, by how much each inertia in a clutch is slower than the output, and how far a shaft
ahead of the load is twisted by accelerating it, with the rate of that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.free_angle import harmonic_balance
from pymoo_hdte.effects.law import PORTS, Law, Memory, PortState, periodic_phase


def smooth_step(x: float) -> tuple[float, float]:
    """Return the envelope that rises from 0 at x = 0 to 1 at x = 1, and its derivative.

    The seventh-degree polynomial whose first three derivatives vanish at both ends.
    """
    if x <= 0.0:
        return 0.0, 0.0
    if x >= 1.0:
        return 1.0, 0.0
    value = x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)
    return value, 140.0 * (x * (1.0 - x)) ** 3


@dataclass(frozen=True)
class StartUp:
    """Prescribed course of the start: speed, load and static error rise together.

    Attributes
    ----------
    speed : float
        Speed reached, rad/s.
    ramp, settle : float
        s; the angle is 0 at ``ramp + settle``.
    """

    speed: float
    ramp: float
    settle: float

    def envelope(self, time: float) -> tuple[float, float]:
        """Return the envelope and its time derivative."""
        value, slope = smooth_step(time / self.ramp)
        return value, slope / self.ramp

    def angle(self, time: float) -> float:
        """Return the angle of the nominal course, the integral of speed times envelope."""
        x = min(time / self.ramp, 1.0)
        ramped = x**5 * (7.0 - 14.0 * x + 10.0 * x**2 - 2.5 * x**3)
        after = max(time - self.ramp, 0.0)
        return self.speed * (self.ramp * (ramped - 0.5) + after - self.settle)


def equations_of_motion(
    coefficients: Coefficients, start_up: StartUp, *, prescribed: bool
) -> Callable[[float, NDArray[np.float64]], list[float]]:
    """Return the right-hand side of Eq. (9) for the first design in ``coefficients``."""
    if coefficients.load_rates:
        raise InvalidInput("load_rates", coefficients.load_rates, "none in the time domain")
    coefficients = coefficients.at_loads(coefficients.load_torque)
    ratio, load = coefficients.ratio, coefficients.load_torque
    stiffness, damping = float(coefficients.stiffness[0]), float(coefficients.damping[0])
    depth, phase = coefficients.stiffness_depth, coefficients.stiffness_phase
    inertia_in, bearing_in = coefficients.input_inertia[0], coefficients.input_damping[0]
    inertia_in, bearing_in = float(inertia_in), float(bearing_in)
    inertia_out, bearing_out = coefficients.output_inertia, coefficients.output_damping
    speed = coefficients.input_speed
    clutches = coefficients.coupled
    driven = inertia_out + sum(inertia for inertia, _ in clutches)
    shaft, inertia_near = coefficients.loaded_shaft, coefficients.near_inertia
    accelerating = (inertia_in + driven / ratio**2) * speed
    holding = bearing_in * speed + coefficients.mean_mesh_torque / ratio
    lines = [
        (float(order), abs(phasor), math.atan2(phasor.imag, phasor.real))
        for order, phasor in zip(
            coefficients.error_orders, coefficients.error_phasors[0].tolist(), strict=True
        )
    ]

    laws = _laws_at_ports(coefficients)
    dry = _laws_at_ports(replace(coefficients, laws=_aperiodic(coefficients)))
    reaction = coefficients.reaction

    def losses(rate: float) -> float:
        at_output = dry("output", 0.0, rate / ratio, 0.0) + dry("load", 0.0, rate / ratio, 0.0)
        return dry("input", 0.0, rate, 0.0) + at_output / ratio

    # The error of the holding torque is of second order, by fluctuations of speed and torsion.
    remembering = memories(coefficients)
    places = np.cumsum([4, *(law.states for law in remembering)])
    *of_laws, of_clutches = places.tolist()
    excess = _holding_torque(coefficients) - holding - losses(speed)

    def right_hand_side(time: float, state: NDArray[np.float64]) -> list[float]:
        input_angle, input_speed, error, error_rate = state[:4].tolist()
        envelope, envelope_rate = start_up.envelope(time)
        if prescribed:
            position, rate = start_up.angle(time), speed * envelope
        else:
            position, rate = input_angle, input_speed
        static = slope = 0.0
        for order, amplitude, line_phase in lines:
            argument = order * position + line_phase
            static += amplitude * math.cos(argument)
            slope -= amplitude * order * math.sin(argument)
        torsion = error - envelope * static
        torsion_rate = error_rate - envelope_rate * static - envelope * slope * rate
        varying = 1.0 + depth * math.cos(2.0 * position + phase)
        mesh_torque = stiffness * varying * torsion + damping * torsion_rate
        mesh_torque += laws("mesh", torsion, torsion_rate, position, load * envelope)
        memory_states = np.split(state[:of_clutches], of_laws)[1:] if remembering else []
        slips = state[of_clutches : of_clutches + len(clutches)].tolist()
        for law, states in zip(remembering, memory_states, strict=True):
            mesh_torque += law.torque(states)
        input_torque = accelerating * envelope_rate + (holding + excess) * envelope
        input_torque += losses(speed * envelope)
        output_speed = input_speed / ratio - error_rate
        output_angle = position / ratio - error
        delivered = load * envelope + bearing_out * output_speed
        delivered += laws("output", output_angle, output_speed, output_angle)
        delivered += laws("load", output_angle, output_speed, output_angle, load * envelope)
        dragged = sum(j / late * slip for (j, late), slip in zip(clutches, slips, strict=True))
        passed = 0.0
        if shaft is not None:
            twist, twist_rate = state[-2:].tolist()
            passed = (twist + shaft[1] * twist_rate) / shaft[0]
        output_acceleration = (mesh_torque - delivered - dragged - passed) / inertia_near
        resisting = bearing_in * input_speed
        resisting += laws("input", position, input_speed, position, delivered / ratio)
        lever = 1.0 / ratio - reaction * envelope * slope
        acceleration = (input_torque - resisting - mesh_torque * lever) / inertia_in
        rates = [input_speed, acceleration, error_rate, acceleration / ratio - output_acceleration]
        for law, states in zip(remembering, memory_states, strict=True):
            rates += law.rates(torsion_rate, states).tolist()
        for (_, late), slip in zip(clutches, slips, strict=True):
            rates.append(output_acceleration - slip / late)
        if shaft is not None:
            rates += [twist_rate, output_acceleration - passed / coefficients.load_inertia]
        return rates

    return right_hand_side


def _holding_torque(coefficients: Coefficients) -> float:
    """Return the mean input torque that holds the speed of the first design."""
    if not (coefficients.laws or coefficients.reaction):
        mean = float(coefficients.mean_mesh_torque) / coefficients.ratio
        return float(coefficients.input_damping[0]) * coefficients.input_speed + mean
    balance = harmonic_balance(coefficients)
    if not balance.converged[0]:
        raise ArithmeticError("no steady state found whose mean input torque holds the speed")
    return float(balance.motor_torque[0, 0].real)


def _aperiodic(coefficients: Coefficients) -> tuple[tuple[str, Law], ...]:
    return tuple((port, law) for port, law in coefficients.laws if not law.orders)


def _laws_at_ports(coefficients: Coefficients) -> Callable[..., float]:
    """Return a function from port, position, speed, angle and load to the torque of its laws.

    Laws with memory are left out: their state is the integrator's (see `memories`).
    """
    stiffness = coefficients.stiffness[:1]
    at_port = {
        port: [law for place, law in coefficients.laws if place == port and not law.states]
        for port in PORTS
    }

    def torque(port: str, position: float, speed: float, angle: float, load: float = 0.0) -> float:
        here = at_port[port]
        if not here:
            return 0.0
        state = PortState(
            np.array([position]),
            np.array([speed]),
            periodic_phase(angle),
            stiffness,
            load=np.array([load]),
        )
        return sum(np.asarray(law.respond(state).torque).item() for law in here)

    return torque


def memories(coefficients: Coefficients) -> list[Memory]:
    """Return the laws with memory, all at the mesh."""
    return [cast(Memory, law) for _, law in coefficients.laws if law.states]
