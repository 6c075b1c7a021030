"""Runs and surrogates that are refused come back, and runs in hand are taken."""

import pickle

import chaospy
import numpy as np
import pytest
import scipy.stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    Design,
    Mean,
    SimulatorProblem,
    Std,
    UntrustedSurrogate,
    robust_problem,
)


class Counted:
    """A simulator that counts its runs."""

    def __init__(self, function):
        self.function, self.runs = function, 0

    def __call__(self, **inputs):
        self.runs += np.size(next(iter(inputs.values())))
        return self.function(**inputs)


def series_system(x, u, v):
    """Return the least of four margins, a function with kinks through the middle of its scatter."""
    bowl, turn = 3.0 + 0.1 * (u - v) ** 2, (u + v) / np.sqrt(2.0)
    return np.minimum.reduce([bowl - turn, bowl + turn, u - v + 4.9, v - u + 4.9]) + x


SYSTEM = {"x": Design(-1.0, 1.0)}, {"u": scipy.stats.norm(), "v": scipy.stats.norm()}
STRICT = {"accuracy": 0.01, "budget": 60, "vectorised": True, "progress": False}


@pytest.fixture(scope="module")
def refused():
    simulator = Counted(series_system)
    with pytest.raises(UntrustedSurrogate) as caught:
        robust_problem(simulator, *SYSTEM, **STRICT)
    return caught.value, simulator.runs


def true_moments(x):
    u, v = scipy.stats.norm.ppf(
        np.clip(scipy.stats.qmc.Sobol(2, rng=np.random.default_rng(1)).random(2**16), 1e-12, 1.0)
    ).T
    values = series_system(0.0, u, v)
    return np.column_stack([x + values.mean(), np.full_like(x, values.std())])


def test_a_refusal_holds_all_runs_and_the_flagged_problem(refused):
    refusal, runs = refused
    X, Y = refusal.runs
    again = Counted(series_system)(**dict(zip(("x", "u", "v"), X.T, strict=True)))
    assert np.allclose(again, Y[:, 0], rtol=1e-12)
    assert len(X) == 60 <= runs
    assert not refusal.problem.trusted
    assert refusal.problem.refusal == str(refusal)
    copied = pickle.loads(pickle.dumps(refusal))
    assert np.array_equal(copied.runs.X, X)
    designs = np.linspace(-0.9, 0.9, 7)[:, None]
    assert np.array_equal(copied.problem.evaluate(designs), refusal.problem.evaluate(designs))


@pytest.mark.slow
def test_the_band_of_what_is_accepted_as_the_best_covers_its_errors(refused, tmp_path):
    with pytest.warns(RuntimeWarning, match="best there is"):
        problem = robust_problem(series_system, *SYSTEM, **STRICT, accept="best")
    designs = np.linspace(-0.9, 0.9, 7)[:, None]
    assert np.array_equal(problem.evaluate(designs), refused[0].problem.evaluate(designs))
    F, band = problem.evaluate(designs, return_values_of=["F", "F_band"])
    assert np.all(np.abs(F - true_moments(designs[:, 0])) <= band)
    assert np.all(problem.accuracy > 0.01)
    problem.save(tmp_path / "best.npz")
    loaded = SimulatorProblem.load(tmp_path / "best.npz")
    assert not loaded.trusted
    assert loaded.refusal == problem.refusal
    assert np.array_equal(loaded.runs.Y, problem.runs.Y)


@pytest.mark.slow
def test_runs_of_a_refusal_are_not_made_again(refused):
    simulator = Counted(series_system)
    with pytest.raises(UntrustedSurrogate) as caught:
        robust_problem(simulator, *SYSTEM, **STRICT | {"budget": 20}, data=refused[0].runs)
    assert simulator.runs <= 24
    with pytest.raises(UntrustedSurrogate) as whole:
        robust_problem(series_system, *SYSTEM, **STRICT | {"budget": 80})
    ours, expected = (np.sort(caught.value.runs.X, axis=0) for caught in (caught, whole))
    assert ours == pytest.approx(expected, abs=1e-9)


WIDTHS = {"x": Design(1.0, 2.0, deviation=0.1)}
LOADS = {
    "a": scipy.stats.lognorm(s=1.0),
    ("m", "n"): chaospy.MvNormal([0.0, 1.0], [[0.01, 0.01], [0.01, 0.04]]),
}


def drawn(count):
    """Return inputs as they scatter: the noise of a Monte Carlo study, heavy-tailed, dependent."""
    rng = np.random.default_rng(3)
    m, n = rng.multivariate_normal([0.0, 1.0], [[0.01, 0.01], [0.01, 0.04]], count).T
    return {"x": rng.uniform(0.9, 2.1, count), "a": rng.lognormal(0.0, 1.0, count), "m": m, "n": n}


def test_data_alone_make_a_problem_whatever_the_noise():
    table = drawn(200)
    y = {"sum": table["x"] * table["n"] + table["m"], "product": table["x"] * np.log(table["a"])}
    wanted = [Mean(response="sum"), Std(response="product")]
    problem = robust_problem(None, WIDTHS, LOADS, wanted, data=(table, y), progress=False)
    x = np.array([[1.2], [1.8]])
    exact = np.column_stack([x[:, 0], np.sqrt(x[:, 0] ** 2 + 0.01 / 3.0)])
    assert problem.evaluate(x) == pytest.approx(exact, rel=1e-3)
    assert problem.n_runs == len(problem.runs.X) <= 200
    rows = np.column_stack([table[name] for name in problem.input_names])[:5]
    expected = np.column_stack([y["sum"], y["product"]])[:5]
    assert problem.predict(rows) == pytest.approx(expected, rel=1e-6)


def test_data_beyond_the_reach_are_left_out_and_failed_runs_stay_failed():
    x = np.linspace(0.5, 2.0, 91)
    y = np.where(np.arange(91) == 50, np.nan, x**2)
    with pytest.warns(RuntimeWarning) as told:
        problem = robust_problem(None, WIDTHS, data=(x[:, None], y), accuracy=0.1, progress=False)
    assert "24 of 91 runs of data are outside" in str(told[0].message)
    assert problem.failed == pytest.approx(x[50:51, None])
    assert problem.evaluate(np.array([1.5]))[0] == pytest.approx(1.5**2 + 0.01 / 3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("simulator", "data", "words"),
    [
        (None, None, "simulator"),
        (None, (np.ones((5, 1)), np.ones(5)), "simulator"),
        (None, np.ones((50, 2)), "data is"),
        (None, (np.ones((50, 2)), np.ones(50)), "X of data"),
        (None, (np.ones((50, 1)), np.ones(40)), "shape of Y"),
        (None, ({"b": np.ones(50)}, np.ones(50)), "inputs in data"),
        (None, (np.full((50, 1), 7.0), np.ones(50)), "within the reach"),
        (lambda x: {"y": x}, (np.linspace(1.0, 2.0, 20)[:, None], {"z": np.ones(20)}), "names of"),
        (lambda x: 2.0 * x, (np.linspace(1.0, 2.0, 20)[:, None], np.ones(20)), "this simulator"),
    ],
)
def test_data_that_do_not_fit_are_refused_by_name(simulator, data, words):
    with pytest.raises(InvalidInput, match=words):
        robust_problem(simulator, WIDTHS, data=data, progress=False)


@pytest.mark.slow
def test_a_coarser_accuracy_takes_fewer_runs_and_is_met():
    """Growth went on to 2 % of the scatter, whatever was asked for."""

    def wave(x, a, b):
        return np.cos(2.0 + 5.0 * x + 4.0 * a + 3.0 * b)

    inputs = {"x": Design(0.25, 0.75, deviation=0.25)}, dict.fromkeys("ab", scipy.stats.uniform())
    coarse, fine = (
        robust_problem(wave, *inputs, accuracy=accuracy, vectorised=True, progress=False)
        for accuracy in (0.3, 0.02)
    )
    assert coarse.n_runs < 0.8 * fine.n_runs
    x = np.linspace(0.25, 0.75, 9)
    # The mean of exp(i (s + w u)) for u uniform in 0..1 is exp(i (s + w / 2)) sin(w / 2) / (w / 2).
    moments = [
        np.exp(1j * k * (2.0 + 5.0 * x + 3.5))
        * np.prod(np.sinc(k * np.array([2.5, 4.0, 3.0]) / 2.0 / np.pi))
        for k in (1, 2)
    ]
    mean, square = moments[0].real, 0.5 + 0.5 * moments[1].real
    exact = np.column_stack([mean, np.sqrt(square - mean**2)])
    F, band = coarse.evaluate(x[:, None], return_values_of=["F", "F_band"])
    assert np.all(np.abs(F - exact) <= band)
    assert np.all(np.abs(F - exact) <= 0.3 * exact[:, 1:])
