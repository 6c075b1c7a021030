"""Robust problems on disk: the same bytes back, without the simulator; others refused by name."""

import chaospy
import numpy as np
import pytest
import scipy
from places import STORED

from pymoo_hdte._io.archive import FileFormat
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    CVaR,
    Design,
    FailureProbability,
    Mean,
    MeanPlusStd,
    Quantile,
    SimulatorProblem,
    Std,
    WorstCase,
    robust_problem,
)
from pymoo_hdte.problems._simulator.distributions import described, rebuilt
from pymoo_hdte.problems._simulator.statistics import Statistic
from pymoo_hdte.problems._simulator.stored import FORMAT
from pymoo_hdte.surrogate import TruncatedNormal


def simulator(b, h, a, c, n, m):
    return {"y": b * (1.0 + 0.1 * a * h + n) + 0.2 * m, "z": h + c * b}


@pytest.fixture(scope="module")
def problem():
    designs = {
        "b": Design(1.0, 4.0, tolerance=0.05, scale="log"),
        "h": Design(-1.0, 1.0, deviation=chaospy.Triangle(-0.1, 0.0, 0.05)),
    }
    noise = {
        "a": chaospy.Normal(1.0, 0.1) + 0.5,
        "c": scipy.stats.lognorm(s=0.2, scale=0.3),
        ("n", "m"): chaospy.MvNormal([0.0, 1.0], [[0.01, 0.01], [0.01, 0.04]]),
    }
    y, z = {"response": "y"}, {"response": "z"}
    objectives = [Mean(**y), -Std(**z), MeanPlusStd(-2.0, **y), WorstCase("smallest", **z)]
    limits = [Quantile(0.9, **y) <= 5.0, CVaR(0.5, **z) >= -2.0]
    limits.append(FailureProbability(below=0.0, **z) <= 0.5)
    return robust_problem(
        simulator, designs, noise, objectives, limits, accuracy=0.05, progress=False
    )


def designs_of(problem, n=30):
    return np.random.default_rng(1).uniform(problem.xl, problem.xu, (n, problem.n_var))


@pytest.mark.slow
def test_a_round_trip_returns_the_same_bytes(problem, tmp_path):
    problem.save(tmp_path / "one.npz")
    again = SimulatorProblem.load(tmp_path / "one.npz")
    again.save(tmp_path / "two.npz")
    assert (tmp_path / "two.npz").read_bytes() == (tmp_path / "one.npz").read_bytes()
    X = designs_of(problem)
    both = (one.evaluate(X, return_values_of=["F", "G", "F_band"]) for one in (problem, again))
    for expected, found in zip(*both, strict=True):
        assert found.tobytes() == expected.tobytes()
    for name in ("obj_names", "var_names", "input_names", "n_runs", "degrees", "n_ieq_constr"):
        assert getattr(again, name) == getattr(problem, name)
    assert again.accuracy.tobytes() == problem.accuracy.tobytes()
    ours, theirs = (one.sobol_indices(X[0], "y") for one in (problem, again))
    assert ours.total.tobytes() == theirs.total.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("simulator", "tails"),
    [(lambda x, a: x * a, True), (lambda x, a: 1.0 / (3.0 + (a - x) ** 2), False)],
)
def test_scatter_beyond_all_runs_counts_again_as_it_did(simulator, tails, tmp_path):
    """That of a polynomial counts; one of a bell curve runs away there, and it is left out."""
    problem = robust_problem(
        simulator,
        {"x": Design(1.0, 2.0)},
        {"a": scipy.stats.norm()},
        accuracy=0.05,
        progress=False,
    )
    problem.save(tmp_path / "one.npz")
    assert FORMAT.read(tmp_path / "one.npz")[0]["tails"] == [True, tails]
    again = SimulatorProblem.load(tmp_path / "one.npz")
    X = designs_of(problem)
    assert np.array_equal(again.evaluate(X), problem.evaluate(X))


def test_a_file_of_version_1_still_gives_its_numbers():
    """y = x (a + 1) with a uniform in 0..1, so that y has mean 1.5 x and deviation x / sqrt(12)."""
    problem = SimulatorProblem.load(STORED / "robust_problem_version_1.npz")
    assert problem.var_names == ("x",)
    assert problem.evaluate(np.array([[1.5]]))[0] == pytest.approx(
        [2.25, 1.5 / np.sqrt(12.0)], rel=1e-9
    )


@pytest.mark.parametrize(
    "given",
    [
        chaospy.Normal(1.0 / 3.0, 0.1),
        chaospy.Normal(0.0, 0.3) + 3.0,
        chaospy.Trunc(chaospy.Normal(0.0, 1.0), upper=1.0),
        chaospy.Beta(2.0, 3.0, 1.0, 2.0),
        chaospy.MvNormal(np.array([0.1, 1 / 3]), np.array([[1.0, 0.1 / 3], [0.1 / 3, 2.0]])),
        chaospy.Nataf(chaospy.J(chaospy.Uniform(), chaospy.Gamma(2)), [[1.0, 0.5], [0.5, 1.0]]),
        scipy.stats.truncnorm(-1.0, 2.0, loc=np.float64(0.1)),
        TruncatedNormal(0.1, 1 / 3, 2.5),
    ],
)
def test_distributions_come_back_to_the_last_bit(given):
    again = rebuilt("d", described("d", given))
    if isinstance(given, TruncatedNormal):
        assert again == given
        return
    p = np.random.default_rng(5).random((len(given) if hasattr(given, "inv") else 1, 200))
    ask = "inv" if hasattr(given, "inv") else "ppf"
    assert (
        np.asarray(getattr(again, ask)(p)).tobytes() == np.asarray(getattr(given, ask)(p)).tobytes()
    )


class Own(chaospy.Normal):
    """A distribution of a user."""


class OwnStatistic(Statistic):
    """A statistic of a user."""


COMMON = chaospy.Uniform(0.0, 1.0)


@pytest.mark.parametrize(
    "given",
    [
        chaospy.GaussianKDE([1.0, 2.0, 3.0]),
        Own(0.0, 1.0),
        chaospy.J(COMMON, COMMON + chaospy.Normal(0.0, 1.0)),
        scipy.stats.Normal(mu=1.0, sigma=2.0),
        7,
    ],
)
def test_distributions_that_would_come_back_otherwise_are_not_saved(given):
    with pytest.raises(InvalidInput, match=r"noise\['a'\].*cannot be saved"):
        described("noise['a']", given)


@pytest.mark.parametrize(
    "words",
    [
        {"chaospy": "__import__('os').system('true')"},
        {"chaospy": "quad_gaussian(3)"},
        {"chaospy": "Normal(mu=open('x'))"},
        {"chaospy": "Normal(mu=0, sigma=1).pdf"},
        {"chaospy": "1"},
        {"chaospy": "(" * 9999},
        {"chaospy": 3},
        {"scipy": ["linregress", [], {}]},
        {"scipy": ["norm", ["a"], {}]},
        {"scipy": ["norm", [], {"scale": 1.0, "seed": 3}]},
        {"truncated_normal": [0.0, -1.0, 3.0]},
        {"pickle": "..."},
        {},
        "Normal()",
    ],
)
def test_a_file_calls_nothing_but_distributions(words):
    with pytest.raises(InvalidInput, match="noise"):
        rebuilt("noise['a']", words)


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Header and arrays of the file of a small problem."""
    path = tmp_path_factory.mktemp("stored") / "whole.npz"
    designs, noise = {"b": Design(1.0, 4.0)}, {"a": scipy.stats.uniform(0.0, 1.0)}
    mean = [Mean(response="y")]
    robust_problem(
        lambda b, a: {"y": a * b, "z": a + b}, designs, noise, mean, progress=False
    ).save(path)
    return FORMAT.read(path)


def changed(parts, path, **changes):
    """Write a problem with parts of its header or arrays changed."""
    header, arrays = (dict(part) for part in parts)
    header |= {key: changes[key] for key in changes if key in header}
    arrays |= {key: changes[key] for key in changes if key in arrays}
    FileFormat(FORMAT.name, FORMAT.version, FORMAT.fields, FORMAT.arrays).write(
        path, header, **arrays
    )
    return path


DESIGN = {"lower": 1.0, "upper": 4.0, "tolerance": 0.0, "deviation": 0.0, "scale": "linear"}
Y = {"sign": 1.0, "response": "y"}
MEAN = {"kind": "Mean", **Y}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"designs": {}}, "designs"),
        ({"designs": {"b": {"lower": 0.0}}}, "fields of 'b'"),
        ({"designs": {"b": {**DESIGN, "upper": 0.5}}}, "upper is"),
        # What is missing would come back as its default: another scatter, another statistic.
        ({"designs": {"b": {k: DESIGN[k] for k in DESIGN if k != "tolerance"}}}, "fields of 'b'"),
        ({"objectives": [{"kind": "Mean", "sign": 1.0}]}, "fields of Mean"),
        ({"objectives": [{"kind": "MeanPlusStd", **Y}]}, "fields of MeanPlusStd"),
        (
            {"constraints": [{"statistic": MEAN, "bound": 1.0, "side": True}]},
            "side",
        ),
        ({"noise": [["a", {"chaospy": "Normal(0, -1)"}]]}, r"noise\['a'\]"),
        ({"noise": 3}, "path is"),
        ({"objectives": []}, "objectives are missing"),
        ({"objectives": [{"kind": "Object", "sign": 1.0}]}, "statistic of the file"),
        ({"objectives": [{"kind": "Mean", **Y, "sign": 2.0}]}, "sign of a statistic"),
        ({"objectives": [{"kind": "Mean", "sign": 1.0, "response": "w"}]}, "response of a"),
        ({"objectives": [{"kind": "CVaR", **Y, "p": 7.0}]}, "p is 7"),
        ({"responses": "yz"}, "names of the responses"),
        ({"responses": ["y", "y"]}, "names of the responses"),
        ({"responses": ["y"]}, "shape of coefficients"),
        ({"n_runs": -1}, "n_runs"),
        ({"tails": [True, 1]}, "tails"),
        ({"indices": np.full((9, 2), 0.5)}, "shape of indices"),
        ({"mean_error": np.full(2, np.nan)}, "mean_error of the file"),
        ({"std_error": np.array([0.1, -0.1])}, "std_error of the file"),
        ({"held_out_error": np.zeros((1, 2))}, "shape of held_out_error"),
    ],
)
def test_parts_that_make_no_problem_are_named(parts, tmp_path, changes, message):
    with pytest.raises(InvalidInput, match=message):
        SimulatorProblem.load(changed(parts, tmp_path / "file", **changes))


@pytest.mark.parametrize("degree", [0.5, -1.0, 101.0, 1e300, np.nan])
def test_degrees_of_the_file_are_small_whole_numbers(parts, tmp_path, degree):
    indices = parts[1]["indices"].copy()
    indices[-1, 0] = degree
    with pytest.raises(InvalidInput, match="indices of the file"):
        SimulatorProblem.load(changed(parts, tmp_path / "file", indices=indices))


def test_a_term_is_in_the_file_once(parts, tmp_path):
    """Moments and values of a polynomial with a doubled term may not agree."""
    indices = parts[1]["indices"].copy()
    indices[-1] = indices[0]
    with pytest.raises(InvalidInput, match="indices of the file"):
        SimulatorProblem.load(changed(parts, tmp_path / "file", indices=indices))


@pytest.mark.parametrize("place", [0, 1])
def test_terms_below_a_term_are_in_the_file(parts, tmp_path, place):
    """Moments are computed on a set with all of them: without the constant the mean was wrong."""
    _, arrays = parts
    order = np.argsort(arrays["indices"].sum(axis=1), kind="stable")
    kept = np.delete(order, place)
    fewer = {"indices": arrays["indices"][kept], "coefficients": arrays["coefficients"][:, kept]}
    with pytest.raises(InvalidInput, match="indices of the file"):
        SimulatorProblem.load(changed(parts, tmp_path / "file", **fewer))
