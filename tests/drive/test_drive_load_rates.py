"""A load that is not rigidly on the output: in a clutch, or as a series in its rates."""

from dataclasses import replace

import numpy as np
import pytest
from drive_mechanism import drive_mechanism

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    CoupledInertia,
    LoadInertia,
    MeshStiffnessVariation,
    hill_steady_state,
    preset,
    simulate_drive,
)
from pymoo_hdte.drive._effects.base import DriveEffect
from pymoo_hdte.drive._solve.free_angle import harmonic_balance
from pymoo_hdte.drive._solve.hill import transfer_function
from pymoo_hdte.drive._solve.stability import UnstableDrive
from pymoo_hdte.drive.dte_map import torsional_mode

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


LATE = 5e-3
"""s, so that the largest line's w T is two: no series follows it."""


def coupled(late):
    return CoupledInertia(INERTIA, late).apply(small_motion())


def lines_of(motion, drive):
    orders = drive.error_orders.tolist()
    return np.array([motion.transmission_error[0, motion.torus.place(one)[0]] for one in orders])


@pytest.mark.parametrize("late", [TIME, LATE])
def test_an_inertia_in_a_clutch_moves_as_its_closed_form_says(late):
    drive = coupled(late)
    assert hill_steady_state(drive).phasors == pytest.approx(
        transfer_function(drive, drive.error_orders) * drive.error_phasors
    )
    found = []
    for order, phasor in zip(drive.error_orders.tolist(), drive.error_phasors[0], strict=True):
        rate = 1j * order * drive.input_speed
        heavy = drive.output_inertia + INERTIA / (1.0 + rate * late)
        plain = replace(drive, output_inertia=heavy, coupled=())
        found.append(transfer_function(plain, np.array([order]))[0, 0] * phasor)
    balance = harmonic_balance(drive)
    # Of the input's fluctuation only the second order is left.
    scale = np.abs(found).max()
    assert lines_of(balance, drive) == pytest.approx(found, abs=2e-3 * scale)


@pytest.mark.parametrize("late", [TIME, LATE])
def test_the_sensor_at_the_output_reads_what_drags_the_clutch(late):
    """Without bearing friction the mesh moves the output's own inertia and what is behind it."""
    drive = replace(coupled(late), output_damping=0.0)
    found = harmonic_balance(drive)
    place, _ = found.torus.place(1.0)
    rate = 1j * drive.input_speed
    torque = (drive.stiffness[0] + rate * drive.damping[0]) * found.torsion[0, place]
    behind = INERTIA / (1.0 + rate * late)
    own = np.ravel(drive.output_inertia)[0] - np.ravel(drive.load_inertia)[0]
    read = np.ravel(drive.load_inertia)[0] + behind
    assert found.coupling_torque[0, place] == pytest.approx(torque * read / (own + read), rel=1e-3)


def test_a_clutch_that_closes_at_once_is_a_rigid_shaft():
    drive = coupled(1e-9)
    rigid = LoadInertia(INERTIA).apply(small_motion())
    assert lines_of(harmonic_balance(drive), drive) == pytest.approx(
        lines_of(harmonic_balance(rigid), rigid), rel=1e-5
    )
    at_once, shaft = (
        replace(preset("published"), effects=(one,))
        for one in (CoupledInertia(0.45, 1e-9), LoadInertia(0.45))
    )
    assert torsional_mode(at_once).frequency == pytest.approx(
        torsional_mode(shaft).frequency, rel=1e-4
    )
    varying = MeshStiffnessVariation(0.95, 0.0)
    loose = replace(at_once, effects=(varying, *at_once.effects))
    # A stiffness that varies has the mode of its mean.
    assert torsional_mode(loose).frequency == pytest.approx(torsional_mode(at_once).frequency)
    with pytest.raises(UnstableDrive):
        loose.dte_arcsec(loose.nominal[None])


@pytest.mark.parametrize(("late", "inertia"), [(1e-9, INERTIA), (1e9, 0.0)])
def test_hill_s_method_knows_clutches_between_a_rigid_inertia_and_none(late, inertia):
    plain = replace(small_motion(), stiffness_depth=0.05)
    drive = CoupledInertia(INERTIA, late).apply(plain)
    rigid = hill_steady_state(LoadInertia(inertia).apply(plain))
    scale = np.abs(rigid.phasors).max()
    assert hill_steady_state(drive).phasors == pytest.approx(rigid.phasors, abs=1e-5 * scale)


def test_a_clutch_damps_what_it_hardly_lets_swing():
    """Of a clutch that slips at the torsion's frequency the drive sees a damper, J over T."""
    model = replace(preset("published"), effects=(CoupledInertia(1.0, 1.0),))
    free = replace(model, effects=())
    with_damper, without = (torsional_mode(one) for one in (model, free))
    assert with_damper.frequency == pytest.approx(without.frequency, rel=0.1)
    assert with_damper.damping_ratio > without.damping_ratio


def test_what_cannot_know_a_clutch_says_so():
    model = replace(preset("published"), effects=(CoupledInertia(0.1, 0.2),))
    with pytest.raises(InvalidInput, match="settle"):
        simulate_drive(model, model.nominal)
    with pytest.raises(InvalidInput, match="coupled_inertia"):
        drive_mechanism(model, model.nominal)


def test_an_inertia_in_a_clutch_is_integrated_over_time_to_the_same_motion():
    model = preset("calibrated")
    model = replace(model, effects=(*model.effects, CoupledInertia(INERTIA, 1e-3)))
    record = simulate_drive(model, model.nominal)
    balance = harmonic_balance(model.coefficients(model.nominal[None]))
    angle = record.input_angle
    turn = np.exp(-1j * np.outer([1.0, 2.0], angle))
    steps = np.gradient(angle)
    found = 2.0 * (turn * record.transmission_error) @ steps / steps.sum()
    places = [balance.torus.place(order)[0] for order in (1.0, 2.0)]
    expected = balance.transmission_error[0, places]
    assert np.abs(found - expected).max() < 5e-3 * np.abs(expected).max()
