"""Moments of sparse polynomials over any scatter: closed forms, chaospy, polynomials are exact."""

import chaospy
import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Design
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.surrogate._sparse.measures import Distribution, Measure, OrthonormalPolynomials
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial

DISTRIBUTIONS = {
    "normal": (chaospy.Normal(2.0, 0.3), 2.0, 0.3),
    "uniform": (scipy.stats.uniform(-1.0, 2.0), 0.0, 1.0 / np.sqrt(3.0)),
    "beta": (chaospy.Beta(2.0, 3.0), 0.4, 0.2),
    "triangle": (chaospy.Triangle(0.0, 0.5, 2.0), 2.5 / 3.0, np.sqrt((4.0 + 0.25 - 1.0) / 18.0)),
    "gamma": (scipy.stats.gamma(2.0), 2.0, np.sqrt(2.0)),
    "arcsine": (scipy.stats.beta(0.5, 0.5), 0.5, np.sqrt(0.125)),
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_a_measure_has_the_moments_of_its_distribution(name):
    given_, mean, std = DISTRIBUTIONS[name]
    measure = Measure.of(name, Distribution(name, given_))
    assert (measure.mean, measure.std) == pytest.approx((mean, std), rel=1e-8, abs=1e-10)
    family = OrthonormalPolynomials(measure, 12)
    products = family(measure.nodes) * measure.weights @ family(measure.nodes).T
    assert products == pytest.approx(np.eye(13), abs=1e-10)
    assert family.weights @ family.nodes**3 == pytest.approx(
        measure.weights @ measure.nodes**3, rel=1e-9, abs=1e-12
    )


@pytest.mark.parametrize(
    "wrong",
    [1.0, None, scipy.stats.poisson(3), chaospy.Binomial(5, 0.5), scipy.stats.norm(0, np.nan)],
)
def test_what_is_no_continuous_distribution_is_refused_by_name(wrong):
    with pytest.raises(InvalidInput, match="noise of x"):
        Distribution("noise of x", wrong)


def inputs():
    designs = {
        "relative": Design(1.0, 2.0, tolerance=0.1),
        "absolute": Design(-1.0, 1.0, deviation=chaospy.Normal(0.0, 0.2)),
        "exact": Design(0.0, 3.0),
    }
    return Inputs(designs, {"noise": chaospy.Normal(1.0, 0.5), "other": scipy.stats.uniform(0, 1)})


def interpolant(values_of, indices, given_):
    """Return the polynomial on a set that is nearest to a function of the physical inputs."""
    cube = np.random.default_rng(4).uniform(-1.0, 1.0, (3 * len(indices), len(given_.axes)))
    values = [float(values_of(*row)) for row in given_.values(cube)]
    terms = SparsePolynomial(indices, np.eye(len(indices)))(cube)
    return SparsePolynomial(indices, np.linalg.lstsq(terms, values, rcond=None)[0][None])


SET = [(a, b, c, d, e) for a in range(3) for b in range(3) for c in range(2) for d in range(3)
       for e in range(2)]  # fmt: skip


# A wrong moment is wrong for any polynomial, up to chance.
@settings(max_examples=6)
@given(
    st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4),
    st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3),
)
def test_moments_of_polynomials_are_exact(weights, place):
    a, b, c, d = weights

    def function(r, s, t, n, o):
        return a * r**2 + b * s * n + c * t * o + d * n**2

    given_ = inputs()
    moments = SparseMoments(interpolant(function, SET, given_), given_.axes)
    u, v, w = np.array([1.0, -1.0, 0.0]) + np.array(place) * np.array([1.0, 2.0, 3.0])
    mean, std = moments(np.array([[u, v, w]]))
    third, fifth = 0.1**2 / 3.0, 0.1**4 / 5.0
    # E r^2, Var r^2 of a uniform band; independent terms share only n.
    true_mean = a * u**2 * (1.0 + third) + b * v + c * w * 0.5 + d * 1.25
    of_square = u**4 * (1.0 + 6.0 * third + fifth) - (u**2 * (1.0 + third)) ** 2
    of_product = (v**2 + 0.04) * 1.25 - v**2
    of_normal = 4.0 * 0.25 + 2.0 * 0.25**2
    shared = 2.0 * b * d * v * 2.0 * 0.25
    variance = a**2 * of_square + b**2 * of_product + d**2 * of_normal + shared
    variance += c**2 * w**2 / 12.0
    assert mean[0, 0] == pytest.approx(true_mean, rel=1e-9, abs=1e-9)
    assert std[0, 0] == pytest.approx(np.sqrt(max(variance, 0.0)), rel=1e-7, abs=1e-7)


def test_values_are_sums_of_products_of_chebyshev_polynomials():
    two = np.random.default_rng(5).normal(size=(2, len(SET)))
    cube = np.random.default_rng(6).uniform(-1.0, 1.0, (50, 5))
    angles = np.arccos(cube)[:, None]
    expected = np.cos(np.array(SET) * angles).prod(axis=2) @ two.T
    assert SparsePolynomial(SET, two)(cube) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.nightly
def test_many_designs_at_once_have_the_moments_of_few(monkeypatch):
    given_ = inputs()
    two = np.random.default_rng(5).normal(size=(2, len(SET)))
    moments = SparseMoments(SparsePolynomial(SET, two), given_.axes)
    X = np.random.default_rng(6).uniform([1.0, -1.0, 0.0], [2.0, 1.0, 3.0], (4200, 3))
    few = [np.concatenate(parts) for parts in zip(*map(moments, np.split(X, 4)), strict=True)]
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0}, raising=False)
    alone = moments(X)
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1, 2}, raising=False)
    for many, expected, same in zip(moments(X), few, alone, strict=True):
        assert many == pytest.approx(expected, rel=1e-12)
        assert many.tobytes() == same.tobytes()


def smooth(r, s, t, n, o):
    return np.exp(0.3 * r * n) + np.sin(s + t) * o


def test_the_moments_agree_with_chaospy():
    given_ = inputs()
    polynomial = interpolant(smooth, SET, given_)
    design = np.array([[1.4, 0.3, 2.0]])
    mean, std = SparseMoments(polynomial, given_.axes)(design)
    scatter = chaospy.J(
        chaospy.Uniform(1.4 * 0.9, 1.4 * 1.1),
        chaospy.Normal(0.3, 0.2),
        chaospy.Normal(1.0, 0.5),
        chaospy.Uniform(0.0, 1.0),
    )
    nodes, weights = chaospy.generate_quadrature(6, scatter, rule="gaussian")
    r, s, n, o = nodes
    physical = [r, s, np.full_like(r, 2.0), n, o]
    cube = np.column_stack([axis.cube(v) for axis, v in zip(given_.axes, physical, strict=True)])
    values = polynomial(cube)[:, 0]
    assert mean[0, 0] == pytest.approx(weights @ values, rel=1e-10)
    assert std[0, 0] ** 2 == pytest.approx(weights @ (values - mean[0, 0]) ** 2, rel=1e-9)


def test_the_order_of_inputs_does_not_matter():
    turned = Inputs(
        {name: Design(1.0, 2.0, tolerance=0.1) for name in "ab"}, {"n": chaospy.Normal(1.0, 0.5)}
    )
    indices = np.array(list(np.ndindex(3, 2, 2)))
    coefficients = np.random.default_rng(8).normal(size=(1, len(indices)))
    found = []
    for order in ((0, 1), (1, 0)):
        polynomial = SparsePolynomial(indices[:, [*order, 2]], coefficients)
        moments = SparseMoments(polynomial, turned.axes)
        found.append(moments(np.array([[1.2, 1.7], [1.9, 1.1]])[:, list(order)]))
    assert np.array(found[0]) == pytest.approx(np.array(found[1]), rel=1e-12)


def test_dependent_noise_is_exact_for_what_is_linear_in_it():
    joint = chaospy.MvNormal([1.0, 2.0], [[0.04, 0.03], [0.03, 0.09]])
    given_ = Inputs({"x": Design(1.0, 2.0)}, {("a", "b"): joint})
    indices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1)]
    polynomial = interpolant(lambda x, a, b: x * a - b, indices, given_)
    mean, std = SparseMoments(polynomial, given_.axes)(np.array([[1.5]]))
    assert mean[0, 0] == pytest.approx(-0.5, abs=1e-9)
    assert std[0, 0] ** 2 == pytest.approx(2.25 * 0.04 + 0.09 - 2 * 1.5 * 0.03, rel=1e-7)
