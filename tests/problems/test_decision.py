"""Choice of a design, its tolerance band, and the distance of prototypes from it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia, deviation_degree, tolerance_band

# Table 9 of the paper: K in 1e4 N.m/rad; J_in in 1e-4 kg.m2; B_in, B_fc in 1e-4 N.m.s/rad.
ACCURACY_FIRST = (3.229, 1.496, 1.891, 4.968)

weights = st.floats(0.0, 1.0).map(lambda w: (w, 1.0 - w))
fronts = arrays(float, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(-1e3, 1e3))


def test_distance_on_a_quarter_circle_has_a_closed_form():
    angle = np.linspace(0.0, np.pi / 2, 9001)
    circle = np.column_stack([1.0 - np.cos(angle), 1.0 - np.sin(angle)])
    # The minimum of w1^2 (1 - cos a)^2 + w2^2 (1 - sin a)^2 with w1 = w2 lies at 45 degrees.
    assert angle[WeightedUtopia((0.5, 0.5)).do(circle)] == pytest.approx(np.pi / 4, abs=1e-4)


def test_distances_by_hand():
    F = np.array([[10.0, 5.0], [12.0, 3.0], [20.0, 1.0]])
    expected = [0.4, np.hypot(0.6 * 0.2, 0.4 * 0.5), 0.6]
    np.testing.assert_allclose(WeightedUtopia((0.6, 0.4)).distances(F), expected)


@pytest.mark.parametrize(("name", "chosen"), [("accuracy_first", 0), ("robustness_first", 2)])
def test_preferences_pull_to_their_own_end(name, chosen):
    F = np.array([[84.0, 15.6], [86.0, 15.5], [88.0, 15.4]])
    assert WeightedUtopia(PREFERENCES[name]).do(F) == chosen
    assert WeightedUtopia(PREFERENCES["balanced"]).do(F) == 1


def test_constant_objective_counts_as_zero():
    decision = WeightedUtopia((0.5, 0.5))
    np.testing.assert_array_equal(decision.distances([[1.0, 7.0], [3.0, 7.0]]), [0.0, 0.5])


def test_first_of_equals_is_chosen_and_single_row_works():
    decision = WeightedUtopia((0.5, 0.5))
    assert decision.do(np.array([[0.0, 1.0], [1.0, 0.0]])) == 0
    assert decision.do(np.array([4.0, 2.0])) == 0
    assert decision.do(np.empty((0, 2))) is None


def test_more_than_two_objectives():
    assert WeightedUtopia((0.2, 0.2, 0.6)).do(np.eye(3)) == 0
    assert WeightedUtopia((0.6, 0.2, 0.2)).do(np.eye(3)) == 1


@given(weights, fronts, st.floats(0.1, 10.0), st.floats(-100.0, 100.0))
def test_distance_does_not_depend_on_units(w, front, factor, shift):
    decision = WeightedUtopia(w)
    span = np.ptp(front, axis=0)
    if np.all((span == 0) | (span > 1e-3)):
        moved = front * [factor, 1.0] + [shift, 0.0]
        np.testing.assert_allclose(decision.distances(moved), decision.distances(front), atol=1e-6)


@given(weights, fronts)
def test_distances_are_bounded_by_the_weights(w, front):
    distances = WeightedUtopia(w).distances(front)
    assert np.all(distances >= 0.0)
    assert np.all(distances <= np.hypot(*w) + 1e-12)


@pytest.mark.parametrize(
    "bad",
    [
        (1.0,),
        (0.5, 0.6),
        (1.5, -0.5),
        (np.nan, 1.0),
        (0.5, 0.5 + 2e-9),
        "half",
        ((0.5, 0.5),),
        (1e308, 1e308),
    ],
)
def test_weights_are_checked(bad):
    with pytest.raises(InvalidInput, match="weights"):
        WeightedUtopia(bad)


def test_weights_may_miss_one_by_rounding():
    assert WeightedUtopia([0.1] * 10).weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("bad", [np.ones((3, 3)), np.array([[1.0, np.nan]])])
def test_front_is_checked(bad):
    with pytest.raises(InvalidInput, match="F"):
        WeightedUtopia((0.5, 0.5)).do(bad)


def test_preferences_are_the_papers_and_cannot_be_changed():
    assert dict(PREFERENCES) == {
        "accuracy_first": (0.9, 0.1),
        "balanced": (0.5, 0.5),
        "robustness_first": (0.1, 0.9),
    }
    with pytest.raises(TypeError):
        PREFERENCES["mine"] = (1.0, 0.0)


def test_tolerance_band_gives_table_9():
    lower, upper = tolerance_band(ACCURACY_FIRST)
    np.testing.assert_allclose(lower, [3.068, 1.421, 1.796, 4.720], atol=5.1e-4)
    np.testing.assert_allclose(upper, [3.390, 1.571, 1.986, 5.216], atol=5.1e-4)


def test_deviation_degree_gives_the_papers_numbers():
    prototypes = [  # Table 6, in the units of Table 9
        (2.724, 1.970, 1.714, 5.125),
        (2.600, 1.970, 1.799, 4.691),
        (2.728, 1.970, 1.683, 4.788),
        (2.393, 1.970, 1.442, 4.862),
        (2.701, 1.970, 1.875, 5.360),
    ]
    degrees = deviation_degree(prototypes, ACCURACY_FIRST)
    np.testing.assert_array_equal(degrees.round(3), [0.367, 0.379, 0.371, 0.474, 0.365])


def test_deviation_degree_is_zero_at_the_optimum_and_relative():
    assert deviation_degree([ACCURACY_FIRST], ACCURACY_FIRST) == [0.0]
    np.testing.assert_allclose(deviation_degree([[1.3, 40.0]], [1.0, 100.0]), np.hypot(0.3, 0.6))


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: tolerance_band([1.0, -1.0]), "design"),
        (lambda: tolerance_band([1.0], tolerance=1.0), "tolerance"),
        (lambda: tolerance_band([1.0], tolerance=-0.1), "tolerance"),
        (lambda: deviation_degree([[1.0, 2.0]], [1.0, 0.0]), "optimum"),
        (lambda: deviation_degree([[1.0, 2.0]], [1.0]), "prototypes"),
        (lambda: deviation_degree([[np.inf]], [1.0]), "prototypes"),
    ],
)
def test_bands_and_degrees_check_their_input(call, field):
    with pytest.raises(InvalidInput, match=field):
        call()
