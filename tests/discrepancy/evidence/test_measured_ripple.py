"""Ripple beyond the band of the motion: found where it is, and nowhere in noise or mains."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import SHARED
from scipy.signal import lfilter

from pymoo_hdte._io.even_steps import even_steps
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.next_test_mechanism import next_test
from pymoo_hdte.discrepancy._answers.revision_mechanism import revised_mechanism
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.high_band import high_bands
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.order_search import (
    SeenOrder,
    _at_two_speeds,
    _order_grids,
    _refined,
    _significance,
    differs_from_frequencies,
)
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple import find_ripples
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple_size import size_of
from pymoo_hdte.discrepancy._report.mechanism import write_mechanism_report
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.mechanism import BelievedValue, Gear, Input, LawAt, Mechanism, Port, Record

STEP, CUTOFF = 5e-3, 4.0
TIME = np.arange(0.0, 20.0, STEP)
GEAR = Gear(101.0, "harmonic drive")


def joint(gear=None):
    return Mechanism(
        {"q": BelievedValue(0.05, 0.5)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, 1.0), gear=gear)],
        [Input("torque", {"q": 1.0})],
    )


JOINT = joint(GEAR)


def swings(generator):
    phases = generator.uniform(0.0, 6.0, 3)
    parts = ((0.8, 0.11), (0.3, 0.31), (0.1, 0.77))
    return sum(
        size * np.sin(2.0 * np.pi * frequency * TIME + phase)
        for (size, frequency), phase in zip(parts, phases, strict=True)
    )


def trapezoids(*speeds):
    """There and back at constant speeds, in a period that holds whole cycles of 50 Hz."""
    ramp, hold = np.linspace(0.0, 1.0, 60), np.ones(400)
    up = np.concatenate([ramp, hold, ramp[::-1]])
    cycle = np.concatenate([sign * speed * up for speed in speeds for sign in (1.0, -1.0)])
    return STEP * np.cumsum(np.resize(cycle, len(TIME)))


def record(q, torque, generator, role="train"):
    q = q + 1e-6 * generator.standard_normal(len(q))
    return Record(role, role, STEP * np.arange(len(q)), {"q": q, "torque": torque})


def noises(generator):
    white, hertz = generator.standard_normal(len(TIME)), 2.0 * np.pi * TIME
    resonance = lfilter([0.1], [1.0, -1.97 * np.cos(0.3 * np.pi), 0.97], white)
    return {
        "white": white,
        "coloured": lfilter([1.0], [1.0, -0.95], white),
        "mains": white + 5.0 * (np.sin(50.0 * hertz) + np.sin(25.0 * hertz + 1.0)),
        "harmonics": white + 5.0 * sum(np.sin(20.0 * n * hertz) for n in (1, 2, 3)),
        "resonance": white + 3.0 * resonance,
    }


def bands_of(q, torque, generator):
    return high_bands(JOINT, JOINT.ports[0], [record(q, torque, generator)], CUTOFF, RULES)


@pytest.mark.parametrize("kind", ["white", "coloured", "mains", "harmonics", "resonance"])
def test_no_noise_and_no_line_of_one_frequency_is_an_order(kind):
    generator = np.random.default_rng([7, len(kind)])
    motions = [swings(generator), trapezoids(0.8), trapezoids(0.4, 0.8), trapezoids(0.3, 0.6, 0.9)]
    for q in motions:
        dry = 0.3 * np.sign(np.gradient(q))
        found = find_ripples(
            JOINT, [record(q, dry + 0.1 * noises(generator)[kind], generator)], CUTOFF
        )
        assert found.lines == ()


@pytest.mark.parametrize("count", [15, pytest.param(600, marks=pytest.mark.nightly)])
def test_noise_makes_an_order_significant_as_rarely_as_the_rule_says(count):
    chance, generator = 0.05, np.random.default_rng(11)
    rules, q = Rules(position_order_chance=chance), swings(generator)
    alarms = 0
    for _ in range(count):
        torque = lfilter([1.0], [1.0, -0.6], generator.standard_normal(len(TIME)))
        bands = bands_of(q, torque, generator)
        grids, resolution, _ = _order_grids(bands, (), rules)
        alarms += bool(np.any(_significance(bands, grids, (), resolution, rules) > 1.0))
    assert alarms <= count * chance + 3.0 * math.sqrt(count * chance)


def test_the_orders_of_a_gear_are_seen_at_a_smaller_size():
    generator = np.random.default_rng(13)
    q = swings(generator)
    bands = bands_of(q, 0.02 * np.cos(202.0 * q) + 0.1 * noises(generator)["white"], generator)
    expected = tuple(GEAR.expected)
    grids, resolution, _ = _order_grids(bands, expected, RULES)
    there = int(np.argmin(np.abs(np.concatenate(grids) - 202.0)))
    with_gear, without = (
        _significance(bands, grids, known, resolution, RULES)[there] for known in (expected, ())
    )
    assert with_gear > 1.2 * without


def hidden(kind, order, size, phase, q):
    turns = np.sign(np.gradient(q)) if kind == "position_dependent_friction" else -1.0
    return size * turns * np.cos(order * q + phase)


@settings(max_examples=5, deadline=None, derandomize=True)
@given(
    kind=st.sampled_from(["torque_ripple", "position_dependent_friction"]),
    order=st.floats(150.0, 420.0),
    phase=st.floats(-3.0, 3.0),
    seed=st.integers(0, 1000),
)
def test_a_ripple_beyond_the_band_is_found_with_its_kind_order_and_size(kind, order, phase, seed):
    generator = np.random.default_rng(seed)
    q = swings(generator)
    noise = 0.1 * noises(generator)["mains"]
    torque = hidden(kind, order, 0.1, phase, q) + noise
    (one,) = find_ripples(JOINT, [record(q, torque, generator)], CUTOFF).lines
    (part,) = one.parts
    assert part.law.name == kind
    assert one.order == pytest.approx(order, abs=0.25 * one.resolution)
    (size, variance), *_ = part.values.values()
    # That of a line beside noise of this power, for all rows.
    assert 0.5 < variance**0.5 / (2.0 * np.mean(noise**2) / len(TIME)) ** 0.5 < 2.0
    assert abs(size - 0.1) <= 4.0 * variance**0.5


def test_at_one_speed_an_order_and_a_frequency_look_alike_and_neither_is_an_order():
    """Constant speed: order 202 has 50 Hz at every moment, and nothing tells them apart."""
    generator = np.random.default_rng(3)
    speed = 2.0 * np.pi * 50.0 / 202.0
    q = speed * TIME + 0.002 * np.sin(2.0 * np.pi * 0.4 * TIME)
    for line in (np.cos(202.0 * q), np.cos(2.0 * np.pi * 50.0 * TIME)):
        torque = 0.02 * line + 0.1 * generator.standard_normal(len(TIME))
        bands = bands_of(q, torque, generator)
        assert not differs_from_frequencies(bands, 202.0, RULES)[0]
        assert find_ripples(JOINT, [record(q, torque, generator)], CUTOFF).lines == ()


def test_what_follows_the_position_at_one_speed_only_is_no_order():
    generator = np.random.default_rng(4)
    q = trapezoids(0.4, 0.8)
    noise = 0.05 * generator.standard_normal(len(TIME))
    fast = np.abs(np.gradient(q, STEP)) > 0.78
    resolution = 2.0 * np.pi / float(np.ptp(q))
    for rows, seen in ((fast, False), (np.ones_like(fast), True)):
        bands = bands_of(q, 0.2 * rows * np.cos(202.0 * q) + noise, generator)
        assert _at_two_speeds(bands, SeenOrder(202.0, resolution, 2.0), RULES) == seen


def test_two_records_of_one_speed_each_tell_an_order_from_a_frequency():
    generator = np.random.default_rng(5)
    for line, orders in ((lambda q: 0.05 * np.cos(202.0 * q), [202.0]), (np.zeros_like, [])):
        records = []
        for name, speed in (("slow", 0.5), ("fast", 0.9)):
            q = speed * TIME + 0.01 * np.sin(2.0 * np.pi * 0.4 * TIME)
            mains = 0.1 * np.sin(2.0 * np.pi * 25.0 * TIME)
            torque = line(q) + mains + 0.1 * generator.standard_normal(len(TIME))
            one = record(q, torque, generator)
            records.append(Record(name, "train", one.time, one.channels))
        found = find_ripples(JOINT, records, CUTOFF).lines
        assert [one.order for one in found] == pytest.approx(orders, abs=0.3)


@pytest.mark.parametrize(("power", "words"), [(2.0, "grows"), (0.0, "hardly"), (-1.0, "falls")])
def test_how_the_amplitude_changes_with_the_speed_is_said(power, words):
    generator = np.random.default_rng(8)
    q = swings(generator)
    speed = np.abs(np.gradient(q, STEP))
    torque = np.maximum(speed, 0.1) ** power * np.cos(202.0 * q)
    torque = torque + 0.02 * generator.standard_normal(len(TIME))
    one = find_ripples(JOINT, [record(q, torque, generator)], CUTOFF).lines[0]
    assert one.trend.startswith(f"It {words}")
    (plain,) = find_ripples(joint(), [record(q, torque, generator)], CUTOFF).lines
    turns = f"{one.order / GEAR.ratio:.4g} per input turn"
    for told, without in ((one.sentence, plain.sentence), (one.words, plain.words)):
        assert turns in told
        assert "input turn" not in without
    of_gear, of_none = (each.as_dicts()[0]["beyond_band"] for each in (one, plain))
    assert of_gear["per_input_turn"] == one.order / GEAR.ratio
    assert "per_input_turn" not in of_none
    assert "202 is 2 per input turn" in one.meaning


def test_a_ripple_that_other_records_do_not_show_is_not_named():
    generator = np.random.default_rng(9)
    train, other = swings(generator), swings(generator)
    noise = 0.1 * generator.standard_normal((3, len(TIME)))
    first = record(train, 0.1 * np.cos(202.0 * train) + noise[0], generator)
    shows = record(other, 0.1 * np.cos(202.0 * other) + noise[1], generator, "held_out")
    not_there = record(other, noise[2], generator, "held_out")
    (one,) = find_ripples(JOINT, [first, shows], CUTOFF).lines
    assert one.held_out[1] < one.held_out[0]
    lost = find_ripples(JOINT, [first, not_there], CUTOFF)
    assert not lost.lines
    assert "not named" in lost.limits[0]


def test_what_is_known_already_is_not_found_again():
    generator = np.random.default_rng(10)
    q = swings(generator)
    torque = hidden("torque_ripple", 202.0, 0.3, 1.0, q)
    one = record(q, torque + 0.1 * generator.standard_normal(len(TIME)), generator)
    (ripple,) = find_ripples(JOINT, [one], CUTOFF).lines
    assert not find_ripples(JOINT, [one], CUTOFF, [part.law for part in ripple.parts]).lines


def geared(*shares):
    """A joint whose coordinate is the angle of its motor, with a port for each share of it."""
    return Mechanism(
        {"m": BelievedValue(1e-5, 0.5)},
        [Port(f"port {n}", {"m": share}) for n, share in enumerate(shares)],
        [Input("torque", {"m": 1.0})],
    )


def test_a_ripple_has_one_size_by_the_angle_of_the_motor_and_by_that_of_the_output():
    generator = np.random.default_rng(15)
    q = swings(generator)
    torque = hidden("torque_ripple", 202.0, 0.1, 1.0, q)
    torque = torque + 0.05 * generator.standard_normal(len(TIME))
    output = record(q, torque, generator)
    channels = {"m": 101.0 * output.channels["q"], "torque": torque / 101.0}
    motor = Record("motor", "train", output.time, channels)
    (expected,) = find_ripples(JOINT, [output], CUTOFF).lines
    (one,) = find_ripples(geared(1.0 / 101.0), [motor], CUTOFF).lines
    assert one.order == pytest.approx(expected.order, rel=1e-6)
    ((name, (size, variance)), *_), same = one.parts[0].values.items(), expected.parts[0].values
    assert size == pytest.approx(0.1, abs=0.005)
    assert (size, variance) == pytest.approx(same[name], rel=1e-4)
    # Ports of the same motion have the same forces: one of them is named, and known at each.
    both = geared(1.0, 1.0 / 101.0)
    (one,) = find_ripples(both, [motor], CUTOFF).lines
    assert one.order == pytest.approx(2.0, rel=1e-3)
    for there in (both.ports[0], both.ports[1]):
        order = one.order / there.motion["m"]
        law = effect_named("torque_ripple").law_of({"order": order, "amplitude": 1.0, "phase": 0.0})
        known = [LawAt("torque_ripple", there.name, law)]
        assert not find_ripples(both, [motor], CUTOFF, known).lines


@pytest.mark.parametrize("count", [40, pytest.param(400, marks=pytest.mark.nightly)])
def test_intervals_of_a_size_an_order_and_a_phase_hold_as_often_as_they_say(count):
    generator = np.random.default_rng(16)
    inside = np.zeros(3)
    for _ in range(count):
        # Far from position 0, at which the phase is told.
        q = 2.0 + swings(generator)
        torque = hidden("torque_ripple", 202.0, 0.05, 1.0, q)
        bands = bands_of(q, torque + 0.1 * generator.standard_normal(len(TIME)), generator)
        resolution = 2.0 * np.pi / float(np.ptp(q))
        order = _refined(bands, 202.0 + resolution * generator.uniform(-0.2, 0.2), 0.5 * resolution)
        size = size_of("bearing", SeenOrder(order, resolution, 2.0), bands, RULES)
        (amplitude, variance), (phase, spread) = size.parts[0].values.values()
        off = math.remainder(phase - 1.0, 2.0 * math.pi)
        inside += (
            abs(amplitude - 0.05) <= 1.96 * variance**0.5,
            abs(order - 202.0) <= 1.96 * size.variance**0.5,
            abs(off) <= 1.96 * spread**0.5,
        )
    least = 0.95 * count - 3.0 * math.sqrt(0.95 * 0.05 * count)
    assert np.all(inside >= least)
    # An interval that always holds is too wide.
    assert count < 100 or np.all(inside < 0.985 * count)


def test_an_order_that_differs_between_the_directions_is_known_no_better_than_that():
    """A joint that moves by half a turn does not resolve what its output and its housing have."""
    generator = np.random.default_rng(22)
    q = swings(generator)
    forward = np.gradient(q) > 0.0
    torque = 0.1 * np.where(forward, np.cos(202.0 * q), np.cos(200.0 * q))
    torque = torque + 0.02 * generator.standard_normal(len(TIME))
    one, *_ = find_ripples(JOINT, [record(q, torque, generator)], CUTOFF).lines
    least, most = one.as_dicts()[0]["parameters"]["order"]["interval95"]
    assert least < 200.0 < 202.0 < most
    assert "200 is 2 per input turn" in one.meaning
    assert "202 is 2 per input turn" in one.meaning


def test_in_one_direction_a_torque_is_not_told_from_friction():
    generator = np.random.default_rng(17)
    there_and_back = swings(generator)
    forward = np.cumsum(np.abs(np.gradient(there_and_back)))
    for q, ways in ((forward, 1), (there_and_back, 2)):
        torque = hidden("position_dependent_friction", 202.0, 0.1, 1.0, q)
        torque = torque + 0.05 * generator.standard_normal(len(TIME))
        found = find_ripples(JOINT, [record(q, torque, generator)], CUTOFF)
        (one,) = found.lines
        assert one.ways == ways
        doubted = [words for words in found.limits if "one direction only" in words]
        assert len(doubted) == (ways == 1)
        assert ("one direction only" in one.sentence) == (ways == 1)


@pytest.mark.nightly
def test_a_ripple_has_the_size_of_the_fitted_gain():
    """The inertia is known, the gain of the input is believed to be 30 % too small."""
    generator = np.random.default_rng(18)
    mechanism = Mechanism(
        {"q": BelievedValue(0.5)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, 1.0))],
        [Input("torque", {"q": 1.0}, BelievedValue(0.7, 0.5))],
    )
    q = swings(generator)
    speed = np.gradient(q, STEP)
    torque = 0.5 * np.gradient(speed, STEP) + 0.5 * speed
    torque = torque + hidden("torque_ripple", 402.0, 0.1, 1.0, q)
    torque = torque + 0.05 * generator.standard_normal(len(TIME))
    finding = examine_mechanism(mechanism, [record(q, torque, generator)], CUTOFF)
    accepted = finding.accepted
    names = [parameter.name for parameter in accepted.parameters]
    assert accepted.values[names.index("gain of torque")] == pytest.approx(1.0, rel=0.03)
    (one,) = finding.ripples.lines
    assert one.parts[0].values["amplitude"][0] == pytest.approx(0.1, rel=0.04)


@pytest.mark.parametrize("kind", ["torque_ripple", "position_dependent_friction"])
def test_a_ripple_in_rows_at_uneven_times_has_its_size(kind):
    """A curve through such rows is too flat near the Nyquist frequency."""
    generator = np.random.default_rng(21)
    fine = np.linspace(0.0, TIME[-1], 20 * len(TIME))
    swung = 0.5 * np.interp(fine, TIME, swings(generator))
    time = np.cumsum(STEP * generator.uniform(0.5, 1.5, len(TIME)))
    time = time[time < TIME[-1]]
    q = np.interp(time, fine, swung)
    turns = np.sign(np.interp(time, fine, np.gradient(swung)))
    torque = 0.3 * (turns if kind != "torque_ripple" else -1.0) * np.cos(1010.0 * q)
    torque = torque + 0.02 * generator.standard_normal(len(time))
    even = even_steps(time, {"q": q, "torque": torque})
    assert even.interpolated
    one = Record("uneven", "train", even.time, even.signals, interpolated=True)
    (found, *_) = find_ripples(JOINT, [one], CUTOFF).lines
    (size, _), *_ = found.parts[0].values.values()
    assert found.parts[0].law.name == kind
    assert size == pytest.approx(0.3, rel=0.05)


@pytest.mark.nightly
def test_a_ripple_that_hides_the_gain_is_told_with_the_gain_that_is_found_without_it():
    generator = np.random.default_rng(20)
    mechanism = Mechanism(
        {"q": BelievedValue(0.5)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, 1.0))],
        [Input("torque", {"q": 1.0}, BelievedValue(0.7, 0.5))],
    )
    speed = 4.0 * np.sin(0.6 * TIME) + 1.2 * np.sin(2.1 * TIME)
    q = STEP * np.cumsum(speed)
    torque = 0.5 * np.gradient(speed, STEP) + 0.5 * speed + 0.3 * np.sign(speed)
    # Between whole numbers, so that it is seen beyond the band only, and within it as well.
    torque = torque + 0.5 * np.cos(20.6 * q + 1.0)
    torque = torque + 0.02 * generator.standard_normal(len(TIME))
    finding = examine_mechanism(mechanism, [record(q, torque, generator)], 8.0)
    assert [one.name for one in finding.accepted.candidates] == ["coulomb_friction"]
    assert finding.accepted.values[:2] == pytest.approx([0.5, 1.0], rel=0.01)
    (one,) = finding.ripples.lines
    assert one.parts[0].values["amplitude"][0] == pytest.approx(0.5, rel=0.02)
    assert finding.believed == ()


def test_a_range_of_orders_that_is_too_long_is_cut_at_its_end_and_that_is_said():
    generator = np.random.default_rng(19)
    rules = Rules(most_tried_orders=100)
    # A linear axis of some cm: orders, in rad per m, are far apart.
    q = 0.01 * swings(generator)
    force = 0.2 * generator.standard_normal(len(TIME))
    bands = bands_of(q, force, generator)
    (whole,), resolution, cut = _order_grids(bands, (), RULES)
    assert not cut
    (short,), _, cut = _order_grids(bands, (), rules)
    assert cut
    assert len(short) <= 101
    # No finer, and from as low on, than without a cut.
    assert short[1] - short[0] == pytest.approx(whole[1] - whole[0])
    assert short[0] < whole[0] + resolution
    found = find_ripples(JOINT, [record(q, force, generator)], CUTOFF, rules=rules)
    assert any("were searched up to" in words for words in found.limits)
    found = find_ripples(JOINT, [record(q, force, generator)], CUTOFF)
    assert not any("were searched up to" in words for words in found.limits)


def test_an_order_of_a_gear_is_seen_between_whole_numbers_and_beyond_a_cut():
    """After many turns only whole numbers are tried, up to a limit."""
    generator = np.random.default_rng(20)
    gear, rules = Gear(20.3, "harmonic drive"), Rules(most_tried_orders=40)
    q = STEP * np.cumsum(3.0 + 1.5 * np.sin(0.6 * TIME))
    for order in (40.6, 81.2):
        force = 0.03 * np.cos(order * q) + 0.1 * generator.standard_normal(len(TIME))
        one = [record(q, force, generator)]
        found = find_ripples(joint(gear), one, CUTOFF, rules=rules).lines
        assert [each.order for each in found] == pytest.approx([order], abs=0.02)
        assert not find_ripples(joint(), one, CUTOFF, rules=rules).lines


def test_a_gear_is_at_a_port_that_is_an_angle_only():
    def with_gear(motion, angles):
        Mechanism(
            {"a": BelievedValue(1.0), "b": BelievedValue(1.0)},
            [Port("joint", motion, gear=GEAR)],
            angles=angles,
        )

    with_gear({"a": 0.01, "b": 0.0}, ["a"])
    with_gear({"a": 0.01}, None)
    for motion, angles in (({"a": 1.0, "b": 1.0}, None), ({"a": 1.0}, ["b"])):
        with pytest.raises(InvalidInput, match="gear of joint"):
            with_gear(motion, angles)


def test_a_model_that_lacks_a_ripple_only_is_not_adequate_and_gets_it(tmp_path):
    generator = np.random.default_rng(12)
    q = swings(generator)
    speed = np.gradient(q, STEP)
    moved = 0.05 * np.gradient(speed, STEP) + 0.5 * speed
    noise = 0.05 * generator.standard_normal(len(TIME))
    plain = examine_mechanism(JOINT, [record(q, moved + noise, generator)], CUTOFF)
    assert plain.verdict.status == "adequate"
    rippled = moved + noise + hidden("torque_ripple", 202.0, 0.1, 1.0, q)
    finding = examine_mechanism(JOINT, [record(q, rippled, generator)], CUTOFF)
    assert finding.verdict.status == "named"
    assert finding.accepted.values == pytest.approx(plain.accepted.values, rel=0.02)
    document = write_mechanism_report("joint", finding, (), next_test(finding), tmp_path / "out")
    (effect,) = document["effects"]
    assert (effect["name"], effect["port"]) == ("torque_ripple", "bearing")
    lower, upper = effect["parameters"]["amplitude"]["interval95"]
    assert lower < 0.1 < upper
    assert "2 per input turn" in document["sentence"]
    (law,) = revised_mechanism("joint", finding).effects
    assert isinstance(law, LawAt)
    again = examine_mechanism(JOINT, [record(q, rippled, generator)], CUTOFF, [law])
    assert again.verdict.status == "adequate"


def test_orders_that_a_gear_has():
    drive = Gear(100.0, "harmonic drive", pole_pairs=7).expected
    # The wave generator has two ends, and turns 99 or 101 times against the output.
    assert {198.0, 200.0, 202.0, 400.0, 700.0, 1400.0, 4200.0, 100.0, 1.0} <= set(drive)
    assert drive[200.0] == "2 per input turn"
    assert set(Gear(5.0).expected) == {5.0, 1.0}
    for wrong in ({"ratio": 0.5}, {"ratio": 5.0, "kind": "belt"}, {"ratio": 5.0, "pole_pairs": -1}):
        with pytest.raises(InvalidInput, match=r"gear\."):
            Gear(**wrong)


UR10E = SHARED / "measured" / "ur10e"
MEASURED = {1: (10.0, 202.0), 4: (9.0, 200.0), 6: (10.12, 404.0)}
"""Torque constant in N.m/A and an order of each joint, 2 or 4 per turn of the wave generator."""


@pytest.mark.skipif(not UR10E.is_dir(), reason="measured data of others are not here")
@pytest.mark.parametrize("number", MEASURED)
def test_joints_of_a_robot_have_two_or_four_cycles_per_input_turn(number):
    gain, order = MEASURED[number]
    rows = np.loadtxt(UR10E / f"joint_{number}.csv", delimiter=",")
    time, q, current = rows[:, 0], rows[:, number], rows[:, 12 + number]
    even = np.linspace(time[0], time[-1], len(time))
    channels = {"q": np.interp(even, time, q), "torque": gain * np.interp(even, time, current)}
    first = int(0.6 * len(time))
    records = [
        Record(role, role, even[part], {name: one[part] for name, one in channels.items()})
        for role, part in (("train", slice(first)), ("held_out", slice(first, None)))
    ]
    found = find_ripples(JOINT, records, 3.5).lines
    assert any(abs(one.order - order) <= one.resolution for one in found)
    assert all("input turn" in one.meaning for one in found[:1])
