"""Functions, true moments and the stored outcome of `experiments robust`."""

import numpy as np
import pytest

from experiments.runner.registry import Context
from experiments.studies.robust.data import (
    CHAOSPY,
    OPENTURNS,
    OURS,
    SEEDS,
    STOP_NUMBERS,
    Outcome,
    ahead,
    curves_text,
    outcome_for,
    read_outcome,
    stops_text,
)
from experiments.studies.robust.experiment import needed_table, run, stops_table
from experiments.studies.robust.functions import FUNCTIONS, G_WEIGHTS
from experiments.studies.robust.ours import Growth
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
    assert np.isfinite(task(points)).all()
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
    assert mean == pytest.approx(expected, rel=1e-3)
    assert std == pytest.approx(np.sqrt(square - expected**2), rel=2e-3)


def test_what_is_needed_is_where_the_error_stays():
    steps = [(10, 0.5, 0.1), (20, 0.005, 0.1), (30, 0.02, 0.005), (40, 0.009, 0.005)]
    steps += [(60, 0.008, 0.001), (80, 0.5, 0.5)]
    assert runs_needed(until_it_stays(iter(steps), 0.01), 0.01) == 40
    assert runs_needed(steps, 0.01) is None
    assert runs_needed(steps[:-1], 0.01, column=2) == 30
    rivals = {("kink", method, "way"): steps[:-1] for method in (CHAOSPY, OPENTURNS)}
    tried = {("kink", method, "way"): steps[:1] for method in (CHAOSPY, OPENTURNS)}
    assert not ahead(Outcome(tried | {("kink", OURS, OURS): [(39, 0.001, 0.001)]}, {}), "kink")
    assert not ahead(Outcome(rivals, {}), "kink")
    assert ahead(Outcome(rivals | {("kink", OURS, OURS): [(39, 0.001, 0.001)]}, {}), "kink")


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
    growth = Growth(task, 0.01, 70, whole_curve=False)
    alone = robust_problem(
        lambda x1, x2, x3: task.function.call(x1=x1, x2=x2, x3=x3),
        task.designs,
        task.noise,
        vectorised=True,
        progress=False,
    )
    assert growth.stopped
    assert growth.steps == []
    assert growth.stop.n_runs == alone.n_runs


def stops_of(functions, **changed):
    numbers = dict.fromkeys(STOP_NUMBERS, 1.0) | changed
    return {(one.name, seed): numbers for one in functions for seed in SEEDS}


def band(stops):
    curves = {(one.name, OURS, OURS): [(39, 0.001, 0.001)] for one in FUNCTIONS}
    (finding,) = stops_table(Outcome(curves, stops)).findings
    return finding


def test_a_band_that_was_not_looked_at_on_all_functions_is_not_shown_to_cover():
    assert band(stops_of(FUNCTIONS)).verdict == SHOWN
    some = band(stops_of(FUNCTIONS[1:]))
    assert some.verdict == NOT_SHOWN
    assert FUNCTIONS[0].name in some.sentence


def test_a_refused_growth_covers_nothing():
    answered, refused = stops_of(FUNCTIONS[1:]), stops_of(FUNCTIONS[:1], runs=np.nan)
    said = band(answered | refused).sentence
    count = len(answered)
    assert f"{count} of {count} surrogate builds" in said
    assert f"{len(SEEDS)} refused ({FUNCTIONS[0].name})" in said
    # What a refused growth has covered, had it been asked, changes nothing.
    worse = stops_of(FUNCTIONS[:1], runs=np.nan, covered_mean=0.1)
    assert band(answered | worse).sentence == said
    answered[FUNCTIONS[-1].name, SEEDS[0]] = dict.fromkeys(STOP_NUMBERS, 0.9)
    short = band(answered | refused)
    assert short.verdict == MISSED
    assert f"{count - 1} of {count} surrogate builds" in short.sentence
    assert band(refused).verdict == NOT_SHOWN


def test_eight_of_ten_functions_are_too_few_to_show_eight_in_ten():
    table = needed_table(outcome_for(Context(1, None, None)))
    (finding,) = table.findings
    assert finding.verdict == NOT_SHOWN


def test_the_stored_outcome_gives_the_report(tmp_path):
    context = Context(1, tmp_path, Campaign(tmp_path))
    outcome = outcome_for(context)
    for name, text in (("a", curves_text(outcome)), ("b", stops_text(outcome))):
        (tmp_path / name).write_text(text)
    again = read_outcome(tmp_path / "a", tmp_path / "b")
    assert again.curves == outcome.curves
    assert list(again.stops) == list(outcome.stops)
    needed, stops, _ = run(context).tables
    assert [row[0] for row in needed.rows] == [one.name for one in FUNCTIONS]
    assert {row[0] for row in stops.rows} <= {row[0] for row in needed.rows}
    assert all(finding.sentence for table in (needed, stops) for finding in table.findings)
