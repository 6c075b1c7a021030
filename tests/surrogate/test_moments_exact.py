"""Exact moments against closed forms, chaospy, brute sampling and finite differences."""

import copy
import pickle

import chaospy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    ExtrapolationError,
    TruncatedNormal,
    UniformBand,
    latin_hypercube,
)

NAMES = ("theta_s", "K", "J_in", "B_in", "B_fc")
NOMINAL = np.array([36.0, 8e3, 5e-5, 1.6e-3, 3.0])
INPUTS = (TruncatedNormal(36.0, 5.6), *[UniformBand(0.05)] * 4)
DESIGN_BOX = Box(NAMES[1:], 0.75 * NOMINAL[1:], 1.25 * NOMINAL[1:])

# Gauss rules of other makes, for polynomials up to degree 9.
BAND_RULE = leggauss(5)
NOISE_RULE = tuple(
    np.ravel(part)
    for part in chaospy.generate_quadrature(
        4, chaospy.TruncNormal(lower=-0.9, upper=1.1, mu=0.1, sigma=0.4), rule="gaussian"
    )
)


def drive_like(seed=0):
    """Return a surrogate of the paper's shape with decaying random coefficients."""
    box = Box(NAMES, 0.5 * NOMINAL, 1.5 * NOMINAL)
    degree = np.indices((4,) * 5).sum(axis=0)
    coefficients = np.random.default_rng(seed).normal(size=(4,) * 5) * 0.5**degree
    coefficients[(0,) * 5] = 90.0
    return ChebyshevSurrogate(box, coefficients)


@pytest.fixture(scope="module")
def surrogate():
    return drive_like()


@pytest.fixture(scope="module")
def moments(surrogate):
    return ExactMoments(surrogate, INPUTS, DESIGN_BOX)


def test_a_product_of_noise_and_design_in_closed_form():
    noise, band = TruncatedNormal(2.0, 0.3), UniformBand(0.1)
    box = Box(("theta", "u"), (1.0, 0.5), (3.0, 5.0))
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] * x[:, 1] + 7.0, box, 1)
    u = np.linspace(1.0, 4.0, 7)
    mean, std = ExactMoments(surrogate, (noise, band), Box(("u",), (1.0,), (4.0,)))(u[:, None])
    second = (2.0**2 + noise.truncated_std**2) * u**2 * (1 + 0.1**2 / 3)
    assert mean == pytest.approx(2.0 * u + 7.0, rel=1e-13)
    assert std == pytest.approx(np.sqrt(second - (2.0 * u) ** 2), rel=1e-12)


def test_a_square_of_a_design_that_changes_sign_in_closed_form():
    t = 0.2
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] ** 2, Box(("u",), (-3,), (3,)), 2)
    u = np.linspace(-2.0, 2.0, 9)
    mean, std = ExactMoments(surrogate, (UniformBand(t),), Box(("u",), (-2,), (2,)))(u[:, None])
    assert mean == pytest.approx(u**2 * (1 + t**2 / 3), abs=1e-14)
    variance = u**4 * ((1 + 2 * t**2 + t**4 / 5) - (1 + t**2 / 3) ** 2)
    assert std == pytest.approx(np.sqrt(variance), abs=1e-7)
    assert std[u != 0] == pytest.approx(np.sqrt(variance[u != 0]), rel=1e-11)


def test_a_tiny_scatter_on_a_large_value_keeps_its_digits():
    t = 1e-6
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] + 1e4, Box(("u",), (0.5,), (3,)), 3)
    u = np.linspace(1.0, 2.0, 5)
    _, std = ExactMoments(surrogate, (UniformBand(t),), Box(("u",), (1,), (2,)))(u[:, None])
    assert std == pytest.approx(t * u / np.sqrt(3), rel=1e-6)


def test_they_agree_with_chaospys_quadrature(surrogate, moments):
    noise = INPUTS[0]
    low, high = noise.support
    theta = chaospy.TruncNormal(lower=low, upper=high, mu=noise.mean, sigma=noise.std)
    designs = latin_hypercube(DESIGN_BOX, 8, 1)
    means, stds = moments(designs)
    for design, mean, std in zip(designs, means, stds, strict=True):
        bands = [chaospy.Uniform(0.95 * u, 1.05 * u) for u in design]
        nodes, weights = chaospy.generate_quadrature(3, chaospy.J(theta, *bands), rule="gaussian")
        values = surrogate(nodes.T)
        expected = weights @ values
        assert mean == pytest.approx(expected, rel=1e-10)
        assert std == pytest.approx(np.sqrt(weights @ (values - expected) ** 2), rel=1e-10)


@pytest.mark.parametrize("order", [3, 5])
def test_very_many_designs_have_the_moments_of_few_on_any_number_of_cores(order, monkeypatch):
    coefficients = drive_like().coefficients
    wider = np.pad(coefficients, [(0, order - 3)] * 5, constant_values=1e-3)
    moments = ExactMoments(ChebyshevSurrogate(drive_like().box, wider), INPUTS, DESIGN_BOX)
    designs = latin_hypercube(DESIGN_BOX, 4500, 3)
    few = np.concatenate([np.array(moments(part)) for part in np.split(designs, 3)], axis=1)
    found = {}
    for cores in (1, 2, 5):
        monkeypatch.setattr(
            "os.sched_getaffinity", lambda pid, n=cores: set(range(n)), raising=False
        )
        found[cores] = np.array(moments(designs))
    assert found[1] == pytest.approx(few, rel=1e-12)
    assert found[1].tobytes() == found[2].tobytes() == found[5].tobytes()


def test_they_agree_with_a_million_samples(surrogate, moments):
    rng = np.random.default_rng(2)
    design = latin_hypercube(DESIGN_BOX, 1, rng)
    mean, std = (float(value[0]) for value in moments(design))
    draws = np.array([entry.sample(rng, 1_000_000) for entry in INPUTS])
    draws[1:] *= design.T
    values = surrogate(draws.T)
    deviation = values - values.mean()
    error_of_mean = values.std() / 1e3
    error_of_std = np.sqrt(np.mean(deviation**4) - values.var() ** 2) / (2 * values.std()) / 1e3
    assert abs(values.mean() - mean) < 4 * error_of_mean
    assert abs(values.std() - std) < 4 * error_of_std


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    kinds=st.lists(st.booleans(), min_size=1, max_size=4).filter(any),
)
def test_any_mixture_of_inputs_agrees_with_brute_quadrature(seed, kinds):
    """Noise may stand anywhere, more than once, and degrees may differ between variables."""
    rng = np.random.default_rng(seed)
    names = tuple(f"x{j}" for j in range(len(kinds)))
    surrogate = ChebyshevSurrogate(
        Box(names, [-2.0] * len(kinds), [2.0] * len(kinds)),
        rng.normal(size=rng.integers(1, 5, len(kinds))),
    )
    inputs = [
        UniformBand(rng.uniform(0, 0.5)) if designed else TruncatedNormal(0.1, 0.4, 2.5)
        for designed in kinds
    ]
    designed = [j for j, kind in enumerate(kinds) if kind]
    design_box = Box(
        tuple(names[j] for j in designed), [-1.0] * len(designed), [1.3] * len(designed)
    )
    moments = ExactMoments(surrogate, inputs, design_box)
    designs = latin_hypercube(design_box, 3, rng)
    for design, mean, std in zip(designs, *moments(designs), strict=True):
        rules = [
            (1 + entry.tolerance * BAND_RULE[0], BAND_RULE[1] / 2) if designed else NOISE_RULE
            for entry, designed in zip(inputs, kinds, strict=True)
        ]
        nodes, weights = (
            np.array(np.meshgrid(*parts)).reshape(len(kinds), -1)
            for parts in zip(*rules, strict=True)
        )
        nodes[designed] *= design[:, None]
        values = surrogate(nodes.T)
        weights = np.prod(weights, axis=0)
        expected = weights @ values
        assert mean == pytest.approx(expected, rel=1e-10, abs=1e-11)
        variance = weights @ (values - expected) ** 2
        assert std**2 == pytest.approx(variance, rel=1e-9, abs=1e-12)


def test_the_mean_has_the_surrogates_degree_and_the_variance_twice_that(moments):
    designs = latin_hypercube(DESIGN_BOX, 50, 3)

    def refitted(quantity, order):
        return ChebyshevSurrogate.fit(quantity, DESIGN_BOX, order)(designs)

    mean, std = moments(designs)
    assert refitted(lambda u: moments(u)[0], 3) == pytest.approx(mean, rel=1e-13)
    assert refitted(lambda u: moments(u)[1] ** 2, 6) == pytest.approx(std**2, rel=1e-11)
    assert np.abs(refitted(lambda u: moments(u)[0], 2) - mean).max() > 1e-4
    assert np.abs(refitted(lambda u: moments(u)[1] ** 2, 5) - std**2).max() > 1e-8


def test_gradients_agree_with_finite_differences(moments):
    designs = 0.9 * latin_hypercube(DESIGN_BOX, 30, 4) + 0.1 * NOMINAL[1:]
    gradients = moments.gradient(designs)
    for axis, step in enumerate(1e-5 * NOMINAL[1:]):
        shift = np.zeros(4)
        shift[axis] = step
        for after, before, gradient in zip(
            moments(designs + shift), moments(designs - shift), gradients, strict=True
        ):
            slope = (after - before) / (2 * step)
            scale = np.abs(gradient[:, axis]).max()
            assert gradient[:, axis] == pytest.approx(slope, rel=1e-6, abs=1e-7 * scale)


def test_without_scatter_the_deviation_and_its_gradient_are_zero():
    surrogate = ChebyshevSurrogate.fit(lambda x: np.exp(x[:, 0]), Box(("u",), (0,), (1,)), 4)
    moments = ExactMoments(surrogate, (UniformBand(0.0),), Box(("u",), (0,), (1,)))
    designs = np.linspace(0, 1, 101)[:, None]
    mean, std = moments(designs)
    assert mean == pytest.approx(surrogate(designs), rel=1e-14)
    assert np.array_equal(std, np.zeros(101))
    dmean, dstd = moments.gradient(designs)
    assert dmean == pytest.approx(surrogate.gradient(designs), rel=1e-11)
    assert np.array_equal(dstd, np.zeros((101, 1)))


def test_a_deviation_that_vanishes_somewhere_is_never_nan():
    """At u = 0 a relative band has no width: the variance is zero up to rounding."""
    surrogate = ChebyshevSurrogate.fit(lambda x: np.sin(3 * x[:, 0]), Box(("u",), (-2,), (2,)), 4)
    moments = ExactMoments(surrogate, (UniformBand(0.1),), Box(("u",), (-1,), (1,)))
    designs = np.concatenate([np.linspace(-1e-7, 1e-7, 201), np.linspace(-1, 1, 201)])[:, None]
    for values in (*moments(designs), *moments.gradient(designs)):
        assert np.all(np.isfinite(values))


@pytest.mark.parametrize(
    ("inputs", "box", "field"),
    [
        (INPUTS[:4], DESIGN_BOX, "number of inputs"),
        ((36.0, *INPUTS[1:]), DESIGN_BOX, "input 'theta_s'"),
        (INPUTS, Box(NAMES[:4], DESIGN_BOX.lower, DESIGN_BOX.upper), "names of the design box"),
        (INPUTS, Box(NAMES[:0:-1], [1] * 4, [2] * 4), "names of the design box"),
        ((TruncatedNormal(36.0, 6.1), *INPUTS[1:]), DESIGN_BOX, "theta_s over"),
        ((*INPUTS[:4], UniformBand(0.21)), DESIGN_BOX, "B_fc over"),
        (
            INPUTS,
            Box(NAMES[1:], DESIGN_BOX.lower * [0.69, 1, 1, 1], DESIGN_BOX.upper),
            "K over",
        ),
    ],
)
def test_inputs_that_do_not_fit_the_surrogate_are_refused(surrogate, inputs, box, field):
    with pytest.raises(InvalidInput) as caught:
        ExactMoments(surrogate, inputs, box)
    assert caught.value.field.startswith(field)


def test_scatter_that_leaves_the_surrogates_box_is_told_with_value_and_interval(surrogate):
    with pytest.raises(InvalidInput) as caught:
        ExactMoments(surrogate, (*INPUTS[:4], UniformBand(0.21)), DESIGN_BOX)
    assert caught.value.value == pytest.approx(3.75 * 1.21)
    assert "1.5 to 4.5" in caught.value.allowed


def test_scatter_up_to_the_very_edge_is_allowed():
    nominal = np.array([36.0, 8e3])
    box = Box(NAMES[:2], [36.0 - 3 * 5.6, 0.75 * 0.95 * 8e3], [36.0 + 3 * 5.6, 1.25 * 1.05 * 8e3])
    surrogate = ChebyshevSurrogate(box, np.ones((3, 3)))
    design_box = Box(NAMES[1:2], 0.75 * nominal[1:], 1.25 * nominal[1:])
    ExactMoments(surrogate, INPUTS[:2], design_box)


def test_designs_outside_their_box_are_refused(moments):
    outside = 1.3 * NOMINAL[None, 1:]
    for evaluate in (moments, moments.gradient):
        with pytest.raises(ExtrapolationError, match="K is 10400"):
            evaluate(outside)


def test_designs_are_left_as_they_were(moments):
    designs = latin_hypercube(DESIGN_BOX, 5, 5)
    before = designs.copy()
    moments(designs)
    moments.gradient(designs)
    assert np.array_equal(designs, before)


def test_copies_give_the_same_bytes(moments):
    designs = latin_hypercube(DESIGN_BOX, 5, 6)
    for other in (pickle.loads(pickle.dumps(moments)), copy.deepcopy(moments)):
        for mine, theirs in zip(moments(designs), other(designs), strict=True):
            assert mine.tobytes() == theirs.tobytes()
