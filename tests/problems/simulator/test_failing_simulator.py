"""A simulator that fails in a region: its probability, and statistics of the runs that succeed."""

import copy
import warnings

import numpy as np
import pytest
import scipy.stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    CrashProbability,
    CVaR,
    Design,
    FailureProbability,
    Mean,
    Quantile,
    SimulatorProblem,
    Std,
    UntrustedSurrogate,
    WorstCase,
    robust_problem,
)


def throttle(x, load, leak):
    """Return a flow, NaN where the pressure is below that of the outlet."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(x + load - 0.6) + leak


INPUTS = (
    {"x": Design(0.3, 0.9, deviation=0.1)},
    {"load": scipy.stats.uniform(0.1, 0.9), "leak": scipy.stats.uniform(0.0, 0.3)},
)
STATISTICS = [
    Mean(),
    Std(),
    Quantile(0.05),
    -CVaR(0.9),
    FailureProbability(below=0.4),
    CrashProbability(),
]
X = np.array([[0.3], [0.4], [0.5], [0.8]])


def built(simulator=throttle, **options):
    settings = {"vectorised": True, "progress": False, "accuracy": 0.05} | options
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return robust_problem(simulator, *INPUTS, **settings)


@pytest.fixture(scope="module", params=[250, pytest.param(1000, marks=pytest.mark.nightly)])
def problem(request):
    """Return what 250 runs make, three times as fast; at night what is as accurate as asked for."""
    return built(objectives=STATISTICS, accuracy=0.1, budget=request.param, accept="best")


def truth(x):
    """Return the statistics of the runs that succeed, and the share of those that fail."""
    u = scipy.stats.qmc.Sobol(3, rng=np.random.default_rng(2)).random(2**17)
    y = throttle(x + 0.1 * (2.0 * u[:, 0] - 1.0), 0.1 + 0.9 * u[:, 1], 0.3 * u[:, 2])
    good = np.sort(y[np.isfinite(y)])
    largest = good[int(0.9 * len(good)) :].mean()
    below = np.mean(good < 0.4)
    return [
        *(good.mean(), good.std(), np.quantile(good, 0.05), -largest),
        *(below, 1.0 - len(good) / len(y)),
    ]


@pytest.mark.slow
def test_statistics_are_those_of_the_runs_that_succeed_within_a_band_that_grows(problem):
    """Extrapolated, the mean at 0.3 was 0.53 +- 0.004, and the quantile of a root negative."""
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    exact = np.array([truth(x) for x in X[:, 0]])
    assert exact[0, -1] > 0.2
    assert np.mean(np.abs(F - exact) <= band + 1e-3) >= 0.95
    assert np.all(band[0, :3] > 1.5 * band[-1, :3])
    assert np.all(band[:, 0] < 0.15)


@pytest.mark.slow
def test_copies_and_files_know_of_failures(problem, tmp_path):
    problem.save(tmp_path / "failing.npz")
    keys = ["F", "F_band"]
    expected = problem.evaluate(X, return_values_of=keys)
    for other in (copy.deepcopy(problem), SimulatorProblem.load(tmp_path / "failing.npz")):
        for ours, theirs in zip(other.evaluate(X, return_values_of=keys), expected, strict=True):
            assert ours == pytest.approx(theirs, rel=1e-12)


@pytest.mark.slow
def test_a_gradient_that_would_miss_the_share_of_failures_is_refused(problem):
    with pytest.raises(InvalidInput, match="no gradient: runs fail"):
        problem.evaluate(X, return_values_of=["dF"])


@pytest.mark.slow
def test_exceptions_of_a_vectorised_simulator_fail_run_by_run():
    """The same runs fail as by NaN, and give the same."""

    def raises(x, load, leak):
        flow = throttle(x, load, leak)
        if not np.all(np.isfinite(flow)):
            raise FloatingPointError("outlet pressure")
        return flow

    settings = {"objectives": [Mean()], "accept": "best", "budget": 38, "tries": 1}
    ours, expected = built(raises, **settings), built(**settings)
    assert np.array_equal(ours.failed, expected.failed)
    assert np.array_equal(ours.evaluate(X), expected.evaluate(X))


@pytest.mark.slow
def test_a_simulator_that_mostly_fails_is_refused_unless_its_failures_are_limited():
    def narrow(x, load, leak):
        return np.where(x < 0.7, np.nan, x + load + leak)

    settings = {"objectives": [Mean()], "budget": 50}
    with pytest.raises(UntrustedSurrogate, match=r"probability of failing runs is .* where x is 0"):
        built(narrow, **settings)
    problem = built(narrow, **settings, constraints=[CrashProbability() <= 0.1], accept="best")
    G = problem.evaluate(np.array([[0.4], [0.85]]), return_values_of=["G"])
    assert G[0, 0] > 0.5
    assert G[1, 0] < 0.0


@pytest.mark.slow
def test_failures_by_chance_change_no_mean():
    rng = np.random.default_rng(4)

    def flaky(x, load, leak):
        return np.where(rng.random(x.shape) < 0.15, np.nan, x + load**2 + leak)

    problem = built(flaky, objectives=[Mean(), CrashProbability()], tries=1, accuracy=0.1)
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    mean = X[:, 0] + np.mean(np.linspace(0.1, 1.0, 20001) ** 2) + 0.15
    assert np.all(np.abs(F[:, 0] - mean) <= band[:, 0])
    # Of the probability, no more is known than how many runs failed.
    share = len(problem.failed) / problem.n_runs
    assert abs(F[:, 1].mean() - share) <= band[:, 1].mean()


@pytest.mark.slow
def test_worst_case_and_rare_quantiles_of_a_failing_simulator():
    problem = built(objectives=[WorstCase("smallest")], accept="best", budget=38)
    smallest = problem.evaluate(X)[:, 0]
    assert np.all(smallest > -0.1)
    with pytest.raises(UntrustedSurrogate, match="for a simulator that fails") as refused:
        built(objectives=[Quantile(1e-4)], accuracy=0.9)
    assert np.all(np.isinf(refused.value.problem.band(X)))
    assert built(objectives=[CrashProbability()], accept="best", budget=38).n_runs == 38


def test_where_no_run_failed_the_rule_of_three_is_the_band():
    problem = built(lambda x, load, leak: x + load, objectives=[CrashProbability()])
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    assert np.all(F == 0.0)
    assert band == pytest.approx(3.0 / problem.n_runs)
