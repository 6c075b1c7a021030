"""Ranks over problems against Demsar's worked example, closed forms and scipy; their figures."""

from itertools import combinations, product
from math import exp, isinf, sqrt
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.backends.backend_agg import FigureCanvasAgg
from scipy.stats import friedmanchisquare

from experiments.comparing.rivals import holm_against, signs_against
from pymoo_hdte._comparing.figures import critical_difference_plot, rank_heatmap
from pymoo_hdte._comparing.ranks import (
    average_ranks,
    cliques,
    friedman,
    medians,
    nemenyi_difference,
    problem_ranks,
    rank_intervals,
)
from pymoo_hdte.checks import InvalidInput

# Areas under the curve, J. Mach. Learn. Res. 7 (2006), Table 6. The last row but one is printed as
# 0.975 twice with the ranks 2 and 3: what tells them apart was lost in rounding and is put back.
DEMSAR_NAMES = ("C4.5", "C4.5+m", "C4.5+cf", "C4.5+m+cf")
DEMSAR = np.array(
    [
        [0.763, 0.768, 0.771, 0.798],
        [0.599, 0.591, 0.590, 0.569],
        [0.954, 0.971, 0.968, 0.967],
        [0.628, 0.661, 0.654, 0.657],
        [0.882, 0.888, 0.886, 0.898],
        [0.936, 0.931, 0.916, 0.931],
        [0.661, 0.668, 0.609, 0.685],
        [0.583, 0.583, 0.563, 0.625],
        [0.775, 0.838, 0.866, 0.875],
        [1.000, 1.000, 1.000, 1.000],
        [0.940, 0.962, 0.965, 0.962],
        [0.619, 0.666, 0.614, 0.669],
        [0.972, 0.981, 0.9751, 0.9749],
        [0.957, 0.978, 0.946, 0.970],
    ]
)

# The same article, Table 5(a): 2 to 10 classifiers.
CRITICAL_VALUES = {
    0.05: (1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031, 3.102, 3.164),
    0.10: (1.645, 2.052, 2.291, 2.459, 2.589, 2.693, 2.780, 2.855, 2.920),
}

NAMES = tuple("abcdefgh")

PERMUTATIONS = st.permutations(range(4)).map(list)
INDICATORS = arrays(
    float, st.tuples(st.integers(1, 6), st.just(4)), elements=st.sampled_from([0, 1, 2, 3, np.nan])
)


def untied(n, k):
    return np.random.default_rng(0).permuted(np.tile(np.arange(k), (n, 1)), axis=1)


class TestDemsarsExample:
    def test_average_ranks(self):
        ranks = average_ranks(DEMSAR, smaller_is_better=False)
        np.testing.assert_allclose(ranks, [3.143, 2.000, 2.893, 1.964], atol=5e-4)

    def test_friedman_and_iman_davenport(self):
        test = friedman(DEMSAR, smaller_is_better=False)
        assert test.chi_square == pytest.approx(9.28, abs=5e-3)
        assert test.f == pytest.approx(3.69, abs=5e-3)
        assert test.f_p < 0.05

    @pytest.mark.parametrize(
        ("level", "printed", "groups"),
        [(0.05, 1.25, [(3, 1, 2, 0)]), (0.10, 1.12, [(3, 1, 2), (2, 0)])],
    )
    def test_critical_difference_and_its_groups(self, level, printed, groups):
        """At 5 % nothing differs; at 10 % C4.5 does from two, and C4.5+cf belongs to either."""
        difference = nemenyi_difference(4, 14, level)
        assert difference == pytest.approx(printed, abs=5e-3)
        assert cliques(average_ranks(DEMSAR, smaller_is_better=False), difference) == groups

    @pytest.mark.slow
    def test_counts_against_a_control(self):
        """C4.5+m beats C4.5 on ten data sets and loses on two; on two both are equal."""
        tests = holm_against("C4.5+m", DEMSAR_NAMES, DEMSAR, smaller_is_better=False)
        assert (tests[0].rival, tests[0].better) == ("C4.5", 10)
        assert tests[0].worse == 2


class TestRanks:
    @pytest.mark.parametrize(
        ("smaller", "expected"), [(True, [2, 4, 4, 1, 4]), (False, [1, 4, 4, 2, 4])]
    )
    def test_failures_share_the_last_ranks(self, smaller, expected):
        values = [[1.0, np.nan, np.inf, 0.5, -np.inf]]
        assert problem_ranks(values, smaller_is_better=smaller).tolist() == [expected]

    @given(INDICATORS, st.booleans())
    def test_ranks_of_a_problem_sum_to_that_of_a_permutation(self, values, smaller):
        ranks = problem_ranks(values, smaller_is_better=smaller)
        np.testing.assert_array_equal(ranks.sum(axis=1), 10.0)

    @given(INDICATORS, PERMUTATIONS)
    def test_permuted_algorithms_permute_the_ranks(self, values, order):
        ranks = average_ranks(values, smaller_is_better=True)
        permuted = average_ranks(values[:, order], smaller_is_better=True)
        np.testing.assert_array_equal(permuted, ranks[order])

    @given(INDICATORS)
    def test_ranks_survive_any_increasing_map_and_swap_with_a_decreasing_one(self, values):
        ranks = problem_ranks(values, smaller_is_better=True)
        scales = np.arange(1.0, len(values) + 1.0)[:, None]
        mapped = np.sinh(scales * values) - 5.0
        np.testing.assert_array_equal(problem_ranks(mapped, smaller_is_better=True), ranks)
        np.testing.assert_array_equal(problem_ranks(-mapped, smaller_is_better=False), ranks)

    def test_a_failed_run_is_the_worst_of_the_runs_of_a_median(self):
        runs = [[[1.0, np.nan, 3.0], [np.inf, 2.0, np.nan]]]
        assert medians(runs, smaller_is_better=True).tolist() == [[3.0, np.inf]]
        assert medians(runs, smaller_is_better=False).tolist() == [[1.0, -np.inf]]

    @pytest.mark.parametrize("shape", [(3,), (0, 3), (3, 0), (2, 3, 4)])
    def test_other_shapes_are_refused(self, shape):
        with pytest.raises(InvalidInput, match="shape of values"):
            problem_ranks(np.zeros(shape), smaller_is_better=True)


class TestFriedman:
    @pytest.mark.parametrize(("n", "k"), [(3, 3), (12, 4), (35, 12)])
    def test_chi_square_is_that_of_scipy_without_ties(self, n, k):
        values = untied(n, k)
        ours, theirs = friedman(values, smaller_is_better=True), friedmanchisquare(*values.T)
        assert ours[:2] == pytest.approx(tuple(theirs), rel=1e-10)

    def test_ties_make_it_smaller_by_the_factor_of_scipy(self):
        """As printed, four data sets hold two equal areas, and one holds four."""
        values = DEMSAR.round(3)
        ours = friedman(values, smaller_is_better=False).chi_square
        factor = 1.0 - (4 * (2**3 - 2) + (4**3 - 4)) / (14 * (4**3 - 4))
        assert ours == pytest.approx(friedmanchisquare(*values.T).statistic * factor, rel=1e-10)

    @pytest.mark.parametrize("n_alike", [0, 8])
    def test_f_is_that_of_the_two_way_analysis_of_variance_of_ranks(self, n_alike):
        ranks = untied(9, 5) + 1.0
        ranks[:n_alike] = np.arange(1.0, 6.0)
        n, k = ranks.shape
        between = n * np.sum((ranks.mean(axis=0) - ranks.mean()) ** 2)
        residual = np.sum((ranks - ranks.mean()) ** 2) - between
        expected = (between / (k - 1)) / (residual / ((k - 1) * (n - 1)))
        assert friedman(ranks, smaller_is_better=True).f == pytest.approx(expected, rel=1e-10)

    def test_p_values_of_three_algorithms_in_closed_form(self):
        """Two degrees of freedom make chi-square exponential and F a power."""
        n = 8
        test = friedman(untied(n, 3), smaller_is_better=True)
        assert test.chi_square_p == pytest.approx(exp(-test.chi_square / 2), rel=1e-10)
        assert test.f_p == pytest.approx((1 + test.f / (n - 1)) ** (1 - n), rel=1e-10)

    def test_full_agreement_and_none(self):
        agreed = friedman(np.tile(np.arange(7.0), (11, 1)), smaller_is_better=True)
        assert agreed.chi_square == pytest.approx(11 * 6)
        assert isinf(agreed.f)
        assert agreed.f_p == 0.0
        assert friedman(np.ones((11, 7)), smaller_is_better=True) == (0.0, 1.0, 0.0, 1.0)

    @pytest.mark.parametrize("shape", [(1, 4), (4, 1)])
    def test_it_takes_two_problems_and_two_algorithms(self, shape):
        with pytest.raises(InvalidInput, match="at least two"):
            friedman(np.ones(shape), smaller_is_better=True)


class TestNemenyi:
    @pytest.mark.parametrize("level", CRITICAL_VALUES)
    def test_critical_values_are_those_printed(self, level):
        """The table cuts some of its digits off instead of rounding them."""
        ours = [nemenyi_difference(k, 1, level) / sqrt(k * (k + 1) / 6) for k in range(2, 11)]
        np.testing.assert_allclose(ours, CRITICAL_VALUES[level], atol=8e-4)

    def test_two_algorithms_are_a_test_of_the_normal_distribution(self):
        """Ranks 1 and 2 at random: their average difference has the standard deviation n^-1/2."""
        for n in (5, 36):
            expected = NormalDist().inv_cdf(0.975) / sqrt(n)
            assert nemenyi_difference(2, n) == pytest.approx(expected, rel=1e-6)

    @pytest.mark.parametrize("arguments", [(1, 5), (3, 0), (3, 5, 0.0), (3, 5, 1.0), (2.5, 5)])
    def test_bad_input_is_refused(self, arguments):
        with pytest.raises(InvalidInput):
            nemenyi_difference(*arguments)


class TestCliques:
    @given(st.lists(st.integers(0, 40), min_size=1, max_size=9), st.integers(1, 20))
    def test_two_share_a_clique_if_and_only_if_they_do_not_differ(self, eighths, difference):
        ranks = np.array(eighths) / 8.0
        groups = cliques(ranks, difference / 8.0)
        together = {frozenset(pair) for group in groups for pair in combinations(group, 2)}
        alike = {
            frozenset((i, j))
            for i, j in combinations(range(len(ranks)), 2)
            if abs(ranks[i] - ranks[j]) < difference / 8.0
        }
        assert together == alike
        assert set().union(*groups) == set(range(len(ranks)))
        assert not any(set(a) <= set(b) for a, b in product(groups, groups) if a is not b)

    def test_no_difference_is_refused(self):
        with pytest.raises(InvalidInput, match="difference"):
            cliques([1.0, 2.0], 0.0)


class TestAgainstAControl:
    gains = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])

    def test_holm_multiplies_what_signs_give(self):
        """Six signs alike have p = 2 / 2^6, of two such rivals Holm makes twice as much."""
        values = np.column_stack([self.gains * 0, self.gains, 0.3 * self.gains])
        tests = holm_against("a", NAMES[:3], values, smaller_is_better=True)
        assert [test.rival for test in tests] == ["b", "c"]
        assert [test.p for test in tests] == pytest.approx([4 / 64, 4 / 64])
        assert [test[2:] for test in tests] == [(6, 0, True), (6, 0, True)]
        swapped = holm_against("a", NAMES[:3], values, smaller_is_better=False)
        assert [test[2:] for test in swapped] == [(0, 6, False), (0, 6, False)]

    def test_a_failure_outweighs_every_other_difference(self):
        """The one lost problem takes the largest rank: by enumeration, not the 4 / 64 of rank 1."""
        ours = np.where(self.gains == 1.0, np.nan, 0.0)
        values = np.column_stack([ours, self.gains])
        (test,) = holm_against("a", NAMES[:2], values, smaller_is_better=True)
        sums = [np.dot(signs, range(1, 7)) for signs in product((0, 1), repeat=6)]
        assert test.p == pytest.approx(2 * np.mean(np.array(sums) <= 6))
        assert test[2:] == (5, 1, True)

    def test_the_signed_ranks_decide_who_is_ahead_and_not_the_counts(self):
        gains = np.array([0.1, 0.2, 0.3, 0.4, -5.0, -6.0, -7.0])
        values = np.column_stack([np.zeros(7), gains])
        (test,) = holm_against("a", NAMES[:2], values, smaller_is_better=True)
        assert test[2:] == (4, 3, False)

    def test_problems_on_which_both_fail_do_not_count(self):
        values = np.column_stack([self.gains * 0, self.gains])
        with_failures = np.vstack([values, [[np.nan, np.inf]]])
        assert holm_against("a", NAMES[:2], with_failures, smaller_is_better=True) == holm_against(
            "a", NAMES[:2], values, smaller_is_better=True
        )

    def test_signs_count_problems_and_not_how_far_apart_they_are(self):
        """Of nine problems that differ eight are won: p = 2 (1 + 9) / 2^9; the second is lost."""
        gains = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, -100.0, 0.0])
        values = np.column_stack([0 * gains, gains, -np.abs(gains)])
        first, second = signs_against("a", NAMES[:3], values, smaller_is_better=True)
        assert first.p == pytest.approx(2 * 10 / 2**9)
        assert second.p == pytest.approx(2 * 2 / 2**9)
        assert (first[2:], second[2:]) == ((8, 1, True), (0, 9, False))
        scaled = np.column_stack([0 * gains, gains**3, -np.abs(gains)])
        assert signs_against("a", NAMES[:3], scaled, smaller_is_better=True) == [first, second]

    def test_without_a_difference_signs_show_nothing(self):
        (test,) = signs_against("a", NAMES[:2], np.ones((5, 2)), smaller_is_better=True)
        assert test[1:] == (1.0, 0, 0, False)

    @pytest.mark.parametrize(
        ("control", "names"), [("z", NAMES[:3]), ("a", NAMES[:2]), ("a", ("a", "a", "b"))]
    )
    def test_names_that_do_not_fit_are_refused(self, control, names):
        with pytest.raises(InvalidInput):
            holm_against(control, names, np.ones((4, 3)), smaller_is_better=True)


class TestRankIntervals:
    def test_they_shrink_to_the_ranks_where_runs_do_not_overlap(self):
        values = np.arange(3.0)[:, None] + 0.1 * np.random.default_rng(0).random((4, 3, 7))
        intervals = rank_intervals(values, np.random.default_rng(1), smaller_is_better=False)
        assert intervals.tolist() == [[3.0, 3.0], [2.0, 2.0], [1.0, 1.0]]

    def test_problems_and_algorithms_are_resampled_on_their_own(self):
        """Of three draws from (0, 0, 2) two are 2 in 7 of 27 cases, problem by problem."""
        n, p = 200, 7 / 27
        values = np.tile([[1.0, 1.0, 1.0], [0.0, 0.0, 2.0]], (n, 1, 1))
        low, high = rank_intervals(values, np.random.default_rng(2), smaller_is_better=True)[1]
        deviation = NormalDist().inv_cdf(0.975) * sqrt(p * (1 - p) / n)
        # Ends of a percentile interval scatter by about a tenth of its width over 1000 resamples.
        assert low == pytest.approx(1 + p - deviation, abs=0.008)
        assert high == pytest.approx(1 + p + deviation, abs=0.008)
        alike = np.tile([0.0, 1.0, 2.0], (1, 2, 1))
        ends = rank_intervals(alike, np.random.default_rng(3), smaller_is_better=True)
        assert ends.tolist() == [[1.0, 2.0], [1.0, 2.0]]

    def test_same_seed_same_bytes_and_the_runs_stay_as_they_are(self):
        values = np.random.default_rng(4).random((5, 3, 7))
        before = values.copy()
        first, second = (
            rank_intervals(values, np.random.default_rng(6), smaller_is_better=True).tobytes()
            for _ in range(2)
        )
        assert first == second
        np.testing.assert_array_equal(values, before)


TWELVE = (*(f"algorithm {number}" for number in range(11)), "An elitist AMP-MOPSO")


def legible(figure):
    """Whether all texts of a figure lie on it, and none but slanted names over another."""
    FigureCanvasAgg(figure).draw()
    (axis,) = figure.axes
    upright = [*axis.texts, *(axis.get_yticklabels() if axis.axison else ())]
    slanted = axis.get_xticklabels() if axis.axison else ()
    low, high = np.array([_corners(text) for text in (*upright, *slanted)]).transpose(1, 0, 2)
    inside = np.all(low >= 0.0) and np.all(high <= figure.bbox.max)
    low, high = low[: len(upright)], high[: len(upright)]
    over = np.all((low[:, None] < high) & (low < high[:, None]), axis=-1)
    return inside and np.count_nonzero(over) == len(upright)


def _corners(text):
    box = text.get_window_extent()
    return box.min, box.max


class TestFigures:
    @pytest.mark.parametrize("spread", [1.0, 0.01], ids=["spread", "crowded"])
    def test_labels_of_twelve_algorithms_do_not_overlap(self, spread):
        ranks = 6.5 + spread * (np.arange(12) - 5.5)
        figure = critical_difference_plot(TWELVE, ranks, 3.5, TWELVE[-1])
        assert legible(figure)

    def test_leaders_do_not_cross(self):
        ranks = untied(1, 12)[0] + 1.0
        (axis,) = critical_difference_plot(TWELVE, ranks, 3.5, TWELVE[0]).axes
        leaders = [line.get_xydata() for line in axis.lines if len(line.get_xdata()) == 3]
        assert len(leaders) == 12
        for (_, (rank, height), (end, _)), (_, (other, depth), _) in product(leaders, leaders):
            assert height >= depth or not min(rank, end) < other < max(rank, end)

    @pytest.mark.parametrize(
        ("difference", "expected"),
        [(1.12, [[1.964, 2.893], [2.893, 3.143]]), (0.2, [[1.964, 2.000]])],
    )
    def test_a_bar_joins_each_clique_of_more_than_one(self, difference, expected):
        ranks = [3.143, 2.000, 2.893, 1.964]
        (axis,) = critical_difference_plot(DEMSAR_NAMES, ranks, difference, "C4.5").axes
        bars = [line.get_xdata() for line in axis.lines if line.get_linewidth() > 4]
        np.testing.assert_allclose(bars, expected, atol=0.02)
        words = {text.get_text().strip(): text.get_fontweight() for text in axis.texts}
        assert words["3.14  C4.5"] == "bold"
        assert words["C4.5+m  2.00"] == "normal"

    def test_heatmap_prints_every_rank_and_the_averages_of_each_group(self):
        ranks = [[1, 2, 3], [3, 2, 1], [1.5, 1.5, 3], [2, 1, 3]]
        groups = ["held out", "tuning", "held out", "held out"]
        figure = rank_heatmap(ranks, ["p", "q", "r", "s"], groups, NAMES[:3], "b")
        (axis,) = figure.axes
        labels = [label.get_text() for label in axis.get_yticklabels()]
        assert labels == ["held out", "p", "r", "s", "average rank", "tuning", "q", "average rank"]
        printed = {(text.get_position()[::-1]): text.get_text() for text in axis.texts}
        rows = [[printed.get((row, column)) for column in range(3)] for row in range(8)]
        assert rows == [
            [None] * 3,
            ["1", "2", "3"],
            ["1.5", "1.5", "3"],
            ["2", "1", "3"],
            ["1.50", "1.50", "3.00"],
            [None] * 3,
            ["3", "2", "1"],
            ["3.00", "2.00", "1.00"],
        ]
        assert [patch.get_x() for patch in axis.patches] == [0.5, 0.5]

    @pytest.mark.nightly
    def test_heatmap_of_a_whole_benchmark_is_legible(self):
        problems = [f"RobustDTE calibrated {number}" for number in range(35)]
        groups = ["held out"] * 23 + ["tuning"] * 12
        figure = rank_heatmap(untied(35, 12) + 1.0, problems, groups, TWELVE, TWELVE[0])
        assert legible(figure)

    @pytest.mark.parametrize(
        ("ranks", "groups", "highlight"),
        [(np.ones((2, 2)), ["x"] * 3, "a"), (np.ones((2, 2)), ["x"], "a"),
         (np.ones((3, 2)), ["x"] * 2, "a"), (np.ones((2, 2)), ["x"] * 2, "z")],
    )  # fmt: skip
    def test_what_does_not_fit_is_refused(self, ranks, groups, highlight):
        with pytest.raises(InvalidInput):
            rank_heatmap(ranks, ["p", "q"], groups, ["a", "b"], highlight)
        with pytest.raises(InvalidInput):
            critical_difference_plot(["a", "b"], [1.0, 2.0], 1.0, "z")
