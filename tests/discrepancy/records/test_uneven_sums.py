"""Sums over uneven angles: with finufft and without they equal the direct sum to one error."""

import numpy as np
import pytest

from pymoo_hdte.discrepancy._records import uneven_sums
from pymoo_hdte.discrepancy._records.uneven_sums import (
    SUM_ERROR,
    direct_sums,
    spread_sums,
    sums_at_lines,
    sums_at_whole_lines,
)


def case(seed, count, turns):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(-turns, turns, count)) * 2.0 * np.pi
    rows = rng.standard_normal((3, count)) + 1j * rng.standard_normal((3, count))
    return angle, rows


def error(sums, exact):
    """Of each row, relative to the size of its sums, as finufft states it."""
    difference = np.linalg.norm(sums - exact, axis=1)
    return np.max(difference / np.linalg.norm(exact, axis=1))


@pytest.mark.parametrize("highest", [0, 1, 7, 250, 1000])
@pytest.mark.parametrize("count", [1, 2, 300, 5000])
@pytest.mark.parametrize("turns", [0.01, 1.0, 20.0])
def test_sums_at_whole_lines_are_the_direct_ones(monkeypatch, highest, count, turns):
    angle, rows = case(1, count, turns)
    exact = direct_sums(angle, rows, np.arange(-highest, highest + 1.0))
    # Angles of many turns are known to their last digit only, which counts once for each line.
    allowed = 3.0 * SUM_ERROR + 1e-15 * highest * turns
    assert error(spread_sums(angle, rows, highest), exact) < allowed
    assert error(sums_at_whole_lines(angle, rows, highest), exact) < allowed
    monkeypatch.setattr(uneven_sums, "finufft", None)
    monkeypatch.setattr(uneven_sums, "_AT_ONCE", 1 + count // 3)
    assert error(sums_at_whole_lines(angle, rows, highest), exact) < allowed


def test_sums_at_any_lines_are_those_of_finufft(monkeypatch):
    pytest.importorskip("finufft")
    angle, rows = case(2, 4000, 5.0)
    lines = 50.5 * np.arange(1.0, 40.0)
    by_finufft = sums_at_lines(angle, rows, lines)
    monkeypatch.setattr(uneven_sums, "finufft", None)
    assert error(sums_at_lines(angle, rows, lines), by_finufft) < 10.0 * SUM_ERROR


def test_the_sum_of_one_wave_is_closed_form():
    """Of a wave at evenly spaced angles all sums vanish but its own."""
    angle = 2.0 * np.pi * np.arange(64) / 64
    sums = spread_sums(angle, np.exp(-3j * angle)[None], 10)[0]
    assert sums[13] == pytest.approx(64.0, rel=1e-12)
    assert np.delete(sums, 13) == pytest.approx(0.0, abs=1e-10)
