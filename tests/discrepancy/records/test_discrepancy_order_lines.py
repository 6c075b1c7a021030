"""Order lines: planted lines come back, with the scatter that the covariance says."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, kstest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import Rig, RunningRecord, order_lines, residual_spectrum
from pymoo_hdte.discrepancy._records import line_basis
from pymoo_hdte.discrepancy._records.line_basis import averaging_gain
from pymoo_hdte.discrepancy._records.line_fit import row_covariance, unsteady_lines
from pymoo_hdte.units import ARCSEC

RATIO = 101.0
ORDERS = [1.0, 2.0, 2.02, 4.0, 6.0]
RIG = Rig(0.02, 0.5, 0.7 * ARCSEC, 0.003, 0.2, 0.3 * ARCSEC, 0.2 * ARCSEC)
SPEED = 600.0 * np.pi / 30.0
RATE = 200.0
N_ROWS = int(RATIO * 2.0 * np.pi / SPEED * RATE) + 1
TIME = np.arange(N_ROWS) / RATE
ANGLE = 40.0 + SPEED * TIME


def waves(phasors, orders, angle):
    """The real signal of phasors at these angles, shape (n_angles,)."""
    return np.real(np.exp(1j * np.outer(angle, orders)) @ phasors)


def record(error, input_torque, output_torque, angle=ANGLE, samples_averaged=1, speed=SPEED):
    return RunningRecord(
        name="run",
        role="train",
        input_speed=speed,
        load_torque=20.0,
        sample_rate=RATE,
        samples_averaged=samples_averaged,
        elapsed=0.0,
        time=TIME,
        input_angle=angle,
        output_angle=angle / RATIO - error,
        input_torque=input_torque,
        output_torque=output_torque,
    )


def noisy(rng, samples_averaged=1):
    """A record of nothing but the noise of the sensors, raw samples averaged and quantised."""
    raw = rng.standard_normal((4, N_ROWS, samples_averaged))
    angle = ANGLE[:, None] / RATIO + RIG.angle_noise * raw[:2]
    steps = np.round(angle / RIG.angle_quantisation)
    reading, output = RIG.angle_quantisation * steps.mean(axis=2)
    torques = raw[2:].mean(axis=2) * [[RIG.input_torque_noise], [RIG.output_torque_noise]]
    plain = record(reading - output, *torques, samples_averaged=samples_averaged)
    return replace(plain, input_angle=reading * RATIO, output_angle=output)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_planted_lines_come_back(rng, direction):
    planted = rng.normal(size=(3, 5)) + 1j * rng.normal(size=(3, 5))
    planted *= np.array([[1e-5], [0.02], [0.5]])
    angle = direction * ANGLE
    channels = [
        mean + slope * TIME + waves(phasors, ORDERS, angle)
        for mean, slope, phasors in zip((7e-4, 0.2, 20.0), (1e-7, 1e-3, 0.0), planted, strict=True)
    ]
    fitted = record(*channels, angle=angle, speed=direction * SPEED)
    lines = order_lines(fitted, RIG, RATIO, ORDERS)
    np.testing.assert_allclose(lines.phasors[:3], planted, rtol=1e-9)
    middle = TIME[-1] / 2.0
    np.testing.assert_allclose(
        lines.mean, [7e-4 + 1e-7 * middle, 0.2 + 1e-3 * middle, 20.0, angle.mean()], rtol=1e-9
    )
    np.testing.assert_allclose(
        lines.slope, [1e-7, 1e-3, 0.0, direction * SPEED], rtol=1e-6, atol=1e-10
    )


@pytest.mark.parametrize("place", range(len(line_basis.FADING)))
def test_what_fades_in_a_record_adds_to_its_mean_and_lines_as_stated(place):
    constant = line_basis.FADING[place] * TIME[-1]
    orders = [1.0 / RATIO, 2.0 / RATIO, *ORDERS]
    fading = 2e-5 * np.exp(-TIME / constant)
    lines = order_lines(record(fading, 0.2 + fading, 20.0 + fading), RIG, RATIO, orders)
    expected = 2e-5 * lines.fading[place]
    found = np.append(lines.mean[0], lines.phasors[0])
    assert found == pytest.approx(expected, abs=1e-9 * 2e-5)
    # Slow lines take up most of what the straight line leaves.
    assert np.abs(found[1:3]).max() > 3.0 * np.abs(found[3:]).max()


@pytest.mark.parametrize("wobble", [0.005, 0.02])
def test_a_line_that_makes_the_speed_vary_is_not_mixed_with_its_double(wobble):
    """Rows even in time are dense where the input is slow, so that the two are not orthogonal.

    Without the double the line is off by the wobble, times its order, of the double's size.
    """
    order, double = 4.0, 2e-3
    phasors = np.array([0.01, double], dtype=complex)
    angle = ANGLE.copy()
    for _ in range(40):
        angle = ANGLE + wobble * np.cos(order * angle)
    torque = waves(phasors, [order, 2.0 * order], angle)
    quiet = 1e-6 * np.sin(angle)
    lines = order_lines(record(quiet, 0.2 + torque, 20.0 + quiet, angle), RIG, RATIO, [1.0, order])
    found = lines.phasors[1, 1]
    assert abs(found - phasors[0]) < 1e-3 * wobble * order * double
    assert lines.orders.tolist() == [1.0, order]
    assert lines.covariance.shape == (4, 5, 5)


def test_speed_fluctuation_is_the_lines_of_the_input_angle():
    # theta = Omega t + eps cos(2 theta), solved for theta.
    phasor = 1e-3 * np.exp(0.4j)
    angle = ANGLE.copy()
    for _ in range(30):
        angle = ANGLE + waves([phasor], [2.0], angle)
    quiet = np.sin(ANGLE) * 1e-6
    lines = order_lines(record(quiet, 0.2 + quiet, 20.0 + quiet, angle), RIG, RATIO, ORDERS)
    expected = np.zeros(5, dtype=complex)
    expected[1] = phasor
    np.testing.assert_allclose(lines.phasors[3], expected, atol=1e-11)


def test_the_rates_of_a_slow_wander_have_no_lines_of_noise(rng):
    """Where rows are left out twice a turn, noise of 0.3 mrad was 30 rad/s2 at order 8."""
    pace = 2.0 * np.pi * 0.4
    noise = 101.0 * RIG.angle_noise
    steady = 40.0 + 61.3 * TIME
    angle = steady + 1e-3 * np.sin(pace * TIME) + noise * rng.standard_normal(N_ROWS)
    whole = record(1e-9 * TIME, TIME, TIME, angle=angle, speed=61.3)
    kept = np.cos(2.0 * steady) < 0.5
    rows = ("time", "input_angle", "output_angle", "input_torque", "output_torque")
    gaps = replace(whole, **{name: getattr(whole, name)[kept] for name in rows})
    orders = [2.0, 4.0, 6.0, 8.0]
    lines = order_lines(gaps, RIG, RATIO, orders)
    acceleration = -(pace**2) * 1e-3 * np.sin(pace * gaps.time)
    true = order_lines(replace(gaps, input_torque=acceleration), RIG, RATIO, orders).phasors[1]
    (_, of_acceleration), _ = unsteady_lines(gaps, RATIO, lines, np.zeros(4))
    assert of_acceleration == pytest.approx(true, abs=0.02)


@settings(max_examples=30, deadline=None)
@given(
    samples_averaged=st.integers(1, 60),
    order=st.floats(0.05, 9.0),
    phase=st.floats(-3.0, 3.0),
)
def test_averaging_of_raw_samples_is_undone(samples_averaged, order, phase):
    offsets = (np.arange(samples_averaged) + 0.5) / samples_averaged - 0.5
    raw_angle = ANGLE[:, None] + SPEED * offsets / RATE
    averaged = np.cos(order * raw_angle + phase).mean(axis=1)
    plain = record(1e-5 * averaged, averaged, averaged, samples_averaged=samples_averaged)
    lines = order_lines(plain, RIG, RATIO, [order])
    np.testing.assert_allclose(lines.phasors[1:3, 0], np.exp(1j * phase), rtol=1e-8)


def test_averaging_is_undone_where_the_input_moves_unevenly():
    """A fifth of its speed at order 2: a row averages the more of a line the faster it passes."""
    rows = np.arange(len(ANGLE)) / RATE
    offsets = ((np.arange(50) + 0.5) / 50.0 - 0.5) / RATE
    time = rows[:, None] + offsets
    angle = SPEED * time
    for _ in range(60):
        angle = SPEED * time + 0.1 * np.cos(2.0 * angle + 0.4)
    channel = np.cos(6.0 * angle + 1.0).mean(axis=1)
    uneven = replace(
        record(1e-5 * channel, channel, channel, samples_averaged=50),
        input_angle=angle.mean(axis=1),
    )
    lines = order_lines(uneven, RIG, RATIO, [2.0, 4.0, 6.0, 8.0])
    assert lines.phasors[1] == pytest.approx([0.0, 0.0, np.exp(1.0j), 0.0], abs=4e-3)
    assert lines.phasors[3, 0] == pytest.approx(0.1 * np.exp(0.4j), rel=1e-3)


@pytest.mark.parametrize("order", [13.0, 21.0, 64.0])
def test_what_averaging_folds_down_is_known_line_by_line(order):
    """Rows show up to ten cycles a turn, and the samples that they average six times as many."""
    offsets = (np.arange(6) + 0.5) / 6.0 - 0.5
    raw_angle = ANGLE[:, None] + SPEED * offsets / RATE
    orders = [1.0, 2.0, 4.0, 7.0, 1.0 / RATIO]
    shown = [np.cos(order * raw_angle).mean(axis=1), -np.sin(order * raw_angle).mean(axis=1)]
    plain = record(1e-5 * ANGLE, *shown, samples_averaged=6)
    lines = order_lines(plain, RIG, RATIO, orders, (order, 30.0))
    of_order = lines.folded[0]
    if order > 60.0:
        # Filtered away before the samples were taken.
        assert not np.any(of_order)
        return
    np.testing.assert_allclose(of_order[:, 0].real, lines.mean[1:3], atol=1e-10)
    np.testing.assert_allclose(of_order[:, 1:], lines.phasors[1:3], atol=1e-10)
    # 20 - 13 and 21 - 20 are among the analysed orders.
    size = averaging_gain([order], plain, SPEED) / averaging_gain([abs(20.0 - order)], plain, SPEED)
    place = 1 + orders.index(abs(20.0 - order))
    np.testing.assert_allclose(np.abs(of_order[:, place]), np.abs(size[0]), rtol=1e-3)


def test_averaging_gain_tends_to_that_of_a_continuous_mean():
    many = record(ANGLE * 1e-9, ANGLE, ANGLE, samples_averaged=10_000)
    orders = np.array([0.5, 3.0, 9.0])
    expected = np.sinc(orders * SPEED / (2.0 * np.pi) / RATE)
    np.testing.assert_allclose(averaging_gain(orders, many, SPEED), expected, rtol=1e-7)


def test_covariance_is_that_of_simulated_noise():
    rng = np.random.default_rng(7)
    orders, n = [1.0 / RATIO, 1.0, 2.0, 2.02], 300
    fits = [order_lines(noisy(rng, 4), RIG, RATIO, orders) for _ in range(n)]
    for channel in range(4):
        draws = np.array(
            [
                np.r_[fit.mean[channel], fit.phasors[channel].real, fit.phasors[channel].imag]
                for fit in fits
            ]
        )
        if channel == 3:
            draws[:, 0] -= ANGLE.mean()
        size = draws.shape[1]
        # Squared Mahalanobis norms add to a chi-square, the first entries alone as well.
        for kept in (slice(0, 1), slice(0, size)):
            inverse = np.linalg.inv(fits[0].covariance[channel][kept, kept])
            total = np.einsum("ni,ij,nj->", draws[:, kept], inverse, draws[:, kept])
            degrees = n * draws[:, kept].shape[1]
            assert chi2.ppf(0.005, degrees) < total < chi2.ppf(0.995, degrees)


def test_noise_of_the_angle_shows_where_a_line_is_steep():
    phasors = np.array([0.3, 0.5 - 0.2j, 2.0j])
    orders = np.array([1.0, 2.0, 6.0])
    torque = waves(phasors, orders, ANGLE)
    lines = order_lines(
        record(1e-9 * np.sin(ANGLE), 1e-9 * np.sin(ANGLE), torque), RIG, RATIO, orders
    )
    slope = waves(1j * orders * phasors, orders, ANGLE)
    quiet = row_covariance(RIG, RATIO, 1)
    added = np.diag(lines.row_covariance - quiet)
    assert added[2] == pytest.approx(np.mean(slope**2) * quiet[3, 3], rel=0.01)
    assert added[[0, 1]] == pytest.approx(0.0, abs=1e-12 * added[2])


def test_noise_of_the_input_encoder_is_shared_by_two_channels():
    rng = np.random.default_rng(8)
    fits = [order_lines(noisy(rng, 4), RIG, RATIO, [2.0]) for _ in range(300)]
    real = np.array([fit.phasors[:, 0].real for fit in fits])
    correlation = np.corrcoef(real.T)
    noise = row_covariance(RIG, RATIO, 4)
    expected = noise / np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
    np.testing.assert_allclose(correlation, expected, atol=0.2)
    assert expected[0, 3] == pytest.approx(np.sqrt(0.5))


def test_residual_spectrum_of_noise_is_exponential():
    rng = np.random.default_rng(9)
    orders, amplitudes = residual_spectrum(noisy(rng, 2), RIG, RATIO, ORDERS)
    assert orders[-1] < 10.0  # the Nyquist order of 200 Hz at 600 r/min
    for channel in amplitudes:
        assert kstest(channel**2, "expon").pvalue > 0.001


@pytest.mark.parametrize("ratio", [RATIO, RATIO - 0.63])
def test_residual_spectrum_is_what_a_line_removes_beside_those_of_the_fit(ratio):
    spoiled = noisy(np.random.default_rng(14))
    orders, amplitudes = residual_spectrum(spoiled, RIG, ratio, ORDERS)
    angle = spoiled.input_angle
    channels = [angle / ratio - spoiled.output_angle, spoiled.input_torque, spoiled.output_torque]
    sigma = np.sqrt(np.diag(row_covariance(RIG, ratio, 1)))
    known = np.outer(angle, ORDERS)
    fitted = np.column_stack([np.ones(N_ROWS), TIME, np.cos(known), np.sin(known)])

    def left(columns):
        squares = [np.linalg.lstsq(columns, one, rcond=None)[1][0] for one in channels]
        return np.array(squares) / sigma[:3] ** 2

    for place in (0, len(orders) // 3, len(orders) - 1):
        more = np.outer(angle, orders[place])
        removed = left(fitted) - left(np.column_stack([fitted, np.cos(more), np.sin(more)]))
        np.testing.assert_allclose(amplitudes[:3, place] ** 2, removed / 2.0, rtol=1e-6, atol=1e-6)


def test_residual_spectrum_shows_the_unlisted_line_only():
    clean = noisy(np.random.default_rng(11))
    strong = waves(np.full(5, 30.0 * RIG.output_torque_noise), ORDERS, ANGLE)
    hidden = 0.3 * RIG.output_torque_noise * np.cos(3.0 * ANGLE + 1.0)
    spoiled = replace(clean, output_torque=clean.output_torque + strong + hidden)
    orders, amplitudes = residual_spectrum(spoiled, RIG, RATIO, ORDERS)
    _, before = residual_spectrum(clean, RIG, RATIO, ORDERS)
    assert orders[np.argmax(amplitudes[2])] == pytest.approx(3.0)
    # 0.3 sigma sqrt(n / 4) in units of noise, give or take the noise itself.
    assert amplitudes[2].max() == pytest.approx(0.3 * np.sqrt(N_ROWS / 4.0), abs=2.0)
    away = np.abs(orders - 3.0) > 0.02
    np.testing.assert_allclose(amplitudes[2][away], before[2][away], atol=0.6)
    np.testing.assert_allclose(amplitudes[:2], before[:2], rtol=1e-12)
    assert not np.any(np.isclose(orders, 204 / RATIO))


def test_residual_spectrum_looks_at_whole_orders_of_the_input_and_of_the_output():
    spoiled = noisy(np.random.default_rng(12))
    hidden = 0.3 * RIG.output_torque_noise * np.cos(3.0 * ANGLE + 1.0)
    spoiled = replace(spoiled, output_torque=spoiled.output_torque + hidden)
    grids = {}
    for ratio in (RATIO, RATIO - 0.5, RATIO - 0.63):
        orders, amplitudes = residual_spectrum(spoiled, RIG, ratio, ORDERS)
        assert orders[np.argmax(amplitudes[2])] == pytest.approx(3.0, abs=1e-12)
        assert np.all(np.diff(orders) > 0.0)
        grids[ratio] = orders
    whole = [order for order in range(1, 10) if np.abs(np.array(ORDERS) - order).min() > 0.02]
    for ratio, orders in grids.items():
        of_output = np.abs(orders * ratio - np.round(orders * ratio)) < 1e-9
        of_input = np.abs(orders - np.round(orders)) < 1e-9
        assert np.all(of_output | of_input)
        assert np.round(orders[of_input]).tolist() == whole


@pytest.mark.parametrize("orders", [[0.0], [-1.0], [10.5], [np.nan], [2.0, 2.0], [2.0, 2.00001]])
def test_orders_out_of_reach_are_refused(orders, rng):
    with pytest.raises(InvalidInput, match="orders"):
        order_lines(noisy(rng), RIG, RATIO, orders)


def test_what_no_row_shows_is_refused():
    """A decay that has ended before the second row has a derivative of zero in all of them."""
    unsettled = replace(noisy(np.random.default_rng(3)), settling=1e-5)
    with pytest.raises(InvalidInput, match="orders"):
        order_lines(unsettled, RIG, RATIO, ORDERS)


def test_an_ill_conditioned_fit_keeps_its_digits():
    """A decay nearly as long as the record is a line with little curvature; angles are large."""
    far = record(*np.sin(np.outer([3.0, 4.0, 5.0], TIME)), angle=1e5 + ANGLE)
    far = replace(far, settling=0.8 * TIME[-1])
    fit = line_basis.LineFit.of(far, RATIO, ORDERS)
    unit = fit.triangle / np.linalg.norm(fit.triangle, axis=0)
    assert 500.0 < np.linalg.cond(unit) < line_basis.LARGEST_CONDITION
    # A straight line without any wave: what is beside it is an error of the fit.
    slope, waves_and_decay = fit.coefficients[1, 3], fit.coefficients[2:, 3]
    assert slope == pytest.approx(SPEED, rel=1e-9)
    assert np.abs(waves_and_decay).max() < 1e-7
    assert np.abs(fit.whole_residual[:, 3]).max() < 1e-9


def test_blocks_of_rows_give_the_lines_and_spectrum_of_all_rows(monkeypatch):
    rng = np.random.default_rng(8)
    whole = noisy(rng, 4)
    fits = [order_lines(whole, RIG, RATIO, ORDERS, [15.0, 30.0])]
    spectra = [residual_spectrum(whole, RIG, RATIO, ORDERS)]
    # The last block has fewer rows than the fit has columns.
    monkeypatch.setattr(line_basis, "ROWS_A_BLOCK", (len(whole.time) - 3) // 4)
    fits.append(order_lines(whole, RIG, RATIO, ORDERS, [15.0, 30.0]))
    spectra.append(residual_spectrum(whole, RIG, RATIO, ORDERS))
    # Rounding is relative to the rows, of which the input angle is many radians.
    largest = np.abs(fits[0].mean) + np.abs(fits[0].slope) * np.ptp(whole.time)
    for field in fields(fits[0]):
        one, other = (getattr(fit, field.name) for fit in fits)
        size = largest[:, None] if field.name == "phasors" else np.abs(one).max()
        assert np.all(np.abs(other - one) <= 1e-12 * size)
    np.testing.assert_array_equal(spectra[1][0], spectra[0][0])
    np.testing.assert_allclose(spectra[1][1], spectra[0][1], rtol=1e-7, atol=1e-9)
