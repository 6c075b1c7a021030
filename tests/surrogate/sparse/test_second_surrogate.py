"""Other surrogates than polynomials of the response: when they are taken, and what they state."""

import sys

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.stats import norm

from pymoo_hdte.problems import Design, Mean, Std, robust_problem
from pymoo_hdte.surrogate._sparse.kernel import EvenPolynomials
from pymoo_hdte.surrogate._sparse.regression import Regression, surprises
from pymoo_hdte.surrogate._sparse.response import COVERAGE_OF_CUT, Judged, ResponseFit
from pymoo_hdte.surrogate._sparse.second import Linked, Process, better, links_for

SHARES = (0.8, 0.5)
"""Deviations of the logarithms of the two factors of the product."""


def product(x, u, v):
    return np.exp(SHARES[0] * u + SHARES[1] * v) / x**2


def moments_of_product(x):
    """Return mean and deviation of the product in closed form; x deviates by 0.1."""
    low, high = x - 0.1, x + 0.1
    first, second = (1.0 / low - 1.0 / high) / 0.2, (low**-3 - high**-3) / 0.6
    variance = SHARES[0] ** 2 + SHARES[1] ** 2
    mean, square = first * np.exp(0.5 * variance), second * np.exp(2.0 * variance)
    return np.column_stack([mean, np.sqrt(square - mean**2)])


@pytest.mark.slow
def test_a_product_over_decades_takes_few_runs_by_its_logarithm():
    """A polynomial of the product itself took 400 runs."""
    problem = robust_problem(
        product,
        {"x": Design(0.3, 0.9, deviation=0.1)},
        {"u": norm(), "v": norm()},
        [Mean(), Std()],
        vectorised=True,
        progress=False,
    )
    assert problem.n_runs < 60
    X = np.linspace(0.3, 0.9, 25)[:, None]
    truth = moments_of_product(X[:, 0])
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    assert np.all(np.abs(F - truth) <= 0.01 * truth[:, 1:])
    assert np.all(np.mean(np.abs(F - truth) <= band, axis=0) >= 0.95)


def test_a_surprise_far_from_the_mean_counts_in_the_deviation():
    values = np.append(np.linspace(-1.0, 1.0, 21), 10.0)
    even, far = np.ones(22), np.append(np.ones(21), 9.0)
    assert surprises(even, np.ones(22), values) == pytest.approx([1.0, 1.0])
    of_mean, of_std = surprises(far, np.ones(22), values)
    assert of_mean**2 == pytest.approx(30.0 / 22.0)
    assert of_std > 2.5
    assert surprises(far, np.ones(22), np.ones(22)) == pytest.approx([of_mean, of_mean])


POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))
FEATURES = EvenPolynomials(20)(POINTS)
ONES = np.ones(60)


def chosen(values):
    return better(FEATURES, values, ONES, Regression(FEATURES, values, ONES), process=True)


def test_each_kind_is_taken_where_it_predicts_better():
    x, y = POINTS.T
    assert isinstance(chosen(np.exp(4.0 * x + 2.0 * np.sin(3.0 * y))), Linked)
    assert isinstance(chosen(np.maximum(x + 0.7 * y, 0.0)), Process)
    assert chosen(x * y + x**2) is None


def test_without_scikit_learn_there_is_no_process(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.gaussian_process", None)
    x, y = POINTS.T
    assert chosen(np.maximum(x + 0.7 * y, 0.0)) is None


def test_links_are_those_that_the_values_allow():
    assert [link.name for link in links_for(np.array([0.1, 0.9]))] == ["log", "logit"]
    assert [link.name for link in links_for(np.array([0.1, 9.0]))] == ["log"]
    assert [link.name for link in links_for(np.array([-0.1, -9.0]))] == ["-log(-y)"]
    assert links_for(np.array([-1.0, 1.0])) == links_for(np.zeros(3)) == []


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_links_are_inverse_to_their_forth_and_slopes_are_differences(share):
    for values in (np.array([share, 0.5]), -np.array([share, 2.0])):
        for link in links_for(values):
            h = link.forth(values)
            assert link.back(h) == pytest.approx(values)
            difference = (link.back(h + 1e-6) - link.back(h - 1e-6)) / 2e-6
            assert link.slope(h) == pytest.approx(difference, rel=1e-6)


@pytest.mark.parametrize("kind", ["process", "linked"])
def test_runs_left_out_are_predicted_as_if_they_had_not_been_made(kind):
    x, y = POINTS.T
    values = np.exp(np.sin(3.0 * x) + y) + 0.1
    if kind == "linked":
        (link,) = links_for(values)
        whole = Linked(FEATURES, values, ONES, link)
        h = link.forth(values)
        expected = values - link.back(h - whole._regression.left_out)
        assert whole.left_out == pytest.approx(expected)
        return
    whole = Process(FEATURES, values, ONES)
    kernel, others = whole._model.kernel_, np.arange(60) != 7
    weights = np.linalg.solve(
        kernel(POINTS[others]), (values[others] - whole._centre) / whole._unit
    )
    across = whole._covariance(POINTS[[7]], POINTS[others])
    predicted = whole._centre + whole._unit * float((across @ weights)[0])
    assert whole.left_out[7] == pytest.approx(values[7] - predicted, rel=1e-3, abs=1e-6)


def test_the_spread_of_a_sum_is_that_of_the_posterior():
    x, y = POINTS.T
    values = np.abs(x) + y
    process = Process(FEATURES, values, ONES)
    nodes, weights = leggauss(12)
    line = np.column_stack([nodes, 0.3 * np.ones(12)])
    features = EvenPolynomials(20)(line)
    _, covariance = process._model.predict(line, return_cov=True)
    # scikit-learn's has the runs' own scatter on the diagonal.
    own = process._model.kernel_.k2.noise_level * np.eye(12)
    expected = process._unit * np.sqrt(weights @ (covariance - own) @ weights)
    spread, _ = process.spread(features, weights[None])
    assert spread[0] == pytest.approx(expected, rel=1e-4)


def test_terms_that_are_left_out_count_by_what_they_change_of_the_moments():
    x, y = POINTS.T
    regression = Regression(FEATURES, x + 0.2 * y, ONES)
    nodes, weights = leggauss(6)
    grid = np.array([(z, w) for z in nodes for w in nodes])[None]
    judged = Judged.at(grid, 0.25 * np.outer(weights, weights).reshape(1, -1), EvenPolynomials(20))
    of_x = np.array([[0, 0], [1, 0]]), np.array([0.0, 3.0**-0.5])
    fit = ResponseFit(regression, regression.parameters, *of_x, regression.left_out, alone=False)
    mean, std = fit.errors(judged, 1e-9)
    assert mean[0] == pytest.approx(0.0, abs=1e-3)
    assert std[0] == pytest.approx(COVERAGE_OF_CUT * (np.sqrt(1.04) - 1.0), rel=0.02)
