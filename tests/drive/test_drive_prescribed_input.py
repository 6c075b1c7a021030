"""A drive whose input moves as measured: against the free one, an integrator and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import LawAtPort, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.drive._solve.lead_response import lead_response, torque_lines
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.friction import CoulombFriction, NonlinearDrag
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.ripple import BrakeRipple, CouplingTorque, PeriodicTorque
from pymoo_hdte.effects.stiffness import HardeningStiffness, SoftWindup

LAWS = [
    (),
    (LawAtPort("coulomb_friction", "output", CoulombFriction(0.3)),),
    (LawAtPort("nonlinear_drag", "input", NonlinearDrag(1e-6, 2.0, 1.0)),),
    (LawAtPort("torque_ripple", "input", PeriodicTorque(3.0, 0.4, 0.02)),),
    (LawAtPort("soft_windup", "mesh", SoftWindup(0.2, 1e-4)),),
    (LawAtPort("hysteresis", "mesh", MaxwellSlip(5.0, 1e-4)),),
]
CHANNELS = ("transmission_error", "torsion", "motor_torque", "coupling_torque", "lead", "energy")


def coefficients_with(*effects, name="calibrated"):
    model = preset(name)
    with_them = replace(model, effects=(*model.effects, *effects))
    return with_them.coefficients(model.nominal[None])


def lead_on(torus, lines):
    lead = np.zeros((1, len(torus.orders)), dtype=complex)
    for order, phasor in lines.items():
        lead[0, torus.place(order)[0]] = phasor
    return lead


@pytest.mark.parametrize("effects", LAWS)
@pytest.mark.parametrize("speed", [200.0, -60.0])
def test_its_own_motion_gives_the_free_drive(effects, speed):
    """The motor then takes the torque of the loop that held the free one."""
    coefficients, torus = coefficients_with(*effects), None
    at = {"input_speed": np.array([speed]), "load_torque": np.array([30.0]), "tolerance": 1e-12}
    free = harmonic_balance(coefficients, motor=SpeedLoop(0.02, 0.5), **at)
    torus = free.torus
    held = harmonic_balance(coefficients, torus=torus, lead=free.lead, **at)
    assert held.converged.all()
    for channel in CHANNELS:
        expected = getattr(free, channel)
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(held, channel), expected, rtol=0, atol=1e-5 * size)


def test_an_input_that_moves_at_will_agrees_with_an_integrator():
    """Of the output alone, in time; the motor's torque is what the input's equation leaves."""
    coefficients = coefficients_with(
        LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(2e9))
    )
    torus = Torus((1.0, 0.02), (18, 2))
    lines = {1.0: 0.02, 3.0: 0.01j, 5.0: -0.003}
    steady = harmonic_balance(coefficients, torus=torus, lead=lead_on(torus, lines))
    assert steady.converged.all()
    ratio, speed = coefficients.ratio, coefficients.input_speed
    stiffness, damping = float(coefficients.stiffness[0]), float(coefficients.damping[0])
    orders = np.array(list(lines)), np.array(list(lines.values()), dtype=complex)
    static = coefficients.error_orders, coefficients.error_phasors[0]

    def at(angle, lines, derivative=0):
        order, phasor = lines
        waves = phasor * (1j * order) ** derivative * np.exp(1j * order * angle)
        return float(waves.sum().real)

    def input_motion(angle):
        rate = speed / (1.0 - at(angle, orders, 1))
        return rate, rate**3 / speed * at(angle, orders, 2)

    def mesh_torque(angle, rate, error, error_rate):
        torsion = error - at(angle, static)
        torsion_rate = error_rate - at(angle, static, 1) * rate
        wave = np.cos(2.0 * angle + coefficients.stiffness_phase)
        varying = stiffness * (1.0 + coefficients.stiffness_depth * wave)
        return varying * torsion + 2e9 * torsion**3 + damping * torsion_rate

    def rates(_, state):
        angle, error, error_rate = state
        rate, acceleration = input_motion(angle)
        torque = mesh_torque(angle, rate, error, error_rate)
        output = torque - coefficients.load_torque
        output -= coefficients.output_damping * (rate / ratio - error_rate)
        return [rate, error_rate, acceleration / ratio - output / coefficients.output_inertia]

    start = [0.0, float(steady.transmission_error[0, 0].real), 0.0]
    turns = 2.0 * np.pi * 30.0
    run = solve_ivp(
        rates, (0.0, turns / speed), start, "DOP853", rtol=1e-9, atol=1e-12, dense_output=True
    )
    times = np.linspace(0.95, 1.0, 400) * turns / speed
    angle, error, error_rate = run.sol(times)
    waves = np.exp(1j * np.outer(angle, torus.orders))
    expected = (waves @ steady.transmission_error[0]).real
    np.testing.assert_allclose(error, expected, rtol=0, atol=2e-6 * np.ptp(error))
    rate, acceleration = np.array([input_motion(a) for a in angle]).T
    mesh = [mesh_torque(*values) for values in zip(angle, rate, error, error_rate, strict=True)]
    motor = coefficients.input_inertia[0] * acceleration + coefficients.input_damping[0] * rate
    motor += np.array(mesh) / ratio
    expected = (waves @ steady.motor_torque[0]).real
    np.testing.assert_allclose(motor, expected, rtol=0, atol=1e-4 * np.ptp(motor))


def test_harmonics_converge_geometrically():
    """The error of the torsion falls by the same factor with further harmonics."""
    law = LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(2e9))
    coefficients, lines = coefficients_with(law), {1.0: 0.1, 2.0: 0.05j}

    def torsion(whole):
        torus = Torus((1.0, 0.02), (whole, 2))
        motion = harmonic_balance(coefficients, torus=torus, lead=lead_on(torus, lines))
        assert motion.converged.all()
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        return (np.exp(1j * np.outer(angle, torus.orders)) @ motion.torsion[0]).real

    finest = torsion(24)
    errors = [np.abs(torsion(whole) - finest).max() for whole in (6, 9, 12, 15)]
    assert np.all(np.diff(np.log(errors)) < -1.0)


@pytest.mark.parametrize("speed", [200.0, -60.0])
def test_a_small_motion_is_answered_as_the_balance_answers_it(speed):
    drag = LawAtPort("nonlinear_drag", "input", NonlinearDrag(1e-6, 2.0, 1.0))
    coefficients = replace(coefficients_with(drag), stiffness_depth=0.0)
    coefficients = replace(coefficients, error_phasors=1e-9 * coefficients.error_phasors)
    torus, step, order = torus_of(coefficients), 1e-5, 3.0
    at = {"input_speed": np.array([speed]), "load_torque": np.array([30.0]), "torus": torus}
    still, moved = (
        harmonic_balance(coefficients, lead=lead_on(torus, {order: size}), tolerance=1e-13, **at)
        for size in (0.0, step)
    )
    response = lead_response(coefficients, still.slopes, at["input_speed"], [order])
    place = torus.place(order)[0]
    for channel in ("torsion", "motor_torque", "coupling_torque"):
        change = (getattr(moved, channel) - getattr(still, channel))[0, place] / step
        assert change == pytest.approx(getattr(response, channel)[0, 0], rel=1e-3)


TORQUES = [
    ("torque_ripple", "input", PeriodicTorque(8.0, 0.4, 2e-3)),
    ("coupling_ripple", "input", CouplingTorque(2.0, 0.4, 2e-3)),
    ("torque_ripple", "output", PeriodicTorque(2.0, 1.4, 0.06)),
    ("gravity", "load", Gravity(0.05, 0.3)),
    ("brake_ripple", "load", BrakeRipple(9.0, -0.7, 0.002)),
]


@pytest.mark.parametrize(("name", "port", "law"), TORQUES)
@pytest.mark.parametrize("speed", [200.0, -60.0])
def test_a_torque_of_one_line_is_answered_as_the_balance_answers_it(name, port, law, speed):
    """Exactly at the input; elsewhere but for what a varying stiffness and the error make of it."""
    for depth in (0.0, 0.03):
        plain = replace(coefficients_with(), stiffness_depth=depth)
        coefficients = replace(plain, laws=(*plain.laws, (port, law)))
        torus, load = torus_of(coefficients), np.array([30.0])
        at = {"input_speed": np.array([speed]), "load_torque": load, "tolerance": 1e-13}
        lead = lead_on(torus, {2.0: 1e-4})
        without, present = (
            harmonic_balance(one, torus=torus, lead=lead, **at) for one in (plain, coefficients)
        )
        lines = torque_lines(plain, [(port, law)], without, at["input_speed"], load)
        place, conjugate = torus.place(float(lines.orders[0]))
        for channel in ("torsion", "motor_torque", "coupling_torque", "brake_torque"):
            change = (getattr(present, channel) - getattr(without, channel))[0]
            expected = np.zeros_like(change)
            expected[place] = getattr(lines, channel)[0, 0]
            expected = expected.conj() if conjugate else expected
            size = max(np.abs(expected).max(), np.abs(change).max())
            if channel == "coupling_torque" and port != "input":
                size = max(size, abs(law.line(load)[0]))
            # The angle of the output varies by the error, which turns the line as well.
            turned = 2.0 * law.orders[0] * np.abs(plain.error_phasors).sum()
            share = 1e-6 if port == "input" else depth + turned + 2e-3
            np.testing.assert_allclose(change, expected, rtol=0.0, atol=share * size + 1e-13)


def test_a_motion_of_another_shape_is_refused():
    coefficients = coefficients_with()
    with pytest.raises(InvalidInput, match="lead"):
        harmonic_balance(coefficients, lead=np.zeros((1, 3), dtype=complex))
