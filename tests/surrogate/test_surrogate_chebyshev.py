"""The surrogate against closed forms, numpy's own Chebyshev series and finite differences."""

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, ExtrapolationError, latin_hypercube

seeds = st.integers(0, 2**32 - 1)


def random_box(rng, dimension):
    lower = rng.uniform(-5, 5, dimension)
    return Box(
        tuple(f"x{j}" for j in range(dimension)), lower, lower + rng.uniform(0.1, 10, dimension)
    )


def power_sum(powers, box):
    """Return the polynomial with these monomial coefficients of scaled physical variables."""

    def function(x):
        scaled = x / np.maximum(np.abs(box.lower), np.abs(box.upper))
        total = np.zeros(len(x))
        for index in np.ndindex(powers.shape):
            total += powers[index] * np.prod(scaled ** np.array(index), axis=1)
        return total

    return function


@settings(max_examples=40, deadline=None)
@given(seed=seeds, order=st.integers(1, 4), dimension=st.integers(1, 4))
def test_a_polynomial_of_its_own_degree_is_reproduced(seed, order, dimension):
    rng = np.random.default_rng(seed)
    box = random_box(rng, dimension)
    function = power_sum(rng.uniform(-1, 1, (order + 1,) * dimension), box)
    surrogate = ChebyshevSurrogate.fit(function, box, order)
    points = latin_hypercube(box, 20, rng)
    assert surrogate(points) == pytest.approx(function(points), rel=1e-10, abs=1e-10)


@settings(max_examples=40, deadline=None)
@given(seed=seeds, shape=st.lists(st.integers(1, 6), min_size=1, max_size=4))
def test_values_and_gradients_equal_numpys(seed, shape):
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=shape)
    box = random_box(rng, len(shape))
    surrogate = ChebyshevSurrogate(box, coefficients)
    points = latin_hypercube(box, 7, rng)
    cube = box.to_cube(points)

    def by_numpy(series):
        bases = [chebyshev.chebvander(x, n - 1) for x, n in zip(cube.T, series.shape, strict=True)]
        letters = "abcd"[: len(bases)]
        terms = ",".join(f"n{letter}" for letter in letters)
        return np.einsum(f"{letters},{terms}->n", series, *bases)

    assert surrogate(points) == pytest.approx(by_numpy(coefficients), rel=1e-12, abs=1e-12)
    for axis in range(len(shape)):
        slope = by_numpy(chebyshev.chebder(coefficients, axis=axis)) / box.half_width[axis]
        assert surrogate.gradient(points)[:, axis] == pytest.approx(slope, rel=1e-11, abs=1e-10)


def test_coefficients_are_those_of_the_series_that_was_fitted():
    coefficients = np.random.default_rng(1).normal(size=(4, 4, 4))
    box = Box(("a", "b", "c"), (-1, -1, -1), (1, 1, 1))
    surrogate = ChebyshevSurrogate.fit(
        lambda x: chebyshev.chebval3d(*x.T, coefficients), box, order=3
    )
    assert surrogate.coefficients == pytest.approx(coefficients, abs=1e-13)
    assert surrogate.orders == (3, 3, 3)


def test_the_rule_is_the_papers():
    """Eqs. (23) and (24) summed term by term, with the factor (1/2)^h outside."""
    box = Box(("a", "b"), (0.5, 1.0), (1.5, 4.0))
    p = 3
    theta = (2 * np.arange(1, p + 1) - 1) * np.pi / (2 * p)

    def function(x):
        return np.exp(x[:, 0]) / x[:, 1]

    point = np.array([0.3, -0.6])
    total = 0.0
    for i in itertools.product(range(p), repeat=2):
        f_i = 0.0
        for q in itertools.product(range(p), repeat=2):
            node = box.centre + box.half_width * np.cos(theta[list(q)])
            f_i += function(node[None])[0] * np.prod(np.cos(np.array(i) * theta[list(q)]))
        f_i *= (2 / p) ** 2
        h = i.count(0)
        total += 0.5**h * f_i * np.prod(np.cos(np.array(i) * np.arccos(point)))
    surrogate = ChebyshevSurrogate.fit(function, box, order=p - 1)
    assert surrogate(box.from_cube(point[None]))[0] == pytest.approx(total, rel=1e-14)


def test_the_error_falls_at_the_rate_that_the_nearest_pole_sets():
    """For 1/(a - x) the error shrinks by a + sqrt(a^2 - 1) per order (Bernstein's theorem)."""
    a = 2.0
    box = Box(("x", "y"), (-1, -1), (1, 1))
    x = latin_hypercube(box, 2000, 5)
    errors = [
        np.abs(
            ChebyshevSurrogate.fit(lambda x: 1 / (a - x[:, 0]) + x[:, 1], box, order)(x)
            - 1 / (a - x[:, 0])
            - x[:, 1]
        ).max()
        for order in range(2, 12)
    ]
    rates = np.divide(errors[:-1], errors[1:])
    assert rates == pytest.approx(np.full(9, a + np.sqrt(a**2 - 1)), rel=0.02)


def test_the_gradient_agrees_with_finite_differences():
    rng = np.random.default_rng(3)
    nominal = np.array([36.0, 8e3, 5e-5, 1.6e-3, 3.0])
    box = Box(("theta_s", "K", "J_in", "B_in", "B_fc"), 0.65 * nominal, 1.35 * nominal)
    surrogate = ChebyshevSurrogate(box, rng.normal(size=(4,) * 5))
    points = 0.9 * latin_hypercube(box, 20, rng) + 0.1 * nominal
    for axis, step in enumerate(1e-5 * nominal):
        shift = np.zeros(5)
        shift[axis] = step
        slope = (surrogate(points + shift) - surrogate(points - shift)) / (2 * step)
        exact = surrogate.gradient(points)[:, axis]
        assert slope == pytest.approx(exact, rel=1e-5, abs=1e-6 * np.abs(exact).max())


def test_many_points_are_evaluated_like_few():
    rng = np.random.default_rng(4)
    box = random_box(rng, 3)
    surrogate = ChebyshevSurrogate(box, rng.normal(size=(3, 4, 2)))
    points = latin_hypercube(box, 20_001, rng)
    few = np.concatenate([surrogate(part) for part in np.array_split(points, 123)])
    assert surrogate(points) == pytest.approx(few, abs=1e-13)
    slopes = np.concatenate([surrogate.gradient(part) for part in np.array_split(points, 123)])
    assert surrogate.gradient(points) == pytest.approx(slopes, abs=1e-12)


def test_the_function_is_called_once_with_all_nodes():
    calls = []
    box = Box(("a", "b"), (0, 10), (2, 30))

    def function(x):
        calls.append(x.copy())
        x[:] = np.nan  # a careless function must not spoil the fit
        return calls[0].sum(axis=1)

    surrogate = ChebyshevSurrogate.fit(function, box, order=2)
    (nodes,) = calls
    roots = np.cos(np.array([1, 3, 5]) * np.pi / 6)
    assert np.unique(nodes[:, 0]) == pytest.approx(np.sort(1 + roots))
    assert np.unique(nodes[:, 1]) == pytest.approx(np.sort(20 + 10 * roots))
    assert len(np.unique(nodes, axis=0)) == 9
    assert surrogate([[0.5, 12.0]])[0] == pytest.approx(12.5, rel=1e-14)


@pytest.mark.parametrize("order", [0, -1, 1.5, True, "3", None])
def test_an_order_below_one_is_refused(order):
    with pytest.raises(InvalidInput, match="order"):
        ChebyshevSurrogate.fit(lambda x: x[:, 0], Box(("a",), (0,), (1,)), order)


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x,
        lambda x: x[1:, 0],
        lambda x: 1.0,
        lambda x: np.where(x[:, 0] > 0.5, np.nan, 1.0),
        lambda x: np.full(len(x), np.inf),
    ],
)
def test_a_function_that_misbehaves_is_refused(function):
    with pytest.raises(InvalidInput, match="values of the function"):
        ChebyshevSurrogate.fit(function, Box(("a",), (0,), (1,)), 2)


def test_it_refuses_to_extrapolate():
    surrogate = ChebyshevSurrogate(Box(("a",), (0,), (1,)), [1.0, 2.0])
    for evaluate in (surrogate, surrogate.gradient):
        with pytest.raises(ExtrapolationError, match=r"a is 1\.001"):
            evaluate([[0.5], [1.001]])


@pytest.mark.parametrize("coefficients", [1.0, [[1.0]], [], [np.nan], ["a"]])
def test_coefficients_that_are_none_are_refused(coefficients):
    with pytest.raises(InvalidInput, match="coefficients"):
        ChebyshevSurrogate(Box(("a",), (0,), (1,)), coefficients)


@pytest.mark.parametrize("provenance", ["a model", 3, {"model": object()}, {"K": np.nan}])
def test_provenance_that_cannot_be_stored_is_refused_at_once(provenance):
    with pytest.raises(InvalidInput, match="provenance"):
        ChebyshevSurrogate(Box(("a",), (0,), (1,)), [1.0], provenance)


def test_nothing_given_or_taken_can_change_a_surrogate():
    coefficients = np.array([1.0, 2.0])
    provenance = {"model": {"name": "published"}}
    surrogate = ChebyshevSurrogate(Box(("a",), (0,), (1,)), coefficients, provenance)
    coefficients[0] = 9.0
    provenance["model"]["name"] = "other"
    surrogate.provenance["model"]["name"] = "another"
    assert surrogate.provenance == {"model": {"name": "published"}}
    assert surrogate([[0.5]])[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        surrogate.coefficients[0] = 9.0


def test_points_are_left_as_they_were():
    surrogate = ChebyshevSurrogate(Box(("a", "b"), (0, 0), (1, 1)), np.ones((3, 3)))
    points = np.array([[0.1, 0.2], [1.0 + 1e-14, 0.3]])
    before = points.copy()
    surrogate(points)
    surrogate.gradient(points)
    assert np.array_equal(points, before)


def test_a_pickled_surrogate_gives_the_same_bytes():
    rng = np.random.default_rng(6)
    surrogate = ChebyshevSurrogate(random_box(rng, 3), rng.normal(size=(3, 3, 3)), {"k": 2})
    other = pickle.loads(pickle.dumps(surrogate))
    points = latin_hypercube(surrogate.box, 50, rng)
    assert other(points).tobytes() == surrogate(points).tobytes()
    assert other.gradient(points).tobytes() == surrogate.gradient(points).tobytes()
    assert other.provenance == {"k": 2}
