"""Rows of records: planted faults are found, named and repaired; motions are no faults."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import Rig, RunningRecord, TorsionRecord, order_lines
from pymoo_hdte.discrepancy._records.cleaning.cleaning import _check_failed
from pymoo_hdte.discrepancy._records.cleaning.repair import RUNNING, repaired_run, repaired_sweep
from pymoo_hdte.discrepancy._records.records import Jump
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.units import ARCSEC

RATIO = 101.0
ORDERS = [1.0 / RATIO, 1.0, 2.0, 2.02, 4.0]
RIG = Rig(0.02, 0.5, 0.7 * ARCSEC, 0.003, 0.2, 0.3 * ARCSEC, 0.2 * ARCSEC, angle_quantisation=0.0)
SPEED = 1000.0 * np.pi / 30.0
RATE = 500.0
N_ROWS = int(RATIO * 2.0 * np.pi / SPEED * RATE) + 1
TIME = np.arange(N_ROWS) / RATE
ERROR = 9.0 * ARCSEC
DEVIATIONS = 6.5
NOISE = dict(zip(RUNNING, (RATIO * RIG.angle_noise, RIG.angle_noise, 0.003, 0.2), strict=True))


def run(rng, motion=0.0, turned=0.0, name="run"):
    """A record of three lines and noise; ``motion`` is one more of the output (n,), rad.

    The input has ``turned`` (n,) farther, rad.
    """
    angle = 40.0 + SPEED * TIME + turned
    angle = angle + 1e-3 * np.sin(angle)
    error = ERROR * (np.sin(angle) + np.sin(2.0 * angle + 1.0)) + motion
    noise = {one: size * rng.standard_normal(N_ROWS) for one, size in NOISE.items()}
    true = {
        "input_angle": angle,
        "output_angle": angle / RATIO - error,
        "input_torque": 0.2 + 0.01 * np.sin(2.0 * angle),
        "output_torque": 20.0 + np.sin(2.0 * angle),
    }
    channels = {one: true[one] + noise[one] for one in RUNNING}
    return RunningRecord(name, "train", SPEED, 20.0, RATE, 1, 0.0, TIME, **channels)


def changed(record, channel, rows, size):
    values = getattr(record, channel).copy()
    values[rows] += size
    return replace(record, **{channel: values})


def repaired(record):
    return repaired_run(record, RATIO, ORDERS, DEVIATIONS, RULES)


def without(record, kept):
    columns = {one: getattr(record, one)[kept] for one in ("time", *RUNNING)}
    return replace(record, **columns)


def assert_lines_as_of(record, untouched, deviations=4.0):
    """The lines of a repaired record differ from those before the fault by their noise at most."""
    found, true = (order_lines(one, RIG, RATIO, ORDERS) for one in (record, untouched))
    variance = np.diagonal(found.covariance, axis1=1, axis2=2)[:, 1:]
    apart = found.phasors - true.phasors
    parts = np.concatenate([apart.real, apart.imag], axis=1)
    assert np.all(parts**2 < deviations**2 * variance)


def test_a_sound_record_stays_the_same_object(rng):
    for _ in range(5):
        record = run(rng)
        result = repaired(record)
        assert result.record is record
        assert result.faults == ()
        assert result.usable


@pytest.mark.parametrize("channel", RUNNING)
@pytest.mark.parametrize("size", [12.0, -3000.0])
def test_spikes_are_found_in_their_channel_and_left_out(rng, channel, size):
    untouched = run(rng)
    rows = [0, 700, 1900, 1901, N_ROWS - 1]
    result = repaired(changed(untouched, channel, rows, size * NOISE[channel]))
    assert {(fault.kind, fault.channel) for fault in result.faults} == {("spike", channel)}
    found = sorted(row for one in result.faults for row in range(one.row, one.row + one.rows))
    assert found == rows
    sizes = np.array([fault.size for fault in result.faults])
    tolerances = {"rtol": 0.02, "atol": 6.0 * NOISE[channel]}
    np.testing.assert_allclose(sizes, size * NOISE[channel], **tolerances)
    assert len(result.record.time) == N_ROWS - len(rows)
    assert_lines_as_of(result.record, untouched)


@pytest.mark.parametrize("channel", RUNNING)
@pytest.mark.parametrize("size", [3.0, -25.0, 2500.0])
def test_a_jump_is_found_with_row_channel_and_size_and_taken_out(rng, channel, size):
    untouched = run(rng)
    broken = changed(untouched, channel, slice(1000, None), size * NOISE[channel])
    result = repaired(broken)
    (fault,) = result.faults
    assert (fault.kind, fault.channel, fault.treatment) == ("jump", channel, "modelled")
    assert abs(fault.row - 1000) <= 3
    assert fault.size == pytest.approx(size * NOISE[channel], abs=0.5 * NOISE[channel])
    assert result.usable
    assert_lines_as_of(result.record, untouched)


def test_the_mean_of_a_channel_that_jumps_is_uncertain_by_the_jump(rng):
    size = 30.0 * ARCSEC
    record = repaired(changed(run(rng), "output_angle", slice(1000, None), size)).record
    lines = order_lines(record, RIG, RATIO, ORDERS)
    assert np.sqrt(lines.covariance[0, 0, 0]) == pytest.approx(size, rel=0.05)
    # Not the other channels, and not the lines.
    others = np.sqrt(np.diagonal(lines.covariance[1:3], axis1=1, axis2=2)[:, 0])
    assert np.all(others < 0.1 * np.array([NOISE["input_torque"], NOISE["output_torque"]]))


@settings(max_examples=10, deadline=None)
@given(row=st.integers(200, N_ROWS - 200), seed=st.integers(0, 2**32 - 1))
def test_lines_beside_a_jump_scatter_as_their_covariance_says(row, seed):
    rng = np.random.default_rng(seed)
    record = run(rng)
    jump = Jump(float(record.time[row]), "output_angle", 0.0)
    jumped = replace(changed(record, "output_angle", slice(row, None), ERROR), jumps=(jump,))
    plain = order_lines(record, RIG, RATIO, ORDERS)
    beside = order_lines(jumped, RIG, RATIO, ORDERS)
    # In units of the noise of a row, which depends on the lines found and so on the jump as well.
    plain_variance, beside_variance = (
        np.diagonal(one.covariance, axis1=1, axis2=2)[:, 1:]
        / np.diagonal(one.row_covariance)[:, np.newaxis]
        for one in (plain, beside)
    )
    np.testing.assert_array_less(plain_variance, beside_variance * (1.0 + 1e-9))
    apart = beside.phasors[0] - np.array([0.0, -1j, -1j * np.exp(1j), 0.0, 0.0]) * ERROR
    parts = np.concatenate([apart.real, apart.imag])
    assert np.all(parts**2 < 5.0**2 * np.diag(beside.covariance[0])[1:])


def test_a_jump_forth_and_back_and_spikes_beside_it_are_told_apart(rng):
    untouched = run(rng)
    broken = changed(untouched, "output_angle", slice(700, 1500), 15.0 * ARCSEC)
    broken = changed(broken, "output_angle", [30, 701, 2000], -900.0 * ARCSEC)
    result = repaired(broken)
    kinds = sorted((fault.kind, fault.row) for fault in result.faults)
    assert kinds == [("jump", 700), ("jump", 1500), ("spike", 30), ("spike", 701), ("spike", 2000)]
    assert_lines_as_of(result.record, untouched)


@pytest.mark.parametrize("lost", [1, 7])
def test_rows_lost_under_a_running_time_are_found_and_the_time_is_set_right(rng, lost):
    untouched = run(rng)
    kept = np.r_[:1200, 1200 + lost : N_ROWS]
    broken = replace(without(untouched, kept), time=TIME[: len(kept)])
    (fault,) = repaired(broken).faults
    assert (fault.kind, fault.channel) == ("jump", "time")
    assert abs(fault.row - 1200) <= 1
    assert fault.size == pytest.approx(lost / RATE, rel=0.1)
    np.testing.assert_allclose(repaired(broken).record.time, TIME[kept], atol=0.2 / RATE)


def test_a_gap_of_time_is_counted_and_needs_nothing(rng):
    record = without(run(rng), np.r_[:1000, 1250:N_ROWS])
    result = repaired(record)
    (fault,) = result.faults
    assert (fault.kind, fault.row, fault.rows) == ("gap", 1000, 250)
    assert fault.size == pytest.approx(250 / RATE)
    assert fault.treatment == "none needed"
    assert result.record is record


def test_repeated_rows_are_left_out(rng):
    record = run(rng)
    frozen = np.arange(N_ROWS)
    frozen[500:505] = 499
    broken = replace(record, **{one: getattr(record, one)[frozen] for one in RUNNING})
    (fault,) = repaired(broken).faults
    assert (fault.kind, fault.row, fault.rows, fault.treatment) == ("repeated", 500, 5, "left out")


@pytest.mark.parametrize("channel", RUNNING)
def test_rows_in_which_a_channel_has_failed_are_left_out(rng, channel):
    """A motor torque that stayed the same for half a record was called a jump, and fitted."""
    record = run(rng)
    held = np.arange(N_ROWS)
    held[500:800] = 499
    result = repaired(replace(record, **{channel: getattr(record, channel)[held]}))
    (fault,) = result.faults
    assert (fault.kind, fault.channel, fault.row, fault.rows) == ("stuck", channel, 499, 301)
    assert fault.size == getattr(record, channel)[499]
    assert_lines_as_of(result.record, without(record, np.r_[:499, 800:N_ROWS]), 1e-6)


@pytest.mark.parametrize("temperature", [25.0, 2773.15, 573.15])
def test_a_temperature_in_another_unit_is_refused(rng, temperature):
    with pytest.raises(InvalidInput, match="200 to 473 K"):
        replace(run(rng), temperature=temperature)


def test_a_coarse_reading_has_not_failed(rng):
    record = replace(run(rng), output_torque=np.round(TIME * 3.0))
    assert "stuck" not in {fault.kind for fault in repaired(record).faults}
    # A sine in counts, which rests long at its crests.
    sine = 20.0 + np.round(400.0 * np.sin(np.pi * TIME) + rng.normal(0.0, 0.1, N_ROWS)) / 100.0
    record = replace(record, output_torque=sine)
    assert "stuck" not in {fault.kind for fault in repaired(record).faults}


@pytest.mark.parametrize(("first", "last"), [(200, N_ROWS), (50, N_ROWS), (50, N_ROWS - 50)])
def test_a_record_without_enough_rows_that_are_sound_is_not_usable(rng, first, last):
    record = run(rng)
    held = np.arange(N_ROWS)
    held[first:last] = first
    result = repaired(replace(record, input_torque=record.input_torque[held]))
    assert not result.usable
    assert [fault.kind for fault in result.faults] == ["stuck"]
    # Where the campaign cannot do without it.
    with pytest.raises(InvalidInput, match=rf"input_torque in \d+ rows from row {first + 1} on"):
        _check_failed([result])


def test_a_record_of_two_loads_is_not_usable(rng):
    record = run(rng)
    for channel, size in (("output_torque", 2.0), ("input_torque", 0.02), ("output_angle", -8e-5)):
        record = changed(record, channel, slice(1500, None), size)
    result = repaired(record)
    assert not result.usable
    assert {fault.channel for fault in result.faults} == {
        "output_torque", "input_torque", "output_angle"
    }  # fmt: skip


def _rattle(rng):
    """Flanks that change sides now and then, each time within some rows."""
    sides = np.cumsum(rng.random(N_ROWS) < 0.01) % 2
    return 20.0 * ARCSEC * np.convolve(sides, np.ones(12) / 12.0, mode="same")


MOTIONS = {
    "vibration of fixed frequency": lambda rng: 30.0 * ARCSEC * np.sin(2.0 * np.pi * 61.7 * TIME),
    "eccentricity": lambda rng: 60.0 * ARCSEC * np.sin(SPEED / RATIO * TIME + 0.3),
    "ripple": lambda rng: 5.0 * ARCSEC * np.sin(6.3 * SPEED * TIME),
    "drift": lambda rng: 20.0 * ARCSEC * -np.expm1(-TIME / 2.0),
    "slow drift": lambda rng: 5.0 * ARCSEC * -np.expm1(-TIME / 6.0),
    "wave of the output": lambda rng: 3.0 * ARCSEC * np.sin(2.5 * SPEED / RATIO * TIME),
    "knock once a turn": lambda rng: 30.0 * ARCSEC * (np.sin(SPEED * TIME) > 0.995),
    "rattling": _rattle,
    "ramp": lambda rng: 20.0 * ARCSEC * np.clip((TIME - 3.0) / 0.1, 0.0, 1.0),
    "stick-slip": lambda rng: 20.0 * ARCSEC * ((TIME * 7.3) % 1.0),
}


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_motion_is_no_fault(rng, kind):
    record = run(rng, MOTIONS[kind](rng))
    assert repaired(record).faults == ()


def sweep(rng, motion=0.0):
    time = np.arange(1200) / 10.0
    torque = 40.0 * np.abs((time / 20.0 + 1.0) % 4.0 - 2.0) - 40.0
    angle = -torque / 2.6e4 + motion * np.sign(torque) + 0.2 * ARCSEC * rng.standard_normal(1200)
    noisy = torque + 0.2 * rng.standard_normal(1200)
    return TorsionRecord("sweep", "train", 10.0, time, angle, noisy)


@pytest.mark.parametrize("clearance", [0.0, 30.0 * ARCSEC])
def test_a_sweep_with_turning_points_and_clearance_is_sound(rng, clearance):
    record = sweep(rng, clearance)
    same, faults = repaired_sweep(record, DEVIATIONS, RULES)
    assert same is record
    assert faults == ()


def test_spikes_of_a_sweep_are_left_out(rng):
    record = changed(sweep(rng, 30.0 * ARCSEC), "output_angle", [100, 777], 20.0 * ARCSEC)
    record = changed(record, "output_torque", [300], -30.0)
    shorter, faults = repaired_sweep(record, DEVIATIONS, RULES)
    assert [(one.channel, one.row) for one in faults] == [
        ("output_angle", 100), ("output_angle", 777), ("output_torque", 300)
    ]  # fmt: skip
    assert len(shorter.time) == 1197


def decayed(constant, size):
    return size * np.exp(-TIME / constant)


def least_deviations(constant, size):
    """Return the Cramer-Rao bounds of the size of a decay, rad, and of the log of its constant."""
    angle = np.outer(SPEED * TIME, ORDERS)
    decay = decayed(constant, 1.0)
    derivatives = [decay, size * decay * TIME / constant]
    design = np.column_stack([TIME**0, TIME, np.cos(angle), np.sin(angle), *derivatives])
    covariance = np.linalg.inv(design.T @ design)
    return NOISE["input_angle"] * np.sqrt(np.diagonal(covariance)[-2:])


@given(constant=st.floats(0.05, 0.4), size=st.floats(1.5e-3, 1.0), seed=st.integers(0, 9999))
@settings(max_examples=25, deadline=None)
def test_lines_of_a_record_that_begins_unsettled_scatter_as_their_covariance_says(
    constant, size, seed
):
    record = run(np.random.default_rng(seed))
    late = run(np.random.default_rng(seed), turned=decayed(constant, size))
    late = changed(late, "input_torque", slice(None), -0.5 * decayed(constant, size))
    result = repaired(late)
    (fault,) = result.faults
    assert (fault.kind, fault.channel, fault.row) == ("settling", "input_angle", 0)
    wrong = [fault.size - size, np.log(result.record.settling / constant)]
    narrowed = [1e-4 * size, 1e-4]
    assert np.all(np.abs(wrong) < 4.5 * least_deviations(constant, size) + narrowed)
    assert_lines_as_of(result.record, record)


def test_left_alone_the_decay_is_taken_for_slow_lines():
    record, late = (
        run(np.random.default_rng(1), turned=turned) for turned in (0.0, decayed(0.15, 2e-3))
    )
    with pytest.raises(AssertionError):
        assert_lines_as_of(late, record)


def test_a_jump_beside_a_decay_is_found_as_it_is_without(rng):
    late = run(rng, turned=decayed(0.15, 2e-3))
    result = repaired(changed(late, "input_torque", slice(1500, None), 0.02))
    assert {one.kind: one.row for one in result.faults} == {"settling": 0, "jump": 1500}


def test_a_jump_after_the_first_rows_and_events_that_come_again_are_no_settling(rng):
    early = changed(run(rng), "input_torque", slice(10), 0.05)
    again = np.zeros(N_ROWS)
    for row in range(0, N_ROWS, 430):
        again[row:] += 0.02 * np.exp(-(TIME[row:] - TIME[row]) / 0.05)
    for record in (early, changed(run(rng), "input_torque", slice(None), again)):
        assert repaired(record).record.settling is None


def test_a_channel_without_noise_hides_no_decay_of_another(rng):
    late = run(rng, turned=decayed(0.15, 2e-3))
    torque = 3.0 * np.round(late.output_torque / 3.0)
    assert repaired(replace(late, output_torque=torque)).record.settling is not None


def test_a_gap_hides_no_decay(rng):
    late = run(rng, turned=decayed(0.15, 2e-2))
    kept = np.ones(N_ROWS, dtype=bool)
    kept[600:1100] = False
    assert repaired(without(late, kept)).record.settling == pytest.approx(0.15, rel=0.1)


def test_what_settles_over_most_of_a_record_or_begins_later_is_a_motion(rng):
    record = run(rng)
    slow = 3e-3 * np.exp(-TIME / 2.0)
    later = np.where(TIME < 2.0, 0.0, 3e-3 * np.exp(-(TIME - 2.0) / 0.15))
    for motion in (slow, later):
        result = repaired(replace(record, input_angle=record.input_angle + motion))
        assert result.record.settling is None


def clipped(record, channel, share):
    """Return a record whose channel reads no more than all but a share of its rows."""
    values = getattr(record, channel)
    return replace(record, **{channel: np.minimum(values, np.quantile(values, 1.0 - share))})


@pytest.mark.parametrize("channel", ["input_torque", "output_torque"])
def test_rows_at_the_end_of_a_range_are_told_and_left_out(rng, channel):
    record = run(rng)
    result = repaired(clipped(record, channel, 0.04))
    (fault,) = result.faults
    assert (fault.kind, fault.channel, fault.treatment) == ("saturated", channel, "left out")
    assert fault.size == np.quantile(getattr(record, channel), 0.96)
    assert fault.rows == N_ROWS - len(result.record.time)
    assert getattr(result.record, channel).max() < fault.size
    assert result.usable
    assert_lines_as_of(result.record, record, 4.5)


def test_a_wave_that_is_cut_at_its_crests_comes_back(rng):
    """Of rows near the end only those stay elsewhere that noise had taken away from it."""
    true = run(rng)
    result = repaired(replace(true, output_torque=np.minimum(true.output_torque, 21.0)))
    assert result.usable
    lines = order_lines(result.record, RIG, RATIO, ORDERS)
    deviation = np.sqrt(np.diag(lines.covariance[2]))
    place = ORDERS.index(2.0)
    assert abs(lines.mean[2] - 20.0) < 4.0 * deviation[0]
    assert abs(lines.phasors[2, place] + 1j) < 5.0 * deviation[1 + place]


def test_rows_near_both_ends_of_a_range_are_left_out(rng):
    true = run(rng)
    torque = true.output_torque + 3.0 * np.sin(2.0 * true.input_angle)
    result = repaired(replace(true, output_torque=np.clip(torque, 15.9, 24.1)))
    assert result.usable
    assert sorted(fault.size for fault in result.faults) == [15.9, 24.1]
    kept = 4.0 * np.sin(2.0 * result.record.input_angle)
    nearest = 4.1 - 2.0 * RIG.output_torque_noise
    assert -nearest < kept.min() < 0.0 < kept.max() < nearest


def test_a_record_far_from_the_end_of_a_range_stays_the_same_object(rng):
    record = replace(run(rng), samples_averaged=20)
    result = repaired_run(record, RATIO, ORDERS, DEVIATIONS, RULES, {("output_torque", 50.0)})
    assert result.record is record
    assert result.usable


def test_a_crest_that_was_cut_before_its_samples_were_averaged_comes_back(rng):
    """No row stands at the end of the range: other records show where that is."""
    true, number = replace(run(rng), samples_averaged=20), 20
    noise = RIG.output_torque_noise * rng.standard_normal((N_ROWS, number))
    samples = np.minimum(20.0 + np.sin(2.0 * true.input_angle)[:, None] + noise, 20.95)
    record = replace(true, output_torque=samples.mean(axis=1))
    place, ends = ORDERS.index(2.0), {("output_torque", 20.95)}
    for known in (set(), ends):
        result = repaired_run(record, RATIO, ORDERS, DEVIATIONS, RULES, known)
        lines = order_lines(result.record, RIG, RATIO, ORDERS)
        deviation = np.sqrt(np.diag(lines.covariance[2]))
        off = abs(lines.phasors[2, place] + 1j) / deviation[1 + place]
        assert off < 5.0 if known else off > 8.0
    (fault,) = result.faults
    assert (fault.kind, fault.size, fault.rows) == (
        "saturated",
        20.95,
        N_ROWS - len(result.record.time),
    )


def test_a_record_that_is_saturated_most_of_the_time_is_not_usable(rng):
    result = repaired(clipped(run(rng), "input_torque", 0.4))
    assert not result.usable
    assert [fault.kind for fault in result.faults] == ["saturated"]
    with pytest.raises(InvalidInput, match="saturated at"):
        _check_failed([result])


def test_a_square_wave_a_rest_and_a_coarse_crest_are_not_saturated(rng):
    square = 20.0 + np.sign(np.sin(np.pi * TIME))
    rests = 20.0 - np.round(rng.random(N_ROWS) - 0.45)
    crest = 20.0 + np.round(400.0 * np.sin(7.0 * np.pi * TIME)) / 100.0
    for torque in (square, rests, crest):
        kinds = {one.kind for one in repaired(replace(run(rng), output_torque=torque)).faults}
        assert "saturated" not in kinds


def test_a_straight_line_of_a_torque_is_a_drift_and_a_slow_wave_is_none(rng):
    record, along = run(rng), TIME / TIME[-1]
    assert not repaired(record).drifts.any()
    for channel, size in (("input_torque", 0.02), ("output_torque", -1.0)):
        drifts = repaired(changed(record, channel, slice(None), size * along)).drifts
        place = RUNNING.index(channel) - 2
        assert drifts[place] == pytest.approx(size, abs=0.5 * NOISE[channel])
        assert drifts[1 - place] == 0.0
    for turns in (1.0, 1.6, 2.5, 3.0, 4.0):
        wave = 0.02 * np.sin(2.0 * np.pi * turns * along + 0.4)
        assert not repaired(changed(record, "input_torque", slice(None), wave)).drifts.any()
