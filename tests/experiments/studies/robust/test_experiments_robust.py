"""Functions, true moments and the stored outcome of `experiments robust`."""

import numpy as np
import pytest

from experiments.runner.registry import Context
from experiments.studies.robust.data import (
    METHODS,
    OURS,
    RARE_PROBABILITIES,
    SEEDS,
    STOP_NUMBERS,
    Outcome,
    ahead,
    curves_text,
    outcome_for,
    rare_text,
    read_outcome,
    stops_text,
)
from experiments.studies.robust.experiment import rare_table, run, stops_table
from experiments.studies.robust.functions import FUNCTIONS, G_WEIGHTS
from experiments.studies.robust.limit_states import LIMIT_STATES, STATE_BY_NAME
from experiments.studies.robust.ours import Growth
from experiments.studies.robust.rare import METHODS as RARE_METHODS
from experiments.studies.robust.rivals import (
    CHAOSPY_WAYS,
    chaospy_traces,
    runs_needed,
    terms_up_to,
    until_it_stays,
)
from experiments.studies.robust.task import Task
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import MISSED, NOT_SHOWN, SHOWN
from pymoo_hdte.problems import robust_problem


@pytest.mark.parametrize("name", [one.name for one in FUNCTIONS])
def test_a_task_has_finite_values_over_its_whole_reach(name):
    task = Task(name)
    points = np.vstack([task.inputs.values(np.full((1, len(task.names)), z)) for z in (-1, 0, 1)])
    assert np.isfinite(task(points)[name == "failing region" :]).all()
    assert 2 <= len(task.names) <= 20
    assert len(task.function.designed) == 2


def test_sampled_moments_are_those_of_closed_forms():
    task = Task("G-function")
    mean, std = task.true_moments
    a = np.array(G_WEIGHTS)
    x = task.X[:, :2, None] + np.linspace(-0.25, 0.25, 20_001)
    designed = (np.abs(4.0 * x - 2.0) + a[:2, None]) / (1.0 + a[:2, None])
    others = 1.0 + 1.0 / (3.0 * (1.0 + a[2:]) ** 2)
    expected = designed.mean(axis=2).prod(axis=1)
    square = (designed**2).mean(axis=2).prod(axis=1) * others.prod()
    assert mean[:, 0] == pytest.approx(expected, rel=1e-3)
    assert std[:, 0] == pytest.approx(np.sqrt(square - expected**2), rel=2e-3)


def test_what_is_needed_is_where_the_error_stays():
    steps = [(10, 0.5, 0.1), (20, 0.005, 0.1), (30, 0.02, 0.005), (40, 0.009, 0.005)]
    steps += [(60, 0.008, 0.001), (80, 0.5, 0.5)]
    assert runs_needed(until_it_stays(iter(steps), 0.01), 0.01) == 40
    assert runs_needed(steps, 0.01) is None
    assert runs_needed(steps[:-1], 0.01, column=2) == 30
    rivals = {("kink", method, "way"): steps[:-1] for method in METHODS[1:]}
    tried = {("kink", method, "way"): steps[:1] for method in METHODS[1:]}
    assert not ahead(Outcome(tried | {("kink", OURS, OURS): [(39, 0.001, 0.001)]}, {}), "kink")
    assert not ahead(Outcome(rivals, {}), "kink")
    assert ahead(Outcome(rivals | {("kink", OURS, OURS): [(39, 0.001, 0.001)]}, {}), "kink")
    # Of ours the median of the seeds counts.
    stops = {("kink", seed): {"needed": runs} for seed, runs in enumerate((38.0, 39.0, 41.0))}
    assert ahead(Outcome(rivals, stops), "kink")
    stops["kink", 3], stops["kink", 4] = {"needed": 41.0}, {"needed": np.inf}
    assert not ahead(Outcome(rivals, stops), "kink")


def test_both_libraries_are_run_on_the_same_task():
    pytest.importorskip("sklearn")
    task = Task("kink")
    for name, steps in chaospy_traces(task, 12).items():
        assert name in CHAOSPY_WAYS
        assert all(np.isfinite(step).all() for step in steps)
    (first, *_) = Growth(task, 0.01, 20).steps
    assert first[0] == 14


def test_hyperbolic_sets_have_the_size_that_openturns_says():
    assert [terms_up_to(degree, 0.5, 20, 600) for degree in range(1, 6)] == [21, 41, 61, 271, None]
    ot = pytest.importorskip("openturns")
    for norm in (0.5, 1.0):
        sets = ot.HyperbolicAnisotropicEnumerateFunction(4, norm)
        for degree in range(1, 9):
            size = sets.getBasisSizeFromTotalDegree(degree)
            assert terms_up_to(degree, norm, 4, 600) == size


@pytest.mark.nightly
def test_a_watched_growth_stops_where_the_problem_of_the_same_seed_does():
    task = Task("Ishigami")
    growth = Growth(task, 0.01, 70)
    alone = robust_problem(
        lambda x1, x2, x3: task.function.call(x1=x1, x2=x2, x3=x3),
        task.designs,
        task.noise,
        vectorised=True,
        progress=False,
    )
    assert growth.stopped
    assert growth.stop.n_runs == alone.n_runs


def stops_of(functions, **changed):
    numbers = dict.fromkeys(STOP_NUMBERS, 1.0) | changed
    return {(one.name, seed): numbers for one in functions for seed in SEEDS}


def band(stops):
    curves = {(one.name, OURS, OURS): [(39, 0.001, 0.001)] for one in FUNCTIONS}
    (finding,) = stops_table(Outcome(curves, stops)).findings
    return finding


def test_a_band_is_honest_where_the_seeds_of_a_function_together_are_covered():
    whole = stops_of(FUNCTIONS)
    assert f"{len(FUNCTIONS)} of {len(FUNCTIONS)} functions" in band(whole).sentence
    some = band(stops_of(FUNCTIONS[1:]))
    assert some.verdict != SHOWN
    assert FUNCTIONS[0].name in some.sentence
    # One of five seeds that covers three quarters leaves a share of 0.95.
    name = FUNCTIONS[0].name
    low = {(name, SEEDS[0]): whole[name, SEEDS[0]] | {"covered_std": 0.75, "runs": np.nan}}
    assert band(whole | low).sentence.startswith(band(whole).sentence[:60])
    assert f"On {name} some seed is above 1 %" in band(whole | low).sentence
    lower = {(name, SEEDS[0]): whole[name, SEEDS[0]] | {"covered_std": 0.7}}
    assert f"{len(FUNCTIONS) - 1} of {len(FUNCTIONS)} functions" in band(whole | lower).sentence


def rare_outcome(errors, seeds=20):
    """Return an outcome in which errors of ours, and those of others in 1000 runs, are these."""
    ours, others = errors
    rows = {
        (state.name, p, method): np.tile(
            [20.0, p * (1.0 + ours), 0.9 * p, 1.1 * p, 1.0]
            if method == OURS
            else [1000.0, p * (1.0 + others), 0.5 * p, 2.0 * p, 1.0],
            (seeds, 1),
        )
        for state in LIMIT_STATES
        for p in RARE_PROBABILITIES
        for method in RARE_METHODS
    }
    # One in twenty of ours is beside its band.
    for (_, p, method), values in rows.items():
        if method == OURS:
            values[0, 2:4] = 2.0 * p, 3.0 * p
    return Outcome({}, {}, rows)


def test_runs_of_sampling_are_those_for_the_error_of_ours():
    table = rare_table(rare_outcome((0.01, 0.02)))
    assert table.rows[0][-1] == pytest.approx(4000.0)
    assert table.findings[0].verdict == SHOWN
    assert rare_table(rare_outcome((0.01, 0.001))).findings[0].verdict == MISSED
    few = rare_table(rare_outcome((0.01, 0.02), seeds=19)).findings[0]
    assert few.verdict == NOT_SHOWN


@pytest.mark.parametrize("name", STATE_BY_NAME)
def test_a_limit_state_fails_as_often_as_it_should(name):
    failure = STATE_BY_NAME[name].failing_with(1e-2)
    points = np.random.default_rng(1).normal(size=(200_000, len(failure.laws)))
    share = np.mean(failure.in_normal_space(points) < 0.0)
    # Four standard errors.
    assert share == pytest.approx(1e-2, abs=4.0 * np.sqrt(1e-2 / 200_000))


def test_the_oscillator_fails_as_published():
    """Echard et al. 2013: 9.09e-6 and 1.55e-8 for a mean force of 0.6 and 0.45."""
    chance = STATE_BY_NAME["oscillator"].chance
    assert chance(0.6) == pytest.approx(9.09e-6, rel=0.03)
    assert chance(0.45) == pytest.approx(1.55e-8, rel=0.05)


def test_the_stored_outcome_gives_the_report(tmp_path):
    context = Context(1, tmp_path, Campaign(tmp_path))
    outcome = outcome_for(context)
    texts = curves_text(outcome), stops_text(outcome), rare_text(outcome)
    for name, text in zip("abc", texts, strict=True):
        (tmp_path / name).write_text(text)
    again = read_outcome(*(tmp_path / name for name in "abc"))
    assert {case: rows.tolist() for case, rows in again.rare.items()} == {
        case: rows.tolist() for case, rows in outcome.rare.items()
    }
    assert again.curves == outcome.curves
    assert list(again.stops) == list(outcome.stops)
    needed, stops, rare, _ = run(context).tables
    assert {row[0] for row in needed.rows} <= {one.name for one in FUNCTIONS}
    assert {row[0] for row in rare.rows} <= set(STATE_BY_NAME)
    assert {row[0] for row in stops.rows} <= {row[0] for row in needed.rows}
    assert all(finding.sentence for table in (needed, stops, rare) for finding in table.findings)
