"""A load that is not rigidly on the output, as a series in the rates of its acceleration."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import hill_steady_state, preset, simulate_drive
from pymoo_hdte.drive.effects.base import DriveEffect
from pymoo_hdte.drive.solve.free_angle import harmonic_balance
from pymoo_hdte.drive.solve.hill import transfer_function

INERTIA, TIME = 0.05, 2e-4
"""kg.m2, and s after which a viscous clutch has brought it to speed."""


def small_motion():
    """A drive of constant stiffness with an error so small that the motion is linear."""
    model = preset("calibrated")
    found = model.coefficients(model.nominal[None])
    small = 1e-3 * found.error_phasors
    return replace(found, laws=(), stiffness_depth=0.0, error_phasors=small)


def in_a_clutch(drive, terms):
    """J s2 / (1 + s T) as a series: J s2 (1 - s T + s2 T2 - ...)."""
    rates = tuple((k, INERTIA * (-TIME) ** k) for k in range(1, terms + 1))
    inertia = drive.output_inertia + INERTIA
    return replace(drive, output_inertia=inertia, load_inertia=inertia, load_rates=rates)


def exact(drive, order):
    rate = 1j * order * drive.input_speed
    heavy = replace(drive, output_inertia=drive.output_inertia + INERTIA / (1.0 + rate * TIME))
    return transfer_function(heavy, np.array([order]))[0, 0]


def error_of(drive, terms):
    """Largest error of the lines, relative to what the clutch changes of them."""
    found = harmonic_balance(in_a_clutch(drive, terms))
    rigid = harmonic_balance(in_a_clutch(drive, 0))
    errors = []
    for order, phasor in zip(drive.error_orders.tolist(), drive.error_phasors[0], strict=True):
        place, _ = found.torus.place(order)
        wanted = exact(drive, order) * phasor
        change = wanted - rigid.transmission_error[0, place]
        errors.append(abs(found.transmission_error[0, place] - wanted) / abs(change))
    return max(errors)


def test_a_load_in_a_clutch_moves_as_its_closed_form_says():
    """Each term brings the series nearer by the largest line's w T, a twelfth."""
    drive = small_motion()
    errors = [error_of(drive, terms) for terms in (0, 1, 2, 4)]
    assert errors[0] == pytest.approx(1.0)
    assert np.all(np.array(errors[1:3]) < 0.2 * np.array(errors[:2]))
    assert errors[3] < 1e-2


def test_the_sensor_at_the_output_reads_what_accelerates_the_load():
    """Bearing and static error left out, it is the mesh torque's line that moves the output."""
    drive = replace(small_motion(), output_damping=0.0)
    found = harmonic_balance(in_a_clutch(drive, 4))
    place, _ = found.torus.place(1.0)
    rate = 1j * drive.input_speed
    mesh = drive.stiffness[0] + rate * drive.damping[0]
    torque, read = mesh * found.torsion[0, place], found.coupling_torque[0, place]
    assert read == pytest.approx(torque, rel=1e-3)


def test_only_the_harmonic_balance_knows_such_a_load():
    drive = in_a_clutch(small_motion(), 1)
    balance = harmonic_balance(drive)
    spectrum = hill_steady_state(drive)
    assert spectrum.orders == pytest.approx(balance.torus.orders)
    assert spectrum.phasors == pytest.approx(balance.transmission_error)
    model = preset("calibrated")

    class Clutch(DriveEffect):
        name = "clutch"

        def apply(self, coefficients):
            return in_a_clutch(coefficients, 1)

    with pytest.raises(InvalidInput, match="load_rates"):
        simulate_drive(replace(model, effects=(*model.effects, Clutch())), model.nominal)
