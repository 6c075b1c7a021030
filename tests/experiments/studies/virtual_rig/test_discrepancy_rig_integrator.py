"""The integrator of the virtual rig against others, and its steady states."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from virtual_rig_cases import BELIEVED, FAST, PHASES, RIG, effect, true_rig

from experiments.studies.virtual_rig.integrator import Course, integrate
from experiments.studies.virtual_rig.laws import static_error
from experiments.studies.virtual_rig.runs import linear_modes, simulate_run
from pymoo_hdte.units import ARCSEC

SMOOTH = true_rig(
    effect("mesh", depth=0.03, depth_phase=1.0, depth_second=2.0),
    effect("input", reaction=1.0, ripple=0.01, ripple_order=3.0, ripple_second=0.7),
    effect("output", drag=0.02, drag_exponent=3.0),
)
COURSE = Course(200.0, 7.0, 30.0, 30.0 / 101.0)


def textbook_rate(time, state):
    """The equations of motion of `SMOOTH` in absolute coordinates, written a second time."""
    deviation, speed, output_angle, output_speed = state
    angle = COURSE.start_angle + COURSE.speed * time + deviation
    orders, amplitudes = np.array([1.0, 2.0, 2.02]), np.array(BELIEVED.error_amplitudes)
    error = amplitudes @ np.sin(orders * angle + PHASES)
    slope = (amplitudes * orders) @ np.cos(orders * angle + PHASES)
    torsion = angle / 101.0 - output_angle - error
    torsion_rate = speed / 101.0 - output_speed - slope * speed
    wave = np.cos(2 * angle + 1.0) + 0.2 * np.cos(4 * angle + 2.0)
    mesh = 2.583e4 * (1 + 0.03 * wave) * torsion + 4.5 * torsion_rate
    motor = COURSE.motor_torque + 0.02 * (COURSE.speed - speed) - 0.5 * deviation
    motor += 0.01 * (np.cos(3 * angle) + 0.2 * np.cos(6 * angle + 0.7))
    acceleration = (motor - 1.7e-4 * speed - mesh * (1 / 101.0 - slope)) / 1.97e-4
    resisting = 5.022e-4 * output_speed + 0.02 * output_speed**3 + COURSE.load_torque
    output = (mesh - resisting) / 0.0808505
    return [speed - COURSE.speed, acceleration, output_speed, output]


def integrated(rig, substeps, n_samples=120, interval=1e-3):
    error = static_error(rig.mesh, COURSE.start_angle)[0]
    state = np.array([0.0, 0.0, error + COURSE.load_torque / 2.583e4, 0.0])
    return integrate(rig, COURSE, state, interval, substeps, 0, n_samples)


def test_integrator_agrees_with_an_independent_one_on_a_smooth_case():
    mechanics = SMOOTH.mechanics(RIG)
    ours = integrated(mechanics, 40)
    start = [0.0, COURSE.speed, ours[1, 0], COURSE.speed / 101.0]
    times = 1e-3 * np.arange(120)
    theirs = solve_ivp(
        textbook_rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-13
    ).y
    assert np.max(np.abs(ours[1] - theirs[2])) < 1e-4 * ARCSEC
    angle = COURSE.start_angle + COURSE.speed * times + theirs[0]
    assert np.max(np.abs(ours[0] - angle)) < 1e-4 * ARCSEC * 101.0
    rates = np.array([textbook_rate(t, y) for t, y in zip(times, theirs.T, strict=True)])
    assert ours[3] == pytest.approx(COURSE.load_torque + 0.08 * rates[:, 3], abs=1e-5)


def test_integrator_converges_with_fourth_order():
    mechanics = SMOOTH.mechanics(RIG)
    reference = integrated(mechanics, 64)[1]
    errors = [np.max(np.abs(integrated(mechanics, n)[1] - reference)) for n in (2, 4, 8)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.4)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.4)


def test_steps_of_a_fast_record_are_short_enough():
    mechanics = true_rig(effect("output", coulomb=1.0, rounding_speed=0.002)).mechanics(RIG)
    fastest = np.abs(linear_modes(mechanics)).max()
    used = int(np.ceil(1e-3 / min(1.0 / fastest, 2.5e-4)))
    assert np.ptp(integrated(mechanics, used)[1] - integrated(mechanics, 200)[1]) < 0.01 * ARCSEC


@pytest.mark.parametrize(("reaction", "conserved"), [(1.0, True), (0.0, False)])
def test_energy_is_conserved_only_with_the_kinematic_reaction(reaction, conserved):
    """Virtual work fixes the sign: the mesh torque does no net work on the two shafts."""
    drive = true_rig(
        effect("input", reaction=reaction),
        damping=0.0,
        input_damping=0.0,
        output_damping=0.0,
        error_amplitudes=(2e-4, 4e-4, 1e-4),
    )
    mechanics = drive.mechanics(replace(RIG, proportional=0.0, integral=0.0))
    course = Course(60.0, 0.0, 0.0, 0.0)
    interval = 1e-4
    state = np.array([0.0, 0.0, 1e-3, 0.0])
    angle, output, _, _ = integrate(mechanics, course, state, interval, 2, 0, 2000)
    error = sum(
        amplitude * np.sin(order * angle + phase)
        for order, amplitude, phase in zip(
            BELIEVED.error_orders, drive.drive.error_amplitudes, PHASES, strict=True
        )
    )
    inner = slice(100, -100)
    speeds = [np.gradient(shaft, interval)[inner] for shaft in (angle, output)]
    kinetic = 0.5 * 1.97e-4 * speeds[0] ** 2 + 0.5 * 0.0808505 * speeds[1] ** 2
    elastic = 0.5 * 2.583e4 * (angle / 101.0 - output - error)[inner] ** 2
    change = np.ptp(kinetic + elastic) / np.mean(elastic)
    assert (change < 0.03) == conserved


def test_lines_of_a_linear_rig_are_those_of_the_closed_form():
    angle, output, motor, _ = simulate_run(true_rig().mechanics(RIG), FAST, 40.0, 100.0)
    orders = np.array(BELIEVED.error_orders)
    waves = np.outer(angle, orders)
    design = np.hstack([np.ones((len(angle), 1)), np.cos(waves), np.sin(waves)])
    fit = np.linalg.lstsq(design, np.stack([angle / 101.0 - output, motor], 1))[0]
    lines = fit[1:4] - 1j * fit[4:]
    w = orders * FAST.input_speed
    phasors = -1j * np.array(BELIEVED.error_amplitudes) * np.exp(1j * np.array(PHASES))
    spring = 2.583e4 + 4.5j * w
    input_side = -(w**2) * 1.97e-4 + 1j * w * (1.7e-4 + 0.02) + 0.5
    output_side = -(w**2) * (8.505e-4 + 0.08) + 5.022e-4j * w
    compliance = 1.0 / (101.0**2 * input_side) + 1.0 / output_side
    torque = -spring * phasors / (1.0 + spring * compliance)
    assert np.max(np.abs(lines[:, 0] + compliance * torque)) < 2e-3 * ARCSEC
    loop = (0.5 + 0.02j * w) * torque / (101.0 * input_side)
    assert np.max(np.abs(lines[:, 1] - loop)) < 1e-5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_mean_torques_balance_in_either_direction(sign):
    friction_torque, level = 0.02, 1.5
    drive = true_rig(
        effect("input", coulomb=friction_torque, rounding_speed=0.2),
        effect("output", coulomb=level, rounding_speed=0.002),
    )
    condition = replace(FAST, speed_rpm=sign * 2000.0)
    _, _, motor, sensor = simulate_run(drive.mechanics(RIG), condition, 40.0, 3.0)
    speed = 2000.0 * np.pi / 30.0
    against = friction_torque + 1.7e-4 * speed + (level + 5.022e-4 * speed / 101.0) / 101.0
    assert motor.mean() == pytest.approx(40.0 / 101.0 + sign * against, rel=1e-5)
    assert sensor.mean() == pytest.approx(40.0, rel=1e-4)


def test_steady_state_has_forgotten_where_it_started():
    """Lines of the first and of the last third of a record are the same."""
    mechanics = true_rig().mechanics(RIG)
    angle, output, _, _ = simulate_run(mechanics, FAST, 40.0, 100.0)
    # Whole periods of order 0.02 do not fit, so the lines are fitted jointly; 4, 3 and 4.02 and
    # the like come from the speed ripple and are far smaller.
    lines = []
    for third in np.array_split(np.arange(len(angle)), 3)[::2]:
        waves = np.outer(angle[third], BELIEVED.error_orders)
        design = np.hstack([np.ones((len(third), 1)), np.cos(waves), np.sin(waves)])
        lines.append(np.linalg.lstsq(design, angle[third] / 101.0 - output[third])[0])
    assert np.max(np.abs(lines[0] - lines[1])) < 1e-2 * ARCSEC
