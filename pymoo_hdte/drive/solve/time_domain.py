"""Eq. (9) integrated from rest, torque-driven: the reference that the steady state is held against.

The state is (th_in, th_in', th_d, th_d') with th_d = th_in / N - th_out, so that the transmission
error, a part in 10^4 of the angles, is integrated to its own precision.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number
from pymoo_hdte.drive.model import PARAMETERS, DriveModel
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.drive.solve.harmonic_balance import harmonic_balance
from pymoo_hdte.laws.hysteresis import SPRINGS, MaxwellSlip
from pymoo_hdte.laws.law import PORTS, Law, PortState, periodic_phase
from pymoo_hdte.units import ARCSEC

METHODS = ("LSODA", "DOP853", "Radau", "RK45", "BDF")
ANGLES = ("free", "prescribed")

_POINTS_PER_TURN = 120


@dataclass(frozen=True)
class Run:
    """One simulated output turn in steady state, on the samples of the integrator's output.

    Attributes
    ----------
    time : ndarray, shape (n_times,)
        s, from the start at rest.
    input_angle : ndarray, shape (n_times,)
        Angle on which theta_s and the stiffness depend, rad; passes 0 where the output turn begins.
    input_speed : ndarray, shape (n_times,)
        th_in', rad/s.
    transmission_error : ndarray, shape (n_times,)
        theta_d, rad.
    ratio : float
        Transmission ratio N, dimensionless.
    """

    time: NDArray[np.float64]
    input_angle: NDArray[np.float64]
    input_speed: NDArray[np.float64]
    transmission_error: NDArray[np.float64]
    ratio: float

    def peak_to_peak(self) -> float:
        """Return the peak-to-peak of theta_d over 0 <= input angle <= 2 pi N, in rad."""
        curve = scipy.interpolate.CubicSpline(self.input_angle, self.transmission_error)
        end = 2.0 * np.pi * self.ratio
        turning = curve.derivative().roots(extrapolate=False)
        inside = turning[(turning > 0.0) & (turning < end)]
        values = curve(np.concatenate([[0.0], inside, [end]]))
        return float(values.max() - values.min())

    def dte_arcsec(self) -> float:
        """Return the DTE of Section 4 in arcsec."""
        return self.peak_to_peak() / ARCSEC


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


def simulate(
    model: DriveModel,
    parameters: ArrayLike,
    *,
    angle: str = "free",
    method: str = "LSODA",
    ramp: float = 0.5,
    settle: float = 1.5,
    rtol: float = 1e-8,
) -> Run:
    """Integrate Eq. (9) for one design from rest to steady state and through one output turn.

    Torque-driven as in Section 2.2, from the rest of Eq. (11). The input torque rises smoothly from
    zero to the level that holds the rated speed, with what it takes to accelerate the inertias in
    between; load and static error follow the same envelope. The drive starts at the negative input
    angle from which it reaches 0 after ``ramp + settle``, so that the output turn is the one the
    steady state is evaluated on.

    Parameters
    ----------
    model : DriveModel
        With its effects.
    parameters : array_like, shape (5,)
        `PARAMETERS` in SI units.
    angle : {"free", "prescribed"}
        Whether theta_s and the stiffness follow the simulated input angle, as in a real drive, or
        the angle of the nominal speed, as Hill's method has it.
    method : str
        One of `METHODS`, of ``scipy.integrate.solve_ivp``.
    ramp, settle : float
        Duration of the start-up and of the settling after it, s.
    rtol : float
        Relative tolerance, dimensionless.

    Returns
    -------
    Run

    Raises
    ------
    InvalidInput
        For a wrong argument.
    ArithmeticError
        If the integrator gives up, the speed does not settle, or no mean torque holds it.
    """
    if not isinstance(model, DriveModel):
        raise InvalidInput("model", model, "a DriveModel, e.g. preset('calibrated')")
    values = finite_array("parameters", parameters, (len(PARAMETERS),))
    one_of("angle", angle, ANGLES)
    one_of("method", method, METHODS)
    real_number("ramp", ramp, above=0.0)
    real_number("settle", settle, at_least=0.0)
    real_number("rtol", rtol, at_least=1e-13, at_most=1e-2)
    coefficients = model.coefficients(values[None, :])
    start_up = StartUp(coefficients.input_speed, ramp, settle)
    turn = 2.0 * np.pi * coefficients.ratio / coefficients.input_speed
    margin = 0.01 * turn
    steps = int(np.ceil(_POINTS_PER_TURN * coefficients.ratio * 1.02))
    times = np.linspace(ramp + settle - margin, ramp + settle + turn + margin, steps)
    if times[0] < ramp:
        raise InvalidInput("settle", settle, f"at least {margin:.3g} s, the margin of the record")

    memory = SPRINGS * len(_springs(coefficients))
    start = np.array([start_up.angle(0.0), *np.zeros(3 + memory)])
    # theta_d is of the order of arcseconds and its rate of the order of arcseconds times 100 1/s.
    atol = np.array([1e-8, 1e-6, 1e-4 * ARCSEC, 1e-2 * ARCSEC, *[1e-4 * ARCSEC] * memory])
    atol *= rtol / 1e-8
    solution = scipy.integrate.solve_ivp(
        equations_of_motion(coefficients, start_up, prescribed=angle == "prescribed"),
        (0.0, times[-1]),
        start,
        method=method,
        t_eval=times,
        rtol=rtol,
        atol=atol,
    )
    if not solution.success:
        reached = f"t = {solution.t[-1]:g} s" if len(solution.t) else "the start"
        raise ArithmeticError(f"{method} gave up at {reached}: {solution.message}")
    input_angle, input_speed, transmission_error = solution.y[:3]
    if angle == "prescribed":
        input_angle = np.array([start_up.angle(time) for time in times])
    end = 2.0 * np.pi * coefficients.ratio
    if not (input_angle[0] <= 0.0 and input_angle[-1] >= end):
        raise ArithmeticError(
            f"the record covers input angles {input_angle[0]:g} to {input_angle[-1]:g} rad, not "
            f"the whole output turn 0 to {end:g}: the speed has not settled"
        )
    return Run(times, input_angle, input_speed, transmission_error, coefficients.ratio)


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
    ratio, load = coefficients.ratio, coefficients.load_torque
    stiffness, damping = float(coefficients.stiffness[0]), float(coefficients.damping[0])
    depth, phase = coefficients.stiffness_depth, coefficients.stiffness_phase
    inertia_in, bearing_in = coefficients.input_inertia[0], coefficients.input_damping[0]
    inertia_in, bearing_in = float(inertia_in), float(bearing_in)
    inertia_out, bearing_out = coefficients.output_inertia, coefficients.output_damping
    speed = coefficients.input_speed
    accelerating = (inertia_in + inertia_out / ratio**2) * speed
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
        return dry("input", 0.0, rate, 0.0) + dry("output", 0.0, rate / ratio, 0.0) / ratio

    # What is left of the holding torque is second order: speed and torsion fluctuate.
    springs = _springs(coefficients)
    left = _holding_torque(coefficients) - holding - losses(speed)

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
        mesh_torque += laws("mesh", torsion, torsion_rate, position)
        stretches = np.split(state[4:], len(springs)) if springs else []
        for spring, stretch in zip(springs, stretches, strict=True):
            mesh_torque += spring.torque(stretch)
        input_torque = accelerating * envelope_rate + (holding + left) * envelope
        input_torque += losses(speed * envelope)
        resisting = bearing_in * input_speed + laws("input", position, input_speed, position)
        lever = 1.0 / ratio - reaction * envelope * slope
        acceleration = (input_torque - resisting - mesh_torque * lever) / inertia_in
        output_speed = input_speed / ratio - error_rate
        output_angle = position / ratio
        resisting = load * envelope + bearing_out * output_speed
        resisting += laws("output", output_angle, output_speed, output_angle)
        output_acceleration = (mesh_torque - resisting) / inertia_out
        rates = [input_speed, acceleration, error_rate, acceleration / ratio - output_acceleration]
        for spring, stretch in zip(springs, stretches, strict=True):
            rates += spring.rates(torsion_rate, stretch).tolist()
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


def _laws_at_ports(coefficients: Coefficients) -> Callable[[str, float, float, float], float]:
    """Return a function from port, position, speed and angle to the torque of its laws.

    Laws with memory are left out: their state is the integrator's (see `_springs`).
    """
    stiffness = coefficients.stiffness[:1]
    at_port = {
        port: [
            law
            for place, law in coefficients.laws
            if place == port and not isinstance(law, MaxwellSlip)
        ]
        for port in PORTS
    }

    def torque(port: str, position: float, speed: float, angle: float) -> float:
        here = at_port[port]
        if not here:
            return 0.0
        state = PortState(np.array([position]), np.array([speed]), periodic_phase(angle), stiffness)
        return sum(np.asarray(law.respond(state).torque).item() for law in here)

    return torque


def _springs(coefficients: Coefficients) -> list[MaxwellSlip]:
    """Return the laws with memory, all at the mesh."""
    return [law for _, law in coefficients.laws if isinstance(law, MaxwellSlip)]
