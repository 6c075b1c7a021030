"""What runs note on their way, the measures made of it, and its files."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from pymoo_hdte._comparing.ioh import ioh_files
from pymoo_hdte._comparing.paired import compare
from pymoo_hdte._comparing.quality import TrueFront
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._comparing.trace import (
    TARGETS,
    TracingEvaluator,
    budgets,
    hypervolumes,
    profile,
)
from pymoo_hdte._runner.campaign import Campaign

LINE = TrueFront(np.column_stack([np.linspace(0.0, 1.0, 1001), np.linspace(1.0, 0.0, 1001)]))


class Grid(Problem):
    """Objectives are the variables themselves, feasible where the last one is not 0."""

    def __init__(self, n_obj):
        super().__init__(n_var=n_obj, n_obj=n_obj, n_ieq_constr=1, xl=0.0, xu=9.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"], out["G"] = x, 0.5 - x[:, -1:]


@pytest.mark.parametrize("n_obj", [2, 3])
def test_a_trace_is_what_nothing_earlier_weakly_dominates(n_obj, rng):
    """On whole numbers, so that equal points and equal objectives are frequent."""
    X = rng.integers(0, 10, size=(300, n_obj)).astype(float)
    evaluator, problem = TracingEvaluator(), Grid(n_obj)
    for batch in np.split(X, [1, 2, 40, 41, 150]):
        evaluator.eval(problem, Population.new(X=batch))
    feasible = X[:, -1] >= 0.5
    expected = [
        [place + 1, *x]
        for place, x in enumerate(X)
        if feasible[place] and not (X[:place][feasible[:place]] <= x).all(axis=1).any()
    ]
    np.testing.assert_array_equal(evaluator.trace, expected)
    assert evaluator.n_eval == 300


def test_hypervolumes_of_a_trace_in_closed_form():
    """Rectangles up to 1.1: of (.5, .5), then with (.1, .9) beside it, then all of the line."""
    trace = np.array([[3, 0.5, 0.5], [7, 0.1, 0.9]])
    found = hypervolumes(trace, LINE, [1, 2, 3, 6, 7, 100])
    first, both = 0.6 * 0.6, 0.6 * 0.6 + 0.4 * 0.2
    np.testing.assert_allclose(found, [0.0, 0.0, first, first, both, both], rtol=1e-14)
    np.testing.assert_array_equal(hypervolumes(np.empty((0, 3)), LINE, [1, 9]), [0.0, 0.0])


@pytest.mark.parametrize("evaluations", [1, 7, 1000, 1003])
def test_budgets_rise_to_the_last_by_at_most_a_twentieth_of_a_decade(evaluations):
    found = budgets(evaluations)
    assert found[0] == 1
    assert found[-1] == evaluations
    assert np.all(np.diff(found) > 0)
    # Whole numbers: a step is never more than the twentieth of a decade and the next number.
    assert np.all(found[1:] <= np.floor(found[:-1] + 1.0) * 10.0**0.05 + 1e-9)


def test_a_profile_counts_the_targets_that_runs_have_reached():
    """A run that finds the reference front at once, and one that finds nothing."""
    at_once = np.column_stack([np.full(1001, 10.0), LINE.F])
    found = profile([(at_once, LINE), (np.empty((0, 3)), LINE)], 100)
    np.testing.assert_array_equal(found.shares, np.where(found.budgets < 10, 0.0, 0.5))


def test_a_profile_of_a_point_in_closed_form():
    """The point (.5, .5) has a hypervolume of .36, in which .36 / .7095 of the line's is held."""
    found = profile([(np.array([[1.0, 0.5, 0.5]]), LINE)], 10)
    missing = 1.0 - 0.36 / LINE.hypervolume
    np.testing.assert_array_equal(found.shares, np.mean(missing <= TARGETS))


def test_the_smallest_target_is_above_what_the_reference_lacks():
    """Under the corner of 1.1, the line of two objectives has a hypervolume of 1.1^2 - 1 / 2."""
    whole = 1.1**2 - 0.5
    lacking = 1.0 - LINE.hypervolume / whole
    assert 0.0 < lacking < TARGETS.min()


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    setting = Setting(("zdt1", "dtlz2"), ("NSGA2", "NSGA-II"), 3, 20, 60)
    campaign = Campaign(tmp_path_factory.mktemp("compared"))
    return setting, compare(setting, range(3, 5), campaign, (), "small"), campaign


def test_the_files_of_iohprofiler_give_every_improvement_back(compared):
    """Read as IOHinspector reads them: a run begins where evaluations are 1."""
    setting, comparisons, _ = compared
    files = dict(ioh_files(comparisons, setting))
    assert len(files) == 2 * 2 * 2
    for comparison in comparisons:
        for algorithm in comparison.algorithms:
            (path,) = (
                path
                for path in files
                if path.startswith(f"{algorithm}/IOH") and comparison.model in path
            )
            described = json.loads(files[path])
            assert described["function_name"] == comparison.model
            assert described["algorithm"]["name"] == algorithm
            (scenario,) = described["scenarios"]
            head, *lines = files[f"{algorithm}/{scenario['path']}"].splitlines()
            assert head.split() == described["attributes"]
            rows = [list(map(float, line.split())) for line in lines if line != head]
            starts = [place for place, row in enumerate(rows) if row[0] == 1.0]
            runs = np.split(np.array(rows), starts[1:])
            for run, trace, entry in zip(
                runs, comparison.traces(algorithm), scenario["runs"], strict=True
            ):
                np.testing.assert_array_equal(run, trace)
                assert entry["evals"] == 60
                assert entry["best"]["y"] == run[:, 1].min()


def test_a_run_that_begins_infeasibly_still_begins_with_evaluation_one(compared):
    setting, comparisons, _ = compared
    runs = [replace(run, trace=run.trace[2:]) for run in comparisons[0].runs["NSGA2"]]
    late = replace(comparisons[0], runs={**comparisons[0].runs, "NSGA2": runs})
    text = dict(ioh_files([late], setting))["NSGA2/data_f1_zdt1/IOHprofiler_f1_DIM30.dat"]
    lines = [line.split() for line in text.splitlines()]
    assert sum(line[0] == "1" for line in lines) == 2
    assert all(float(line[1]) > 1e100 for line in lines if line[0] == "1")


def test_a_run_from_the_disk_has_its_trace(compared):
    setting, comparisons, campaign = compared
    again = compare(setting, range(3, 5), Campaign(campaign.out), (), "small")
    for one, other in zip(comparisons, again, strict=True):
        for algorithm in one.algorithms:
            for mine, theirs in zip(one.traces(algorithm), other.traces(algorithm), strict=True):
                np.testing.assert_array_equal(mine, theirs)
                assert len(mine) > 2
