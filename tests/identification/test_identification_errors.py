"""Error statistics: planted outliers, correlations and distributions are found; SciPy agrees."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from experiments.paper.bench.prototypes import draw_prototypes, plant_outliers, repeat_measurements
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.identification import (
    NormalSample,
    detectable_correlation,
    draw_errors,
    error_statistics,
    find_outliers,
    largest_deviation,
)
from pymoo_hdte.identification.error_samples import holm
from pymoo_hdte.identification.outliers import mean_of_valid

SYMBOLS = tuple(f"e{number}" for number in range(13))
MEANS, STDS = np.linspace(4.0, 10.0, 13), np.linspace(0.6, 1.7, 13)
NOISE = 0.3


def campaign(rng, correlation=None, n_prototypes=20):
    truth = draw_prototypes(MEANS, STDS, n_prototypes, rng, correlation)
    return truth, repeat_measurements(truth, NOISE, 10, rng)


def independent_campaign(rng):
    """The first campaign in which no correlation is significant."""
    results = (error_statistics(campaign(rng)[1], SYMBOLS) for _ in range(20))
    return next(result for result in results if result.independent)


def consistent(successes, trials, rate):
    """Whether a one-sided exact binomial test at 1 % keeps the hypothesis of at least this rate."""
    return stats.binomtest(successes, trials, rate, "less").pvalue >= 0.01


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=12))
def test_no_reading_can_deviate_further_than_the_bound(readings):
    values = np.array(readings)
    deviation = np.abs(values - values.mean()).max()
    assert deviation <= largest_deviation(len(values)) * values.std(ddof=1) * (1 + 1e-9) + 1e-9


def test_the_bound_is_attained_by_one_outlier_and_lies_below_three_for_ten():
    values = np.array([0.0] * 9 + [1e6])
    attained = (values.max() - values.mean()) / values.std(ddof=1)
    assert attained == pytest.approx(largest_deviation(10))
    assert largest_deviation(10) < 3.0 < largest_deviation(11)


def test_planted_outliers_are_found_and_good_readings_kept(rng):
    found = planted_in_all = lost = good = 0
    for _ in range(20):
        _, readings = campaign(rng)
        spoilt, planted = plant_outliers(readings, 26, 2.0, rng)
        rejected = find_outliers(spoilt)
        found += np.count_nonzero(rejected & planted)
        planted_in_all += np.count_nonzero(planted)
        lost += np.count_nonzero(rejected & ~planted)
        good += np.count_nonzero(~planted)
    # 2.0 um are 6.7 sigma: the chance to fall within 3 is 2e-4.
    assert consistent(found, planted_in_all, 0.999)
    assert stats.binomtest(lost, good, 2.0 * stats.norm.sf(3.0)).pvalue >= 0.01


def test_two_gross_outliers_in_one_cell_take_no_good_reading_along(rng):
    _, readings = campaign(rng)
    readings[4, 7, :2] += [30.0, 40.0]
    rejected = find_outliers(readings)
    assert rejected[4, 7, :2].all()
    np.testing.assert_allclose(rejected[4, 7].sum(), 2, atol=1)
    assert rejected.sum() < 30
    mean = mean_of_valid(readings, rejected)[4, 7]
    assert mean == pytest.approx(readings[4, 7][~rejected[4, 7]].mean(), rel=1e-14)


def test_outliers_do_not_depend_on_unit_or_order_and_input_stays(rng):
    _, readings = campaign(rng)
    readings, _ = plant_outliers(readings, 26, 2.0, rng)
    before = readings.copy()
    rejected = find_outliers(readings)
    np.testing.assert_array_equal(readings, before)
    np.testing.assert_array_equal(find_outliers(1e-6 * readings), rejected)
    np.testing.assert_array_equal(find_outliers(readings[::-1, :, ::-1]), rejected[::-1, :, ::-1])


def test_exact_readings_have_no_outliers():
    assert not find_outliers(np.ones((4, 2, 5))).any()


def test_wild_readings_are_refused(rng):
    readings = repeat_measurements(np.zeros((40, 1)), 1e-3, 10, rng)
    readings[3, 0] += np.array([-500, 400, -300, 200, -100, 0, 1e2, 2e2, -3e2, 4e2])
    with pytest.raises(InvalidInput, match=r"valid repeats of measurements\[3, 0\]"):
        find_outliers(readings)


def test_statistics_are_those_of_scipy(rng):
    _, readings = campaign(rng)
    result = error_statistics(readings, SYMBOLS)
    for index, column in enumerate(result.values.T):
        test = stats.shapiro(column)
        assert (result.shapiro_w[index], result.shapiro_p[index]) == (test.statistic, test.pvalue)
        sample = result.samples[index]
        assert sample.mean == pytest.approx(column.mean(), rel=1e-14)
        assert sample.std == pytest.approx(stats.tstd(column), rel=1e-14)
        expected = stats.t.interval(0.95, 19, column.mean(), stats.sem(column))
        assert sample.mean_interval() == pytest.approx(expected, rel=1e-12)
        for other in range(index):
            pearson = stats.pearsonr(column, result.values[:, other])
            assert result.correlation[index, other] == pytest.approx(pearson.statistic, rel=1e-12)
            assert result.correlation_p[index, other] == pytest.approx(pearson.pvalue, rel=1e-9)
    np.testing.assert_array_equal(np.diag(result.correlation_p), 1.0)


def test_intervals_cover_the_truth_on_200_campaigns(rng):
    covered = {"mean": 0, "std": 0}
    for _ in range(200):
        _, readings = campaign(rng)
        sample = error_statistics(readings[:, :2], SYMBOLS[:2]).samples[0]
        low, high = sample.mean_interval()
        covered["mean"] += low <= MEANS[0] <= high
        low, high = sample.std_interval()
        # Averages of ten readings still hold a tenth of the noise variance.
        covered["std"] += low <= (STDS[0] ** 2 + NOISE**2 / 10) ** 0.5 <= high
    assert consistent(covered["mean"], 200, 0.95)
    assert consistent(covered["std"], 200, 0.95)


def test_standard_error_of_the_std_is_that_of_normal_samples(rng):
    stds = rng.standard_normal((20_000, 20)).std(axis=1, ddof=1)
    sample = NormalSample(20, 0.0, 1.0)
    assert stds.std() == pytest.approx(sample.std_error, rel=0.03)


@pytest.mark.nightly
def test_a_planted_correlation_is_found_on_200_campaigns(rng):
    matrix = np.eye(13)
    matrix[2, 9] = matrix[9, 2] = 0.92
    found = alarms = 0
    for _ in range(200):
        pairs = error_statistics(campaign(rng, matrix)[1], SYMBOLS).correlated_pairs
        found += (2, 9) in pairs
        alarms += any(pair != (2, 9) for pair in pairs)
    assert consistent(found, 200, 0.98)
    assert consistent(200 - alarms, 200, 0.95)


def test_holm_asks_less_of_each_further_p_value_and_keeps_their_order():
    # Times 4, 3, 2 and 1 from the smallest on, and never below the one before.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]).tolist() == [1.0, 1.0]


def test_false_alarms_keep_to_five_per_cent_of_campaigns(rng):
    normal = independent = 0
    for _ in range(200):
        result = error_statistics(campaign(rng)[1], SYMBOLS)
        normal += set(result.marginals) == {"normal"}
        independent += result.independent
    assert consistent(normal, 200, 0.95)
    assert consistent(independent, 200, 0.95)


def test_the_detectable_correlation_is_where_the_largest_pair_turns_significant():
    limit = detectable_correlation(20, 13)
    statistic = limit * (18 / (1 - limit**2)) ** 0.5
    assert 2 * stats.t.sf(statistic, 18) * 78 == pytest.approx(0.05, rel=1e-9)


def test_advice_says_what_fails_and_what_to_use(rng):
    truth = draw_prototypes(np.full(13, 5.0), np.full(13, 0.5), 200, rng)
    truth[:, 1] = np.exp(rng.normal(0.0, 1.0, 200))
    truth[:, 2] = rng.choice([1.0, 9.0], 200) + rng.normal(0.0, 0.1, 200)
    truth[:, 4] = truth[:, 3] + 0.1 * rng.standard_normal(200)
    result = error_statistics(repeat_measurements(truth, 1e-3, 10, rng), SYMBOLS)
    assert result.marginals[:4] == ("normal", "lognormal", "empirical", "normal")
    assert (3, 4) in result.correlated_pairs
    advice = "\n".join(result.advice())
    assert "e1 is not normal, its logarithm is" in advice
    assert "e2 is neither normal nor lognormal" in advice
    assert "e3 and e4 are correlated (+0.98): draw the errors jointly" in advice


def test_advice_on_good_data_says_what_was_not_shown(rng):
    advice = independent_campaign(rng).advice()
    assert "below 0.70: independence remains an assumption" in advice[-1]


def test_draws_follow_marginals_and_correlation(rng):
    matrix = np.eye(13)
    matrix[0, 5] = matrix[5, 0] = -0.95
    truth, _ = campaign(rng, matrix)
    truth[:, 12] = np.exp(rng.normal(0.0, 1.5, 20))
    truth[:, 11] = np.where(np.arange(20) % 2, 1.0, 9.0) + 1e-3 * rng.standard_normal(20)
    result = error_statistics(repeat_measurements(truth, 1e-6, 10, rng), SYMBOLS)
    assert result.marginals[10:] == ("normal", "empirical", "lognormal")
    drawn = draw_errors(result, 20_000, rng)
    for sample, column in zip(result.samples[:11], drawn.T, strict=False):
        truncated = stats.truncnorm(-3, 3, sample.mean, sample.std)
        assert stats.kstest(column, truncated.cdf).pvalue > 1e-4
    assert set(drawn[:, 11]) == set(result.values[:, 11])
    assert drawn[:, 12].min() > 0.0
    correlation = np.corrcoef(drawn[:, :11], rowvar=False)
    np.testing.assert_allclose(correlation, result.correlation[:11, :11], atol=0.03)


def test_draws_are_independent_where_nothing_else_is_shown(rng):
    drawn = draw_errors(independent_campaign(rng), 20_000, rng)
    correlation = np.corrcoef(drawn, rowvar=False) - np.eye(13)
    assert np.abs(correlation).max() < 5 / 20_000**0.5


@pytest.mark.parametrize(
    ("shape", "symbols", "message"),
    [
        ((3, 2, 10), ("a", "b"), "number of prototypes is 3, allowed: at least 4"),
        ((4, 2, 2), ("a", "b"), "number of repeats is 2, allowed: at least 3"),
        ((4, 2, 10), ("a", "a"), "symbols is .*2 different names"),
        ((4, 2), ("a", "b"), "shape of measurements"),
    ],
)
def test_bad_measurements_are_named(shape, symbols, message, rng):
    with pytest.raises(InvalidInput, match=message):
        error_statistics(rng.standard_normal(shape), symbols)


def test_bad_values_are_named(rng):
    readings = rng.standard_normal((4, 2, 10))
    readings[1, 0, 3] = np.nan
    with pytest.raises(InvalidInput, match=r"measurements\[1, 0, 3\] is nan"):
        error_statistics(readings, "ab")
    with pytest.raises(InvalidInput, match=r"values of a is 1.0, allowed: prototypes that differ"):
        error_statistics(np.ones((4, 2, 10)), "ab")


@pytest.mark.parametrize(
    ("correlation", "message"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], "negative eigenvalues"),
        ([[1.0, 0.1], [0.2, 1.0]], "symmetric"),
        ([[1.0]], "shape of correlation"),
    ],
)
def test_bad_correlations_are_named(correlation, message, rng):
    with pytest.raises(InvalidInput, match=message):
        draw_prototypes([1.0, 2.0], [1.0, 1.0], 5, rng, correlation)


def test_too_many_outliers_are_named(rng):
    with pytest.raises(InvalidInput, match="count is 9, allowed: at most 8"):
        plant_outliers(rng.standard_normal((4, 2, 10)), 9, 1.0, rng)
