"""Problems of the peer comparison: the moved ZDT, and true fronts that nothing undercuts."""

import numpy as np
import pytest
from moocore import is_nondominated
from pymoo.problems import get_problem
from scipy.optimize import differential_evolution, minimize

from experiments.studies.contest.benchmark_fronts import (
    WELDED_BEAM,
    even_curve,
    follow_welded_beam,
    front_of,
    wfg_front,
)
from experiments.studies.contest.problems import BENCHMARKS, INTERIOR, MovedZDT, problem_of

TWO_OBJECTIVES = [name for name in BENCHMARKS if not name.startswith(("DTLZ", "RobustDTE"))]


@pytest.mark.parametrize("rotated", [False, True])
@pytest.mark.parametrize("name", ["zdt1", "zdt2", "zdt3", "zdt4", "zdt6"])
def test_moved_optima_give_the_front_of_the_original(name, rotated):
    problem, original = MovedZDT(name, rotated, seed=5), get_problem(name)
    share = (problem.optimum - problem.xl[1:]) / (problem.xu - problem.xl)[1:]
    assert np.all((INTERIOR[0] <= share) & (share <= INTERIOR[1]))
    first = np.linspace(0.0, 1.0, 7)
    best = np.column_stack([first, np.tile(problem.optimum, (7, 1))])
    at_rest = np.column_stack([first, np.zeros((7, problem.n_var - 1))])
    np.testing.assert_allclose(problem.evaluate(best), original.evaluate(at_rest), atol=1e-12)


@pytest.mark.parametrize("name", ["zdt1", "zdt4"])
def test_a_moved_problem_is_the_original_of_the_turned_distance(name, rng):
    problem = MovedZDT(name, rotated=True, seed=9)
    np.testing.assert_allclose(
        problem.rotation @ problem.rotation.T, np.eye(problem.n_var - 1), atol=1e-12
    )
    # A step along a turned axis is a step along one axis of the original.
    step = 0.2
    x = np.concatenate([[0.3], problem.optimum + step * problem.rotation[2]])
    along_axis = np.zeros(problem.n_var)
    along_axis[[0, 3]] = 0.3, step
    np.testing.assert_allclose(
        problem.evaluate(x), get_problem(name).evaluate(along_axis), rtol=1e-12
    )


def test_the_seed_decides_the_place_and_the_same_problem_comes_back():
    one, again, other = (MovedZDT("zdt1", True, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.optimum, again.optimum)
    np.testing.assert_array_equal(one.rotation, again.rotation)
    assert not np.allclose(one.optimum, other.optimum)


@pytest.mark.parametrize("name", BENCHMARKS)
def test_true_fronts_are_fronts_and_no_random_design_undercuts_them(name, rng):
    problem, front = problem_of(name), front_of(name)
    assert front.shape[1] == problem.n_obj
    assert is_nondominated(front).all()
    X = problem.xl + rng.random((20_000, problem.n_var)) * (problem.xu - problem.xl)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    F = F[np.all(G <= 0.0, axis=1)]
    F = F[is_nondominated(F)]
    span = np.ptp(front, axis=0)
    margin = ((front[:, np.newaxis] - F) / span).min(axis=2)
    assert margin.max() < 1e-6


@pytest.mark.parametrize("name", TWO_OBJECTIVES)
def test_fronts_are_dense_but_for_their_gaps(name):
    front = front_of(name)
    assert len(front) > 350
    normal = (front - front.min(axis=0)) / np.ptp(front, axis=0)
    steps = np.linalg.norm(np.diff(normal, axis=0), axis=1)
    # WFG2 has five gaps, ZDT3 has four and TNK two.
    assert np.sum(steps > 0.0105) <= 5


@pytest.mark.parametrize("number", range(1, 10))
def test_wfg_fronts_are_what_pymoo_finds_at_the_optimal_distances(number):
    problem = problem_of(f"WFG{number}")
    # The Pareto set of pymoo: random positions, each with its own best distances.
    positions = problem._rand_optimal_position(300, random_state=np.random.default_rng(number))
    F = problem.evaluate(problem._positional_to_optimal(positions))
    # WFG1 raises distances to the power 0.02, by which the rounding of 0.35, 5.6e-17, becomes
    # 0.07 in both objectives: in floating point no design comes closer to its front.
    rounding = 0.0694639 if number == 1 else 0.0
    normal = (F - rounding) / [2.0, 4.0]
    front = wfg_front(number) / [2.0, 4.0]
    found = np.array([np.linalg.norm(front - f, axis=1).min() for f in normal])
    dominated = np.array([np.all(front <= f + 1e-9, axis=1).any() for f in normal])
    # WFG1's and WFG2's shapes hold points that others dominate; all the rest lie on the front.
    on_front = found < 2e-3
    assert np.all(on_front | dominated)
    assert on_front.mean() > 0.2


@pytest.mark.parametrize("name", ["BNH", "SRN"])
def test_weighted_sums_are_least_on_the_front(name):
    problem, front = problem_of(name), front_of(name)
    for weight in (0.02, 0.1, 0.4, 0.6, 0.9, 0.98):
        weights = np.array([weight, 1.0 - weight])

        def total(x, weights=weights):
            return float(problem.evaluate(x, return_values_of=["F"]) @ weights)

        def slack(x):
            return -problem.evaluate(x, return_values_of=["G"])

        ends = [
            minimize(
                total,
                start,
                method="SLSQP",
                bounds=list(zip(problem.xl, problem.xu, strict=True)),
                constraints={"type": "ineq", "fun": slack},
            )
            for start in ((1.0, 2.0), (-3.0, 8.0), (4.0, 4.0))
        ]
        least = min(end.fun for end in ends if end.success and slack(end.x).min() > -1e-6)
        assert least == pytest.approx((front @ weights).min(), abs=2e-3 * np.ptp(front @ weights))


def test_srn_has_the_stretches_along_its_constraints_that_pymoo_leaves_out():
    ours, theirs = front_of("SRN"), get_problem("srn").pareto_front()
    assert np.all(ours.min(axis=0) < theirs.min(axis=0) - 4.0)


def test_osy_front_has_the_published_ends():
    front = front_of("OSY")
    np.testing.assert_allclose(front[[0, -1]], [[-274.0, 76.0], [-42.0, 4.0]], atol=1e-6)


# SciPy before 1.16 tells of steps that it cuts to the bounds.
@pytest.mark.filterwarnings("ignore:Values in x were outside bounds:RuntimeWarning")
def test_the_stored_welded_beam_is_what_the_solver_finds():
    stored = np.loadtxt(WELDED_BEAM, delimiter=",", skiprows=1)
    some = stored[[0, 1, 600, 1000, -1]]
    again = follow_welded_beam(problem_of("WeldedBeam"), some[:, 1])
    np.testing.assert_allclose(again, some, rtol=1e-5)
    # The least cost that the literature gives (Deb 2000: 2.38).
    assert stored[:, 0].min() == pytest.approx(2.381, abs=1e-3)


@pytest.mark.nightly
@pytest.mark.parametrize("row", [0, 800])
def test_the_welded_beam_is_feasible_and_as_cheap_as_another_solver_makes_it(row):
    problem = problem_of("WeldedBeam")
    cost, deflection = np.loadtxt(WELDED_BEAM, delimiter=",", skiprows=1)[row]

    def penalised(x):
        F, G = problem.evaluate(x, return_values_of=["F", "G"])
        violation = np.maximum(np.append(G, F[1] / deflection - 1.0), 0.0).sum()
        return F[0] + 1e3 * violation

    found = differential_evolution(
        penalised,
        list(zip(problem.xl, problem.xu, strict=True)),
        rng=np.random.default_rng(row),
        popsize=20,
        maxiter=400,
        tol=1e-10,
    )
    # A penalty may be paid with up to a thousandth of a unit of cost, no more.
    assert found.fun == pytest.approx(cost, rel=2e-3)
    assert found.fun >= cost * (1.0 - 1e-6)


def test_even_curves_keep_both_ends_of_every_gap():
    line = np.linspace(0.0, 1.0, 5001)
    curve = np.column_stack([line, 1.0 - line])
    holed = curve[(line < 0.3) | (line > 0.5)]
    kept = even_curve(holed)
    gap = np.argmax(np.diff(kept[:, 0]))
    np.testing.assert_allclose(kept[[gap, gap + 1], 0], [0.3, 0.5], atol=5e-4)
    assert len(kept) == pytest.approx(1000, abs=5)
