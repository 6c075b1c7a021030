"""What a bench does to a drive and to its sensors, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import LawAtPort, harmonic_balance, preset
from pymoo_hdte.drive._effects import (
    BenchResonance,
    InputTorqueDrift,
    NewInputTorqueZero,
    NewOutputTorqueZero,
    OutputTorqueDrift,
    WarmingFriction,
)
from pymoo_hdte.effects.ripple import BrakeRipple, CouplingTorque, PeriodicTorque

MODEL = preset("published")
PLAIN = MODEL.coefficients(MODEL.nominal[None])
SMOOTH = replace(PLAIN, error_phasors=np.zeros_like(PLAIN.error_phasors))
"""Without a static error, so that nothing but the nuisance makes lines."""


def balance(law, port, name, **changes):
    coefficients = LawAtPort(name, port, law).apply(replace(SMOOTH, **changes))
    found = harmonic_balance(coefficients)
    assert found.converged.all()
    return found


def line(motion, values, order):
    place, conjugate = motion.torus.place(order)
    found = values[0, place]
    return found.conjugate() if conjugate else found


def test_a_coupling_accelerates_the_whole_inertia_and_is_no_torque_of_the_motor():
    """Far below the resonance: half the square of the speed grows by the work over the inertia."""
    amplitude, phase = 1e-4, 0.7
    motion = balance(CouplingTorque(1.0, phase, amplitude), "input", "coupling_ripple")
    inertia = SMOOTH.input_inertia[0] + SMOOTH.output_inertia / SMOOTH.ratio**2
    work = amplitude * np.exp(1j * phase) / 1j
    assert line(motion, motion.energy, 1.0) == pytest.approx(work / inertia, rel=0.01)
    assert abs(line(motion, motion.motor_torque, 1.0)) < 1e-6 * amplitude


def test_a_coupling_at_the_output_twists_the_spring():
    """At its few cycles per output turn the load's inertia hardly resists: T = K d."""
    amplitude, phase = 0.05, 0.4
    law = PeriodicTorque(1.0, phase, amplitude)
    motion = balance(law, "output", "torque_ripple")
    twisted = -amplitude * np.exp(1j * phase) / SMOOTH.stiffness[0]
    found = line(motion, motion.torsion, 1.0 / SMOOTH.ratio)
    # The input's speed follows a little, for it is free.
    still = 1.0 / (1.0 + SMOOTH.output_inertia / (SMOOTH.input_inertia[0] * SMOOTH.ratio**2))
    assert found == pytest.approx(twisted * still, rel=0.02)
    assert abs(line(motion, motion.coupling_torque, 1.0 / SMOOTH.ratio)) < 0.01 * amplitude


def test_the_ripple_of_a_brake_is_a_share_of_the_load_that_the_sensor_reads():
    law = BrakeRipple(3.0, 0.9, 0.02)
    for load in (20.0, -20.0):
        motion = balance(law, "load", "brake_ripple", load_torque=load)
        found = line(motion, motion.coupling_torque, 3.0 / SMOOTH.ratio)
        assert found == pytest.approx(0.02 * load * np.exp(0.9j), rel=0.01)
    idle = balance(law, "load", "brake_ripple", load_torque=0.0)
    assert np.abs(idle.coupling_torque[0, 1:]).max() < 1e-12


@pytest.mark.parametrize("elapsed", [0.0, 300.0, 3000.0, np.inf])
def test_warming_takes_its_share_of_the_friction(elapsed):
    law = WarmingFriction(float(SMOOTH.input_damping[0]), 0.4, 600.0)
    motion = balance(law, "input", "warming", elapsed=np.array([elapsed]))
    lost = 0.4 * -np.expm1(-elapsed / 600.0)
    plain = harmonic_balance(SMOOTH)
    less = plain.motor_torque[0, 0].real - motion.motor_torque[0, 0].real
    expected = lost * SMOOTH.input_damping[0] * SMOOTH.input_speed
    assert less == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_zeros_of_torque_sensors_drift_and_change():
    elapsed = np.array([0.0, 600.0, 6e4])
    of_input, of_output = InputTorqueDrift(2e-3, 600.0), OutputTorqueDrift(0.1, 600.0)
    course = np.array([0.0, 1.0 - np.exp(-1.0), 1.0])
    np.testing.assert_allclose(of_input.torque_reading(elapsed), [2e-3 * course, 0 * course])
    np.testing.assert_allclose(of_output.torque_reading(elapsed), [0 * course, 0.1 * course])
    late = [0.0, 1.0, 1.0]
    changed = NewInputTorqueZero(3e-3, 600.0).torque_reading(elapsed)
    np.testing.assert_allclose(changed, np.outer([3e-3, 0.0], late))
    changed = NewOutputTorqueZero(0.2, 600.0).torque_reading(elapsed)
    np.testing.assert_allclose(changed, np.outer([0.0, 0.2], late))


def test_a_mode_of_the_bench_is_that_of_an_oscillator():
    """Of an inertia on a spring and damper, as its equation of motion in the time domain has it."""
    compliance, natural, damping = 2e-7, 500.0, 0.05
    mode = BenchResonance(compliance, natural, damping)
    frequency = np.array([0.0, 120.0, 500.0, 1700.0, -500.0])
    turned = mode.turned_back(frequency)
    inertia = 1.0 / (compliance * natural**2)
    damper = 2.0 * damping * natural * inertia
    # J x'' + c x' + x / compliance = torque.
    left = (-inertia * frequency**2 + 1j * damper * frequency + 1.0 / compliance) * turned
    np.testing.assert_allclose(left, 1.0, atol=1e-12)
    assert abs(turned[2]) == pytest.approx(compliance / (2.0 * damping))
    assert turned[4] == turned[2].conjugate()
