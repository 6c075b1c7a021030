"""The most probable polynomial: its prior, its likelihood, runs left out, terms, few exact ones."""

import chaospy
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.problems import Design
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.surrogate._sparse import adaptive, components
from pymoo_hdte.surrogate._sparse import regression as module
from pymoo_hdte.surrogate._sparse.adaptive import fit_adaptively
from pymoo_hdte.surrogate._sparse.draws import SpreadPoints, draw_around, draw_designs
from pymoo_hdte.surrogate._sparse.kernel import EvenPolynomials, covariance, variances
from pymoo_hdte.surrogate._sparse.regression import Regression
from pymoo_hdte.surrogate._sparse.terms import closed, likely_terms, products

INPUTS = Inputs(
    {"x": Design(0.5, 1.0, deviation=0.1)},
    {"a": chaospy.Uniform(0.0, 1.0), "b": chaospy.Normal(0.0, 1.0)},
)
POLYNOMIALS = EvenPolynomials(6)


def runs(count):
    points = SpreadPoints(INPUTS.axes, np.random.default_rng(1)).next(count)
    x, a, b = INPUTS.values(points).T
    return points, np.exp(x * a) + 0.1 * np.sin(b) * a


def test_the_covariance_of_two_points_is_the_sum_over_all_terms():
    points, _ = runs(5)
    features = POLYNOMIALS(points)
    variance, _ = variances(np.random.default_rng(2).normal(size=(3, 3)), 6)
    every = np.array(list(np.ndindex(7, 7, 7)))
    whole = np.column_stack([np.ones(3), variance])
    prior = np.prod(whole[np.arange(3), every], axis=1)
    terms = products(features, every)
    assert covariance(features, features, variance) == pytest.approx((terms * prior) @ terms.T)
    chosen = likely_terms(variance, 60)
    assert len(chosen) <= 60
    assert np.array_equal(closed(chosen), np.array(sorted(map(tuple, chosen.tolist()))))


def test_a_run_left_out_is_predicted_as_if_it_had_not_been_made():
    points, values = runs(25)
    features = POLYNOMIALS(points)
    fitted = Regression(features, values, np.ones(25))
    standard = (values - fitted.centre) / fitted.unit
    others = np.arange(25) != 7
    of_others = [one[:, others] for one in features]
    inside = covariance(of_others, of_others, fitted.variance)
    inside += module.NUGGET * np.trace(inside) / 24 * np.eye(24)
    across = covariance([one[:, [7]] for one in features], of_others, fitted.variance)
    expected = standard[7] - across @ np.linalg.solve(inside, standard[others])
    assert fitted.left_out[7] == pytest.approx(fitted.unit * expected[0], rel=1e-3)


def test_the_slope_of_the_likelihood_equals_differences():
    points, values = runs(20)
    features, standard = POLYNOMIALS(points), values - values.mean()
    start = np.append(np.random.default_rng(3).normal(-1.0, 0.5, 9), -3.0)
    shares = np.linspace(0.5, 1.0, 20)

    def misfit(flat):
        return module._misfit(features, standard, flat[:9], np.exp(flat[9:]), shares)

    _, slope = misfit(start)
    for j in range(10):
        step = np.zeros(10)
        step[j] = 1e-5
        difference = (misfit(start + step)[0] - misfit(start - step)[0]) / 2e-5
        assert slope[j] == pytest.approx(difference, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_runs_that_scatter_by_themselves_are_told_from_those_that_do_not(seed):
    points, values = runs(120)
    features = EvenPolynomials(24)(points)
    assert Regression(features, values, np.ones(120)).noise == 0.0
    noisy = values + np.random.default_rng(seed).normal(0.0, 0.01, 120)
    fitted = Regression(features, noisy, np.ones(120))
    # Of some hundred values, the deviation is known to 7 %.
    assert fitted.noise_std == pytest.approx(0.01, rel=0.25)
    # What is left is less than the noise: of 120 runs, some 60 coefficients have to be told.
    assert np.std(fitted.predict(features) - values) < 0.008


def test_the_mean_of_replicates_scatters_less():
    points, values = runs(80)
    features = EvenPolynomials(24)(points)
    shares = np.where(np.arange(80) < 40, 1.0, 0.01)
    rng = np.random.default_rng(5)
    noisy = values + rng.normal(0.0, 0.05, 80) * np.sqrt(shares)
    fitted = Regression(features, noisy, np.ones(80), shares=shares)
    assert fitted.noise_std == pytest.approx(0.05, rel=0.3)
    off = np.abs(fitted.predict(features) - values)
    assert off[40:].mean() < 0.015


def test_draws_weigh_as_the_scatter_does():
    designs = draw_designs(INPUTS.axes, 8, np.random.default_rng(4))
    points, weights = draw_around(INPUTS.axes, designs, 512, np.random.default_rng(5))
    values = INPUTS.values(points.reshape(-1, 3)).reshape(8, 512, 3)
    mean = np.einsum("vk,vkd->vd", weights, values)
    assert mean[:, 0] == pytest.approx(designs[:, 0], abs=0.02)
    assert mean[:, 1:] == pytest.approx(np.tile([0.5, 0.0], (8, 1)), abs=0.15)
    rare = np.einsum("vk,vk->v", weights, values[..., 2] ** 2)
    assert rare.mean() == pytest.approx(1.0, abs=0.05)


def test_a_polynomial_of_few_terms_is_found_to_rounding():
    def function(cube):
        x, a, b = INPUTS.values(cube).T
        return np.column_stack([x * a + b**2, x**3 - a])

    fit = fit_adaptively(INPUTS.axes, function, 1e-9, 80, np.random.default_rng(6))
    assert fit.n_runs < 80
    cube = np.random.default_rng(7).uniform(-1.0, 1.0, (50, 3))
    assert fit.polynomial(cube) == pytest.approx(function(cube), rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_growth_fits_on_one_thread_and_leaves_the_function_its_own(monkeypatch):
    # With two threads that wait for each other growth took five times as long.
    threads = {"function": set(), "fit": set()}

    def noted(what, call):
        def noting(*given):
            threads[what] |= {library["num_threads"] for library in threadpool_info()}
            return call(*given)

        return noting

    def function(cube):
        return np.exp(cube.sum(axis=1, keepdims=True))

    # A fit that itself calls what runs on one thread is no other.
    nested = ONE_THREAD(noted("fit", components.fitted))
    monkeypatch.setattr(components, "fitted", nested)
    with threadpool_limits(2):
        rng = np.random.default_rng(8)
        adaptive.fit_adaptively(INPUTS.axes, noted("function", function), 0.1, 40, rng)
    assert threads == {"function": {2}, "fit": {1}}
