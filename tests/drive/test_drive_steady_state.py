"""Transfer function and Hill's method: limits, residuals, independent state space, integration."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import random_designs
from night import others_at_night

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    PRESETS,
    DampingReference,
    DriveModel,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    floquet_multipliers,
    harmonic_balance,
    hill_steady_state,
    preset,
    simulate_drive,
    transfer_function,
)
from pymoo_hdte.drive._solve.stability import require_stable
from pymoo_hdte.units import ARCSEC


def test_transfer_function_equals_a_state_space_model(model, rng):
    coefficients = model.coefficients(random_designs(model, 1, rng))
    stiffness, damping = coefficients.stiffness[0], coefficients.damping[0]
    inertia_in, bearing_in = coefficients.input_inertia[0], coefficients.input_damping[0]
    inertia_out, bearing_out = coefficients.output_inertia, coefficients.output_damping
    ratio = coefficients.ratio
    # State (w_in, w_out, d); input s'. The mesh torque is K d + c d', d' = w_in/N - w_out - s'.
    relative = np.array([1 / ratio, -1.0, 0.0])
    mesh = damping * relative + np.array([0.0, 0.0, stiffness])
    system = np.array(
        [
            -mesh / ratio / inertia_in - np.array([bearing_in / inertia_in, 0, 0]),
            mesh / inertia_out - np.array([0, bearing_out / inertia_out, 0]),
            relative,
        ]
    )
    drive = np.array([[damping / ratio / inertia_in], [-damping / inertia_out], [-1.0]])
    orders = np.array([1.0, 2.0, 2.02, 7.0])
    frequency = orders * coefficients.input_speed
    # theta_d = d + s, and s = s' / (i w).
    resolvents = 1j * frequency[:, None, None] * np.eye(3) - system
    torsion_per_rate = np.linalg.solve(resolvents, drive)[:, 2, 0]
    expected = 1.0 + 1j * frequency * torsion_per_rate
    assert transfer_function(coefficients, orders)[0] == pytest.approx(expected, rel=1e-9)


def test_a_slow_drive_follows_its_static_error(model):
    slow = model.at(input_speed=1e-3, load_torque=40.0)
    coefficients = slow.coefficients(slow.nominal[None])
    response = transfer_function(coefficients, np.array([1.0, 2.0]))
    assert np.abs(response - 1.0).max() < 1e-3


def test_hill_without_variation_is_the_transfer_function(rng):
    model = preset("published")
    designs = random_designs(model, 5, rng)
    faint = replace(model, effects=(MeshStiffnessVariation(1e-9, 0.3),))
    assert faint.dte_arcsec(designs) == pytest.approx(model.dte_arcsec(designs), rel=1e-6)


@pytest.mark.parametrize("name", ["calibrated", "resonant"])
def test_hill_solution_satisfies_the_equations_of_motion(name, rng):
    model = preset(name)
    coefficients = model.coefficients(random_designs(model, 4, rng))
    angle = rng.uniform(0.0, 600.0, 50)
    speed, ratio = coefficients.input_speed, coefficients.ratio

    def series(orders, phasors, derivative=0):
        factors = (1j * orders * speed) ** derivative
        return ((phasors * factors) @ np.exp(1j * np.outer(orders, angle))).real

    error = hill_steady_state(coefficients)
    static = coefficients.error_orders, coefficients.error_phasors
    torsion, torsion_rate = (
        series(error.orders, error.phasors, k) - series(*static, k) for k in (0, 1)
    )
    variation = np.cos(2 * angle + coefficients.stiffness_phase)
    stiffness = coefficients.stiffness[:, None] * (1 + coefficients.stiffness_depth * variation)
    mesh_torque = stiffness * torsion + coefficients.damping[:, None] * torsion_rate

    # What torque moves both free inertias so that theta_in / N - theta_out is theta_d?
    moving = error.orders != 0.0
    orders, phasors = error.orders[moving], error.phasors[:, moving]
    rate = 1j * orders * speed
    input_side = coefficients.input_damping[:, None] + rate * coefficients.input_inertia[:, None]
    output_side = coefficients.output_damping + rate * coefficients.output_inertia
    mobility = 1.0 / (ratio**2 * input_side) + 1.0 / output_side
    demanded = series(orders, -phasors * rate / mobility) + coefficients.mean_mesh_torque
    assert mesh_torque == pytest.approx(demanded, rel=1e-7)


def test_printed_equations_pass_the_static_error_through(rng):
    model = preset("published")
    designs = random_designs(model, 20, rng)
    theta_s = designs[:, 0] / ARCSEC
    assert model.dte_arcsec(designs) == pytest.approx(theta_s, rel=0.01)
    gains = np.abs(transfer_function(model.coefficients(designs), np.array([1.0, 2.0, 2.02])))
    assert np.abs(gains - 1.0).max() < 0.01


def test_constant_stiffness_scales_with_the_static_error_and_ignores_the_load(rng):
    model = preset("published")
    designs = random_designs(model, 3, rng)
    doubled = designs * np.array([2.0, 1, 1, 1, 1])
    assert model.dte_arcsec(doubled) == pytest.approx(2 * model.dte_arcsec(designs), rel=1e-12)
    unloaded = model.at(model.sheet.input_speed, 0.0)
    assert unloaded.dte_arcsec(designs) == pytest.approx(model.dte_arcsec(designs), rel=1e-12)


def test_load_and_varying_stiffness_excite_order_two_in_proportion_to_both():
    sheet_model = preset("published")
    weak = replace(sheet_model, effects=(MeshStiffnessVariation(1e-3, 0.0),))
    faint_error = sheet_model.nominal * np.array([1e-6, 1, 1, 1, 1])
    for load in (20.0, 40.0):
        spectrum = weak.at(sheet_model.sheet.input_speed, load).steady_state(faint_error[None])
        # Quasi-static torsion T / (K (1 + k cos)) has amplitude k T / K at order 2; the response
        # at 67 Hz is that, times the gain H of a drive far below its resonance.
        gain = np.abs(
            transfer_function(weak.coefficients(faint_error[None]), np.array([2.0]))[0, 0]
        )
        amplitude = spectrum.amplitudes()[2.0][0]
        assert amplitude == pytest.approx(1e-3 * load / faint_error[1] * gain, rel=1e-2)


def test_damping_reference_and_load_inertia_do_what_their_names_say():
    model = preset("published")
    nominal = model.nominal[None]
    heavy = replace(model, effects=(LoadInertia(0.1), DampingReference(2.0)))
    before, after = model.coefficients(nominal), heavy.coefficients(nominal)
    assert after.output_inertia == before.output_inertia + 0.1
    assert after.damping == pytest.approx(2.0 * 101**2 * before.damping)


# Other tests of the gate integrate ``published``, with the angle free and prescribed.
@pytest.mark.parametrize("model", others_at_night(PRESETS, "calibrated", "resonant"), indirect=True)
@pytest.mark.parametrize("angle", ["prescribed", "free"])
def test_integration_from_rest_reaches_the_steady_state(model, angle, rng):
    """Hill's method leaves out how the angle itself fluctuates; the harmonic balance does not."""
    resonant = any(isinstance(effect, LoadInertia) for effect in model.effects)
    tolerance = 1e-2 if resonant and angle == "free" else 1e-4
    designs = random_designs(model, 1, rng)
    balance = harmonic_balance(model.coefficients(designs)).spectrum()
    balanced = balance.peak_to_peak(model.sheet.ratio) / ARCSEC
    for design, expected, exact in zip(designs, model.dte_arcsec(designs), balanced, strict=True):
        run = simulate_drive(model, design, angle=angle)
        assert run.dte_arcsec() == pytest.approx(expected, rel=tolerance)
        if angle == "free":
            assert run.dte_arcsec() == pytest.approx(exact, rel=1e-4)
        assert run.input_speed.mean() == pytest.approx(model.sheet.input_speed, rel=1e-4)


def test_multipliers_contain_the_rigid_decay_and_multiply_to_liouvilles_volume(model, rng):
    coefficients = model.coefficients(random_designs(model, 3, rng))
    fast = replace(coefficients, input_speed=coefficients.input_speed * 400)
    period = np.pi / fast.input_speed
    multipliers = floquet_multipliers(fast)
    inertia = fast.input_inertia + fast.output_inertia / fast.ratio**2
    bearing = fast.input_damping + fast.output_damping / fast.ratio**2
    rigid = np.exp(-bearing / inertia * period)
    assert np.abs(multipliers - rigid[:, None]).min(axis=1).max() < 1e-4
    trace = (
        fast.input_damping / fast.input_inertia
        + fast.damping / (fast.ratio**2 * fast.input_inertia)
        + (fast.damping + fast.output_damping) / fast.output_inertia
    )
    assert multipliers.prod(axis=1).real == pytest.approx(np.exp(-trace * period), rel=1e-6)


def parametric_resonance() -> DriveModel:
    """A lightly damped load whose resonance is at half the frequency of a deep variation."""
    effects = (LoadInertia(0.395), DampingReference(0.01), MeshStiffnessVariation(0.3, 0.0))
    return replace(preset("published"), effects=effects).at(280.0, 40.0)


def test_an_unstable_drive_is_refused_and_grows_when_integrated():
    model = parametric_resonance()
    with pytest.raises(UnstableDrive, match="Floquet multiplier"):
        model.dte_arcsec(model.nominal[None])
    largest = np.abs(floquet_multipliers(model.coefficients(model.nominal[None]))).max()
    run = simulate_drive(model, model.nominal, angle="prescribed", settle=0.3)
    period = np.pi / 280.0
    apart = 60 * period
    early, late = (
        np.abs(run.transmission_error[(run.time >= start) & (run.time < start + 20 * period)]).max()
        for start in (1.5, 1.5 + apart)
    )
    assert np.log(late / early) == pytest.approx(60 * np.log(largest), rel=0.01)


def test_presets_are_stable_over_the_whole_box(model, rng):
    require_stable(model.coefficients(random_designs(model, 200, rng)))


@pytest.mark.parametrize("column", range(5))
@pytest.mark.parametrize("value", [np.nan, -1.0, 0.0])
def test_bad_parameters_are_named(column, value):
    model = preset("calibrated")
    design = model.nominal
    design[column] = value
    with pytest.raises(InvalidInput, match=r"parameters|theta_s|K|J_in|B_in|B_fc"):
        model.dte_arcsec(design[None])


def test_no_designs_give_no_values(model):
    assert model.dte_arcsec(np.empty((0, 5))).shape == (0,)


def test_two_error_lines_of_one_order_add_up(rng):
    for name in ("published", "calibrated"):
        model = preset(name)
        design = model.nominal[None]
        coefficients = model.coefficients(design)
        whole = replace(
            coefficients,
            error_orders=np.array([1.0, 2.0]),
            error_phasors=np.array([[1e-4 + 0j, 2e-4j]]),
        )
        halves = replace(
            coefficients,
            error_orders=np.array([2.0, 1.0, 2.0 + 4e-10]),
            error_phasors=np.array([[1e-4j, 1e-4 + 0j, 1e-4j]]),
        )
        assert hill_steady_state(halves).peak_to_peak(101.0) == pytest.approx(
            hill_steady_state(whole).peak_to_peak(101.0), rel=1e-6
        )


def test_the_load_acts_even_if_the_error_has_odd_orders_only():
    model = preset("calibrated").at(5.0, 40.0)
    coefficients = model.coefficients(model.nominal[None])
    odd = replace(coefficients, error_orders=np.array([1.0]), error_phasors=np.array([[1e-9 + 0j]]))
    amplitudes = hill_steady_state(odd).amplitudes()
    quasi_static = coefficients.stiffness_depth * coefficients.mean_mesh_torque / 2.583e4
    assert amplitudes[2.0][0] == pytest.approx(quasi_static, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("depth", "speed"),
    [
        pytest.param(0.3, 209.0, marks=pytest.mark.nightly),
        (0.8, 209.0),
        pytest.param(0.3, 50.0, marks=pytest.mark.nightly),
        pytest.param(0.8, 50.0, marks=pytest.mark.nightly),
    ],
)
def test_deep_variations_agree_with_integration(depth, speed):
    effects = (DampingReference(5.0), MeshStiffnessVariation(depth, 1.0))
    model = replace(preset("published"), effects=effects).at(speed, 40.0)
    run = simulate_drive(model, model.nominal, angle="prescribed")
    assert run.dte_arcsec() == pytest.approx(model.dte_arcsec(model.nominal[None])[0], rel=1e-4)


@pytest.mark.parametrize("speed", [0.5, 1.0, 1.25, 5.0, 20.0])
def test_slow_drives_are_not_taken_for_unstable(speed):
    for depth in (0.2, 0.5):
        effects = (MeshStiffnessVariation(depth, 0.0),)
        model = replace(preset("published"), effects=effects).at(speed, 0.0)
        require_stable(model.coefficients(model.nominal[None]))


def test_the_unstable_design_is_named():
    model = parametric_resonance()
    stiff = model.nominal * np.array([1.0, 4.0, 1.0, 1.0, 1.0])
    with pytest.raises(UnstableDrive, match="design 1 "):
        require_stable(model.coefficients(np.array([stiff, model.nominal, stiff])))
