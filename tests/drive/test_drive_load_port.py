"""Laws at the load, beyond the output torque sensor: closed forms, and what sensors read."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.drive import LawAtPort, LoadInertia, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.drive._effects import effect_from_fields
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.ripple import PeriodicTorque

RIPPLE = PeriodicTorque(3.0, 0.7, 0.5)
GRAVITY = Gravity(2.0, 0.4)
LAWS = [("torque_ripple", RIPPLE, 3.0), ("gravity", GRAVITY, 1.0)]


def without_error(name, speed_rpm, load=0.0):
    """Return coefficients of a drive that errs nowhere, whose load has half of its inertia."""
    model = preset(name).at(speed_rpm, load)
    model = replace(model, effects=(LoadInertia(0.4),))
    coefficients = model.coefficients(model.nominal[None])
    return replace(coefficients, error_phasors=np.zeros_like(coefficients.error_phasors))


def with_law(coefficients, law, port="load"):
    return replace(coefficients, laws=((port, law),))


def line(balance, channel, order):
    place, conjugate = balance.torus.place(order)
    phasor = getattr(balance, channel)[0, place]
    return phasor.conjugate() if conjugate else phasor


@pytest.mark.parametrize(("name", "law", "order"), LAWS)
def test_slowly_turned_it_twists_the_mesh_and_is_read_by_the_sensor(name, law, order):
    """With a motor that holds its speed the torsion is the torque over the stiffness.

    The output turns by the torsion less than the input, here by 7e-5 rad at most.
    """
    coefficients = without_error("published", 0.1)
    balance = harmonic_balance(with_law(coefficients, law), motor=SpeedLoop(1e4))
    at = order / coefficients.ratio
    sign = -1.0 if law is RIPPLE else 1.0
    size = law.amplitude if law is RIPPLE else law.torque
    torque = sign * size * np.exp(1j * law.phase)
    assert line(balance, "torsion", at) == pytest.approx(
        torque / coefficients.stiffness[0], rel=1e-4
    )
    assert line(balance, "coupling_torque", at) == pytest.approx(torque, rel=1e-4)
    at_brake = torque if law.drives else 0.0
    assert line(balance, "brake_torque", at) == pytest.approx(at_brake, rel=1e-4)


def test_a_ripple_swings_the_load_on_the_mesh():
    """Two free inertias on spring and damper: th_out = -(1 / k_out) of the torque beyond."""
    coefficients = without_error("published", 1500.0)
    fast = replace(RIPPLE, order=303.0, amplitude=0.05)
    balance = harmonic_balance(with_law(coefficients, fast))
    frequency = 3.0 * coefficients.input_speed
    ratio = coefficients.ratio
    mesh = coefficients.stiffness[0] + 1j * frequency * coefficients.damping[0]
    at_input = -(frequency**2) * coefficients.input_inertia[0] * ratio**2
    at_input += 1j * frequency * coefficients.input_damping[0] * ratio**2
    at_output = (
        -(frequency**2) * coefficients.output_inertia + 1j * frequency * coefficients.output_damping
    )
    # [input at the output, output] against the torque on the output.
    system = np.array([[at_input + mesh, -mesh], [-mesh, at_output + mesh]])
    torque = fast.amplitude * np.exp(1j * fast.phase)
    turned = np.linalg.solve(system, [0.0, torque])
    found = line(balance, "transmission_error", 3.0)
    assert found == pytest.approx(turned[0] - turned[1], rel=1e-3)
    read = -torque + 0.4 * -(frequency**2) * turned[1]
    assert line(balance, "coupling_torque", 3.0) == pytest.approx(read, rel=1e-3)


@pytest.mark.parametrize(("name", "law", "order"), LAWS)
def test_at_the_output_the_drive_moves_alike_and_the_sensor_reads_less(name, law, order):
    coefficients = without_error("calibrated", 900.0, 10.0)
    beyond, before = (
        harmonic_balance(with_law(coefficients, law, port)) for port in ("load", "output")
    )
    assert beyond.transmission_error == pytest.approx(before.transmission_error, abs=1e-15)
    read = beyond.coupling_torque - before.coupling_torque
    at = order / coefficients.ratio
    size = law.amplitude if law is RIPPLE else law.torque
    place, _ = beyond.torus.place(at)
    assert abs(read[0, place]) == pytest.approx(size, rel=1e-6)
    # What the transmission error turns the output modulates the torque by that angle.
    most = 3.0 * np.abs(beyond.transmission_error[0]).sum() * size
    assert np.abs(np.delete(read[0], place)).max() < most


@pytest.mark.parametrize(("name", "law", "order"), LAWS)
def test_a_model_file_keeps_it(name, law, order):
    effect = LawAtPort(name, "load", law)
    assert effect_from_fields(Fields(effect.to_dict(), "effect")) == effect
