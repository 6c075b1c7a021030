"""Which rows of a log without roles are fitted, and which are held out."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte.discrepancy import analyse, read_rig
from pymoo_hdte.discrepancy._records.split import DEFAULT, SPLIT, _blocks, _Moments, split_of
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.motion import margin_of
from pymoo_hdte.mechanism.resampling import refined

MASS, DAMPING, LEVEL = 25.0, 40.0, 18.0
STEP, CUTOFF = 0.002, 30.0
AXIS = Mechanism(
    {"x": BelievedValue(24.0, tolerance=0.2)},
    [Port("guide", {"x": 1.0}, damping=BelievedValue(30.0, factor=10.0))],
    [Input("force", {"x": 1.0})],
    lengths=["x"],
)


def steady(rows=8000):
    """Return a position whose speeds and accelerations stay the same."""
    time = STEP * np.arange(rows)
    tones = np.random.default_rng(1).uniform(0.3, 8.0, 12)
    phases = np.random.default_rng(2).uniform(0.0, 6.3, 12)
    return np.sum(
        0.1 / tones[:, None] * np.sin(2.0 * np.pi * tones[:, None] * time + phases[:, None]), axis=0
    )


def of_speed(speed):
    """Return a position of this speed, whose corners are rounded within a tenth of a second."""
    round_ = np.hanning(51)
    padded = np.pad(speed, 25, mode="edge")
    return STEP * np.cumsum(np.convolve(padded, round_ / round_.sum(), mode="valid"))


def one_push():
    up = np.linspace(0.0, 0.6, 500)
    return of_speed(np.r_[np.zeros(150), up, up[::-1], np.zeros(150)])


def staircase():
    """Return to and fro strokes, each faster than the one before."""
    strokes = [np.repeat([fast, -fast], 250) for fast in np.linspace(0.05, 0.8, 10)]
    return of_speed(np.concatenate(strokes))


def forward_then_backward():
    wave = 0.3 + 0.2 * np.sin(2.0 * np.pi * 1.7 * STEP * np.arange(3000))
    return of_speed(np.r_[wave, -wave[:1800]])


def record_of(position, role="train"):
    """Return a record of a position, with the force that a mass on a rough, damped guide needs."""
    noise = np.random.default_rng(0).standard_normal((2, len(position)))
    speed = np.gradient(position, STEP)
    force = (
        MASS * np.gradient(speed, STEP)
        + DAMPING * speed
        + LEVEL * np.sign(speed) * (np.abs(speed) > 1e-4)
    )
    channels = {"x": position + 1e-7 * noise[0], "force": force + 0.5 * noise[1]}
    return Record("log", role, STEP * np.arange(len(position)), channels)


def rig(folder, record, role=""):
    columns = np.column_stack([record.time, record.channels["x"], record.channels["force"]])
    np.savetxt(folder / "log.csv", columns, "%.9g", ",", header="t,x,F", comments="")
    (folder / "rig.toml").write_text(
        f"""title = "An axis"
[coordinates.x]
inertia = {{ value = 24.0, tolerance = 0.2 }}
[ports.guide]
motion = {{ x = 1.0 }}
damping = {{ value = 30.0, factor = 10.0 }}
[inputs.force]
acts = {{ x = 1.0 }}
gain = {{ value = 1.0 }}
[table]
time = {{ column = "t", unit = "s" }}
channels.x = {{ column = "x", unit = "m" }}
channels.force = {{ column = "F", unit = "N" }}
[[records]]
file = "log.csv"
{role}
"""
    )
    return read_rig(folder)


@given(st.integers(1, 8), st.floats(0.0, 0.999))
def test_blocks_divide_a_record_and_keep_the_shares(periods, phase):
    blocks = _blocks(periods, phase)
    assert (blocks[0].start, blocks[-1].stop) == (0.0, 1.0)
    for one, after in pairwise(blocks):
        assert one.stop == after.start
        assert one.role != after.role
    fitted = sum(one.stop - one.start for one in blocks if one.role == "train")
    assert fitted == pytest.approx(SPLIT, abs=1e-7)


def test_motion_that_stays_the_same_is_divided_by_default():
    split = split_of(AXIS, [record_of(steady())], CUTOFF)
    assert split.blocks == DEFAULT


@pytest.mark.parametrize("motion", [one_push, staircase, forward_then_backward])
def test_both_parts_hold_what_moves(motion):
    record = record_of(motion())
    split = split_of(AXIS, [record], CUTOFF)
    assert split.chosen < split.by_default
    speed = np.gradient(record.channels["x"], STEP)
    acceleration = np.gradient(speed, STEP)
    rows = len(speed)
    parts = {
        role: np.concatenate(
            [
                np.arange(round(b.start * rows), round(b.stop * rows))
                for b in split.blocks
                if b.role == role
            ]
        )
        for role in ("train", "held_out")
    }
    for inside in parts.values():
        for signal in (speed, acceleration):
            for side in (signal, -signal):
                often = np.quantile(side, 0.9)
                if often > 0.05 * np.abs(signal).max():
                    assert side[inside].max() > 0.5 * often


def test_the_expected_error_is_that_of_least_squares():
    """Against a simulation: force noise on the rows that are independent at this cutoff."""
    record = record_of(staircase())
    moments = _Moments(AXIS, [record], CUTOFF)
    margin, rows = margin_of(CUTOFF, STEP), len(record.time)
    stride = round(1.0 / (2.0 * CUTOFF * STEP))
    assert stride * 2.0 * CUTOFF * STEP == pytest.approx(1.0, rel=0.05)
    speed = np.gradient(record.channels["x"], STEP)
    fastest = np.abs(speed).max()
    columns = np.column_stack(
        [
            np.gradient(speed, STEP),
            np.ones(rows),
            np.sign(speed),
            np.sign(speed) * np.exp(-((speed / (0.2 * fastest)) ** 2)),
            speed,
            speed * np.abs(speed),
        ]
    )
    inside = np.arange(margin, rows - margin, stride)
    early = inside < SPLIT * rows
    noise = np.random.default_rng(5).standard_normal((len(inside), 400))
    errors = []
    for known in (early, ~early):
        fitted = np.linalg.lstsq(columns[inside][known], noise[known], rcond=None)[0]
        errors.append(np.mean((noise[~known] - columns[inside][~known] @ fitted) ** 2))
    assert moments.error(DEFAULT) == pytest.approx(max(errors), rel=0.1)


def test_a_push_in_one_log_is_fitted_and_proved(tmp_path):
    analysis = analyse(rig(tmp_path, record_of(one_push())))
    records = analysis.finding.records
    assert {one.role for one in records} == {"train", "held_out"}
    assert len(records) > 2
    assert "are held out" in " ".join(one.remarks[0] for one in records if one.remarks)
    (effect,) = analysis.verdict.accepted.effects
    assert effect.law.level == pytest.approx(LEVEL, rel=0.05)
    # Rows of a force balance belong to one record only.
    times = [ForceBalance(AXIS, one, analysis.finding.cutoff).time for one in records]
    for one, after in pairwise(times):
        assert one[-1] < after[0]
    simulated = [one for record in analysis.finding.simulated for one in record.time]
    for balance in analysis.finding.data.spectra:
        assert not any(balance.time[0] < one < balance.time[-1] for one in simulated)


def test_a_stated_role_is_kept(tmp_path):
    (record,) = rig(tmp_path, record_of(one_push()), 'role = "train"').records
    assert len(record.time) == len(one_push())


def test_rows_of_other_records_stay_marked_at_other_rates_and_delays():
    """A row that belongs to another record has its time in no force balance."""
    position = steady(3000)
    time = STEP * np.arange(len(position))
    channels = {"x": position, "force": np.gradient(position, STEP)}
    own = 400, 2300
    one = Record("part", "train", time, channels, context=(own[0], len(time) - 1 - own[1]))
    for changed in (one, one.finer(3), refined(one, 2), one.with_delays({"force": 11.4 * STEP})):
        balance = ForceBalance(AXIS, changed, CUTOFF)
        assert own[0] * STEP - 1e-9 <= balance.time[0] < (own[0] + 20) * STEP
        assert (own[1] - 60) * STEP < balance.time[-1] <= own[1] * STEP + 1e-9
