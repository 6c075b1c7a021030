"""Statistics of experiments against closed forms."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte._comparing.statistics import effect_size, holm, summary, wilcoxon_p


def test_summary_of_one_to_five():
    assert summary([5, 1, 4, 2, 3]) == (3.0, 3.0, np.sqrt(2.5))


def test_summary_of_a_single_run_has_no_spread():
    mean, median, std = summary([7.0])
    assert (mean, median) == (7.0, 7.0)
    assert np.isnan(std)


@pytest.mark.parametrize("n", [3, 6, 10])
def test_wilcoxon_of_differences_of_one_sign_is_two_in_two_to_the_n(n):
    """All ranks on one side has probability 2^-n on either side."""
    differences = np.arange(1.0, n + 1.0)
    assert wilcoxon_p(differences, np.zeros(n)) == pytest.approx(2.0 / 2**n, rel=1e-12)


def test_wilcoxon_by_enumeration_of_all_signs():
    differences = np.array([-1.0, 2.0, 3.0, -4.0, 5.0])
    ranks = np.arange(1, 6)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 5)).reshape(5, -1).T
    extreme = np.abs(signs @ ranks) >= abs(np.sign(differences) @ ranks)
    assert wilcoxon_p(differences, np.zeros(5)) == pytest.approx(extreme.mean(), rel=1e-12)


def test_wilcoxon_is_symmetric_and_one_for_equal_runs():
    a, b = np.array([1.0, 3.0, 2.5, 4.0]), np.array([0.5, 3.5, 1.0, 4.7])
    assert wilcoxon_p(a, b) == wilcoxon_p(b, a)
    assert wilcoxon_p(a, a) == 1.0


def test_equal_pairs_are_dropped():
    differences = np.concatenate([np.arange(1.0, 6.0), np.zeros(12)])
    assert wilcoxon_p(differences, np.zeros(17)) == pytest.approx(2.0 / 2**5, rel=1e-12)


def test_wilcoxon_of_an_undefined_run_is_undefined():
    assert np.isnan(wilcoxon_p([1.0, np.nan, 2.0], [0.0, 1.0, 1.0]))


def test_holm_by_hand():
    """Sorted 0.01, 0.03, 0.04 times 3, 2, 1 is 0.03, 0.06, 0.04, made monotone."""
    np.testing.assert_allclose(holm([0.04, 0.01, 0.03]), [0.06, 0.03, 0.06], rtol=1e-15)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_lies_between_the_raw_value_and_bonferroni(p_values):
    p = np.array(p_values)
    adjusted = holm(p)
    assert np.all(adjusted >= p)
    assert np.all(adjusted <= np.minimum(1.0, p * p.size) + 1e-15)


def test_effect_size_by_counting_pairs():
    a, b = [1, 2, 3], [2, 2, 0]
    wins = Fraction(sum((x > y) * 2 + (x == y) for x in a for y in b), 18)
    assert effect_size(a, b) == pytest.approx(float(wins), abs=1e-15)
    assert effect_size(a, b) + effect_size(b, a) == pytest.approx(1.0)


def test_effect_size_ignores_the_order_of_runs():
    values = {effect_size(order, [1.5, 2.5]) for order in permutations([1.0, 2.0, 3.0])}
    assert values == {0.5}
