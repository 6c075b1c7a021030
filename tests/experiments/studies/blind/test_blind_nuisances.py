"""Each nuisance of the blind bench does what it says, and none does anything where it is off."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from experiments.studies.blind.benches import ALONE, Comparison, nuisances_of
from experiments.studies.blind.campaigns import IDEAL, hiding
from experiments.studies.blind.cases import Case, all_cases
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import element
from experiments.studies.blind.rig.machine import SENSOR, ThirdBody, linear_part
from experiments.studies.blind.rig.nuisances import GROUPS, MILD, Nuisances, bench_with
from experiments.studies.blind.rig.runs import Condition, run
from experiments.studies.blind.rig.session import ARCSEC, draw_circumstances, running
from experiments.studies.blind.rig.visible import means
from pymoo_hdte.checks import InvalidInput

RATIO = 101.0
RATED = Condition(2000.0, 40.0, 1000.0, 1, "train")
ABOUT = draw_circumstances(np.random.default_rng(5))
MACHINE = replace(ABOUT.machine, amplitudes=(0.0, 0.0, 0.0))
"""Without a static error, so that every line is that of a nuisance."""


def generators(group):
    """Give each group a generator of its own, as a case does."""
    return np.random.default_rng([7, *group.encode()])


def on_bench(nuisances):
    return bench_with(replace(ABOUT, machine=MACHINE), nuisances, generators)


def line(seen, condition, order):
    """Phasors of input angle, output angle and both torques at an order of the input."""
    turned = condition.speed * np.arange(seen.shape[1]) / condition.rate
    level = seen - np.outer([1.0, 1.0 / RATIO, 0.0, 0.0], turned)
    basis = np.column_stack([np.ones(len(turned)), np.cos(order * turned), -np.sin(order * turned)])
    parts = np.linalg.lstsq(basis, level.T, rcond=None)[0]
    return parts[1] + 1j * parts[2]


def answer(machine, place, frequency):
    """Phasors of the same for a torque of 1 N.m at one of the entries of the linear machine."""
    linear, s = linear_part(machine), 1j * frequency
    y = np.linalg.solve(s * np.eye(len(linear.system)) - linear.system, linear.entry[:, place])
    sensed = linear.sensor @ y + linear.sensor_inertia * s * y[3]
    return np.array([y[0], y[1], linear.motor @ y, sensed])


@pytest.mark.parametrize("port", ["input", "output"])
@pytest.mark.parametrize(("number", "times"), [("once", 1), ("twice", 2)])
def test_a_misaligned_coupling_is_a_torque_at_its_order_of_either_shaft(port, number, times):
    size = getattr(MILD, f"{port}_{number}")
    machine = on_bench(Nuisances(**{f"{port}_{number}": size})).machine
    phase = next(row[3] for row in machine.elements if row[1])
    order = times if port == "input" else times / RATIO
    exact = answer(machine, int(port == "output"), order * RATED.speed) * size * np.exp(1j * phase)
    found = line(run(machine, RATED, 40.0, 0.0, 0.0), RATED, order)
    # The order is that of the true angle, which swings by less than a thousandth.
    assert np.abs(found - exact) == pytest.approx(0.0, abs=5e-3 * np.abs(exact).max())
    assert abs(found[2] - exact[2]) < 5e-3 * abs(exact[2])


@pytest.mark.parametrize("order", [1.0, 3.0])
def test_a_loop_that_lags_turns_the_motor_torque_by_its_time(order):
    machine = replace(
        on_bench(Nuisances(lag=1e-4)).machine,
        elements=(element(el.COUPLING, 1e-3, order, 0.3),),
    )
    s = 1j * order * RATED.speed
    angle, _, motor, _ = line(run(machine, RATED, 40.0, 0.0, 0.0), RATED, order)
    command = -(machine.proportional * s + machine.integral) * angle
    assert np.angle(motor / command) == pytest.approx(-math.atan(abs(s) * 1e-4), abs=1e-4)


@pytest.mark.parametrize("size", [1e-5, 4e-4])
def test_the_input_follows_a_set_speed_that_wanders_by_its_size(size):
    machine = on_bench(Nuisances(wander=size)).machine
    rows = [row for row in machine.elements if row[0] == el.WANDER]
    assert sum(0.5 * row[1] ** 2 for row in rows) == pytest.approx(size**2)
    slow = replace(RATED, rpm=200.0, load=0.0)
    seen = run(machine, slow, 0.0, 0.0, 0.0)
    time = np.arange(seen.shape[1]) / slow.rate
    exact = np.zeros(len(time))
    for _, amplitude, frequency, phase, proportional, integral, *_ in rows:
        command = proportional + integral / (1j * frequency)
        turned = amplitude * slow.speed * np.exp(1j * (frequency * time + phase)) * command
        exact += (turned * answer(machine, 0, frequency)[0]).real
    found = seen[0] - slow.speed * time
    assert found - found.mean() == pytest.approx(exact - exact.mean(), abs=2e-3 * np.ptp(exact))


def test_cogging_has_the_orders_of_poles_and_slots_and_its_amplitude():
    machine = on_bench(MILD.alone("cogging")).machine
    (most, size, *_), *uneven = ((row[2], row[1], row[3]) for row in machine.elements)
    slots, poles = (order for order, *_ in uneven)
    assert most == math.lcm(int(slots), int(poles))
    slow = replace(RATED, rpm=30.0, load=0.0)
    seen = run(machine, slow, 0.0, 0.0, 0.0)
    exact = np.array([0.0, 0.0, 1.0, 0.0]) + answer(machine, 0, most * slow.speed)
    assert abs(line(seen, slow, most)[2]) == pytest.approx(size * abs(exact[2]), rel=0.02)


def test_no_ripple_is_folded_at_half_the_sampling_rate():
    folded = replace(MACHINE, elements=(element(el.RIPPLE, 2e-3, 36.0, 0.0),))
    assert RATED.speed * 36.0 > math.pi * RATED.rate
    assert np.array_equal(run(folded, RATED, 40.0, 0.0, 0.0), run(MACHINE, RATED, 40.0, 0.0, 0.0))


def test_damping_of_an_output_ahead_of_a_shaft_does_not_make_it_diverge():
    """At place 3014 all records above 200 r/min were no numbers."""
    machine = on_bench(MILD.alone("shaft")).machine
    damped = replace(machine, elements=(element(el.DAMPING, 39.0, 1.4e-3),))
    assert np.isfinite(run(damped, RATED, 20.0, 0.0, 0.0)).all()


def test_ripple_and_gravity_of_the_load_show_at_the_sensor_and_do_no_work():
    whole = replace(RATED, rpm=600.0, rate=1010.0)
    plain = run(MACHINE, whole, 40.0, 0.0, 0.0)
    for group, size in (("gravity", MILD.gravity), ("brake_ripple", 40.0 * MILD.brake_once)):
        machine = on_bench(MILD.alone(group)).machine
        seen = run(machine, whole, 40.0, 0.0, 0.0)
        beyond = 1.0 + answer(machine, linear_part(machine).load_row, whole.speed / RATIO)[3]
        shown = abs(line(seen, whole, 1.0 / RATIO)[3])
        assert shown == pytest.approx(size, rel=0.02)
        assert abs(beyond) > 0.0
        power, alone = (np.mean(each[2] * np.gradient(each[0])) for each in (seen, plain))
        assert power == pytest.approx(alone, rel=1e-5)


def test_a_sensor_at_the_brake_shows_the_load_without_what_accelerates():
    machine = replace(ABOUT.machine, sensor_at_brake=True)
    there, here = (run(one, RATED, 40.0, 0.0, 0.0) for one in (machine, ABOUT.machine))
    assert np.array_equal(there[:3], here[:3])
    assert there[3] == pytest.approx(40.0, abs=1e-12)
    acceleration = np.gradient(np.gradient(here[1], 1e-3), 1e-3)[10:-10]
    inertial = MACHINE.load_inertia * acceleration
    assert here[3][10:-10] - 40.0 == pytest.approx(inertial, abs=0.2 * np.abs(inertial).max())


def test_a_shaft_that_twists_has_the_resonance_of_its_spring():
    shaft = on_bench(MILD.alone("shaft")).machine
    assert shaft.third == ThirdBody(SENSOR, 0.0, MILD.shaft_stiffness, MILD.shaft_damping)
    springs = 1.0 / (1.0 / MACHINE.stiffness + 1.0 / MILD.shaft_stiffness)
    # The speed loop all but holds the input, seen through the square of the ratio.
    stiff = replace(shaft, proportional=100.0)
    modes = np.linalg.eigvals(linear_part(stiff).system)
    slow = min(abs(mode) for mode in modes if abs(mode.imag) > 50.0)
    assert slow == pytest.approx((springs / MACHINE.load_inertia) ** 0.5, rel=0.02)


def test_a_mount_turns_by_its_compliance_and_resonates():
    mount = on_bench(MILD.alone("mount")).sensors.mount
    rate, count, level = 1000.0, 4000, 30.0
    time = np.arange(count) / rate
    for frequency in (10.0, MILD.mount_frequency, 200.0):
        x = frequency / MILD.mount_frequency
        gain = 1.0 / (1.0 - x * x + 2j * MILD.mount_damping * x)
        turned = mount.turned(level + np.cos(2.0 * math.pi * frequency * time), rate)
        exact = level + (gain * np.exp(2j * math.pi * frequency * time)).real
        assert turned == pytest.approx(MILD.mount_compliance * exact, rel=1e-9)


def test_warming_takes_viscous_friction_away_and_nothing_else():
    about = on_bench(Nuisances(warming=0.2, warming_time=300.0))
    late = int(np.argmax(about.clocks))
    machine = about.machine_in(late, about.machine)
    clock = about.clocks[late] + 0.5 * about.conditions[late].duration(RATIO)
    left = 1.0 - 0.2 * (1.0 - math.exp(-clock / 300.0))
    bare = ABOUT.machine_in(late, MACHINE)
    assert machine.input_damping == pytest.approx(left * bare.input_damping)
    assert machine.output_damping == pytest.approx(left * bare.output_damping)
    still = {"input_damping": 0.0, "output_damping": 0.0}
    assert replace(machine, **still) == replace(bare, **still)
    drop = means(bare, 40.0, 200.0)[1] - means(machine, 40.0, 200.0)[1]
    lost = (1.0 - left) * (bare.input_damping + bare.output_damping / RATIO**2)
    assert drop == pytest.approx(200.0 * lost)


def shown(nuisances, torque=40.0, clock=(0.0, 1e9)):
    """What sensors show of a constant torque at two moments, beside what they showed before."""
    seen = np.tile([[0.0], [0.0], [torque / 80.0], [torque]], 2)
    about = on_bench(nuisances)
    return about.sensors.shown(seen, np.array(clock), 1e3) - ABOUT.sensors.shown(
        seen, np.array(clock), 1e3
    )


def test_zeros_run_away_and_change_once():
    drift = shown(MILD.alone("drift"))
    sizes = [0.0, MILD.angle_drift, MILD.input_drift, MILD.output_drift]
    assert drift[:, 0] == pytest.approx(0.0)
    assert np.abs(drift[:, 1]) == pytest.approx(sizes)
    step = shown(MILD.alone("zeros"))
    sizes = [0.0, MILD.angle_zero_change, MILD.input_zero_change, MILD.output_zero_change]
    assert step[:, 0] == pytest.approx(0.0)
    assert np.abs(step[:, 1]) == pytest.approx(sizes)
    assert on_bench(MILD.alone("zeros")).sensors.zero_step.since in ABOUT.clocks


def test_saturation_cuts_torques_and_a_coarse_scale_has_steps():
    about = on_bench(MILD.alone("saturation"))
    seen = np.array([[0.0] * 3, [0.0] * 3, [0.0, 0.6, -0.6], [0.0, 50.0, -50.0]])
    cut = about.sensors.shown(seen, np.zeros(3), 1e3)
    assert cut[2:, 1:] == pytest.approx(
        np.outer([MILD.input_range, MILD.output_range], [1.0, -1.0])
    )
    coarse = on_bench(MILD.alone("resolution")).sensors
    rows = coarse.sampled(np.zeros((4, 500)), RATIO, 1, np.random.default_rng(1))
    steps = [MILD.angle_step * RATIO, MILD.angle_step, MILD.input_step, MILD.output_step]
    counts = rows / np.array(steps)[:, None]
    assert counts == pytest.approx(np.rint(counts), abs=1e-9)
    # Noise below half a step of 1.24 arcsec leaves a few of them.
    assert 2 <= len(np.unique(rows[1])) < 9
    assert coarse.angle_step / ARCSEC == pytest.approx(1.236, abs=1e-3)


def test_a_bench_without_nuisances_is_the_same_object_and_draws_nothing():
    def forbidden(group):
        raise AssertionError(group)

    assert bench_with(ABOUT, Nuisances(), forbidden) is ABOUT


def test_each_nuisance_alone_is_the_one_among_all_and_both_follow_the_seed():
    whole = on_bench(MILD)
    again = on_bench(MILD)
    assert whole.machine == again.machine
    assert whole.sensors == again.sensors
    alone = [on_bench(MILD.alone(group)).machine.elements for group in ALONE]
    assert whole.machine.elements == tuple(row for rows in alone for row in rows)
    other = bench_with(ABOUT, MILD, lambda group: np.random.default_rng([8, *group.encode()]))
    assert other.machine.elements != whole.machine.elements
    assert {name for names in GROUPS.values() for name in names} == {
        field.name for field in fields(Nuisances)
    }


@pytest.mark.parametrize("group", ALONE)
def test_every_mild_nuisance_shows_in_a_record(group):
    """With the same noise, at the resonance of the load, a reading changes that folders keep."""
    late = int(np.argmax(ABOUT.clocks))
    rows = []
    for bench in (ABOUT, bench_with(ABOUT, MILD.alone(group), generators)):
        conditions = list(bench.conditions)
        conditions[late] = RATED
        loads = np.full(len(conditions), RATED.load)
        about = replace(bench, conditions=tuple(conditions), loads=loads)
        seen = running(about, late, about.machine, about.sensors)
        rows.append(about.sensors.sampled(seen, RATIO, 1, np.random.default_rng(1)))
    assert np.isfinite(rows[1]).all()
    digits = np.array([1e-9, 1e-11, 1e-8, 1e-6])
    assert np.any(np.abs(rows[1] - rows[0]).max(axis=1) > digits)


@pytest.mark.nightly
def test_paired_sessions_hide_the_same_and_a_second_third_body_is_left_out():
    case = next(
        case
        for case in all_cases()
        if case.kind == "single" and any(effect.hidden.third for effect in case.drawn)
    )
    plain, real = hiding(case), hiding(case, MILD)
    assert [effect.size for effect in plain.effects] == [effect.size for effect in real.effects]
    assert "shaft" not in real.nuisances.groups
    assert set(real.nuisances.groups) == set(ALONE) - {"shaft"}
    assert plain.nuisances == IDEAL


def test_benches_have_names_and_numbers():
    assert nuisances_of("ideal") == IDEAL
    assert nuisances_of("mild") == MILD
    assert nuisances_of("wander=4e-4") == Nuisances(wander=4e-4)
    assert nuisances_of("sensor_at_brake").sensor_at_brake
    for wrong in ("fog", "wander=much"):
        with pytest.raises(InvalidInput):
            nuisances_of(wrong)


def test_a_name_is_lost_only_where_the_ideal_bench_gives_it():
    case = next(case for case in all_cases() if case.names == ("coulomb_friction",))
    given = Outcome(case, "named", ("coulomb_friction:input",))
    none = Outcome(case, "unlisted", ())
    assert Comparison("mild", given, none).lost == {"coulomb_friction"}
    assert not Comparison("mild", none, none).lost
    ripple = Outcome(case, "named", ("coulomb_friction:input", "torque_ripple:input@1"))
    assert Comparison("mild", given, ripple).wrong == {"torque_ripple"}
    clean = Case("none", 0)
    quiet, loud = Outcome(clean, "adequate", ()), Outcome(clean, "unlisted", ())
    assert Comparison("mild", quiet, loud).alarm
    assert not Comparison("mild", loud, loud).alarm
