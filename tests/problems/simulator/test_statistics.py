"""Statistics of a response against closed forms, their gradients and their stated errors."""

from itertools import product
from types import SimpleNamespace

import chaospy
import numpy as np
import pytest
from scipy.stats import norm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    CVaR,
    Design,
    FailureProbability,
    Mean,
    MeanPlusStd,
    Quantile,
    Response,
    Std,
    WorstCase,
    robust_problem,
)
from pymoo_hdte.problems._simulator.around import Around, CommonSamples

LIMIT = 3.5
ASKED = (
    *(Mean(), Std(), MeanPlusStd(2.0), Quantile(0.9), CVaR(0.9), WorstCase()),
    *(WorstCase("smallest"), FailureProbability(above=LIMIT), FailureProbability(below=LIMIT)),
)


def response(x, a, b):
    return x + x * a + 0.5 * b


@pytest.fixture(scope="module")
def problem():
    """A response that is normal: mean x, variance 0.01 x^2 + 0.01."""
    noise = {"a": chaospy.Normal(0.0, 0.1), "b": chaospy.Normal(0.0, 0.2)}
    return robust_problem(
        response, {"x": Design(2.0, 4.0)}, noise, objectives=ASKED, progress=False
    )


@pytest.mark.nightly
def test_very_many_designs_have_the_objectives_and_constraints_of_few():
    several = robust_problem(
        lambda x, y, a: {"first": x * y + a, "second": x - y * a},
        {"x": Design(2.0, 4.0, tolerance=0.1), "y": Design(1.0, 2.0)},
        {"a": chaospy.Normal(0.0, 0.1)},
        objectives=[-Mean(response="second"), Std(response="first")],
        constraints=[MeanPlusStd(3.0, response="first") >= 5.0, Mean(response="second") <= 1.0],
        progress=False,
    )
    X = np.random.default_rng(1).uniform(several.xl, several.xu, (4500, 2))
    few = [several.evaluate(part) for part in np.split(X, 3)]
    for many, expected in zip(several.evaluate(X), zip(*few, strict=True), strict=True):
        assert many == pytest.approx(np.concatenate(expected), rel=1e-12, abs=1e-12)


def test_statistics_of_a_normal_response_are_closed_forms(problem):
    x = np.linspace(2.0, 4.0, 9)
    F, band = problem.evaluate(x[:, None], return_values_of=["F", "F_band"])
    std = 0.1 * np.hypot(x, 1.0)
    z = norm.ppf(0.9)
    reach = norm.ppf(1.0 - 1e-5)
    worst = (0.1 * x + 0.1) * reach
    failing = norm.sf((LIMIT - x) / std)
    truth = np.column_stack(
        [
            *(x, std, x + 2.0 * std, x + z * std, x + norm.pdf(z) / 0.1 * std),
            *(x + worst, x - worst, failing, 1.0 - failing),
        ]
    )
    assert F[:, [0, 1, 2]] == pytest.approx(truth[:, [0, 1, 2]], rel=1e-9)
    assert F[:, [5, 6]] == pytest.approx(truth[:, [5, 6]], rel=1e-6)
    assert np.all(np.abs(F - truth)[:, 3:5] < 0.02 * std[:, None])
    assert np.all(np.abs(F - truth)[:, 7:] < 0.01)
    assert np.all(np.abs(F - truth)[:, :3] <= band[:, :3] + 1e-9)
    assert np.isnan(band[:, 5:7]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statistic", "reach"),
    [
        (Quantile(0.9), norm.ppf(0.9)),
        pytest.param(Quantile(0.05), norm.ppf(0.05), marks=pytest.mark.nightly),
        pytest.param(CVaR(0.9), norm.pdf(norm.ppf(0.9)) / 0.1, marks=pytest.mark.nightly),
        (FailureProbability(above=LIMIT), None),
    ],
)
def test_the_band_of_a_sampled_statistic_covers_it_for_most_seeds(problem, statistic, reach):
    x = np.array([2.5, 3.2])
    std = 0.1 * np.hypot(x, 1.0)
    truth = norm.sf((LIMIT - x) / std) if reach is None else x + reach * std
    moments = problem._fit.moments
    covered = []
    for seed in range(120):
        around = Around(CommonSamples(moments, seed), moments.expansion(x[:, None])[:, 0])
        band = statistic._half_width(around)
        covered.append(np.abs(statistic._value(around)[0] - truth) <= band)
    assert np.all(np.mean(covered, axis=0) >= 0.9)


def test_what_never_fails_does_so_with_less_than_one_in_a_billion(problem):
    moments = problem._fit.moments
    around = Around(CommonSamples(moments, 1), moments.expansion(np.array([[2.0]]))[:, 0])
    one = FailureProbability(above=1e3)
    assert one._value(around)[0] == 0.0
    assert one._half_width(around) == pytest.approx(1e-9)


def test_gradients_of_statistics_equal_differences():
    noise = {"a": chaospy.Normal(0.0, 0.1), "b": chaospy.Uniform(-0.2, 0.2)}
    designs = {"x": Design(2.0, 4.0, tolerance=0.05), "y": Design(0.0, 1.0, deviation=0.1)}
    problem = robust_problem(
        lambda x, y, a, b: x**2 * (1.0 + a) + b * y + np.sin(y),
        *(designs, noise, ASKED[:7]),
        progress=False,
    )
    X = np.array([[2.5, 0.3], [3.3, 0.8]])
    F, dF = problem.evaluate(X, return_values_of=["F", "dF"])
    for j in range(2):
        step = 1e-6 * np.eye(2)[j]
        difference = (problem.evaluate(X + step) - problem.evaluate(X - step)) / 2e-6
        assert dF[:, :, j] == pytest.approx(difference, rel=1e-3, abs=2e-3)
    assert F.shape == (2, 7)


def test_the_worst_case_lies_inside_the_box_where_the_response_turns():
    problem = robust_problem(
        lambda x, a: 1.0 - (a - 0.3 * x) ** 2,
        {"x": Design(1.0, 2.0)},
        {"a": chaospy.Uniform(0.0, 1.0)},
        objectives=[WorstCase(), WorstCase("smallest")],
        progress=False,
    )
    F = problem.evaluate(np.array([[1.0], [2.0]]))
    assert pytest.approx(np.array([[1.0, 0.51], [1.0, 0.64]]), abs=1e-6) == F


def test_a_probability_has_no_gradient(problem):
    with pytest.raises(InvalidInput, match="gradient"):
        problem.evaluate(np.array([[3.0]]), return_values_of=["dF"])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Quantile(1.0),
        lambda: CVaR(0.0),
        lambda: WorstCase("best"),
        lambda: FailureProbability(),
        lambda: FailureProbability(above=1.0, below=0.0),
        lambda: MeanPlusStd(np.nan),
        lambda: Mean() <= None,
        lambda: Quantile(1.0 - 1e-10),
        lambda: Quantile(1e-10),
        lambda: CVaR(1.0 - 1e-10),
        lambda: FailureProbability(above=1.0) <= 1e-10,
        lambda: FailureProbability(above=1.0) >= 1.0 - 1e-10,
        lambda: FailureProbability(above=1.0, event=Response() > 1.0),
        lambda: FailureProbability(event=Response("y") > 1.0, response="y"),
        lambda: FailureProbability(event=1.0),
    ],
)
def test_a_statistic_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(InvalidInput):
        wrong()


@pytest.mark.parametrize("k", [-2.0, -0.5, 0.0, 3.0])
def test_the_band_of_a_sum_is_what_the_worst_signs_of_its_errors_do(k):
    """A lower limit is as uncertain as an upper one."""
    of_mean, of_std = np.array([0.3, 0.1]), np.array([0.2, 0.4])
    changes = [sign * of_mean + k * other * of_std for sign, other in product((-1, 1), repeat=2)]
    band = MeanPlusStd(k)._half_width(SimpleNamespace(mean_error=of_mean, std_error=of_std))
    assert band == pytest.approx(np.max(changes, axis=0))
