"""A random simulator: its own scatter is part of mean, deviation and quantiles."""

import numpy as np
import pytest
import scipy.stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    Design,
    Mean,
    Quantile,
    SimulatorProblem,
    Std,
    UntrustedSurrogate,
    robust_problem,
)

INPUTS = {"x": Design(1.0, 2.0, deviation=0.1)}, {"a": scipy.stats.uniform(0.0, 1.0)}
X = np.array([[1.1], [1.5], [1.9]])
OWN = 0.4


def queue(x, a, seed):
    """Return x^2 + a x with a normal scatter of its own that grows with the design."""
    return x**2 + a * x + OWN * x * np.random.default_rng(seed).standard_normal()


def exact():
    """Return mean, deviation and upper quantile of the queue by brute force."""
    u = scipy.stats.qmc.Sobol(3, rng=np.random.default_rng(1)).random(2**16)
    x = X + 0.1 * (2.0 * u[:, 0] - 1.0)
    y = x**2 + u[:, 1] * x + OWN * x * scipy.stats.norm.ppf(np.clip(u[:, 2], 1e-12, 1.0 - 1e-12))
    return np.column_stack([y.mean(axis=1), y.std(axis=1), np.quantile(y, 0.95, axis=1)])


@pytest.fixture(scope="module")
def problem():
    wanted = [Mean(), Std(), Quantile(0.95)]
    return robust_problem(
        queue, *INPUTS, wanted, accuracy=0.2, budget=2000, replicates=2, progress=False
    )


@pytest.mark.slow
def test_its_own_scatter_is_part_of_deviation_and_quantile(problem):
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    assert np.all(np.abs(F - exact()) <= band)
    # Without its own scatter the deviation would be this much smaller.
    by_inputs = np.sqrt(np.maximum(exact()[:, 1] ** 2 - (OWN * X[:, 0]) ** 2, 0.0))
    assert np.all(F[:, 1] - band[:, 1] > by_inputs)
    assert np.all(band[:, :2] < 0.25 * F[:, 1:2])


@pytest.mark.slow
def test_gradients_know_of_its_own_scatter(problem):
    other = SimulatorProblem(
        problem._inputs, problem._fit, problem.responses, [Mean(), Std()], [], problem.n_runs
    )
    dF = other.evaluate(X, return_values_of=["dF"])
    step = 1e-5
    difference = (other.evaluate(X + step) - other.evaluate(X - step)) / (2.0 * step)
    assert dF[:, :, 0] == pytest.approx(difference, rel=1e-5, abs=1e-7)


@pytest.mark.slow
def test_files_and_data_hold_its_own_scatter(problem, tmp_path):
    problem.save(tmp_path / "random.npz")
    loaded = SimulatorProblem.load(tmp_path / "random.npz")
    assert loaded.evaluate(X) == pytest.approx(problem.evaluate(X), rel=1e-12)
    runs = problem.runs
    assert problem.n_runs == len(runs.X) == len(runs.Y)
    assert len(np.unique(runs.X, axis=0)) == len(runs.X) // 2
    again = robust_problem(
        None, *INPUTS, data=runs, replicates=2, accuracy=0.3, accept="best", progress=False
    )
    F, band = again.evaluate(X, return_values_of=["F", "F_band"])
    assert np.all(np.abs(F - exact()[:, :2]) <= band)
    single = (np.vstack([runs.X, [1.5, 0.123]]), np.vstack([runs.Y, [[3.0]]]))
    with pytest.raises(InvalidInput, match="at one point"):
        robust_problem(None, *INPUTS, data=single, replicates=2, progress=False)


@pytest.mark.slow
def test_seeds_differ_from_run_to_run_and_a_study_is_repeatable(tmp_path):
    seeds = []

    def noted(x, a, seed):
        seeds.append(seed)
        return queue(x, a, seed)

    options = {"accuracy": 0.5, "accept": "best", "budget": 100, "progress": False}
    first, second = (robust_problem(noted, *INPUTS, **options) for _ in range(2))
    assert np.array_equal(first.evaluate(X), second.evaluate(X))
    half = len(seeds) // 2
    for further in (half, 0):
        made = len(seeds)
        third = robust_problem(noted, *INPUTS, **options, cache=tmp_path / "runs.jsonl")
        assert len(seeds) - made in (further, further + 1)
        assert np.array_equal(third.evaluate(X), first.evaluate(X))
    seeds = seeds[: 2 * half]
    assert seeds[:half] == seeds[half:]
    assert len(set(seeds)) == half == first.n_runs
    assert all(type(seed) is int for seed in seeds)


@pytest.mark.slow
def test_one_that_takes_no_seed_is_repeated_if_told_so():
    rng = np.random.default_rng(5)

    def shaky(x, a):
        return x + a + OWN * rng.standard_normal(np.shape(x))

    options = {"accuracy": 0.3, "vectorised": True, "budget": 1000, "progress": False}
    problem = robust_problem(shaky, *INPUTS, replicates=2, **options)
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    std = np.sqrt(1.0 / 12.0 + 0.01 / 3.0 + OWN**2)
    assert np.all(np.abs(F - np.column_stack([X[:, 0] + 0.5, np.full(3, std)])) <= band)
    with pytest.raises(InvalidInput, match="replicates"):
        robust_problem(shaky, *INPUTS, replicates=1, **options)
    with pytest.raises(UntrustedSurrogate, match="replicates=2"):
        robust_problem(shaky, *INPUTS, **options | {"accuracy": 0.01, "budget": 40})
