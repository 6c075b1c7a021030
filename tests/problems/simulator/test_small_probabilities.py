"""Small probabilities and far quantiles against closed forms, on surrogates and with few runs."""

import numpy as np
import pytest
from scipy.stats import gamma, lognorm, multivariate_normal, norm, uniform

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    CVaR,
    Design,
    FailureProbability,
    Quantile,
    Response,
    SimulatorProblem,
    failure_probability,
    robust_problem,
)
from pymoo_hdte.surrogate._rare.importance import adapted, sample_of

STD = 1.25**0.5
"""Deviation of u + v / 2."""


def linear(x, u, v):
    return {"sum": x + u + 0.5 * v, "difference": x + u - 0.5 * v}


@pytest.fixture(scope="module")
def problem():
    (above, below) = Response("sum") > 4.0, Response("difference") < -4.0
    return robust_problem(
        linear,
        {"x": Design(-0.5, 0.5)},
        {"u": norm(), "v": norm()},
        [
            FailureProbability(event=above | below),
            FailureProbability(event=above & (Response("difference") > 3.0)),
            *(Quantile(p, response="sum") for p in (1e-6, 0.99865, 1.0 - 1e-6)),
            CVaR(1.0 - 1e-5, response="sum"),
        ],
        [FailureProbability(above=4.0, response="sum") <= 1e-4],
        vectorised=True,
        progress=False,
    )


def both(a, b):
    """Return the probability that both x + u + v/2 > a and x + u - v/2 > b at x = 0."""
    return multivariate_normal.cdf([-a, -b], cov=[[1.25, 0.75], [0.75, 1.25]], abseps=1e-12)


def test_far_statistics_of_a_normal_response_are_closed_forms(problem):
    F, band, G = problem.evaluate(np.array([[0.0], [0.3]]), return_values_of=["F", "F_band", "G"])
    either = 2.0 * norm.sf(4.0 / STD) - multivariate_normal.cdf(
        [-4.0, -4.0], cov=[[1.25, -0.75], [-0.75, 1.25]]
    )
    quantiles = STD * norm.ppf([1e-6, 0.99865, 1.0 - 1e-6])
    tail = STD * norm.pdf(norm.ppf(1e-5)) / 1e-5
    truth = np.array([either, both(4.0, 3.0), *quantiles, tail])
    assert np.all(np.abs(F[0] - truth) <= band[0])
    assert np.all(band[0, :2] < 0.15 * truth[:2])
    assert np.all(band[0, 2:] < 0.02 * STD)
    assert G[1, 0] + 1e-4 == pytest.approx(norm.sf(3.7 / STD), rel=0.08)


def test_the_slope_of_a_far_quantile_is_that_of_the_response(problem):
    only = SimulatorProblem(
        *(problem._inputs, problem._fit, problem.responses, problem.objectives[2:], (), 0)
    )
    dF = only.evaluate(np.array([[0.1]]), return_values_of=["dF"])
    assert dF == pytest.approx(np.ones((1, 4, 1)), abs=1e-6)


def test_a_joint_event_survives_storage(problem, tmp_path):
    problem.save(tmp_path / "problem")
    again = SimulatorProblem.load(tmp_path / "problem")
    X = np.array([[0.2]])
    assert again.objectives == problem.objectives
    assert np.array_equal(again.evaluate(X)[0], problem.evaluate(X)[0])


def test_an_event_joined_by_the_wrong_word_is_refused():
    with pytest.raises(TypeError, match="&"):
        (Response("a") > 1.0) and (Response("b") > 1.0)
    with pytest.raises(InvalidInput):
        (Response("a") > 1.0) | 2.0


def regions(p):
    """Return limit states of one, of two and of very many regions, failing with probability p."""
    beta = norm.isf(p)
    two = norm.isf(0.5 * p)
    far = gamma.isf(p, 2.5) * 2.0
    return {
        "plane": (6, lambda u: u.sum(axis=1) / 6**0.5 - beta),
        "two sides": (2, lambda u: np.abs(u.sum(axis=1)) / 2**0.5 - two),
        "outside a sphere": (5, lambda u: np.sum(u**2, axis=1) - far),
    }


@pytest.mark.parametrize("name", regions(0.1))
@pytest.mark.parametrize("p", [1e-3, 1e-6])
def test_the_stated_error_of_sampling_is_the_true_one(name, p):
    d, margin = regions(p)[name]
    deviations = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        sample = sample_of(adapted(margin, d, rng), rng)
        share, error = sample.mean(margin(sample.points) > 0.0)
        assert error < 0.15 * p
        deviations.append((share - p) / error)
    # Of 20 standard normal numbers, in one of a thousand cases (chi-square) each.
    assert 5.9 < np.sum(np.square(deviations)) < 45.4


@pytest.mark.parametrize(
    ("simulator", "noise", "event", "truth", "runs"),
    [
        (
            lambda load, strength: load - strength,
            {"load": norm(2.0, 0.3), "strength": norm(4.0, 0.4)},
            Response() > 0.0,
            norm.sf(4.0),
            30,
        ),
        (
            lambda load, strength: strength / load,
            {"load": lognorm(0.2), "strength": lognorm(0.1, scale=np.exp(0.05**0.5 * 4.75))},
            Response() < 1.0,
            norm.sf(4.75),
            40,
        ),
        (
            lambda a, b: a + b,
            {"a": uniform(), "b": uniform()},
            Response() > 1.99,
            5e-5,
            40,
        ),
        (
            lambda a, b: np.abs(a + b),
            {"a": norm(), "b": norm()},
            Response() > 3.5 * 2**0.5,
            2.0 * norm.sf(3.5),
            80,
        ),
    ],
    ids=["normal", "lognormal", "corner", "two sides"],
)
def test_a_probability_of_failure_is_within_its_band(simulator, noise, event, truth, runs):
    result = failure_probability(simulator, noise, event, vectorised=True, progress=False)
    low, high = result.interval
    middle, error = np.log(result.probability), np.log(high / low) / 4.0
    # Three standard errors: a test of one seed must not fail by chance.
    assert abs(np.log(truth) - middle) < 3.0 * error
    assert result.confirmed
    assert high / low < 1.23
    assert result.n_runs <= runs
    assert sum(result.importance.values()) == pytest.approx(1.0)


def test_the_most_probable_point_is_that_of_first_order():
    result = failure_probability(
        lambda load, strength: load - strength,
        *({"load": norm(2.0, 0.3), "strength": norm(4.0, 0.4)}, Response() > 0.0),
        vectorised=True,
        progress=False,
    )
    assert result.form_beta == pytest.approx(4.0, abs=1e-4)
    assert result.most_probable_point == pytest.approx({"load": 2.72, "strength": 2.72}, abs=1e-3)
    assert result.importance == pytest.approx({"load": 0.36, "strength": 0.64}, abs=1e-3)


def test_inputs_that_do_not_fit_the_signature_are_told_before_any_run():
    noise = {"load": norm(), "strength": norm()}
    with pytest.raises(InvalidInput, match="it takes no strength"):
        failure_probability(lambda load: load, noise, Response() > 4.0, progress=False)


def test_a_budget_that_ends_first_gives_a_wide_band():
    with pytest.warns(RuntimeWarning, match="budget"):
        result = failure_probability(
            lambda a, b: np.abs(a + b) + 0.3 * np.sin(4.0 * a),
            {"a": norm(), "b": norm()},
            Response() > 5.0,
            budget=16,
            vectorised=True,
            progress=False,
        )
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 1_000_000))
    truth = np.mean(np.abs(a + b) + 0.3 * np.sin(4.0 * a) > 5.0)
    assert not result.confirmed
    assert result.interval[0] < truth < result.interval[1]


def youn_choi(x1, x2):
    return {
        "g1": x1**2 * x2 / 20.0 - 1.0,
        "g2": (x1 + x2 - 5.0) ** 2 / 30.0 + (x1 - x2 - 12.0) ** 2 / 120.0 - 1.0,
        "g3": 80.0 / (x1**2 + 8.0 * x2 + 5.0) - 1.0,
    }


FAILS = (Response("g1") < 0.0) | (Response("g2") < 0.0) | (Response("g3") < 0.0)


def on_a_grid(design, std=0.3, count=3000):
    """Return the probability of failure around a design by the midpoint rule."""
    edges = np.linspace(-7.0, 7.0, count + 1)
    shares, middle = np.diff(norm.cdf(edges)), 0.5 * (edges[1:] + edges[:-1])
    x1, x2 = (x + std * middle for x in design)
    margins = youn_choi(x1[:, None], x2[None])
    fails = np.min(np.broadcast_arrays(*margins.values()), axis=0) < 0.0
    return shares @ fails @ shares


@pytest.mark.slow
def test_the_published_optimum_of_youn_and_choi_fails_as_probably_as_it_does():
    design = (3.4391, 3.2866)
    result = failure_probability(
        youn_choi,
        {name: norm(x, 0.3) for name, x in zip(("x1", "x2"), design, strict=True)},
        FAILS,
        vectorised=True,
        progress=False,
    )
    truth = on_a_grid(design)
    assert truth == pytest.approx(2.6e-3, rel=0.02)
    assert abs(np.log(result.probability / truth)) < 1.5 * np.log(
        result.interval[1] / result.probability
    )
    # Both active limits were designed for three deviations.
    assert result.form_beta == pytest.approx(3.0, abs=0.01)


@pytest.mark.slow
def test_one_surrogate_serves_all_designs_of_youn_and_choi():
    problem = robust_problem(
        youn_choi,
        {name: Design(3.0, 4.5, deviation=norm(0.0, 0.3)) for name in ("x1", "x2")},
        objectives=[FailureProbability(event=FAILS)],
        vectorised=True,
        progress=False,
    )
    X = np.array([[3.4391, 3.2866], [3.6, 3.5], [3.7, 3.8]])
    P, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    truth = np.array([on_a_grid(x) for x in X])
    assert truth[2] < 2e-5
    assert np.all(np.abs(P[:, 0] - truth) <= 1.5 * band[:, 0])
    assert np.all(band[:, 0] < 0.5 * truth)
