"""Rows at uneven times: brought to even steps so that the motion stays what it was, and said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoo_hdte._io.even_steps import even_steps, is_even
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.parts import Part, part_from_fields
from pymoo_hdte._io.tables import Channel, TableLayout, read_table
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.mechanism.motion import noise_of

LAYOUT = TableLayout("plain", {"q": Channel(1, "m")}, Channel(0, "s"), None, 0)
SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20)


def motion(time, step):
    """Return a motion with at least ten rows in a period."""
    return np.sin(0.1 * 2.0 * np.pi * time / step) + np.sin(0.03 * 2.0 * np.pi * time / step + 1.0)


def late_stamps(chance, clock):
    """Return stamps that rise, some of them late."""
    late = np.where(chance.random(len(clock)) < 0.2, chance.exponential(0.3, len(clock)), 0.0)
    return np.maximum.accumulate(clock + late * np.diff(clock).min()) + 1e-9 * np.arange(len(clock))


@FEW
@given(seed=SEEDS, spread=st.floats(0.02, 0.5), start=st.floats(-1e5, 1e5))
def test_rows_that_were_taken_unevenly_keep_their_motion(seed, spread, start):
    time = start + 0.01 * np.cumsum(
        np.random.default_rng(seed).uniform(1 - spread, 1 + spread, 600)
    )
    even = even_steps(time, {"q": motion(time, 0.01), "held": np.ones(600)})
    step = np.diff(even.time)
    assert np.ptp(step) < 1e-6 * step[0]
    assert step[0] == pytest.approx(np.mean(np.diff(time)))
    assert time[0] <= even.time[0] < even.time[-1] <= time[-1] + 1e-9
    inside = slice(5, -5)
    error = even.signals["q"] - motion(even.time, 0.01)
    assert np.sqrt(np.mean(error[inside] ** 2)) < 2e-3
    assert even.interpolated
    np.testing.assert_allclose(even.signals["held"], 1.0, atol=1e-9)


@FEW
@given(seed=SEEDS, tick=st.floats(1e-4, 1.0), lost=st.integers(0, 4))
def test_stamps_that_are_late_do_not_move_the_rows_of_an_even_clock(seed, tick, lost):
    chance = np.random.default_rng(seed)
    places = 50 + 100 * np.arange(lost)
    clock = np.delete(tick * np.arange(600.0), places)
    signal = motion(clock, tick) + 1e-4 * chance.standard_normal(len(clock))
    even = even_steps(late_stamps(chance, clock), {"q": signal})
    assert f"lost and are interpolated: {lost}." in even.remark
    assert even.interpolated == (lost > 0)
    assert len(even.time) == 600
    assert np.mean(np.diff(even.time)) == pytest.approx(tick, rel=1e-3)
    # Rows that were measured stay as they are, but where a late stamp hides which row was lost.
    exact = np.isclose(even.signals["q"][np.delete(np.arange(600), places)], signal, atol=1e-6)
    assert np.count_nonzero(~exact) <= lost


@pytest.mark.parametrize("least", [0.1, 2e-2, 2e-3, 1e-4])
def test_a_speed_is_integrated_over_the_steps_that_are_believed(tmp_path, least):
    chance, tick = np.random.default_rng(6), 0.01
    clock = tick * np.arange(3000.0)
    late = np.where(chance.random(3000) < 0.3, chance.exponential(0.3 * tick, 3000), 0.0)
    # A stamp that is late lets the next one follow after as little as ``least``, in steps.
    stamps = np.maximum.accumulate(clock + late - least * tick * np.arange(3000))
    stamps += least * tick * np.arange(3000)
    omega = 2.0 * np.pi * 0.7
    rate = omega * np.cos(omega * clock) + 1e-4 * chance.standard_normal(3000)
    path = tmp_path / "log.txt"
    np.savetxt(path, np.c_[stamps, rate], fmt="%.9f")
    channels = {"q": Channel(1, "rad/s", integrated=True)}
    table = read_table(path, replace(LAYOUT, channels=channels))
    assert "and the stamps as late" in table.remark
    np.testing.assert_allclose(table.channels["q"], np.sin(omega * clock), atol=1e-4)
    # A later part counts from the first row of the file: over stamps, of which each is late.
    part = read_table(path, replace(LAYOUT, channels=channels), part=Part("share", 0.5, 1.0))
    np.testing.assert_allclose(part.channels["q"], np.sin(omega * clock[1500:]), atol=0.03)


def test_the_noise_of_a_sensor_is_still_known_after_the_rows_are_evened():
    chance = np.random.default_rng(4)
    time = np.cumsum(np.where(np.arange(4000) % 2, 0.010, 0.012))
    signal = np.sin(2.0 * time) + 1e-3 * chance.standard_normal(4000)
    assert noise_of(even_steps(time, {"q": signal}).signals["q"]) == pytest.approx(1e-3, rel=0.2)


def test_even_and_uneven_times_are_told_apart():
    even = 1e-3 * np.arange(100.0)
    assert is_even(even + np.random.default_rng(1).uniform(-4e-6, 4e-6, 100))
    assert not is_even(np.delete(even, 50))
    # Within 1 % of the median, not of the mean.
    assert not is_even(np.cumsum(np.r_[np.full(10, 1.0), np.full(9, 1.0099), 0.9901]))


def written(tmp_path, time):
    path = tmp_path / "log.txt"
    np.savetxt(path, np.c_[time, np.sin(time)], fmt="%.6f")
    return path


def test_a_log_of_1_to_20_ms_is_read_and_said(tmp_path):
    time = np.cumsum(np.random.default_rng(2).uniform(1e-3, 20e-3, 2000))
    table = read_table(written(tmp_path, time), LAYOUT)
    assert "steps of 1.0" in table.remark
    assert "to 20 ms" in table.remark
    np.testing.assert_allclose(table.channels["q"], np.sin(table.time), atol=1e-5)


def test_a_part_of_a_file_has_its_rows_and_its_times(tmp_path):
    time = 100.0 + 0.01 * np.arange(1000)
    path = written(tmp_path, time)
    for part, rows in (
        (Part("share", 0.0, 0.6), slice(0, 600)),
        (Part("share", 0.6, 1.0), slice(600, 1000)),
        (Part("rows", 20, 5000), slice(20, 1000)),
        (Part("seconds", 101.0, 103.0), slice(100, 300)),
    ):
        table = read_table(path, LAYOUT, part=part)
        np.testing.assert_allclose(table.time, time[rows])
        np.testing.assert_allclose(table.channels["q"], np.sin(time[rows]), atol=1e-6)
    with pytest.raises(InvalidInput, match=r"in seconds = \[0\.0, 1\.0\] is 0"):
        read_table(path, LAYOUT, part=Part("seconds", 0.0, 1.0))


def test_a_part_of_a_file_without_numbers_is_refused(tmp_path):
    path = written(tmp_path, np.full(40, np.nan))
    for part in (Part("seconds", 0.0, 1.0), Part("share", 0.0, 0.6)):
        with pytest.raises(InvalidInput, match=r"finite rows .* is 0"):
            read_table(path, LAYOUT, part=part)


def test_a_gap_outside_of_a_part_is_no_fault_of_it(tmp_path):
    time = 0.01 * np.arange(1000.0)
    time[500:] += 3.0
    path = written(tmp_path, time)
    with pytest.raises(
        InvalidInput, match=r"line 501: column 0 is 8\.0, .* a record for each part"
    ):
        read_table(path, LAYOUT)
    for part in (Part("rows", 0, 500), Part("seconds", 8.0, 99.0)):
        assert len(read_table(path, LAYOUT, part=part).time) == 500
    with pytest.raises(InvalidInput, match="line 501: column 0"):
        read_table(path, LAYOUT, part=Part("share", 0.4, 0.6))


@given(size=st.integers(16, 5000), at=st.floats(0.01, 0.99))
def test_two_parts_that_meet_are_the_whole(size, at):
    first, second = (Part("share", *ends).rows_of(np.arange(size)) for ends in ((0, at), (at, 1)))
    assert (first.start, second.stop) == (0, size)
    assert first.stop == second.start


BAD_PARTS = [
    ({"share": [0.0, 1.2]}, r"record\.share is \[0\.0, 1\.2\], allowed: \[from, to\] between 0"),
    ({"share": [0.5, 0.5]}, r"record\.share"),
    ({"rows": [0.5, 9]}, r"record\.rows is .* whole numbers"),
    ({"rows": [-1, 9]}, r"record\.rows"),
    ({"seconds": [3.0]}, r"record\.seconds is \(3\.0,\), allowed: two numbers"),
    ({"seconds": [3.0, 1.0]}, r"record\.seconds is .* in s, rising"),
    ({"share": [0, 1], "rows": [0, 9]}, r"record\.rows is .* absent beside share"),
]


@pytest.mark.parametrize(("table", "words"), BAD_PARTS)
def test_a_bad_part_is_refused_with_its_field(table, words):
    with pytest.raises(InvalidInput, match=words):
        part_from_fields(Fields(table, "record"))
