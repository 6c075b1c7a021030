"""Scenarios, whole numbers and intervals as noise, against sums and maxima in closed form."""

import chaospy
import numpy as np
import pytest
import scipy.stats
from scipy.stats import norm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    CVaR,
    Design,
    FailureProbability,
    Interval,
    Mean,
    MeanPlusStd,
    Quantile,
    Response,
    Scenarios,
    SimulatorProblem,
    Std,
    WorstCase,
    failure_probability,
    robust_problem,
)

X = np.linspace(0.0, 1.0, 9)[:, None]
DESIGN = {"x": Design(0.0, 1.0)}


def made(simulator, noise, *objectives, designs=DESIGN, **options):
    settings = {"progress": False, "vectorised": True} | options
    return robust_problem(simulator, designs, noise, objectives or (Mean(), Std()), **settings)


def test_moments_over_scenarios_are_weighted_sums():
    values, weights = np.array([-1.0, 0.5, 2.0, 2.5]), np.array([1.0, 3.0, 4.0, 2.0])

    def simulator(x, case, load):
        return (1.0 + x) * np.exp(case) + case * load

    problem = made(simulator, {"case": Scenarios(values, weights), "load": norm(0.0, 0.5)})
    shares = weights / weights.sum()
    by_case = (1.0 + X) * np.exp(values)
    mean = by_case @ shares
    variance = (by_case - mean[:, None]) ** 2 @ shares + 0.25 * values**2 @ shares
    np.testing.assert_allclose(problem.evaluate(X), np.column_stack([mean, variance**0.5]), 1e-7)
    assert problem.degrees["case"] == len(values) - 1


def test_a_scenario_sets_several_inputs_at_once():
    rows = np.array([[3.0, -1.0], [1.0, 2.0], [4.0, 2.0]])
    seen = set()

    def simulator(x, speed, load):
        seen.update(zip(np.ravel(speed), np.ravel(load), strict=True))
        return np.sin(speed) * (x + load)

    noise = {("speed", "load"): Scenarios(rows.tolist()), "other": norm()}
    problem = made(lambda x, speed, load, other: simulator(x, speed, load) + 0 * other, noise)
    assert seen == set(map(tuple, rows.tolist()))
    values = np.sin(rows[:, 0]) * (X + rows[:, 1])
    exact = np.column_stack([values.mean(axis=1), values.std(axis=1)])
    np.testing.assert_allclose(problem.evaluate(X), exact, atol=1e-9)
    assert problem.input_names == ("x", "speed", "load", "other")
    given = np.array([[0.25, *row, 0.3] for row in rows])
    np.testing.assert_allclose(problem.predict(given)[:, 0], simulator(0.25, *rows.T), atol=1e-9)
    assert problem.sobol_indices([0.5]).names == ("x", "speed, load", "other")
    again = made(lambda x, speed, load, other: simulator(x, speed, load), noise, data=problem.runs)
    np.testing.assert_allclose(again.evaluate(X), exact, atol=1e-9)


@pytest.mark.parametrize(
    ("distribution", "same"),
    [
        (scipy.stats.binom(6, 0.3), scipy.stats.binom(6, 0.3)),
        (scipy.stats.poisson(4.0), scipy.stats.poisson(4.0)),
        (chaospy.DiscreteUniform(2, 5), scipy.stats.randint(2, 6)),
    ],
)
def test_whole_numbers_have_the_moments_of_their_distribution(distribution, same):
    seen = []

    def simulator(x, count):
        seen.append(count)
        return count**2 + x * count

    problem = made(simulator, {"count": distribution})
    assert all(np.all(part == np.round(part)) for part in seen)
    mean = same.expect(lambda n: n**2) + X[:, 0] * same.mean()
    square = [same.expect(lambda n, x=x: (n**2 + x * n) ** 2) for x in X[:, 0]]
    exact = np.column_stack([mean, np.sqrt(np.array(square) - mean**2)])
    # The sum of a distribution without an end is cut where 1e-9 is left.
    np.testing.assert_allclose(problem.evaluate(X), exact, 3e-6)


@pytest.mark.parametrize(
    "distribution",
    [
        scipy.stats.binom(4, 0.3, loc=0.5),
        scipy.stats.rv_discrete(values=([0, 1.5, 4], [0.2, 0.3, 0.5]))(),
    ],
)
def test_values_between_whole_numbers_are_not_rounded(distribution):
    with pytest.raises(InvalidInput, match=r"noise\['count'\].* of at most 10000 whole numbers"):
        made(lambda x, count: x + count, {"count": distribution})


def test_tails_over_scenarios_are_those_of_the_mixture():
    values, weights = np.array([0.0, 1.0, 3.0]), np.array([0.7, 0.2, 0.1])
    goals = Quantile(0.99), FailureProbability(above=6.0), WorstCase(), CVaR(0.9)
    noise = {"case": Scenarios(values, weights), "load": norm(0.0, 0.6)}
    problem = made(lambda x, case, load: case + load + 0 * x, noise, *goals)
    F, band = problem.evaluate(X[:1], return_values_of=["F", "F_band"])

    def above(limit):
        return weights @ norm.sf(limit - values, scale=0.6)

    quantile = scipy.optimize.brentq(lambda limit: above(limit) - 0.01, 0.0, 9.0)
    box = norm(0.0, 0.6).ppf(1.0 - 1e-5)
    start = scipy.optimize.brentq(lambda limit: above(limit) - 0.1, 0.0, 9.0)
    beyond = start + scipy.integrate.quad(above, start, 9.0)[0] / 0.1
    exact = np.array([quantile, above(6.0), 3.0 + box, beyond])
    assert np.all(np.abs(F[0] - exact) <= np.nan_to_num(band[0]) + 1e-9 * exact)
    assert band[0, 1] < 0.3 * exact[1]


def test_a_rare_failure_in_one_scenario():
    noise = {"case": Scenarios([0.0, 2.0], [0.99, 0.01]), "load": norm()}
    event = Response() > 5.0
    rare = failure_probability(
        lambda case, load: case + load, noise, event, vectorised=True, progress=False
    )
    low, high = rare.interval
    assert low <= 0.99 * norm.sf(5.0) + 0.01 * norm.sf(3.0) <= high
    assert high < 2.0 * low


def test_every_goal_has_its_own_worst_values_of_an_interval():
    def simulator(x, heat, load):
        return (x - heat) ** 2 + heat * load

    # The mean is worst at an end that depends on the design, the deviation at the upper end.
    noise = {"heat": Interval(0.2, 0.6), "load": norm(0.0, 2.0)}
    limits = [MeanPlusStd(-1.0) >= -5.0]
    problem = made(simulator, noise, Mean(), Std(), -Mean(), constraints=limits)
    assert (problem.n_var, problem.var_names) == (1, ("x",))
    X_smooth = np.array([[0.1], [0.35], [0.7], [0.9]])
    x = X_smooth[:, 0]
    values = ["F", "G", "dF", "F_band"]
    F, G, dF, band = problem.evaluate(X_smooth, return_values_of=values)
    worst = np.where(x < 0.4, 0.6, 0.2)
    best = np.clip(x, 0.2, 0.6)
    exact = np.column_stack([(x - worst) ** 2, np.full(4, 1.2), -((x - best) ** 2)])
    np.testing.assert_allclose(F, exact, atol=1e-9)
    slopes = np.column_stack([2.0 * (x - worst), np.zeros(4), -2.0 * (x - best)])
    np.testing.assert_allclose(dF[..., 0], slopes, atol=1e-4)
    ends = np.linspace(0.2, 0.6, 10_001)
    least = np.min((x[:, None] - ends) ** 2 - 2.0 * ends, axis=1)
    np.testing.assert_allclose(G[:, 0], -5.0 - least, atol=1e-7)
    assert band.shape == F.shape
    _, values = problem.scatter([0.1])
    assert values.mean() == pytest.approx(0.25, abs=0.1)


def test_the_worst_of_two_intervals_may_lie_inside_them():
    def simulator(x, a, b, load):
        apart, beside = a - x, b - 0.5 * x
        return (1.0 + load) * (1.0 - apart**2 - beside**2 + 1.4 * apart * beside)

    noise = {"a": Interval(-0.5, 1.5), "load": norm(0.0, 0.1), "b": Interval(-1.0, 1.0)}
    problem = made(simulator, noise, -Mean(), Mean())
    corners = [np.array([a, b]) for a in (-0.5, 1.5) for b in (-1.0, 1.0)]
    least = [np.min([simulator(x, *corner, 0.0) for corner in corners]) for x in X[:, 0]]
    # The smallest of a concave function lies in a corner, its largest here within.
    np.testing.assert_allclose(problem.evaluate(X), np.column_stack([-np.array(least), X**0]), 1e-6)


@pytest.mark.slow
def test_the_worst_of_a_response_that_no_polynomial_is_lies_within_the_band():
    noise = {"a": Interval(-0.5, 1.5), "load": norm(0.0, 0.1)}
    problem = made(lambda x, a, load: np.exp(-2.0 * (a - x) ** 2) * (1.0 + load), noise)
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    assert np.mean(np.abs(F - [1.0, 0.1]) <= band) >= 0.95
    assert np.all(band < 0.01)


def test_without_any_other_noise_an_interval_makes_a_minimax_problem():
    problem = made(lambda x, a: np.abs(x - 0.5) ** 2 + a * x, {"a": Interval(-1.0, 1.0)}, Mean())
    np.testing.assert_allclose(problem.evaluate(X), (X - 0.5) ** 2 + X, atol=1e-9)


def test_they_are_in_the_file_of_a_problem(tmp_path):
    noise = {
        "heat": Interval(0.2, 0.6),
        ("speed", "load"): Scenarios([(1.0, 2.0), (3.0, 0.0)], [1, 3]),
        "count": scipy.stats.binom(3, 0.5),
    }
    problem = made(lambda x, heat, speed, load, count: x * heat * speed + load * count, noise)
    problem.save(tmp_path / "problem.npz")
    loaded = SimulatorProblem.load(tmp_path / "problem.npz")
    values = ["F", "dF", "F_band"]
    ours, theirs = (one.evaluate(X, return_values_of=values) for one in (problem, loaded))
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(mine, other)


@pytest.mark.parametrize(
    ("noise", "field"),
    [
        ({"a": lambda: Scenarios([1.0, 1.0])}, "values"),
        ({"a": lambda: Scenarios([])}, "values"),
        ({"a": lambda: Scenarios([1.0, 2.0], [1.0, 0.0])}, "weights"),
        ({"a": lambda: Scenarios([1.0, 2.0], [1.0])}, "shape of weights"),
        ({"a": lambda: Scenarios([[1.0, 2.0]])}, "noise[('a',)]"),
        ({("a", "b"): lambda: Scenarios([1.0, 2.0])}, "noise[('a', 'b')]"),
        ({"a": lambda: Interval(1.0, 1.0)}, "upper"),
        ({("a", "b"): lambda: Interval(0.0, 1.0)}, "noise[('a', 'b')]"),
        ({"a": lambda: scipy.stats.poisson(1e9)}, "noise['a']"),
    ],
)
def test_what_is_no_such_noise_is_named(noise, field):
    with pytest.raises(InvalidInput) as error:
        made(lambda **inputs: 0.0, {key: make() for key, make in noise.items()})
    assert error.value.field == field


def test_an_interval_has_no_probability_of_failure():
    with pytest.raises(InvalidInput, match="Interval has no probability"):
        failure_probability(lambda a: a, {"a": Interval(0.0, 1.0)}, Response() > 0.5)
