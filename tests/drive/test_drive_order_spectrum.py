"""Peak-to-peak of sums of orders: closed forms, brute force, symmetries."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import OrderSpectrum

RATIO = 101.0
phasor = st.builds(
    lambda amplitude, phase: amplitude * np.exp(1j * phase),
    st.floats(0.0, 5.0),
    st.floats(0.0, 2 * np.pi),
)


def brute_force(spectrum: OrderSpectrum, ratio: float, points: int) -> np.ndarray:
    signal = spectrum.at(np.linspace(0.0, 2 * np.pi * ratio, int(points * ratio) + 1))
    return signal.max(axis=1) - signal.min(axis=1)


def test_one_sinusoid_has_twice_its_amplitude():
    spectrum = OrderSpectrum(np.array([2.0]), np.array([[3.0 * np.exp(0.7j)]]))
    assert spectrum.peak_to_peak(RATIO)[0] == pytest.approx(6.0, rel=1e-14)


def test_sum_of_first_and_second_harmonic_in_closed_form():
    # cos x + a cos 2x has its maximum 1 + a at 0 and, for a > 1/4, its minimum -a - 1/(8a).
    a = 0.6
    spectrum = OrderSpectrum(np.array([1.0, 2.0]), np.array([[1.0, a]], dtype=complex))
    assert spectrum.peak_to_peak(RATIO)[0] == pytest.approx(1 + 2 * a + 1 / (8 * a), rel=1e-13)


def test_extremes_on_the_ends_of_the_turn_count():
    # A half order falls from 1 to -1 over a turn of ratio 1 without an extreme inside.
    spectrum = OrderSpectrum(np.array([0.5]), np.array([[1.0 + 0j]]))
    assert spectrum.peak_to_peak(1.0)[0] == pytest.approx(2.0, rel=1e-12)


def test_constant_lines_do_not_count():
    spectrum = OrderSpectrum(np.array([0.0]), np.array([[7.0 + 0j], [1.0 + 0j]]))
    assert spectrum.peak_to_peak(RATIO).tolist() == [0.0, 0.0]


@settings(max_examples=40, deadline=None)
@given(st.lists(phasor, min_size=4, max_size=4))
@example([0j, 5e-324 + 0j, 5e-324 + 0j, 0j])
def test_never_below_and_barely_above_a_dense_grid(phasors):
    spectrum = OrderSpectrum(np.array([1.0, 2.0, 2.02, 4.02]), np.array([phasors]))
    exact = spectrum.peak_to_peak(RATIO)[0]
    points = 400
    grid = brute_force(spectrum, RATIO, points)[0]
    curvature = np.abs(phasors) @ spectrum.orders**2
    rounding = 1e-9 * (1.0 + np.abs(phasors).sum())
    assert grid <= exact + rounding
    assert exact <= grid + curvature * (2 * np.pi / points) ** 2 / 4 + rounding


@settings(max_examples=30, deadline=None)
@given(st.lists(phasor, min_size=3, max_size=3), st.floats(0.0, 6.0), st.floats(0.1, 10.0))
def test_shift_scale_and_sign_leave_the_shape(phasors, shift, scale):
    orders = np.array([1.0, 2.0, 4.0])
    original = OrderSpectrum(orders, np.array([phasors])).peak_to_peak(RATIO)
    moved = -scale * np.array([phasors]) * np.exp(1j * orders * shift)
    assert OrderSpectrum(orders, moved).peak_to_peak(RATIO) == pytest.approx(
        scale * original, rel=1e-9, abs=1e-9
    )


def test_result_does_not_depend_on_the_company_of_other_rows(rng):
    orders = np.array([1.0, 2.0, 2.02])
    phasors = rng.normal(size=(70, 3)) + 1j * rng.normal(size=(70, 3))
    together = OrderSpectrum(orders, phasors).peak_to_peak(RATIO)
    alone = [OrderSpectrum(orders, row[None]).peak_to_peak(RATIO)[0] for row in phasors]
    assert together == pytest.approx(alone, rel=1e-12)


def test_lines_of_opposite_sign_fold_into_one_amplitude():
    # 2 exp(ix) + 1j exp(-ix) has the real part of (2 - 1j) exp(ix).
    spectrum = OrderSpectrum(np.array([1.0, -1.0, 0.0]), np.array([[2.0, 1j, -3.0]]))
    amplitudes = spectrum.amplitudes()
    assert list(amplitudes) == [0.0, 1.0]
    assert amplitudes[1.0][0] == pytest.approx(5**0.5)
    assert amplitudes[0.0][0] == 3.0


def test_wrong_shapes_are_refused():
    with pytest.raises(InvalidInput, match="shape of phasors"):
        OrderSpectrum(np.array([1.0, 2.0]), np.zeros((3, 1), dtype=complex))


@settings(max_examples=40, deadline=None)
@given(st.lists(phasor, min_size=4, max_size=4), st.floats(0.3, 3.7))
def test_turns_that_end_between_grid_points_lose_nothing(phasors, ratio):
    spectrum = OrderSpectrum(np.array([0.5, -0.3, 1.7, 2.02]), np.array([phasors]))
    exact = spectrum.peak_to_peak(ratio)[0]
    fine = spectrum.at(np.linspace(0.0, 2 * np.pi * ratio, 20_001))[0]
    grid = fine.max() - fine.min()
    step = 2 * np.pi * ratio / 20_000
    curvature = np.abs(phasors) @ spectrum.orders**2
    rounding = 1e-9 * (1.0 + np.abs(phasors).sum())
    assert -rounding <= exact - grid <= curvature * step**2 / 4 + rounding


def test_lines_that_are_not_finite_are_refused():
    with pytest.raises(InvalidInput, match="phasors"):
        OrderSpectrum(np.array([1.0]), np.array([[np.nan + 0j]]))
