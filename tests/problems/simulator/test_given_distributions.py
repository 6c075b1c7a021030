"""What users give for a distribution: what is used, and what is refused with its reason."""

import chaospy
import numpy as np
import pytest
import scipy

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Design, robust_problem
from pymoo_hdte.problems._simulator.inputs import Inputs

X = {"x": Design(1.0, 2.0)}
NORMAL = chaospy.Normal(0.0, 1.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (scipy.stats.norm, "with its numbers.*norm has none"),
        (chaospy.Normal, "with its numbers.*Normal has none"),
        (scipy.stats.poisson(1e9), "at most 10000 whole numbers"),
        (scipy.stats.poisson, "with its numbers.*poisson has none"),
        (scipy.stats.multivariate_normal([0.0, 1.0]), "belongs to a tuple of their names"),
        (chaospy.J(NORMAL, chaospy.Uniform()), "belongs to a tuple of their names"),
        (scipy.stats.t(2), r"finite variance; this is t\(2\)"),
        (chaospy.Cauchy(), "finite variance"),
        (scipy.stats.norm(0.0, -1.0), r"positive scatter; this is norm\(0.0, -1.0\)"),
        (scipy.stats.norm(np.zeros(3), 1.0), "positive scatter"),
        (chaospy.Normal(0.0, -1.0), "positive scatter"),
        (chaospy.Uniform(1.0, 1.0), "positive scatter.*upper > lower"),
        (lambda n: n, "of chaospy or a frozen one of scipy.stats"),
        (0.1, "of chaospy or a frozen one of scipy.stats"),
    ],
)
def test_noise_that_cannot_be_used_is_refused_with_the_reason(given, message):
    with pytest.raises(InvalidInput, match=rf"noise\['a'\] is .*{message}"):
        Inputs(X, {"a": given})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (chaospy.MvNormal([0.0, 1.0, 2.0], np.eye(3)), "of 2 continuous variables"),
        ((NORMAL, NORMAL), "a joint distribution of chaospy"),
        (chaospy.J, "a joint distribution of chaospy"),
        (chaospy.J(chaospy.Binomial(4, 0.5), chaospy.Normal(0.0, 1.0)), "whole numbers"),
        (NORMAL, "of 2 continuous variables"),
        (scipy.stats.dirichlet([1.0, 2.0]), "of 2 continuous variables"),
        (
            scipy.stats.multivariate_normal(cov=np.ones((2, 2)), allow_singular=True),
            "of 2 continuous variables.*not positive definite",
        ),
    ],
)
def test_joint_noise_that_cannot_be_used_is_refused_with_the_reason(given, message):
    with pytest.raises(InvalidInput, match=message):
        Inputs(X, {("a", "b"): given})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (scipy.stats.uniform, "uniform has none"),
        (chaospy.Binomial(5, 0.5), "not one of whole numbers"),
    ],
)
def test_a_deviation_that_cannot_be_used_is_refused_with_the_reason(given, message):
    with pytest.raises(InvalidInput, match=rf"deviation of 'x' is .*{message}"):
        Inputs({"x": Design(1.0, 2.0, deviation=given)}, {})


@pytest.mark.parametrize(
    ("given", "same"),
    [
        pytest.param(
            *(scipy.stats.Normal(mu=1.0, sigma=2.0), chaospy.Normal(1.0, 2.0)),
            marks=pytest.mark.nightly,
        ),
        (scipy.stats.Uniform(a=1.0, b=2.0), chaospy.Uniform(1.0, 2.0)),
    ],
)
def test_distributions_of_either_library_are_the_same(given, same):
    F = [
        robust_problem(lambda x, a: x * a**2, X, {"a": one}, progress=False).evaluate(
            np.array([[1.5]])
        )
        for one in (given, same)
    ]
    assert F[0] == pytest.approx(F[1], rel=1e-8)


def test_dependent_normal_noise_of_scipy_is_that_of_chaospy():
    """The mean of x + a b is x + cov, its variance 1 + cov^2 for variances 1 and means 0."""
    covariance = [[1.0, 0.6], [0.6, 1.0]]
    noise = {("a", "b"): scipy.stats.multivariate_normal([0.0, 0.0], covariance)}
    problem = robust_problem(lambda x, a, b: x + a * b, X, noise, progress=False)
    expected = [1.5 + 0.6, np.sqrt(1.0 + 0.6**2)]
    assert problem.evaluate(np.array([[1.5]]))[0] == pytest.approx(expected, rel=1e-6)


def test_sobol_indices_are_those_of_chaospy():
    designs = {"x": Design(1.0, 2.0, tolerance=0.1), "u": Design(0.0, 1.0)}
    noise = {"a": chaospy.Normal(0.3, 0.5), "b": chaospy.Beta(2.0, 3.0)}
    problem = robust_problem(
        lambda x, u, a, b: x**2 * a + (u + x) * b**2 + a * b * x, designs, noise, progress=False
    )
    scatter = chaospy.J(chaospy.Uniform(1.4 * 0.9, 1.4 * 1.1), noise["a"], noise["b"])
    expansion = chaospy.generate_expansion(4, scatter, normed=True)
    nodes, weights = chaospy.generate_quadrature(6, scatter, rule="gaussian")
    x, a, b = nodes
    values = problem.predict(np.column_stack([x, np.full_like(x, 0.7), a, b]))[:, 0]
    _, coefficients = chaospy.fit_quadrature(expansion, nodes, weights, values, retall=True)
    ours = problem.sobol_indices([1.4, 0.7])
    scattered = [0, 2, 3]
    assert ours.mean == pytest.approx(coefficients[0], rel=1e-9)
    assert ours.variance == pytest.approx(np.sum(coefficients[1:] ** 2), rel=1e-8)
    for found, theirs in (
        (ours.first, chaospy.FirstOrderSobol),
        (ours.total, chaospy.TotalOrderSobol),
    ):
        assert found[scattered] == pytest.approx(theirs(expansion, coefficients), abs=1e-8)
        assert found[1] == 0.0
