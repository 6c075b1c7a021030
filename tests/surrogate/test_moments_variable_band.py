"""Moments with the tolerance as a variable: closed forms, chaospy, `ExactMoments`, differences."""

import copy
import pickle

import chaospy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    ExtrapolationError,
    TruncatedNormal,
    UniformBand,
    VariableBandMoments,
    latin_hypercube,
)

NAMES = ("K", "theta_s", "B_fc")
"""The noise stands in the middle, as it may."""

NOISE = TruncatedNormal(36.0, 5.6)
SPACE = Box(("K", "B_fc", "tolerance"), (6e3, 2.2, 0.001), (1e4, 3.8, 0.1))


def made_up(sizes=(4, 3, 5), seed=0):
    """Return a surrogate with decaying random coefficients around 90."""
    degree = np.indices(sizes).sum(axis=0)
    coefficients = np.random.default_rng(seed).normal(size=sizes) * 0.5**degree
    coefficients[0, 0, 0] = 90.0
    return ChebyshevSurrogate(Box(NAMES, (5e3, 18.0, 1.9), (1.1e4, 54.0, 4.2)), coefficients)


@pytest.fixture(scope="module")
def surrogate():
    return made_up()


@pytest.fixture(scope="module")
def moments(surrogate):
    return VariableBandMoments(surrogate, {"theta_s": NOISE}, SPACE)


def test_a_product_of_noise_and_design_in_closed_form():
    noise = TruncatedNormal(2.0, 0.3)
    box = Box(("theta", "u"), (1.0, 0.5), (3.0, 5.0))
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] * x[:, 1] + 7.0, box, 1)
    moments = VariableBandMoments(
        surrogate, {"theta": noise}, Box(("u", "t"), (1.0, 0.01), (4.0, 0.2))
    )
    u, t = np.linspace(1.0, 4.0, 7), np.linspace(0.2, 0.01, 7)
    mean, std = moments(np.column_stack([u, t]))
    second = (2.0**2 + noise.truncated_std**2) * u**2 * (1 + t**2 / 3)
    assert mean == pytest.approx(2.0 * u + 7.0, rel=1e-13)
    assert std == pytest.approx(np.sqrt(second - (2.0 * u) ** 2), rel=1e-12)


def test_a_square_of_a_design_that_changes_sign_in_closed_form():
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] ** 2, Box(("u",), (-3,), (3,)), 2)
    moments = VariableBandMoments(surrogate, {}, Box(("u", "t"), (-2, 0.05), (2, 0.3)))
    u, t = np.linspace(-2.0, 2.0, 9), np.linspace(0.05, 0.3, 9)
    mean, std = moments(np.column_stack([u, t]))
    assert mean == pytest.approx(u**2 * (1 + t**2 / 3), abs=1e-13)
    variance = u**4 * ((1 + 2 * t**2 + t**4 / 5) - (1 + t**2 / 3) ** 2)
    assert std == pytest.approx(np.sqrt(variance), rel=1e-11, abs=1e-14)


@pytest.mark.parametrize("tolerance", [0.001, 0.05, 0.1])
def test_at_a_fixed_tolerance_they_are_the_exact_moments(surrogate, moments, tolerance):
    inputs = (UniformBand(tolerance), NOISE, UniformBand(tolerance))
    fixed = ExactMoments(surrogate, inputs, Box(("K", "B_fc"), SPACE.lower[:2], SPACE.upper[:2]))
    designs = latin_hypercube(fixed.design_box, 60, 1)
    points = np.column_stack([designs, np.full(60, tolerance)])
    for mine, theirs in zip(moments(points), fixed(designs), strict=True):
        assert mine == pytest.approx(theirs, rel=1e-12)
    for mine, theirs in zip(moments.gradient(points), fixed.gradient(designs), strict=True):
        scale = np.abs(theirs).max(axis=0)
        assert mine[:, :2] / scale == pytest.approx(theirs / scale, abs=1e-10)


@pytest.mark.nightly
def test_they_agree_with_chaospys_quadrature(surrogate, moments):
    low, high = NOISE.support
    theta = chaospy.TruncNormal(lower=low, upper=high, mu=NOISE.mean, sigma=NOISE.std)
    points = latin_hypercube(SPACE, 8, 1)
    for (first, last, t), mean, std in zip(points, *moments(points), strict=True):
        bands = [chaospy.Uniform((1 - t) * u, (1 + t) * u) for u in (first, last)]
        scatter = chaospy.J(bands[0], theta, bands[1])
        nodes, weights = chaospy.generate_quadrature(4, scatter, rule="gaussian")
        values = surrogate(nodes.T)
        expected = weights @ values
        assert mean == pytest.approx(expected, rel=1e-10)
        assert std == pytest.approx(np.sqrt(weights @ (values - expected) ** 2), rel=1e-10)


@settings(max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    kinds=st.lists(st.booleans(), min_size=1, max_size=4).filter(any),
)
def test_any_mixture_of_inputs_agrees_with_fixed_bands(seed, kinds):
    """Noise may stand anywhere, more than once or not at all; degrees may differ, down to 0."""
    rng = np.random.default_rng(seed)
    names = tuple(f"x{j}" for j in range(len(kinds)))
    coefficients = rng.normal(size=rng.integers(1, 5, len(kinds)))
    surrogate = ChebyshevSurrogate(
        Box(names, [-2.0] * len(kinds), [2.0] * len(kinds)), coefficients
    )
    noise = {
        name: TruncatedNormal(0.1, 0.4, 2.5)
        for name, designed in zip(names, kinds, strict=True)
        if not designed
    }
    designed = tuple(name for name in names if name not in noise)
    low, high = [-1.0] * len(designed), [1.3] * len(designed)
    moments = VariableBandMoments(
        surrogate, noise, Box((*designed, "t"), [*low, 0.01], [*high, 0.5])
    )
    for point in latin_hypercube(moments.design_box, 3, rng):
        inputs = [noise.get(name, UniformBand(point[-1])) for name in names]
        fixed = ExactMoments(surrogate, inputs, Box(designed, low, high))
        expected = np.ravel(fixed(point[None, :-1]))
        assert np.ravel(moments(point[None])) == pytest.approx(expected, rel=1e-8, abs=1e-7)


def test_gradients_agree_with_finite_differences(moments):
    inner = Box(SPACE.names, 0.99 * SPACE.lower + 0.01 * SPACE.upper, 0.99 * SPACE.upper)
    points = latin_hypercube(inner, 30, 4)
    gradients = moments.gradient(points)
    for axis, step in enumerate(1e-5 * (SPACE.upper - SPACE.lower)):
        shift = np.zeros(3)
        shift[axis] = step
        for after, before, gradient in zip(
            moments(points + shift), moments(points - shift), gradients, strict=True
        ):
            slope = (after - before) / (2 * step)
            scale = np.abs(gradient[:, axis]).max()
            assert gradient[:, axis] == pytest.approx(slope, rel=1e-6, abs=1e-7 * scale)


def test_a_constant_has_neither_deviation_nor_slopes():
    surrogate = ChebyshevSurrogate(Box(("u",), (0,), (2,)), [90.0])
    moments = VariableBandMoments(surrogate, {}, Box(("u", "t"), (0.5, 0.01), (1, 0.1)))
    points = latin_hypercube(moments.design_box, 5, 1)
    assert np.array_equal(moments(points), [[90.0] * 5, [0.0] * 5])
    assert np.array_equal(moments.gradient(points), np.zeros((2, 5, 2)))


def test_a_tiny_scatter_on_a_large_value_keeps_its_digits():
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] + 1e4, Box(("u",), (0.5,), (3,)), 3)
    moments = VariableBandMoments(surrogate, {}, Box(("u", "t"), (1, 1e-7), (2, 1e-5)))
    u = np.linspace(1.0, 2.0, 5)
    _, std = moments(np.column_stack([u, np.full(5, 1e-6)]))
    assert std == pytest.approx(1e-6 * u / np.sqrt(3), rel=1e-6)


def test_a_design_has_the_same_moments_alone_and_among_many(moments):
    """More designs than are worked on at once."""
    points = latin_hypercube(SPACE, 2000, 6)
    together = moments(points), moments.gradient(points)
    for row in (0, 777, 1999):
        alone = moments(points[row : row + 1]), moments.gradient(points[row : row + 1])
        for whole, part in zip(sum(together, ()), sum(alone, ()), strict=True):
            assert whole[row] == pytest.approx(part[0], rel=1e-14)


def test_no_designs_give_no_moments(moments):
    assert moments(np.empty((0, 3)))[0].shape == (0,)
    assert moments.gradient(np.empty((0, 3)))[1].shape == (0, 3)


def test_copies_give_the_same_bytes(moments):
    points = latin_hypercube(SPACE, 5, 6)
    for other in (pickle.loads(pickle.dumps(moments)), copy.deepcopy(moments)):
        for mine, theirs in zip(moments(points), other(points), strict=True):
            assert mine.tobytes() == theirs.tobytes()


def test_designs_outside_their_box_are_refused(moments):
    for evaluate in (moments, moments.gradient):
        with pytest.raises(ExtrapolationError, match=r"tolerance is 0\.11"):
            evaluate(np.array([[8e3, 3.0, 0.11]]))
        with pytest.raises(ExtrapolationError, match="K is nan"):
            evaluate(np.array([[np.nan, 3.0, 0.05]]))


@pytest.mark.parametrize(
    ("noise", "space", "message"),
    [
        ({"theta": NOISE}, SPACE, "name of a noise variable is 'theta', allowed: one of K"),
        ({}, SPACE, "names of the design box"),
        ({"theta_s": NOISE}, Box(SPACE.names[::-1], SPACE.lower, SPACE.upper), "tolerance"),
        ({"theta_s": NOISE}, Box(SPACE.names, (6e3, 2.2, 0.0), SPACE.upper), "tolerance is 0.0"),
        ({"theta_s": NOISE}, Box(SPACE.names, SPACE.lower, (1e4, 3.8, 1.0)), "tolerance is 1.0"),
        ({"theta_s": NOISE}, Box(SPACE.names, SPACE.lower, (1e4, 3.8, 0.2)), "K over the design"),
        ({"theta_s": TruncatedNormal(36.0, 7.0)}, SPACE, "theta_s over the design box"),
        ({"theta_s": 36.0}, SPACE, "input 'theta_s' is 36.0"),
    ],
)
def test_what_does_not_fit_the_surrogate_is_refused(surrogate, noise, space, message):
    with pytest.raises(InvalidInput) as caught:
        VariableBandMoments(surrogate, noise, space)
    assert message in str(caught.value)
