"""Eqs. (1) and (2): against a direct sum over Table 1, and against expectation in closed form."""

import numpy as np
import pytest
from scipy import stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import class_amplitudes, hs_20_100, preset, sample_static_error
from pymoo_hdte.drive.static_error import TRUNCATION
from pymoo_hdte.units import ARCSEC

SLOW = ("e_m", "e_g", "e_w", "e_p")


def test_spectrum_equals_the_sum_over_table_1(rng):
    sheet = hs_20_100()
    sample = sample_static_error(sheet, 3, rng)
    angle = np.linspace(0.0, 40.0, 200)
    motion = np.zeros((3, len(angle)))
    for index, source in enumerate(sheet.error_sources):
        order = sheet.error_orders[source.error_class]
        projection = 0.5 if source.error_class in ("e_p", "e_h") else np.cos(np.pi / 9)
        argument = order * angle + sample.phases[:, index, None]
        motion += sample.magnitudes[:, index, None] * 1e6 * np.sin(argument) * projection
    arcsec = 0.9 / np.sqrt(50) * motion * 412.8 / 51.348
    assert sample.spectrum().at(angle) / ARCSEC == pytest.approx(arcsec, abs=1e-9)


def test_errors_are_truncated_normal_and_phases_uniform(rng):
    sheet = hs_20_100()
    sample = sample_static_error(sheet, 4000, rng)
    means = np.array([source.mean for source in sheet.error_sources])
    stds = np.array([source.std for source in sheet.error_sources])
    standard = (sample.magnitudes - means) / stds
    assert np.abs(standard).max() <= TRUNCATION * (1.0 + 1e-9)
    truncated = stats.truncnorm(-TRUNCATION, TRUNCATION)
    for column in range(13):
        assert stats.kstest(standard[:, column], truncated.cdf).pvalue > 1e-4
        uniform = sample.phases[:, column] / (2 * np.pi)
        assert stats.kstest(uniform, "uniform").pvalue > 1e-4
    correlation = np.corrcoef(np.hstack([standard, sample.phases]).T) - np.eye(26)
    assert np.abs(correlation).max() < 5 / np.sqrt(4000)


def test_class_resultants_have_the_expected_mean_square(rng):
    sheet = hs_20_100()
    sample = sample_static_error(sheet, 40_000, rng)
    shrink = stats.truncnorm(-TRUNCATION, TRUNCATION).var()
    for name, amplitude in class_amplitudes(sheet).items():
        members = [source for source in sheet.error_sources if source.error_class == name]
        mean_square = sum(source.mean**2 for source in members)
        scatter = shrink * sum(source.std**2 for source in members)
        expected = amplitude**2 * (1.0 + scatter / mean_square)
        squares = np.abs(sample.class_phasor(name)) ** 2
        error = squares.std() / np.sqrt(len(squares))
        assert abs(squares.mean() - expected) < 4 * error


def test_published_preset_takes_its_error_from_table_2(rng):
    sheet = hs_20_100()
    amplitudes = class_amplitudes(sheet)
    by_order = [amplitudes["e_w"], amplitudes["e_m"] + amplitudes["e_p"], amplitudes["e_g"]]
    error = preset("published").kinematic_error
    assert error.amplitudes == pytest.approx(np.array(by_order) / by_order[1], rel=1e-5)
    values = sample_static_error(sheet, 4000, rng).peak_to_peak(SLOW)
    variation = values.std() / values.mean()
    printed = error.std / sheet.nominal.static_error
    assert abs(variation - printed) < 4 * variation * np.sqrt((0.5 + variation**2) / len(values))


def test_the_tooth_order_adds_at_most_twice_its_amplitude(rng):
    sample = sample_static_error(hs_20_100(), 3, rng)
    added = sample.peak_to_peak() - sample.peak_to_peak(SLOW)
    tooth = 2.0 * np.abs(sample.class_phasor("e_h"))
    assert np.all(added <= tooth)
    assert np.all(added >= 0.98 * tooth)


def test_bad_input_is_named(rng):
    with pytest.raises(InvalidInput, match="n_samples is 0"):
        sample_static_error(hs_20_100(), 0, rng)
    with pytest.raises(InvalidInput, match="error_class is 'x'"):
        sample_static_error(hs_20_100(), 1, rng).class_phasor("x")
    with pytest.raises(InvalidInput, match="error class is 'x'"):
        sample_static_error(hs_20_100(), 1, rng).spectrum(("e_m", "x"))
    with pytest.raises(InvalidInput, match="classes"):
        sample_static_error(hs_20_100(), 1, rng).spectrum(())
