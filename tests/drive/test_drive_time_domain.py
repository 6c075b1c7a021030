"""The start-up from rest, the run's peak-to-peak, and the measurement chain."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import butter, sosfreqz

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import Run, low_pass, measured_dte, preset, simulate_drive
from pymoo_hdte.drive._solve.time_domain import StartUp, equations_of_motion, smooth_step


def test_smooth_step_is_monotone_and_flat_at_both_ends():
    x = np.linspace(0.0, 1.0, 1001)
    values, slopes = np.array([smooth_step(value) for value in x]).T
    assert (values[0], values[-1]) == (0.0, 1.0)
    assert np.all(np.diff(values) >= 0.0)
    assert slopes == pytest.approx(np.gradient(values, x), abs=1e-4)
    # Three derivatives vanish at the ends: the step leaves them like x^4.
    assert smooth_step(1e-3)[0] == pytest.approx(35e-12, rel=1e-2)
    assert 1.0 - smooth_step(1.0 - 1e-3)[0] == pytest.approx(35e-12, rel=1e-2)


def test_start_up_angle_is_the_integral_of_its_speed_and_reaches_zero_in_time():
    course = StartUp(speed=200.0, ramp=0.4, settle=0.3)
    for begin, end in ((0.0, 0.2), (0.1, 0.55), (0.4, 0.9)):
        travelled, _ = quad(lambda t: 200.0 * course.envelope(t)[0], begin, end, points=[0.4])
        assert course.angle(end) - course.angle(begin) == pytest.approx(travelled, rel=1e-9)
    assert course.angle(0.7) == pytest.approx(0.0, abs=1e-12)


def test_equations_balance_power(model):
    """Work of the torques equals the change of energy plus what the dampers take (Lagrange)."""
    design = model.nominal.copy()
    design[0] = 1e-12  # The static error would do work of its own.
    coefficients = model.coefficients(design[None])
    course = StartUp(coefficients.input_speed, 0.5, 0.5)
    motion = equations_of_motion(coefficients, course, prescribed=True)
    state = np.array([1.3, 200.0, 1.1e-3, 0.02])
    time = 0.2
    _, acceleration, error_rate, error_acceleration = motion(time, state)
    ratio = coefficients.ratio
    output_speed = state[1] / ratio - state[3]
    output_acceleration = acceleration / ratio - error_acceleration
    kinetic = (
        coefficients.input_inertia[0] * state[1] * acceleration
        + coefficients.output_inertia * output_speed * output_acceleration
    )
    envelope, slope = course.envelope(time)
    speed = coefficients.input_speed
    inertia = coefficients.input_inertia[0] + coefficients.output_inertia / ratio**2
    holding = coefficients.input_damping[0] * speed + coefficients.mean_mesh_torque / ratio
    input_torque = inertia * speed * slope + holding * envelope
    variation = np.cos(2 * course.angle(time) + coefficients.stiffness_phase)
    stiffness = coefficients.stiffness[0] * (1 + coefficients.stiffness_depth * variation)
    elastic = stiffness * state[2] * error_rate
    lost = (
        coefficients.input_damping[0] * state[1] ** 2
        + coefficients.output_damping * output_speed**2
        + coefficients.damping[0] * state[3] ** 2
    )
    supplied = input_torque * state[1] - coefficients.load_torque * envelope * output_speed
    assert kinetic + elastic + lost == pytest.approx(supplied, rel=1e-9)


def test_a_finer_tolerance_changes_the_dte_little():
    model = preset("resonant")
    coarse = simulate_drive(model, model.nominal).dte_arcsec()
    fine = simulate_drive(model, model.nominal, rtol=1e-11, method="DOP853").dte_arcsec()
    assert coarse == pytest.approx(fine, rel=1e-5)
    assert coarse != fine


def test_peak_to_peak_of_a_run_counts_one_output_turn_only():
    angle = np.linspace(-3.0, 2 * np.pi * 2.0 + 3.0, 4000)
    signal = np.sin(angle) + np.where(angle < -1.0, 5.0, 0.0) * (angle + 1.0) ** 4
    run = Run(angle, angle, np.ones_like(angle), signal, ratio=2.0)
    assert run.peak_to_peak() == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"angle": "loose"}, "angle"),
        ({"method": "Euler"}, "method"),
        ({"ramp": 0.0}, "ramp"),
        ({"settle": 0.0}, "settle"),
        ({"rtol": 1.0}, "rtol"),
    ],
)
def test_wrong_arguments_are_named(arguments, field):
    model = preset("published")
    with pytest.raises(InvalidInput, match=f"^{field} is"):
        simulate_drive(model, model.nominal, **arguments)


@pytest.mark.parametrize("frequency", [20.0, 66.7, 100.0, 250.0])
def test_low_pass_has_the_squared_gain_of_one_pass_and_no_phase(frequency):
    time = np.arange(4000) / 1000.0
    filtered = low_pass(np.sin(2 * np.pi * frequency * time))[1000:3000]
    argument = 2 * np.pi * frequency * time[1000:3000]
    in_phase, quadrature = (2 * np.mean(filtered * wave(argument)) for wave in (np.sin, np.cos))
    _, response = sosfreqz(butter(4, 100.0, fs=1000.0, output="sos"), [frequency], fs=1000.0)
    assert in_phase == pytest.approx(abs(response[0]) ** 2, rel=2e-3, abs=1e-4)
    assert abs(quadrature) < 2e-3


def test_measured_dte_of_slow_errors_is_their_peak_to_peak():
    ratio, speed = 101.0, 200.0
    time = np.arange(0.0, 2 * np.pi * ratio / speed * 1.3, 1e-3)
    driving = speed * time
    error = 1e-4 * np.sin(driving * 0.2)
    for sign in (1.0, -1.0):
        found = measured_dte(sign * driving, sign * driving / ratio - error, ratio)
        assert found == pytest.approx(2e-4, rel=1e-3)


def test_a_record_shorter_than_a_turn_or_not_finite_is_refused():
    time = np.arange(0.0, 1.0, 1e-3)
    with pytest.raises(InvalidInput, match="travel of input_angle"):
        measured_dte(200.0 * time, 2.0 * time, 101.0)
    with pytest.raises(InvalidInput, match=r"signal\[3\]"):
        low_pass([0.0, 0.0, 0.0, np.nan] * 20)
    with pytest.raises(InvalidInput, match="length of signal"):
        low_pass(np.zeros(5))
    with pytest.raises(InvalidInput, match="sampling_rate"):
        low_pass(np.zeros(100), sampling_rate=200.0)


def test_the_middle_turn_of_a_record_is_evaluated():
    ratio, speed = 101.0, 200.0
    time = np.arange(0.0, 2 * np.pi * ratio / speed * 2.0, 1e-3)
    driving = speed * time
    turn = 2 * np.pi * ratio
    outside = np.maximum(turn / 2 - 60.0 - driving, 0.0) + np.maximum(
        driving - 1.5 * turn - 60.0, 0.0
    )
    error = 1e-4 * np.sin(driving * 0.2) + 1e-3 * outside
    assert measured_dte(driving, driving / ratio - error, ratio) == pytest.approx(2e-4, rel=1e-3)


def test_static_error_enters_with_the_rate_of_its_envelope():
    """A transmission error that follows the enveloped static error leaves no mesh torque."""
    model = preset("published")
    # With the printed damping of the mesh a wrong rate would hardly show.
    design = model.nominal * [1.0, 1.0, 1.0, 1.0, 1e6]
    coefficients = model.coefficients(design[None])
    course = StartUp(coefficients.input_speed, 0.5, 0.5)
    motion = equations_of_motion(coefficients, course, prescribed=True)
    time, step = 0.25, 1e-6

    def static(at):
        angle = course.angle(at)
        lines = coefficients.error_phasors[0] * np.exp(1j * coefficients.error_orders * angle)
        return course.envelope(at)[0] * lines.real.sum()

    rate = (static(time + step) - static(time - step)) / (2 * step)
    state = np.array([0.0, 150.0, static(time), rate])
    _, _, error_rate, error_acceleration = motion(time, state)
    envelope, slope = course.envelope(time)
    inertia = coefficients.input_inertia[0]
    total = inertia + coefficients.output_inertia / 101.0**2
    holding = (
        coefficients.input_damping[0] * coefficients.input_speed
        + coefficients.mean_mesh_torque / 101.0
    )
    torque = total * coefficients.input_speed * slope + holding * envelope
    free_input = (torque - coefficients.input_damping[0] * 150.0) / inertia
    output_speed = 150.0 / 101.0 - error_rate
    bearing = coefficients.output_damping * output_speed
    free_output = (-coefficients.load_torque * envelope - bearing) / coefficients.output_inertia
    assert error_acceleration == pytest.approx(free_input / 101.0 - free_output, rel=1e-6)
