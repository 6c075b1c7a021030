"""Printed numbers held against each other: each derivation by brute force or simulation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from experiments.paper import later_prototypes, table8
from experiments.paper.prototypes import consistency
from experiments.paper.prototypes.consistency import bounds_table
from experiments.paper.prototypes.printed_validation import (
    HALF_DIGIT,
    HIGHEST,
    LOWEST,
    MAE,
    MAX_ERROR,
    NUMBERS,
    R2,
    RMSE,
    bounds,
    least_lead_unrounded,
    mean_error_interval,
)
from experiments.paper.static_error import tables
from experiments.paper.static_error.tables import implied_size, shapiro_p
from experiments.paper.table8 import box_finding
from experiments.published_values import DESIGN_BOX, TABLE_2, TABLE_3, TABLE_6, TABLE_9
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.identification import largest_deviation

HIGH, LOW = NUMBERS.index(HIGHEST), NUMBERS.index(LOWEST)


def residuals(rng, worst, n):
    """Return residuals, shape (n, 5), with the printed mean, mean square and largest value."""
    mean = (5 * MAE - MAX_ERROR) / 4
    radius = np.sqrt(5 * RMSE**2 - MAX_ERROR**2 - 4 * mean**2)
    direction = rng.normal(size=(n, 4))
    direction -= direction.mean(axis=1, keepdims=True)
    others = mean + radius * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.insert(others, worst, MAX_ERROR, axis=1)


def measured(rng, n):
    """Return values, shape (n, 5), of the implied deviation, with the paper's two extremes."""
    values = rng.normal(size=(n, 5)) * rng.choice([0.1, 1.0], size=(n, 5))
    values *= bounds().measured_std / values.std(axis=1, keepdims=True)
    values.sort(axis=1)
    order = np.array([place for place in range(5) if place not in (HIGH, LOW)])
    placed = np.empty_like(values)
    placed[:, LOW], placed[:, HIGH] = values[:, 0], values[:, -1]
    placed[:, order] = values[:, 1:-1]
    return placed


class TestRanking:
    def test_every_prediction_with_the_printed_statistics_has_the_lead(self, rng):
        found = bounds()
        for worst in range(5):
            truth, error = measured(rng, 20_000), residuals(rng, worst, 20_000)
            assert np.sqrt(np.mean(error**2, axis=1)) == pytest.approx(RMSE, rel=1e-12)
            r2 = 1.0 - np.mean(error**2, axis=1) / np.var(truth, axis=1)
            assert r2 == pytest.approx(R2, rel=1e-9)
            predicted = truth - error
            assert (predicted[:, HIGH] - predicted[:, LOW]).min() >= found.least_lead
            low, high = found.predicted_std
            assert predicted.std(axis=1).min() >= low
            assert predicted.std(axis=1).max() <= high

    def test_the_least_lead_is_reached(self):
        found = bounds()
        truth = np.zeros(5)
        truth[[HIGH, *[place for place in range(5) if place not in (HIGH, LOW)][:2]]] = 1.0
        truth *= found.measured_std / truth.std()
        error = np.full(5, (5 * MAE - MAX_ERROR - found.smallest_residual) / 3)
        error[[HIGH, LOW]] = MAX_ERROR, found.smallest_residual
        assert np.mean(error**2) == pytest.approx(RMSE**2, rel=1e-12)
        predicted = truth - error
        assert predicted[HIGH] - predicted[LOW] == pytest.approx(found.least_lead, rel=1e-12)

    def test_no_rounding_of_the_statistics_takes_the_lead_away(self, rng):
        printed = np.array([MAE, RMSE, MAX_ERROR, R2])
        near = printed + rng.uniform(-HALF_DIGIT, HALF_DIGIT, (2000, 4))
        leads = [bounds(*statistics).least_lead for statistics in near]
        assert least_lead_unrounded() <= min(leads)
        assert least_lead_unrounded() > bounds().least_lead - 0.05

    def test_a_response_that_grows_with_theta_s_needs_more_of_the_design(self, rng):
        static = np.array([prototype.theta_s_arcsec for prototype in TABLE_6.values()])
        truth, error = measured(rng, 5000), residuals(rng, 0, 5000)
        for demand in consistency.demands():
            by_design = truth - error - demand.slope * static
            assert (by_design[:, HIGH] - by_design[:, LOW]).min() >= demand.by_design
            assert demand.by_design > consistency.reach()

    def test_the_reach_is_that_of_a_linear_response_between_opposite_corners(self, rng):
        """Its least value over the box lies as far below the centre as the greatest above it."""
        slopes = rng.normal(size=4)
        corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 4), axis=-1).reshape(-1, 4) @ slopes
        assert np.ptp(corners) == pytest.approx(-2.0 * corners.min())
        nominal = hs_20_100().nominal
        centre = (
            nominal.stiffness, nominal.input_inertia, nominal.input_damping, nominal.mesh_damping,
        )  # fmt: skip
        designs = np.array([prototype.design for prototype in TABLE_6.values()])
        assert np.abs(designs / centre - 1.0).max() < DESIGN_BOX

    def test_it_contradicts_the_tables_only_while_the_designs_cannot_do_it(self, monkeypatch):
        (finding,) = consistency.ranking_table().findings
        assert (finding.within_paper, finding.agrees) == (True, False)
        assert consistency.of_the_first_page()
        monkeypatch.setattr(consistency, "reach", lambda: 14.0)
        (finding,) = consistency.ranking_table().findings
        assert finding.agrees
        assert not consistency.of_the_first_page()

    def test_the_interval_of_the_mean_error_is_that_of_a_t_test(self):
        values = residuals(np.random.default_rng(1), 2, 1)[0]
        expected = stats.ttest_1samp(-values, 0.0).confidence_interval(0.95)
        assert mean_error_interval() == pytest.approx(tuple(expected), abs=1e-3)
        (finding,) = bounds_table().findings
        assert (finding.within_paper, finding.agrees) == (True, True)


class TestShapiroWilk:
    @pytest.mark.parametrize("n", [20, 200])
    def test_the_size_is_found_again_from_scipy_s_w_and_p(self, n, rng):
        for _ in range(20):
            test = stats.shapiro(rng.standard_normal(n))
            if test.pvalue < 0.999:
                assert implied_size(test.statistic, test.pvalue) == pytest.approx(n, rel=1e-4)

    @pytest.mark.parametrize("row", TABLE_2.values(), ids=TABLE_2)
    def test_every_printed_pair_is_of_about_200_values(self, row):
        assert 185 < implied_size(row.shapiro_w, row.shapiro_p) < 215
        assert shapiro_p(row.shapiro_w + 5e-4, 200) > row.shapiro_p - 5e-4
        assert shapiro_p(row.shapiro_w - 5e-4, 200) < row.shapiro_p + 5e-4

    def test_twenty_normal_values_hardly_ever_have_so_large_a_w(self, rng):
        least = min(row.shapiro_w for row in TABLE_2.values())
        tests = [stats.shapiro(values) for values in rng.standard_normal((4000, 20))]
        share = np.mean([test.statistic >= least for test in tests])
        assert share == pytest.approx(1.0 - shapiro_p(least, 20), abs=0.005)
        assert share < 0.02

    @pytest.mark.nightly
    def test_the_page_finds_no_size_that_fits_twenty(self):
        (finding,) = tables.sizes_table().findings
        assert (finding.within_paper, finding.agrees) == (True, False)
        low, high = tables.common_sizes()
        assert low <= 200 <= high


class TestOutliers:
    def test_no_ten_readings_hold_one_beyond_three_deviations(self, rng):
        readings = np.vstack([rng.standard_normal((5000, 10)), rng.standard_cauchy((5000, 10))])
        distance = np.abs(readings - readings.mean(axis=1, keepdims=True)).max(axis=1)
        assert (distance / readings.std(axis=1, ddof=1)).max() <= largest_deviation(10) * (1 + 1e-9)
        assert (distance / readings.std(axis=1)).max() <= 3.0 * (1 + 1e-9)

    def test_the_farthest_that_a_reading_can_be_is_reached_by_one_among_equals(self):
        readings = np.append(np.zeros(9), 1.0)
        distance = np.abs(readings - readings.mean()).max()
        assert distance / readings.std(ddof=1) == pytest.approx(9 / 10**0.5)
        assert distance / readings.std() == pytest.approx(3.0)
        assert largest_deviation(10) == pytest.approx(9 / 10**0.5)


class TestLaterPrototypes:
    def test_p_is_how_often_five_of_the_series_lie_as_far_away(self, rng):
        """Student's t in 400,000 simulated pairs of a series of 20 and five more of it."""
        rows = {row.name: row for row in later_prototypes.later_prototypes()}
        series = rng.standard_normal((400_000, 25))
        twenty, five = series[:, :20], series[:, 20:]
        simulated = np.abs(stats.ttest_ind(five, twenty, axis=1).statistic)
        for name in ("B_in", "B_fc"):
            row, printed = rows[name], TABLE_3[name]
            pooled = np.sqrt((4 * row.std**2 + 19 * printed.std**2) / 23)
            t = (row.mean - printed.mean) / pooled / np.sqrt(1 / 5 + 1 / 20)
            share = np.mean(simulated >= abs(t))
            assert row.p == pytest.approx(share, abs=4 * (row.p / len(simulated)) ** 0.5)

    def test_of_the_coefficients_only_b_fc_is_apart(self):
        apart = [
            row.name
            for row in later_prototypes.later_prototypes()
            if row.adjusted < later_prototypes.ALIKE
        ]
        assert apart == ["B_fc"]
        row = next(row for row in later_prototypes.later_prototypes() if row.name == "B_fc")
        assert row.welch < later_prototypes.ALIKE
        assert row.mean == pytest.approx(4.965e-4, abs=1e-7)

    def test_nothing_stands_on_the_first_page_where_all_are_alike(self, monkeypatch):
        rows = [replace(row, adjusted=0.5) for row in later_prototypes.later_prototypes()]
        assert later_prototypes.of_the_first_page()
        monkeypatch.setattr(later_prototypes, "later_prototypes", lambda: rows)
        assert not later_prototypes.of_the_first_page()
        (finding,) = later_prototypes.later_prototypes_table().findings
        assert finding.agrees


class TestTimes:
    def test_a_run_is_the_printed_time_as_often_as_designs_are_evaluated(self):
        assert table8.run_seconds() == pytest.approx(sum([0.0030] * 100 * 100))
        assert table8.run_seconds(1000 * 3e-6) == pytest.approx(30.0)

    def test_no_rounding_brings_it_down_to_a_run_of_table_7(self, rng):
        single = rng.uniform(2.5e-6, 3.5e-6, 1000)
        batch = rng.uniform(0.00295, 0.00305, 1000)
        seconds = np.minimum(single * 1000, batch) * 10_000
        assert table8.least_run_seconds() <= seconds.min()
        assert table8.least_run_seconds() > table8.longest_run()

    def test_the_speed_ups_are_ratios_of_the_printed_times(self):
        longer, ratios = table8.times_table().findings
        assert (longer.within_paper, longer.agrees) == (True, False)
        assert (ratios.within_paper, ratios.agrees) == (True, True)

    def test_the_first_page_is_silent_where_the_times_fit(self, monkeypatch):
        assert table8.of_the_first_page()
        monkeypatch.setattr(table8, "longest_run", lambda: 40.0)
        assert table8.times_table().findings[0].agrees
        assert not table8.of_the_first_page()


def test_one_of_the_paper_s_optimal_values_is_a_bound_of_its_box():
    nominal = hs_20_100().nominal
    assert box_finding().agrees
    bound = (1 + DESIGN_BOX) * nominal.stiffness
    stiffness = [design[0] for design in TABLE_9.values()]
    assert [abs(value - bound) <= 5.0 for value in stiffness] == [True, False, False]
    assert stiffness[0] > bound
