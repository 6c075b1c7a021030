"""Validation metrics: the paper's printed numbers, simulation, and independent formulas."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.validation import validation_metrics

MEASURED = np.array([90.0, 85.0, 100.0, 110.0, 82.0])


def errors_of(mean, rmse):
    """Five errors with this mean and root mean square."""
    shape = stats.zscore(np.array([1.0, -2.0, 0.5, 0.2, 0.3]))
    return mean + np.sqrt(rmse**2 - mean**2) * shape


def test_the_papers_interval_follows_from_its_mean_error_and_rmse():
    metrics = validation_metrics(MEASURED + errors_of(-7.761, 7.968), MEASURED)
    assert metrics.mean_error == pytest.approx(-7.761)
    assert metrics.rmse == pytest.approx(7.968)
    assert metrics.mae == pytest.approx(7.761)
    # Three roundings, of mean, RMSE and interval, meet here.
    assert metrics.mean_error_interval == pytest.approx((-10.265, -5.257), abs=0.003)
    assert metrics.n == 5


def test_the_interval_is_the_one_of_the_t_test(rng):
    predicted = MEASURED + rng.normal(-3.0, 5.0, 5)
    test = stats.ttest_1samp(predicted - MEASURED, 0.0)
    expected = test.confidence_interval(0.95)
    metrics = validation_metrics(predicted, MEASURED)
    assert metrics.mean_error_interval == pytest.approx((expected.low, expected.high), rel=1e-12)


def test_the_interval_covers_the_true_bias_in_95_percent_of_campaigns(rng):
    measured = rng.normal(95.0, 9.0, (2000, 5))
    covered = 0
    for truth in measured:
        low, high = validation_metrics(truth + rng.normal(-2.0, 1.8, 5), truth).mean_error_interval
        covered += low <= -2.0 <= high
    assert stats.binomtest(covered, len(measured), 0.95).pvalue > 0.01


@given(st.lists(st.floats(-50.0, 50.0), min_size=5, max_size=5), st.floats(-10.0, 10.0))
def test_a_shift_of_all_predictions_moves_the_mean_error_and_its_interval(errors, shift):
    before = validation_metrics(MEASURED + errors, MEASURED)
    after = validation_metrics(MEASURED + errors + shift, MEASURED)
    assert after.mean_error == pytest.approx(before.mean_error + shift, abs=1e-9)
    moved = np.array(before.mean_error_interval) + shift
    assert after.mean_error_interval == pytest.approx(moved, abs=1e-9)
    assert before.rmse >= abs(before.mean_error) - 1e-9
    assert before.max_error >= before.mae - 1e-9


def test_a_perfect_prediction_has_no_error():
    metrics = validation_metrics(MEASURED, MEASURED)
    assert (metrics.mean_error, metrics.mean_error_interval) == (0.0, (0.0, 0.0))
    assert (metrics.r2, metrics.mae, metrics.max_error, metrics.mape_percent) == (1.0, 0, 0, 0)


@pytest.mark.parametrize(
    ("predicted", "measured", "field"),
    [
        ([1.0, 2.0], [1.0, float("nan")], r"measured\[1\]"),
        ([1.0], [1.0, 2.0], "shape of predicted"),
        ([1.0], [1.0], "actual"),
        ([1.0, 2.0], [0.0, 1.0], r"actual\[0\]"),
    ],
)
def test_what_cannot_be_compared_is_refused(predicted, measured, field):
    with pytest.raises(InvalidInput, match=field):
        validation_metrics(predicted, measured)
