"""Test points and error measures."""

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import Box, accuracy, latin_hypercube

BOX = Box(("a", "b", "c"), (0, -5, 1e-5), (1, 5, 3e-5))


def test_every_slice_of_every_variable_holds_one_point():
    points = latin_hypercube(BOX, 500, 0)
    slices = np.floor((points - BOX.lower) / (BOX.upper - BOX.lower) * 500).astype(int)
    for column in slices.T:
        assert np.array_equal(np.sort(column), np.arange(500))


def test_a_seed_and_a_generator_of_that_seed_give_the_same_points():
    by_seed = latin_hypercube(BOX, 30, 0)
    by_generator = latin_hypercube(BOX, 30, np.random.default_rng(0))
    assert by_seed.tobytes() == by_generator.tobytes()
    assert by_seed.tobytes() != latin_hypercube(BOX, 30, 1).tobytes()


@pytest.mark.parametrize(("n", "seed"), [(0, 0), (2.5, 0), (3, -1), (3, None), (3, 0.5)])
def test_no_points_and_no_seeds_are_refused(n, seed):
    with pytest.raises(InvalidInput):
        latin_hypercube(BOX, n, seed)


def test_measures_of_a_case_done_by_hand():
    measures = accuracy(predicted=[1.0, 5.0, 9.0], actual=[2.0, 4.0, 12.0])
    assert measures.mae == pytest.approx(5 / 3)
    assert measures.rmse == pytest.approx(np.sqrt(11 / 3))
    assert measures.mape_percent == pytest.approx(100 * (1 / 2 + 1 / 4 + 1 / 4) / 3)
    assert measures.max_error == 3.0
    assert measures.r2 == pytest.approx(1 - 11 / 56)


def test_perfect_and_constant_predictions():
    actual = np.array([-1.0, 2.0, 5.0])
    assert accuracy(actual, actual).r2 == 1.0
    assert accuracy(actual, actual).max_error == 0.0
    assert accuracy([2.0, 2.0, 2.0], actual).r2 == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("predicted", "actual"),
    [
        ([1.0], [1.0, 2.0]),
        ([[1.0, 2.0]], [1.0, 2.0]),
        ([1.0, np.nan], [1.0, 2.0]),
        ([1.0, 2.0], [1.0, 0.0]),
        ([1.0, 2.0], [3.0, 3.0]),
        ([1.0], [1.0]),
        ([], []),
    ],
)
def test_measures_that_would_mean_nothing_are_refused(predicted, actual):
    with pytest.raises(InvalidInput):
        accuracy(predicted, actual)
