"""Table 5: test errors over hypercubes, and what noise and faulty runs do to an interpolant."""

from itertools import pairwise

import numpy as np
import pytest

from experiments.paper import node_faults, table5
from experiments.paper.node_faults import (
    AS_PRINTED,
    EVERY_RUN,
    FAULTY_RUNS,
    HIGH,
    LOW,
    cardinal_functions,
    fault_effects,
    least_rmse_below,
)
from experiments.published_values import TABLE_5
from experiments.runner.registry import Context
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import WITHIN_PAPER
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, latin_hypercube
from pymoo_hdte.units import ARCSEC

CUBE = Box(("a", "b", "c", "d", "e"), -np.ones(5), np.ones(5))


def cubes(n, points=200):
    return [latin_hypercube(CUBE, points, seed) for seed in range(n)]


def test_a_cardinal_function_is_what_one_faulty_run_adds_to_the_surrogate():
    def response(points):
        return np.exp(points @ [0.1, -0.2, 0.3, 0.4, 0.5])

    (points,) = cubes(1)
    faulty = 17

    def spoilt(nodes):
        values = response(nodes)
        values[faulty] += 50.0
        return values

    whole, broken = (ChebyshevSurrogate.fit(f, CUBE, LOW) for f in (response, spoilt))
    added = broken(points) - whole(points)
    assert added == pytest.approx(50.0 * cardinal_functions(points, LOW)[:, faulty], abs=1e-10)


def test_no_noise_makes_the_higher_order_as_much_worse_as_printed():
    """Equal noise leaves the lower order above the bound, whatever error a response adds to it."""
    random_state = np.random.default_rng(3)
    bound = least_rmse_below() / TABLE_5[HIGH].rmse_arcsec
    assert bound < 1.0
    assert least_rmse_below() > TABLE_5[LOW].rmse_arcsec
    (points,) = cubes(1, 500)
    by_order = {order: cardinal_functions(points, order) for order in (LOW, HIGH)}
    ratios = []
    for rest in (0.0, 0.5, 2.0):
        for _ in range(50):
            low, high = (
                np.sqrt(np.mean((functions @ random_state.normal(size=functions.shape[1])) ** 2
                                + rest**2))
                for functions in by_order.values()
            )  # fmt: skip
            ratios.append(low / high)
    printed = TABLE_5[LOW].rmse_arcsec / TABLE_5[HIGH].rmse_arcsec
    assert np.mean(ratios) >= bound
    assert min(ratios) > printed


def test_every_explanation_gives_the_printed_rmse():
    points = cubes(3)
    rest = np.random.default_rng(1).normal(0.0, 0.7, (len(points), len(points[0])))
    effects = fault_effects({"smooth": rest}, points)
    assert {(e.rest, e.explanation) for e in effects} == {
        (name, words)
        for name in ("smooth", AS_PRINTED)
        for words in (*FAULTY_RUNS.values(), EVERY_RUN)
    }
    target = TABLE_5[HIGH].rmse_arcsec
    for effect in effects:
        assert np.all(effect.size > 0.0)
        assert np.all(effect.mae < target)
        assert np.all(effect.largest > target)
        assert effect.largest.max() < target * np.sqrt(len(points[0]))
    # Fewer faults must be larger, and leave the mean of the absolute error smaller.
    smooth = {e.explanation: e for e in effects if e.rest == "smooth"}
    order = (*FAULTY_RUNS.values(), EVERY_RUN)
    for fewer, more in pairwise(order):
        assert np.median(smooth[fewer].size) > np.median(smooth[more].size)
        assert np.median(smooth[fewer].mae) < np.median(smooth[more].mae)
        assert np.median(smooth[fewer].largest) > np.median(smooth[more].largest)


def test_a_scaled_error_has_the_printed_rmse():
    random_state = np.random.default_rng(2)
    rest, shape = random_state.normal(size=(400, 1)), random_state.normal(size=(400, 5))
    size, mae, largest = node_faults._scaled_to_print(rest, shape)
    error = rest + size * shape
    assert np.sqrt(np.mean(error**2, axis=0)) == pytest.approx(TABLE_5[HIGH].rmse_arcsec)
    assert np.abs(error).mean(axis=0) == pytest.approx(mae)
    assert np.abs(error).max(axis=0) == pytest.approx(largest)
    assert node_faults._scaled_to_print(10.0 * rest, shape).shape == (3, 0)


def test_errors_as_printed_have_both_printed_measures():
    drawn = node_faults._rest_as_printed(np.random.default_rng(4), 20_000)
    printed = TABLE_5[LOW]
    assert np.sqrt(np.mean(drawn**2, axis=0)) == pytest.approx(printed.rmse_arcsec)
    assert np.abs(drawn).mean() == pytest.approx(printed.mae_arcsec, rel=2e-3)


def test_the_distance_is_in_standard_deviations_of_the_draws():
    printed = TABLE_5[HIGH]
    random_state = np.random.default_rng(6)
    scatter = np.exp(0.1 * random_state.normal(size=(2, 20_000)))
    mae, largest = scatter * [[printed.mae_arcsec * np.exp(0.3)], [printed.max_error_arcsec]]
    effect = node_faults.FaultEffect("rest", "cause", mae, mae, largest)
    assert effect.distance == pytest.approx(3.0, rel=0.03)


def test_the_printed_scatter_holds_for_every_order():
    low, high = table5.printed_scatter()
    assert low < high
    for row in TABLE_5.values():
        r2 = 1.0 - (row.rmse_arcsec / np.array([low, high])) ** 2
        assert np.all(np.abs(r2 - row.r2) <= 0.0005 + 1e-12)


def test_both_intervals_of_theta_s_stand_beside_the_same_bands():
    problem = robust_problem("calibrated")
    boxes = table5.intervals_of(problem)
    nominal = problem.model.nominal
    for box in boxes.values():
        assert box.lower[1:] == pytest.approx(0.65 * nominal[1:])
        assert box.upper[1:] == pytest.approx(1.35 * nominal[1:])
    half_widths = [boxes[name].half_width[0] / ARCSEC for name in (table5.SCATTER, table5.BAND)]
    std = problem.model.kinematic_error.std / ARCSEC
    assert half_widths == pytest.approx([3.0 * std, 0.35 * nominal[0] / ARCSEC])


@pytest.mark.nightly
def test_the_page_shows_the_spread_over_hypercubes(tmp_path, monkeypatch):
    monkeypatch.setattr(table5, "HYPERCUBES", {table5.SCATTER: 3, table5.BAND: 2})
    result = table5.run(Context(1, tmp_path, Campaign(tmp_path)))
    accuracy = result.tables[0]
    headings = [column.heading for column in accuracy.columns]
    problem = robust_problem("calibrated")
    expected = []
    for seed in range(1, 4):
        points = latin_hypercube(problem.surrogate.box, table5.N_TEST, seed)
        error = problem.surrogate(points) - problem.model.dte_arcsec(points)
        expected.append(np.sqrt(np.mean(error**2)))
    (row,) = (r for r in accuracy.rows if r[:2] == ("calibrated", 3) and r[3].startswith("RMSE"))
    shown = dict(zip(headings, row, strict=True))
    assert shown["ours mean"] == pytest.approx(np.mean(expected))
    assert shown["ours std"] == pytest.approx(np.std(expected, ddof=1))
    assert (shown["ours smallest"], shown["ours largest"]) == pytest.approx(
        (min(expected), max(expected))
    )
    within = [f for table in result.tables for f in table.findings if f.within_paper]
    assert [finding.agrees for finding in within] == [False]
    assert set(result.first_page) == {WITHIN_PAPER}
