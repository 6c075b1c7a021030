"""A load behind a shaft that twists, against its closed form and a time integrator."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import LoadInertia, harmonic_balance, preset, simulate_drive
from pymoo_hdte.drive._effects import LoadShaft
from pymoo_hdte.drive._solve.hill import hill_steady_state, transfer_function
from pymoo_hdte.drive._solve.stability import floquet_multipliers
from pymoo_hdte.drive.dte_map import operating_map, torsional_mode

LOAD, COMPLIANCE, TIME = 0.05, 2e-5, 1e-4
"""kg.m2, rad/(N.m), s: a resonance of 1000 rad/s on a shaft twice as soft as the drive."""
LINES = (1.0, 2.0, 2.02)
"""Orders of the error."""


def behind_a_shaft(compliance=COMPLIANCE, time=TIME):
    """A drive of constant stiffness, with an error so small that its motion is linear."""
    model = preset("published")
    found = model.coefficients(model.nominal[None])
    found = replace(found, error_phasors=1e-3 * found.error_phasors, output_damping=0.0)
    return LoadShaft(compliance, time).apply(LoadInertia(LOAD).apply(found))


def test_the_drive_feels_an_oscillator():
    """J_out alone, and beside it the torque that twists the shaft between both inertias."""
    drive = behind_a_shaft()
    motion, spectrum = harmonic_balance(drive), hill_steady_state(drive)
    for order, phasor in zip(drive.error_orders.tolist(), drive.error_phasors[0], strict=True):
        rate = 1j * order * drive.input_speed
        spring = (1.0 + TIME * rate) / COMPLIANCE
        # Load: J a = spring (output - load), so that the output carries this inertia.
        felt = LOAD * spring / (LOAD * rate**2 + spring)
        own = drive.output_inertia - LOAD + felt
        plain = replace(drive, shaft=None, output_inertia=own, load_inertia=0.0)
        expected = transfer_function(plain, np.array([order]))[0, 0] * phasor
        place, _ = motion.torus.place(order)
        assert motion.transmission_error[0, place] == pytest.approx(expected, rel=2e-3)
        (place,) = np.flatnonzero(np.isclose(spectrum.orders, order))
        assert spectrum.phasors[0, place] == pytest.approx(expected, rel=1e-9)
    # What the sensor reads accelerates the load, and the mesh the output's own inertia beside it.
    place, _ = motion.torus.place(order)
    torque = (drive.stiffness[0] + rate * drive.damping[0]) * motion.torsion[0, place]
    assert motion.coupling_torque[0, place] == pytest.approx(torque * felt / own, rel=1e-3)


def test_a_stiff_shaft_is_a_rigid_one():
    rigid = behind_a_shaft(0.0)
    assert rigid.shaft is None
    stiff = behind_a_shaft(1e-11)
    expected = hill_steady_state(rigid).phasors
    assert hill_steady_state(stiff).phasors == pytest.approx(expected, rel=1e-5)


def test_a_shaft_that_nothing_turns_behind_changes_nothing():
    bare = preset("published")
    model = replace(bare, effects=(LoadShaft(COMPLIANCE, TIME),))
    drives = [one.coefficients(one.nominal[None]) for one in (bare, model)]
    expected, found = (floquet_multipliers(drive) for drive in drives)
    assert found == pytest.approx(expected, rel=1e-12)
    assert np.isfinite(simulate_drive(model, model.nominal).transmission_error).all()


def test_vibrations_are_those_of_three_inertias():
    """Of a bare chain input, output, load; the input is referred to the output."""
    model = replace(preset("published"), effects=(LoadInertia(LOAD), LoadShaft(COMPLIANCE, 0.0)))
    drive = model.coefficients(model.nominal[None])
    inertias = [drive.input_inertia[0] * drive.ratio**2, drive.output_inertia - LOAD, LOAD]
    mesh, shaft = drive.stiffness[0], 1.0 / COMPLIANCE
    springs = np.array([[mesh, -mesh, 0.0], [-mesh, mesh + shaft, -shaft], [0.0, -shaft, shaft]])
    squares = np.sort(np.linalg.eigvals(springs / np.array(inertias)[:, None]).real)
    lowest = float(np.sqrt(squares[1])) / (2.0 * np.pi)
    assert torsional_mode(model).frequency == pytest.approx(lowest, rel=1e-3)
    mapped = operating_map(model, np.array([drive.input_speed]), np.array([20.0]))
    assert mapped.resonances()[2.0] == pytest.approx([np.pi * lowest], rel=1e-2)
    assert (np.abs(floquet_multipliers(drive)) < 1.0).all()


def test_it_is_integrated_over_time_to_the_same_motion():
    model = preset("published")
    model = replace(model, effects=(LoadInertia(LOAD), LoadShaft(COMPLIANCE, TIME)))
    record = simulate_drive(model, model.nominal)
    motion = harmonic_balance(model.coefficients(model.nominal[None]))
    waves = np.exp(1j * np.outer(record.input_angle, LINES))
    columns = np.hstack([waves.real, -waves.imag, np.ones((len(waves), 1))])
    parts = np.linalg.lstsq(columns, record.transmission_error, rcond=None)[0]
    found = parts[: len(LINES)] + 1j * parts[len(LINES) : -1]
    expected = motion.transmission_error[0, [motion.torus.place(order)[0] for order in LINES]]
    assert found == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
