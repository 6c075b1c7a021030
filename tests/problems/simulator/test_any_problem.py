"""The robust counterpart of any pymoo problem: on a surrogate, or at common draws."""

import copy
import pickle

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Choice, Integer, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from scipy.stats import norm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    FailureProbability,
    Mean,
    Quantile,
    Robust,
    Std,
    UntrustedSurrogate,
    WorstCase,
)

pytestmark = pytest.mark.filterwarnings("ignore:the problem is not finite beyond its bounds")


class Quadratic(Problem):
    """The sum of squares of 30 variables, limited to at least 1 from below."""

    def __init__(self):
        super().__init__(n_var=30, n_obj=1, n_ieq_constr=1, xl=-1.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.sum(x**2, axis=1)
        out["G"] = 1.0 - x[:, :1]


class Mixed(ElementwiseProblem):
    """A product of a real and a whole number, with a shift that is chosen."""

    def __init__(self):
        kinds = {
            "a": Real(bounds=(0.0, 1.0)),
            "n": Integer(bounds=(1, 5)),
            "shift": Choice(options=["none", "one"]),
        }
        super().__init__(vars=kinds, n_obj=1)

    def _evaluate(self, X, out, *args, **kwargs):
        out["F"] = X["a"] * X["n"] + (X["shift"] == "one")


def test_moments_of_thirty_variables_are_within_their_bands():
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 30))
    # s = 0.1 (2 u - 1): variance of (x + s)^2 is 4 x^2 var(s) + var(s^2).
    mean = np.sum(X**2 + 0.01 / 3.0, axis=1)
    std = np.sqrt(np.sum(4.0 * X**2 * 0.01 / 3.0 + 1e-4 * (0.2 - 1.0 / 9.0), axis=1))
    truth = np.column_stack([mean, std])
    objectives = [statistic(response="F1") for statistic in (Mean, Std, WorstCase)]
    covered = []
    for seed in range(40):
        problem = Robust(Quadratic(), 0.1, objectives, seed=seed, progress=False)
        F, band, G = problem.evaluate(X, return_values_of=["F", "F_band", "G"])
        covered.append(np.abs(F[:, :2] - truth) <= band[:, :2])
    assert np.mean(covered, axis=(0, 1)) == pytest.approx(0.95, abs=0.06)
    assert np.all(F[:, 2] > mean + std)
    assert G[:, 0] == pytest.approx(1.0 - X[:, 0] + 3.0 * 0.1 / 3.0**0.5, abs=3e-3)
    assert problem.n_runs == 3 * 128


def test_designs_share_their_draws():
    """Common random numbers: equal designs are equal, and differences have no sampling error."""
    problem = Robust(Quadratic(), scatter=norm(0.0, 0.1), method="direct", progress=False)
    X = np.zeros((2, 30))
    X[1, 3] = 1e-6
    F = problem.evaluate(X, return_values_of=["F"])
    assert abs(F[1, 0] - F[0, 0]) < 1e-7
    again = pickle.loads(pickle.dumps(copy.deepcopy(problem)))
    assert np.array_equal(again.evaluate(X, return_values_of=["F"]), F)


def test_real_variables_of_a_mixed_problem_scatter():
    problem = Robust(Mixed(), scatter={"a": 0.1}, objectives=[Std(response="F1")], progress=False)
    X = np.array([{"a": 0.5, "n": n, "shift": "one"} for n in (1, 4)], dtype=object)
    F = problem.evaluate(X)
    assert F.ravel() == pytest.approx([0.1 / 3**0.5, 0.4 / 3**0.5], rel=1e-2)
    result = minimize(problem, MixedVariableGA(pop_size=10), ("n_gen", 5), seed=1)
    assert result.X["n"] == 1


def test_a_surrogate_is_used_where_it_serves():
    problem = Robust(get_problem("bnh"), scatter=0.02, progress=False)
    direct = Robust(get_problem("bnh"), scatter=0.02, method="direct", draws=512, progress=False)
    X = np.random.default_rng(1).uniform(problem.xl, problem.xu, (20, 2))
    F, band = direct.evaluate(X, return_values_of=["F", "F_band"])
    assert problem.n_runs <= 300
    assert np.all(np.abs(problem.evaluate(X, return_values_of=["F"]) - F) <= 2.0 * band + 1e-6)


def test_scatter_stays_inside_where_a_problem_ends_at_its_bounds():
    with pytest.warns(RuntimeWarning, match="kept inside"):
        problem = Robust(get_problem("zdt1"), scatter=0.02, progress=False)
    assert problem.clip
    assert np.isfinite(problem.evaluate(np.zeros((1, 30)))).all()
    assert not Robust(get_problem("zdt1"), 0.02, clip=False, progress=False).clip


@pytest.mark.parametrize(
    "name",
    [
        *("zdt1", "zdt2", "zdt3", "zdt4", "zdt6", "bnh", "tnk", "osy", "kursawe", "truss2d"),
        *("welded_beam", "carside", "ctp1", "dtlz1", "dtlz2", "dtlz5", "ackley", "rastrigin"),
        *("rosenbrock", "griewank", "himmelblau", "pressure_vessel", "mw1", "c1dtlz1"),
    ],
)
def test_every_problem_has_a_robust_counterpart(name):
    problem = get_problem(name)
    scatter = (0.01 * (problem.xu - problem.xl)).tolist()
    robust = Robust(problem, scatter, draws=16, method="direct", progress=False)
    result = minimize(robust, NSGA2(8), ("n_gen", 2), seed=1)
    population = result.algorithm.pop
    assert np.isfinite(population.get("F")).all()
    assert np.isfinite(population.get("G")).all()


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["bnh", "tnk", "kursawe", "welded_beam", "truss2d", "dtlz2"])
def test_a_surrogate_or_direct_sampling_serves(name):
    problem = get_problem(name)
    scatter = (0.01 * (problem.xu - problem.xl)).tolist()
    robust = Robust(problem, scatter, budget=100, progress=False)
    direct = Robust(problem, scatter, method="direct", draws=1024, progress=False)
    X = np.random.default_rng(1).uniform(robust.xl, robust.xu, (20, robust.n_var))
    (F, band), (known, own) = (
        each.evaluate(X, return_values_of=["F", "F_band"]) for each in (robust, direct)
    )
    assert np.mean(np.abs(F - known) <= band + own) >= 0.9


def test_a_surrogate_that_has_to_be_is_refused_where_it_does_not_serve():
    with pytest.raises(UntrustedSurrogate):
        Robust(get_problem("ackley"), 0.5, method="surrogate", budget=40, progress=False)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "both"}, "method"),
        ({"draws": 10}, "multiple of 4"),
        ({"method": "surrogate"}, "at most 20"),
        ({"scatter": [0.1]}, "length of scatter"),
        ({"scatter": -0.1}, "scatter of 'x1'"),
        ({"constraints": [Quantile(0.999, response="G1") <= 0.0]}, "at least 10000"),
        ({"constraints": [FailureProbability(above=0.0, response="G1") <= 1e-3]}, "10000"),
    ],
)
def test_what_cannot_be_is_refused(arguments, message):
    given = {"scatter": 0.1, "progress": False} | arguments
    with pytest.raises(InvalidInput, match=message):
        Robust(Quadratic(), **given)
