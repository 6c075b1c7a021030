"""Tables 2 and 3: the reasoning behind their findings, against SciPy and brute force."""

import numpy as np
import pytest
from night import others_at_night
from scipy import stats

from experiments.paper import later_prototypes, table2, table3
from experiments.paper.bench.campaign import draw_campaign, slope_error_per_noise, summaries
from experiments.paper.static_error import statistics as static_error_statistics
from experiments.paper.static_error.statistics import (
    READINGS,
    angle_ranges,
    components,
    of_component,
    outlier_counts,
    power,
    prototypes,
    prototypes_needed,
    sample_statistics,
    spoilt_readings,
    tooth_order_error,
)
from experiments.paper.static_error.tables import (
    pooled_rejection_rate,
    possible_sizes,
    shapiro_p,
)
from experiments.published_values import TABLE_2, TABLE_3, TABLE_6
from experiments.runner.registry import Context
from pymoo_hdte._comparing.statistics import at_least
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.identification import detectable_correlation
from pymoo_hdte.units import ARCSEC


@pytest.mark.parametrize("n", [12, 20, 200, 1000])
def test_p_of_a_statistic_is_scipy_s(n, rng):
    for values in (rng.standard_normal(n), rng.exponential(size=n)):
        test = stats.shapiro(values)
        assert shapiro_p(test.statistic, n) == pytest.approx(test.pvalue, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("n", others_at_night([20, 200], 20))
def test_the_true_size_is_among_the_possible_ones(n, rng):
    for _ in range(5):
        test = stats.shapiro(rng.standard_normal(n))
        low, high = possible_sizes(round(test.statistic, 3), round(test.pvalue, 3))
        assert low <= n <= high


@pytest.mark.nightly
def test_the_printed_tests_fit_200_values_and_not_20():
    sizes = [possible_sizes(row.shapiro_w, row.shapiro_p) for row in TABLE_2.values()]
    assert all(low <= 200 <= high for low, high in sizes)
    assert all(low > 100 for low, _ in sizes)


def test_pooling_is_harmless_only_if_the_prototypes_hardly_differ(rng):
    assert pooled_rejection_rate(100.0, 300, rng) < 0.1
    assert pooled_rejection_rate(0.1, 50, rng) > 0.9


def test_printed_tables_are_those_of_the_data_sheet():
    sheet = hs_20_100()
    for source in sheet.error_sources:
        row = TABLE_2[source.symbol]
        assert (row.mean_um, row.std_um) == pytest.approx((source.mean * 1e6, source.std * 1e6))
    nominal = sheet.nominal
    printed = (nominal.input_damping, nominal.mesh_damping, nominal.output_damping)
    assert tuple(row.mean for row in TABLE_3.values()) == printed
    for row in TABLE_3.values():
        assert 100 * row.std / row.mean == pytest.approx(row.cv_percent, abs=0.03)


def test_the_plain_rule_finds_nothing_and_the_pooled_one_all(rng):
    lost = good = 0
    for _ in range(10):
        plain, pooled = outlier_counts(*spoilt_readings(rng)).values()
        assert (plain.found, plain.lost) == (0, 0)
        assert pooled.found == pooled.planted == 26
        lost, good = lost + pooled.lost, good + pooled.good
    assert at_least(good - lost, good, 0.9973)


@pytest.mark.parametrize("correlation", [0.5, 0.8])
def test_power_is_that_of_simulated_pairs(correlation, rng):
    first, noise = rng.standard_normal((2, 4000, 20))
    second = correlation * first + (1 - correlation**2) ** 0.5 * noise
    first = first - first.mean(axis=1, keepdims=True)
    second = second - second.mean(axis=1, keepdims=True)
    r = (first * second).sum(axis=1) / np.sqrt((first**2).sum(axis=1) * (second**2).sum(axis=1))
    found = np.mean(np.abs(r) > detectable_correlation(20, 13))
    assert power(correlation, 20) == pytest.approx(found, abs=0.04)
    needed = prototypes_needed(correlation)
    assert power(correlation, needed) >= 0.9 > power(correlation, needed - 1)


@pytest.fixture
def few(monkeypatch):
    """A handful of virtual prototypes."""
    monkeypatch.setattr(static_error_statistics, "N_SAMPLES", 20)
    return prototypes()


@pytest.mark.slow
def test_statistics_are_those_of_the_signal(few):
    found = sample_statistics(few)
    angle = np.linspace(0.0, 2 * np.pi * 101, 101 * 8000)
    one_turn = slice(0, 8001)
    amplitudes = [np.abs(few.class_phasor(name)) / ARCSEC for name in ("e_w", "e_g", "e_h")]
    amplitudes.append(np.abs(few.class_phasor("e_m") + few.class_phasor("e_p")) / ARCSEC)
    for row in range(3):
        signal = few.spectrum().at(angle)[row] / ARCSEC
        expected = {
            "peak-to-peak, output turn, with order 404": np.ptp(signal),
            "semi-amplitude, one input turn, with order 404": np.ptp(signal[one_turn]) / 2,
            "rms, with order 404": signal.std(),
            "sum of the order amplitudes, with order 404": sum(a[row] for a in amplitudes),
        }
        for name, value in expected.items():
            assert found[name][row] == pytest.approx(value, rel=2e-3)


def test_the_tooth_order_may_be_added_as_twice_its_amplitude(few):
    assert tooth_order_error(few) < 0.02


def test_readings_change_the_factor_as_they_say(few):
    ours, root, plain, one_phase = (
        sample_statistics(reading.sample(20.0, few))["rms"] for reading in READINGS
    )
    np.testing.assert_allclose(ours, sample_statistics(few)["rms"], rtol=1e-12)
    np.testing.assert_allclose(root, ours / 0.9**0.5, rtol=1e-12)
    np.testing.assert_allclose(plain, ours / 50**0.5, rtol=1e-12)
    assert np.all(one_phase > ours)
    sample = READINGS[3].sample(20.0, few)
    member = [source.error_class == "e_w" for source in few.sheet.error_sources]
    total = few.magnitudes[:, member].sum(axis=1)
    scale = 0.9 / 50**0.5 * 412.8 / 51.348 * 1e6 * np.cos(np.pi / 9)
    np.testing.assert_allclose(np.abs(sample.class_phasor("e_w")) / ARCSEC, scale * total)


def test_the_angle_that_gives_a_mean_is_found_again(few):
    reading = READINGS[0]
    at = sample_statistics(reading.sample(37.0, few))
    for name in ("peak-to-peak, output turn", "rms"):
        wanted = float(at[name].mean())
        found = angle_ranges(reading, few, wanted)[name]
        assert found.exact == pytest.approx(37.0, abs=0.05)
        assert found.low < 37.0 < found.high
    assert angle_ranges(reading, few, 1e3)["rms"] == static_error_statistics.AngleRange(*3 * [None])


def test_components_add_up_to_the_drive(few):
    names = components(few.sheet)
    assert names == ("FS", "CS", "WG", "FB")
    for error_class in ("e_m", "e_g", "e_w", "e_p", "e_h"):
        parts = sum(of_component(few, name).class_phasor(error_class) for name in names)
        np.testing.assert_allclose(parts, few.class_phasor(error_class), rtol=1e-12, atol=1e-20)


def test_a_campaign_s_damping_errors_are_those_of_least_squares(rng):
    records, _ = draw_campaign(rng)
    fits = records.fits()
    noise = {"B_in": 5e-4, "B_fc": 5e-4, "B_out": 2e-5}
    for name, std in noise.items():
        squares = np.mean([fit.slope_error**2 for fit in fits[name].values()])
        assert squares**0.5 == pytest.approx(std * slope_error_per_noise(name), rel=0.2)
        repeats = summaries(fits)[name].repeatability
        assert repeats == pytest.approx(std * slope_error_per_noise(name), rel=0.4)


@pytest.mark.parametrize("experiment", [pytest.param(table2, marks=pytest.mark.nightly), table3])
def test_experiments_run_and_their_own_checks_hold(experiment, few, monkeypatch, tmp_path):
    monkeypatch.setattr(experiment, "N_CAMPAIGNS", 8)
    first, second = (experiment.run(Context(1, tmp_path, Campaign(tmp_path))) for _ in range(2))
    checks = [finding for table in first.tables for finding in table.findings if finding.check]
    assert checks
    assert all(finding.agrees for finding in checks)
    assert repr(first.tables) == repr(second.tables)


def test_whether_later_prototypes_are_of_the_series_is_said_as_the_test_has_it(monkeypatch):
    (apart,) = later_prototypes.later_prototypes_table().findings
    assert not apart.agrees
    assert apart.sentence.endswith("they are not of the series that Table 3 describes.")
    means = {name: row.mean for name, row in TABLE_3.items()}
    alike = {
        number: prototype._replace(
            **{
                name: mean * (0.96 + 0.02 * place)
                for name, mean in means.items()
                if name != "B_out"
            }
        )
        for place, (number, prototype) in enumerate(TABLE_6.items())
    }
    monkeypatch.setattr(later_prototypes, "TABLE_6", alike)
    (finding,) = later_prototypes.later_prototypes_table().findings
    assert finding.agrees
    assert finding.sentence.endswith("nothing tells them from the series that Table 3 describes.")


def test_whether_b_out_needs_a_sensor_of_its_own_hangs_on_the_noise(monkeypatch):
    (finding,) = table3._resolution_table().findings
    assert not finding.agrees
    assert finding.sentence.endswith("so B_out needs one of its own.")
    coarse = TABLE_3 | {"B_out": TABLE_3["B_out"]._replace(std=1e3 * TABLE_3["B_out"].std)}
    monkeypatch.setattr(table3, "TABLE_3", coarse)
    (finding,) = table3._resolution_table().findings
    assert finding.agrees
    assert finding.sentence.endswith("which is enough.")
