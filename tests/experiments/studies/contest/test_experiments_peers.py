"""The peer comparison and the ablation: scores on disk, demands judged, costs of parts."""

from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from pymoo.optimize import minimize
from scipy.stats import mannwhitneyu

from experiments.comparing.contestants import CONTESTANTS
from experiments.runner.registry import Context
from experiments.studies.contest import peers, swarm_parts
from experiments.studies.contest.peers_data import (
    MEASURES,
    ContestRun,
    Scores,
    committed_scores,
    contest_scores,
    format_scores,
    format_seconds,
    measure,
    read_scores,
)
from experiments.studies.contest.peers_tables import (
    FAITHFUL,
    OURS,
    must_reach_table,
    ranks_tables,
    subsets_table,
)
from experiments.studies.contest.problems import BENCHMARKS, problem_of
from experiments.studies.contest.reduced_swarms import SWARM_VARIANTS
from pymoo_hdte._comparing.indicators import CORNER, IndicatorsAgainst
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.algorithms import AMPMOPSO
from pymoo_hdte.checks import InvalidInput

PROBLEMS = tuple(name for name in BENCHMARKS if name.startswith(("ZDT", "WFG")))
ALGORITHMS = (OURS, FAITHFUL, "NSGA-II", "SMS-EMOA")


def planted(rng, shift, seeds=10):
    """Scores in which every algorithm's distances are those of ours times a factor."""
    runs = rng.uniform(0.9, 1.1, (4, len(PROBLEMS), len(ALGORITHMS), 1, seeds))
    factors = np.array(shift)[np.newaxis, np.newaxis, :, np.newaxis, np.newaxis]
    values = 0.01 * runs * factors
    # The hypervolume is a merit.
    values[2] = 1.0 - values[2]
    values = np.concatenate([values, values[[0, 2]]])
    spent = np.full(values.shape[1:], 10_000)
    seconds = np.ones((len(PROBLEMS), len(ALGORITHMS)))
    seeds = tuple(range(1, seeds + 1))
    return Scores(PROBLEMS, ALGORITHMS, (10_000,), seeds, values, spent, seconds)


def demands(scores):
    return {row[0]: (row[-1], row) for row in must_reach_table(scores).rows}


def test_the_first_page_tells_where_our_swarm_is_not_the_best():
    said = peers._new(committed_scores("peers"))
    assert "takes place 1 by IGD and 2 by hypervolume among 12 algorithms after 25,000" in said


# --- indicators ---------------------------------------------------------------------------------


def test_indicators_of_a_plane_are_the_closed_forms():
    line = np.linspace(0.0, 1.0, 51)
    first, second = (grid.ravel() for grid in np.meshgrid(line, line))
    inside = first + second <= 1.0 + 1e-12
    plane = np.column_stack([first, second, 1.0 - first - second])[inside]
    measure = IndicatorsAgainst(plane * [1.0, 10.0, 100.0])
    corners = measure(np.diag([1.0, 10.0, 100.0]))
    # Three corners: a unit cube cut at 1.1 less what no corner dominates.
    step, rest = CORNER - 1.0, CORNER
    assert corners.hypervolume == pytest.approx(3 * step * rest**2 - 3 * step**2 * rest + step**3)
    assert corners.spacing == pytest.approx(0.0)
    # A plane shifted by d in every objective is d sqrt(3) away, measured either way.
    shifted = measure((plane + 0.05) * [1.0, 10.0, 100.0])
    assert shifted.igd_plus == pytest.approx(0.05 * np.sqrt(3.0), rel=1e-6)
    assert shifted.igd == pytest.approx(0.05 * np.sqrt(3.0), rel=0.02)


def test_two_points_have_no_spacing():
    measure = IndicatorsAgainst([[0.0, 1.0], [1.0, 0.0]])
    assert np.isnan(measure([[0.0, 1.0], [1.0, 0.0]]).spacing)
    assert measure([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]).spacing == pytest.approx(0.0)


def test_an_empty_set_is_the_worst_and_a_front_that_does_not_vary_is_refused():
    measure = IndicatorsAgainst([[0.0, 1.0], [1.0, 0.0]])
    nothing = measure(np.empty((0, 2)))
    assert nothing.igd == nothing.igd_plus == np.inf
    assert nothing.hypervolume == 0.0
    assert np.isnan(nothing.spacing)
    with pytest.raises(InvalidInput, match="extent of the true front"):
        IndicatorsAgainst([[0.0, 1.0], [0.0, 2.0]])


# --- scores -------------------------------------------------------------------------------------


def test_scores_survive_the_file(tmp_path, rng):
    scores = planted(rng, [1.0, 2.0, 3.0, 4.0])
    values = np.vectorize(lambda value: float(f"{value:.6g}"))(scores.values)
    values[:, 2, 1] = np.nan
    values[:, 3, 1, 0, 2] = [np.inf, np.inf, 0.0, np.nan, np.inf, 0.0]
    spent = scores.spent.copy()
    spent[2, 1], spent[3, 1, 0, 2] = 0, 9_936
    scores = replace(scores, values=values, spent=spent)
    path, seconds = tmp_path / "peers.csv", tmp_path / "seconds.csv"
    path.write_text(format_scores(scores))
    seconds.write_text(format_seconds(scores))
    again = read_scores(path, seconds)
    np.testing.assert_array_equal(again.values, scores.values)
    np.testing.assert_array_equal(again.spent, scores.spent)
    np.testing.assert_array_equal(again.seconds, scores.seconds)
    assert again.problems == scores.problems
    assert again.algorithms == scores.algorithms


def test_runs_are_measured_at_every_budget_and_a_rerun_reads_them(tmp_path):
    arguments = (["ZDT1", "BNH"], [OURS, FAITHFUL, "NSPSO"], (200, 400), range(1, 3))
    if not CONTESTANTS["NSPSO"].available:
        arguments = (arguments[0], [OURS, FAITHFUL, "MOPSO-CD"], *arguments[2:])
    scores = contest_scores(Campaign(tmp_path), *arguments)
    assert scores.values.shape == (len(MEASURES), 2, 3, 2, 2)
    ours = scores.values[:, :, 0]
    assert np.isfinite(ours).all()
    # More evaluations bring both closer to the front.
    assert np.all(ours[0, 0, 1] < ours[0, 0, 0])
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.csv")}
    again = contest_scores(Campaign(tmp_path), *arguments)
    np.testing.assert_array_equal(again.values, scores.values)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.csv")} == before


# --- demands ------------------------------------------------------------------------------------


def test_demands_are_shown_by_who_is_best_and_missed_by_who_is_not(rng):
    best = demands(planted(rng, [1.0, 3.0, 2.0, 1.5]))
    assert {state for state, _ in best.values()} == {"shown"}
    worst = demands(planted(rng, [80.0, 3.0, 2.0, 1.5]))
    assert {state for state, _ in worst.values()} == {"missed"}
    assert worst["place 1 by average rank, IGD"][1][2] == "place 4 of 4, rank 4.00"


def test_an_equal_rival_is_named_as_not_beaten(rng):
    rows = demands(planted(rng, [1.0, 3.0, 2.0, 1.0]))
    state, row = rows["better than every peer beyond chance, IGD"]
    assert state in ("not shown", "missed")
    assert row[3].startswith("not: SMS-EMOA (p = ")
    assert "NSGA-II" not in row[3]


def test_worse_than_the_faithful_version_on_one_problem_is_found(rng):
    scores = planted(rng, [1.0, 3.0, 2.0, 1.5])
    scores.values[0, 4, 1] *= 0.1
    state, row = demands(scores)[f"never worse than {FAITHFUL} beyond the noise"]
    assert state == "missed"
    ours, faithful = np.median(scores.of("igd", 10_000)[4, :2], axis=-1)
    assert row[2] == f"worse on {PROBLEMS[4]} (IGD, +{100 * (ours / faithful - 1):.0f} %)"


def test_ranks_come_with_intervals_that_hold_them(rng):
    (table,) = ranks_tables(planted(rng, [1.0, 3.0, 1.02, 1.01]))
    assert [row[0] for row in table.rows][-1] == FAITHFUL
    for row in table.rows:
        low, high = map(float, row[2].split(".."))
        assert low - 0.06 <= row[1] <= high + 0.06


def test_a_change_that_has_no_percentage_is_told_without(rng):
    scores = planted(rng, [1.0, 3.0, 2.0, 1.5])
    scores.values[0, 4, 0] = np.inf
    _, row = demands(scores)[f"never worse than {FAITHFUL} beyond the noise"]
    assert row[2] == f"worse on {PROBLEMS[4]} (IGD)"


def test_ranks_without_a_family_are_those_of_the_others(rng):
    scores = planted(rng, [1.0, 4.0, 3.0, 2.0])
    # Ours is the worst on WFG alone.
    wfg = [name.startswith("WFG") for name in PROBLEMS]
    scores.values[0, wfg, 0] = 1.0
    every, without = subsets_table(scores).rows[:2]
    assert without[:6] == ("without WFG", 5, 10_000, 1.0, "SMS-EMOA", 2.0)
    assert every[:4] == ("all", 14, 10_000, (9 * 4.0 + 5 * 1.0) / 14)
    # Five problems that all agree have p = 2 / 2^5 before Holm.
    assert without[6] == "0 of 3"


# --- ablation -----------------------------------------------------------------------------------


def test_the_cost_of_a_part_is_the_planted_one(rng):
    runs = 0.01 * np.exp(0.05 * rng.standard_normal((20, 3, 21)))
    runs[:, 1] *= 1.5
    cost, low, high = swarm_parts.costs(runs, rng)
    np.testing.assert_array_equal([cost[0], low[0], high[0]], 1.0)
    assert low[1] < 1.5 < high[1]
    assert low[2] < 1.0 < high[2]
    assert high[1] - low[1] < 0.05


def test_a_part_without_which_runs_fail_costs_everything(rng):
    runs = rng.uniform(0.9, 1.1, (5, 2, 9))
    runs[2, 1, :6] = np.inf
    cost, low, _ = swarm_parts.costs(runs, rng)
    assert cost[1] == np.inf
    assert np.isfinite(low[0])


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("experiment", "algorithms"),
    [(peers, set(CONTESTANTS)), (swarm_parts, {OURS, *SWARM_VARIANTS})],
)
def test_the_committed_outcome_is_whole_and_makes_the_report(tmp_path, experiment, algorithms):
    name = experiment.__name__.rpartition(".")[2]
    scores = committed_scores(name)
    assert len(scores.seeds) == experiment.FULL.seeds
    assert set(scores.problems) == set(BENCHMARKS)
    assert set(scores.algorithms) == algorithms
    assert scores.budgets == experiment.FULL.budgets
    result = experiment.run(Context(20, tmp_path, Campaign(tmp_path)))
    assert result.tables[0].rows


def test_omopso_never_holds_more_than_two_solutions_of_the_welded_beam():
    """What the page says of its archive: fewer than three points have no Spacing."""
    assert "leaves it at most two solutions of the welded beam" in peers.PEERS_NOTE
    scores = committed_scores("peers")
    place = scores.problems.index("WeldedBeam"), scores.algorithms.index("OMOPSO")
    values = dict(zip(MEASURES, scores.values[(slice(None), *place)], strict=True))
    assert np.isfinite(values["igd"]).all()
    assert np.isnan(values["spacing"]).all()


@pytest.mark.parametrize("problem", others_at_night(["WFG4", "ZDT1-moved", "ZDT6-moved"], "WFG4"))
def test_the_committed_scores_are_those_of_the_swarms_as_they_are(problem, tmp_path):
    # Taking away exchange, difference, mutation or shares by success, or adding inertia, shows on
    # one of the problems.
    problems, swarms = [problem], [OURS, FAITHFUL]
    seeds = range(1, 4)
    stored = committed_scores("peers")
    again = contest_scores(Campaign(tmp_path), problems, swarms, (10_000,), seeds)
    rows = [stored.problems.index(problem) for problem in problems]
    columns = [stored.algorithms.index(swarm) for swarm in swarms]
    runs = stored.of("igd", 10_000)[np.ix_(rows, columns)]
    median = np.median(again.of("igd", 10_000), axis=-1)
    # Same versions on the same processor repeat the digits; others fall where the stored seeds do.
    assert np.all(median >= 0.95 * runs.min(axis=-1))
    assert np.all(median <= 1.05 * runs.max(axis=-1))


def test_stored_runs_of_the_papers_swarm_are_of_the_law_that_its_page_names():
    """Processors that round otherwise send every run another way: what is alike are the scores."""
    stored = committed_scores("cards")
    place = stored.problems.index("RobustToy"), stored.algorithms.index(FAITHFUL)
    expected = stored.of("igd", 500)[place]
    seeds = range(101, 121)
    made = [
        measure("RobustToy", ContestRun("RobustToy", FAITHFUL, seed, (500,)).execute(), 500)[0][0]
        for seed in seeds
    ]
    assert mannwhitneyu(expected, made).pvalue > 1e-3
    problem = problem_of("RobustToy")
    igd = IndicatorsAgainst(problem.pareto_front())
    printed = [
        igd(minimize(problem, AMPMOPSO(archive_size=100), ("n_eval", 500), seed=seed).F).igd
        for seed in seeds
    ]
    assert mannwhitneyu(expected, printed).pvalue < 1e-2
