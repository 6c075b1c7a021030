"""Robust problems in closed form: samples give the statistics, other solvers the fronts."""

import copy
import inspect
import pickle
import pkgutil
from functools import cache
from importlib import import_module
from itertools import product

import numpy as np
import pymoo.algorithms.moo
import pymoo.algorithms.moo.pinsga2
import pytest
import scipy
from night import others_at_night
from pymoo.core.algorithm import Algorithm
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from pymoo.util.ref_dirs import get_reference_directions
from scipy.optimize import differential_evolution

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Robust, WorstCase, robust_benchmarks, robust_problem
from pymoo_hdte.problems._closed_form import (
    DebGupta3,
    DebGupta4,
    DebGupta12,
    ExponentialNoise,
    MeanDTLZ2,
    RobustSrinivas,
    WorstCaseSchaffer,
)
from pymoo_hdte.problems._simulator.sampled_statistics import CVaR, FailureProbability, Quantile
from pymoo_hdte.problems._simulator.statistics import Mean, MeanPlusStd
from pymoo_hdte.surrogate import ExtrapolationError

NAMES = tuple(robust_benchmarks())
CASES = others_at_night(NAMES, "deb_gupta_3", "deb_gupta_4", "srinivas", "toy", "portfolio")
SIMULATED = tuple(name for name in NAMES if name != "toy")


@cache
def built(name):
    return robust_benchmarks()[name]()


def designs(problem, n, seed=1):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (n, problem.n_var))


# --- statistics against samples ---------------------------------------------------------------


def drawn(problem, design, logarithm):
    """Return the responses at points that fill the scatter around a design evenly."""
    noise = problem.noise()
    count = problem.n_var + sum(len(key) if isinstance(key, tuple) else 1 for key in noise)
    share = scipy.stats.qmc.Sobol(count, rng=np.random.default_rng(1)).random_base2(logarithm)
    inputs = {}
    for column, (name, one) in enumerate(problem.designs.items()):
        inputs[name] = design[column] + one.deviation * (2.0 * share[:, column] - 1.0)
    column = problem.n_var
    for key, distribution in noise.items():
        if isinstance(key, tuple):
            inputs |= dict(zip(key, distribution.inv(share[:, column:].T), strict=True))
        else:
            inputs[key] = distribution.ppf(share[:, column])
            column += 1
    return problem.simulator(**inputs)


def at_corners(problem, design):
    reach = [one.deviation for one in problem.designs.values()]
    corners = design + np.array(list(product((-1.0, 1.0), repeat=len(reach)))) * reach
    return problem.simulator(**dict(zip(problem.designs, corners.T, strict=True)))


def sampled(statistic, values, corners):
    of = (lambda table: table[statistic.response]) if statistic.response else _only
    y = of(values)
    if isinstance(statistic, WorstCase):
        return of(corners()).max()
    if isinstance(statistic, Mean):
        return y.mean()
    if isinstance(statistic, MeanPlusStd):
        return y.mean() + statistic.k * y.std()
    if isinstance(statistic, Quantile):
        return np.quantile(y, statistic.p)
    if isinstance(statistic, CVaR):
        return np.sort(y)[int(statistic.p * len(y)) :].mean()
    if isinstance(statistic, FailureProbability):
        return np.mean(y < statistic.below)
    return y.std()


def _only(table):
    (values,) = table.values()
    return values


@pytest.mark.parametrize("name", SIMULATED)
def test_statistics_are_those_of_the_simulator(name):
    problem = built(name)
    front = problem.pareto_set()
    X = np.vstack([designs(problem, 2), front[len(front) // 3]])
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    for row, x in enumerate(X):
        values = drawn(problem, x, 16 if name == "beam_reliability" else 13)

        def corners(x=x):
            return at_corners(problem, x)

        found = [sampled(one, values, corners) for one in problem.objectives]
        assert F[row] == pytest.approx(found, rel=3e-3, abs=3e-4)
        for one, g in zip(problem.constraints, G[row], strict=True):
            value = sampled(one.statistic, values, corners)
            assert one.side * (value - one.bound) == pytest.approx(g, rel=3e-3, abs=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", others_at_night(["exponential_noise", "portfolio"], "exponential_noise")
)
def test_a_surrogate_of_the_simulator_finds_them_within_its_band(name):
    problem = built(name)
    again = robust_problem(problem.simulator, **problem.settings, progress=False)
    X = designs(problem, 40)
    F, band = again.evaluate(X, return_values_of=["F", "F_band"])
    known = problem.evaluate(X, return_values_of=["F"])
    assert np.all(np.mean(np.abs(F - known) <= band + 1e-9, axis=0) >= 0.95)


@pytest.mark.nightly
def test_pymoos_problem_made_robust_is_ours():
    ours, theirs = RobustSrinivas(0.5), Robust(get_problem("srn"), scatter=0.5, progress=False)
    X = designs(ours, 50)
    for key in ("F", "G"):
        found, known = (one.evaluate(X, return_values_of=[key]) for one in (theirs, ours))
        assert found == pytest.approx(known, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("delta", [0.01, 0.1])
def test_the_nodes_of_the_fourth_problem_are_enough(delta):
    problem = DebGupta4(delta)
    for x in designs(problem, 5):
        low = max(x[0] - delta, 0.0)
        over_x1 = scipy.integrate.quad(
            lambda a, x=x: _mean_over_x2(problem, a, x), low, x[0] + delta, epsabs=1e-13
        )
        assert problem.evaluate(x)[1] == pytest.approx(over_x1[0] / (2.0 * delta), rel=1e-10)


def _mean_over_x2(problem, first, x):
    delta = problem.deltas[0]
    g = 50.0 * np.sum(x[2:] ** 2 + problem.deltas[2:] ** 2 / 3.0)

    def at(second):
        zeros = np.zeros((3, 1))
        found = problem.simulator(
            x1=np.array([first]), x2=np.array([second]), **dict(zip("cde", zeros, strict=True))
        )
        return found["f2"][0] / (1.0 - np.sqrt(first)) * (g + 1.0 - np.sqrt(first))

    return scipy.integrate.quad(at, x[1] - delta, x[1] + delta, epsabs=1e-13)[0] / (2.0 * delta)


# --- fronts -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_fronts_are_on_the_problem_feasible_and_undominated(name):
    problem = built(name)
    front, chosen = problem.pareto_front(), problem.pareto_set()
    assert len(front) == len(chosen) >= 990
    F, G = problem.evaluate(chosen, return_values_of=["F", "G"])
    assert front == pytest.approx(F, rel=1e-9, abs=1e-15)
    assert G.max(initial=0.0) < 1e-9
    assert len(NonDominatedSorting().do(front, only_non_dominated_front=True)) == len(front)


def least(problem, limits, objective, start):
    """Return the least value of an objective with limits on the others, by SLSQP from a start."""
    low, width = problem.xl, problem.xu - problem.xl
    size = np.ptp(problem.pareto_front(), axis=0)

    def values(z):
        F, G = problem.evaluate(low + np.clip(z, 0.0, 1.0) * width, return_values_of=["F", "G"])
        return F / size, G

    def slack(z):
        F, G = values(z)
        others = [(limits[k] / size[k] - F[k]) for k in range(len(F)) if np.isfinite(limits[k])]
        return np.concatenate([others, -np.ravel(G)])

    done = scipy.optimize.minimize(
        lambda z: values(z)[0][objective], (start - low) / width, method="SLSQP",
        bounds=[(0.0, 1.0)] * problem.n_var, constraints={"type": "ineq", "fun": slack},
        options={"ftol": 1e-13, "maxiter": 200},
    )  # fmt: skip
    return values(done.x)[0][objective] if slack(done.x).min(initial=0.0) > -1e-7 else np.inf


@pytest.mark.parametrize("name", CASES)
def test_an_independent_solver_finds_the_front_and_nothing_better(name):
    """At levels of the other objectives, from beside the front and from anywhere."""
    problem = built(name)
    front, chosen = problem.pareto_front(), problem.pareto_set()
    width, size = problem.xu - problem.xl, np.ptp(front, axis=0)
    rng = np.random.default_rng(3)
    last = problem.n_obj - 1
    for row in rng.choice(len(front), 3, replace=False):
        limits = np.append(front[row, :last], np.inf)
        beside = chosen[row] + 0.02 * width * rng.uniform(-1.0, 1.0, problem.n_var)
        starts = [np.clip(beside, problem.xl, problem.xu), *designs(problem, 2, seed=row)]
        found = [least(problem, limits, last, start) for start in starts]
        assert min(found) * size[last] == pytest.approx(front[row, last], abs=1e-6 * size[last])


@pytest.mark.parametrize("name", CASES)
def test_fronts_reach_from_one_optimum_to_the_other(name):
    problem = built(name)
    front, chosen = problem.pareto_front(), problem.pareto_set()
    free = np.full(problem.n_obj, np.inf)
    for k, size in enumerate(np.ptp(front, axis=0)):
        start = chosen[front[:, k].argmin()]
        found = least(problem, free, k, 0.98 * start + 0.02 * (problem.xl + problem.xu) / 2.0)
        assert front[:, k].min() == pytest.approx(found * size, abs=2e-6 * size)


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_a_global_search_finds_nothing_below_the_front(name):
    problem = built(name)
    front = problem.pareto_front()
    size = np.ptp(front, axis=0)
    for row in np.linspace(0, len(front) - 1, 5).astype(int):
        # A point below the front in all objectives would have a value below 0.
        def excess(x, row=row):
            F, G = problem.evaluate(x, return_values_of=["F", "G"])
            return np.max((F - front[row]) / size) + 10.0 * np.maximum(G, 0.0).sum()

        found = differential_evolution(
            excess, list(zip(problem.xl, problem.xu, strict=True)), rng=1, maxiter=60, polish=False
        )
        assert found.fun > -1e-6


def test_kinks_pieces_and_switches_are_where_the_problems_have_them():
    steps = np.diff(built("disconnected").pareto_front()[:, 0])
    assert np.sum(steps > 0.1) == 3
    # Of two valleys the narrow one is the best until its mean is not: Deb and Gupta's point.
    for delta, valley in ((0.01, 0.85), (0.027, 0.85), (0.028, 0.35), (0.05, 0.35)):
        second = DebGupta3(delta).pareto_set()[:, 1]
        assert second == pytest.approx(valley, abs=0.02)
    sums = built("deb_gupta_4").pareto_set()[:, :2].sum(axis=1)
    assert np.ptp(sums) > 0.3
    first, second = (built(f"deb_gupta_{k}").pareto_front()[:, 0] for k in (1, 2))
    assert first.max() == pytest.approx(0.99)
    assert second.max() < 0.3


def test_the_front_of_the_fourth_problem_is_the_best_at_its_smallest_box():
    """Were the mean height below 0, as in a smaller box, far from the curve would be better."""
    problem = DebGupta4(DebGupta4.smallest)
    chosen = problem.pareto_set()
    far = chosen.copy()
    far[:, 2:] = problem.xu[2:]
    assert np.all(problem.closed_form(far)[0][:, 1] > problem.closed_form(chosen)[0][:, 1])


def test_a_front_may_be_one_point():
    """With this slope f2 rises from the least x1 on."""
    problem = DebGupta12(beta=2000.0)
    X = designs(problem, 200)
    front = problem.pareto_front()
    assert len(front) == 1
    assert np.all(problem.evaluate(X) >= front)


# --- as problems of pymoo ---------------------------------------------------------------------


def algorithms():
    """Return the classes of all multi-objective algorithms that this pymoo can import."""
    found = {}
    for module in pkgutil.iter_modules(pymoo.algorithms.moo.__path__):
        try:
            parts = vars(import_module(f"pymoo.algorithms.moo.{module.name}"))
        except ModuleNotFoundError:
            continue
        for name, one in parts.items():
            if (
                inspect.isclass(one)
                and issubclass(one, Algorithm)
                and one.__module__.startswith("pymoo.algorithms.moo.")
            ):
                found[name] = one
    return found


ALGORITHMS = algorithms()
NO_CONSTRAINTS = {"MOEAD", "ParallelMOEAD", "DNSGA2", "KGB"}
"""These refuse every problem that has some."""


def made(name, problem):
    """Return an algorithm with what its constructor asks for."""
    takes = inspect.signature(ALGORITHMS[name]).parameters
    arguments = {}
    if "ref_dirs" in takes or name == "NSDER":
        arguments["ref_dirs"] = get_reference_directions(
            "das-dennis", problem.n_obj, n_partitions=19 if problem.n_obj == 2 else 5
        )
    if "ref_points" in takes:
        front = problem.pareto_front()
        arguments["ref_points"] = front[[len(front) // 4, len(front) // 2]]
    if name == "RNSGA3":
        arguments["pop_per_ref_point"] = 10
    elif "pop_size" in takes or (
        "ref_dirs" not in arguments and any(one.kind is one.VAR_KEYWORD for one in takes.values())
    ):
        arguments["pop_size"] = 20
    if name == "PINSGA2":
        # It fails where the first generation has no feasible design.
        arguments |= {"automated_dm": Chooser(), "pop_size": 100}
    return ALGORITHMS[name](**arguments)


class Chooser(pymoo.algorithms.moo.pinsga2.AutomatedDM):
    def makeDecision(self, F):
        return int(np.argmin(F.sum(axis=1)))


def runs(name, problem):
    if name in NO_CONSTRAINTS and problem.has_constraints():
        pytest.skip(f"pymoo's {name} takes no constraints")
    result = minimize(problem, made(name, problem), ("n_gen", 4), seed=1)
    assert np.isfinite(result.pop.get("F")).all()
    assert len(result.pop) > 1


# Some divide by the width of a front of one point when one individual is feasible.
IN_PYMOO = pytest.mark.filterwarnings("ignore:(invalid|divide).* encountered:RuntimeWarning")


@IN_PYMOO
@pytest.mark.parametrize(
    ("name", "problem"),
    [("NSGA2", one) for one in NAMES]
    + [("CTAEA", "portfolio"), ("RVEA", "mean_dtlz2"), ("MOEAD", "deb_gupta_3")],
)
def test_algorithms_of_pymoo_run(name, problem):
    runs(name, built(problem))


@IN_PYMOO
@pytest.mark.nightly
@pytest.mark.parametrize("problem", NAMES)
@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_every_algorithm_of_pymoo_runs_on_every_problem(name, problem):
    runs(name, built(problem))


@pytest.mark.parametrize("name", SIMULATED)
def test_copies_are_the_same_problem(name):
    problem = built(name)
    X = designs(problem, 3)
    for twin in (pickle.loads(pickle.dumps(problem)), copy.deepcopy(problem)):
        assert np.array_equal(
            twin.evaluate(X, return_values_of=["F"]), problem.evaluate(X, return_values_of=["F"])
        )
    with pytest.raises(ExtrapolationError):
        problem.evaluate(X + 2.0 * (problem.xu - problem.xl))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: DebGupta12(delta=0.2), "delta"),
        (lambda: DebGupta12(beta=-1.0), "beta"),
        (lambda: DebGupta3(n_var=1), "n_var"),
        (lambda: DebGupta4(delta=0.003), "delta"),
        (lambda: MeanDTLZ2(n_var=2), "n_var"),
        (lambda: WorstCaseSchaffer("wide"), "deviation"),
        (lambda: RobustSrinivas(2.0), "deviation"),
        (lambda: ExponentialNoise(limit=0.1), "limit"),
    ],
)
def test_wrong_arguments_are_named(make, field):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.field == field
