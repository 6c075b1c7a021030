"""Sobol indices against closed forms, chaospy, Saltelli samples and the rules they obey."""

import chaospy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from night import others_at_night
from scipy import stats

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    ExtrapolationError,
    TruncatedNormal,
    UniformBand,
    sobol_indices,
    sobol_indices_over_box,
)

NOISE = TruncatedNormal(36.0, 5.6)


def cube(d):
    return Box(tuple(f"x{j}" for j in range(d)), [-1.0] * d, [1.0] * d)


def random_surrogate(seed, sizes):
    """Noise first, then designs of about 1; coefficients that decay as those of a smooth drive."""
    d = len(sizes)
    box = Box(
        ("s", *[f"u{j}" for j in range(1, d)]), [15.0, *[0.4] * (d - 1)], [60.0] + [2] * (d - 1)
    )
    decay = 0.6 ** np.indices(sizes).sum(axis=0)
    coefficients = np.random.default_rng(seed).normal(size=sizes) * decay
    return ChebyshevSurrogate(box, coefficients)


def standard_variables(bands):
    """chaospy's twin of NOISE and some bands, about 0: in physical units it loses its digits."""
    uniforms = [chaospy.Uniform(-1, 1) for _ in range(bands)]
    return chaospy.J(chaospy.TruncNormal(lower=-3, upper=3, mu=0, sigma=1), *uniforms)


def fitted_by_chaospy(surrogate, noise, design, tolerance, order):
    """Return joint distribution, expansion, its coefficients, and the polynomial they make."""
    joint = standard_variables(len(design))
    expansion = chaospy.generate_expansion(order, joint, cross_truncation=np.inf, normed=True)
    nodes, weights = chaospy.generate_quadrature(order, joint, rule="gaussian")
    centre, scale = np.r_[noise.mean, design], np.r_[noise.std, design * tolerance]
    values = surrogate(centre + scale * nodes.T)
    polynomial, coefficients = chaospy.fit_quadrature(
        expansion, nodes, weights, values, retall=True
    )
    return joint, expansion, coefficients, polynomial


@pytest.mark.parametrize(
    ("sizes", "tolerance"),
    [
        pytest.param((4, 4), 0.05, marks=pytest.mark.nightly),
        pytest.param((5, 3), 0.2, marks=pytest.mark.nightly),
        pytest.param((2, 3, 2), 0.3, marks=pytest.mark.nightly),
        ((2, 2, 2), 0.3),
    ],
)
def test_they_agree_with_chaospys_conditional_variances(sizes, tolerance):
    surrogate = random_surrogate(1, sizes)
    design = np.linspace(0.9, 1.3, len(sizes) - 1)
    joint, _, _, fitted = fitted_by_chaospy(surrogate, NOISE, design, tolerance, max(sizes) - 1)
    ours = sobol_indices(surrogate, [NOISE, *[UniformBand(tolerance)] * len(design)], design)
    assert ours.first == pytest.approx(chaospy.Sens_m(fitted, joint), abs=1e-8)
    assert ours.total == pytest.approx(chaospy.Sens_t(fitted, joint), abs=1e-8)
    assert ours.mean == pytest.approx(float(chaospy.E(fitted, joint)), rel=1e-8)
    assert ours.variance == pytest.approx(float(chaospy.Var(fitted, joint)), rel=1e-8)


@pytest.mark.parametrize("model", others_at_night(["resonant", "published"], "resonant"))
def test_in_five_variables_they_agree_with_chaospys_expansion_coefficients(model):
    problem = RobustDTE(model, order=2)
    noise, *bands = inputs = problem.inputs
    _, expansion, coefficients, _ = fitted_by_chaospy(
        problem.surrogate, noise, problem.nominal, bands[0].tolerance, 2
    )
    ours = sobol_indices(problem.surrogate, inputs, problem.nominal)
    first = chaospy.FirstOrderSobol(expansion, coefficients)
    total = chaospy.TotalOrderSobol(expansion, coefficients)
    assert ours.first == pytest.approx(first, abs=1e-8)
    assert ours.total == pytest.approx(total, abs=1e-8)


@pytest.mark.parametrize("tolerance", [0.05, 0.3])
def test_they_agree_with_saltelli_samples_within_their_error(tolerance):
    surrogate = random_surrogate(3, (4, 4, 4, 4))
    design = np.array([0.8, 1.0, 1.3])
    dists = [stats.truncnorm(-3, 3, loc=NOISE.mean, scale=NOISE.std)]
    dists += [stats.uniform(u * (1 - tolerance), 2 * u * tolerance) for u in design]
    estimates = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        sample = stats.sobol_indices(func=lambda x: surrogate(x.T), n=1024, dists=dists, rng=rng)
        estimates.append([sample.first_order, sample.total_order])
    ours = sobol_indices(surrogate, [NOISE, *[UniformBand(tolerance)] * 3], design)
    error = np.std(estimates, axis=0, ddof=1) / np.sqrt(len(estimates))
    assert np.all(np.abs(np.mean(estimates, axis=0) - [ours.first, ours.total]) < 4.5 * error)
    assert error.max() < 0.01


def test_an_additive_polynomial_shares_out_its_variance_without_interactions():
    linear, quadratic = np.array([1.0, -2.0, 0.5]), np.array([0.0, 1.5, 3.0])
    surrogate = ChebyshevSurrogate.fit(lambda x: x @ linear + x**2 @ quadratic, cube(3), 2)
    indices = sobol_indices_over_box(surrogate, cube(3))
    parts = linear**2 / 3 + quadratic**2 * 4 / 45
    assert indices.variance == pytest.approx(parts.sum(), rel=1e-13)
    assert indices.first == pytest.approx(parts / parts.sum(), rel=1e-13)
    assert indices.total == pytest.approx(indices.first, rel=1e-12)


@given(a=st.floats(-5.0, 5.0), b=st.floats(-5.0, 5.0))
def test_a_polynomial_of_ishigamis_kind_has_its_closed_form(a, b):
    """y = x0 + a x1^2 + b x2^4 x0: x2 acts through an interaction alone."""
    surrogate = ChebyshevSurrogate.fit(
        lambda x: x[:, 0] + a * x[:, 1] ** 2 + b * x[:, 2] ** 4 * x[:, 0], cube(3), 4
    )
    indices = sobol_indices_over_box(surrogate, cube(3))
    first, second = (1 + b / 5) ** 2 / 3, a**2 * 4 / 45
    both = b**2 / 3 * (1 / 9 - 1 / 25)
    variance = first + second + both
    assert indices.variance == pytest.approx(variance, rel=1e-11)
    assert indices.first == pytest.approx(np.array([first, second, 0]) / variance, abs=1e-11)
    total = np.array([first + both, second, both]) / variance
    assert indices.total == pytest.approx(total, abs=1e-11)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    sizes=st.lists(st.integers(1, 4), min_size=2, max_size=4),
    tolerance=st.floats(0.0, 0.3),
)
def test_indices_obey_their_sum_rules_and_belong_to_the_exact_variance(seed, sizes, tolerance):
    surrogate = random_surrogate(seed, tuple(sizes))
    designed = len(sizes) - 1
    inputs = [NOISE, *[UniformBand(tolerance)] * designed]
    indices = sobol_indices(surrogate, inputs, np.ones(designed))
    box = Box(surrogate.box.names[1:], [0.99] * designed, [1.01] * designed)
    mean, std = ExactMoments(surrogate, inputs, box)(np.ones((1, designed)))
    assert indices.mean == pytest.approx(mean[0], rel=1e-10, abs=1e-10)
    assert indices.variance == pytest.approx(std[0] ** 2, rel=1e-8, abs=1e-13)
    if indices.variance == 0.0:
        assert not indices.first.any()
        assert not indices.total.any()
        return
    assert np.all(indices.first >= 0.0)
    assert np.all(indices.first <= indices.total + 1e-14)
    assert indices.first.sum() <= 1.0 + 1e-12
    assert indices.total.sum() >= 1.0 - 1e-12
    if len(sizes) == 2:
        assert indices.first + indices.total[::-1] == pytest.approx(np.ones(2), rel=1e-12)


def test_knowing_an_input_takes_its_first_order_share_of_the_variance_on_average():
    """The definition: first = 1 - mean over x_j of the variance given x_j, over the variance."""
    surrogate = random_surrogate(7, (4, 3, 4))
    inputs = [NOISE, UniformBand(0.2), UniformBand(0.1)]
    design = np.array([1.0, 1.2])
    whole = sobol_indices(surrogate, inputs, design)
    factors, weights = inputs[1].quadrature(8)
    known = [NOISE, UniformBand(0.0), inputs[2]]
    left = [sobol_indices(surrogate, known, design * [f, 1.0]).variance for f in factors]
    assert whole.first[1] == pytest.approx(1.0 - weights @ left / whole.variance, abs=1e-13)


def test_a_band_of_no_width_has_no_share_and_a_narrow_one_keeps_its_digits():
    surrogate = ChebyshevSurrogate.fit(
        lambda x: x[:, 0] + x[:, 1], Box(("a", "b"), [0.5, 0.5], [1.5, 1.5]), 3
    )
    ones = np.ones(2)
    indices = sobol_indices(surrogate, [UniformBand(0.0), UniformBand(0.1)], ones)
    assert indices.first.tolist() == indices.total.tolist()
    assert indices.first == pytest.approx([0.0, 1.0], abs=1e-15)
    narrow = sobol_indices(surrogate, [UniformBand(1e-6), UniformBand(2e-6)], ones)
    assert narrow.first == pytest.approx([0.2, 0.8], rel=1e-8)


def test_a_box_around_a_design_is_a_band_around_it():
    surrogate = random_surrogate(4, (4, 4, 4))
    box = Box(surrogate.box.names, [30.0, 0.9, 1.08], [40.0, 1.1, 1.32])
    as_bands = [UniformBand(5 / 35), UniformBand(0.1), UniformBand(0.1)]
    over_box = sobol_indices_over_box(surrogate, box)
    around = sobol_indices(surrogate, as_bands, box.centre)
    assert over_box.first == pytest.approx(around.first, rel=1e-12)
    assert over_box.total == pytest.approx(around.total, rel=1e-12)


def test_indices_do_not_depend_on_scale_offset_or_the_order_of_variables():
    surrogate = random_surrogate(5, (4, 3, 2))
    box = surrogate.box
    plain = sobol_indices_over_box(surrogate, box)
    moved = -7.0 * np.array(surrogate.coefficients)
    moved[0, 0, 0] += 1e3
    other = sobol_indices_over_box(ChebyshevSurrogate(box, moved), box)
    assert other.first == pytest.approx(plain.first, rel=1e-9)
    order = [2, 0, 1]
    turned = Box(tuple(box.names[j] for j in order), box.lower[order], box.upper[order])
    permuted = ChebyshevSurrogate(turned, surrogate.coefficients.transpose(order))
    assert sobol_indices_over_box(permuted, turned).total == pytest.approx(plain.total[order])


def test_a_constant_has_nothing_to_share():
    surrogate = ChebyshevSurrogate.fit(lambda x: np.full(len(x), 3.7), cube(3), 3)
    indices = sobol_indices_over_box(surrogate, cube(3))
    assert (indices.mean, indices.variance) == (pytest.approx(3.7), 0.0)
    assert indices.first.tolist() == indices.total.tolist() == [0.0] * 3


def test_what_does_not_match_the_surrogate_is_refused():
    surrogate = random_surrogate(6, (2, 2))
    band = UniformBand(0.1)
    with pytest.raises(InvalidInput, match="number of inputs is 1, allowed: 2"):
        sobol_indices(surrogate, [NOISE], [1.0])
    with pytest.raises(InvalidInput, match=r"input 'u1' is 0\.1"):
        sobol_indices(surrogate, [NOISE, 0.1], [1.0])
    with pytest.raises(InvalidInput, match="shape of design"):
        sobol_indices(surrogate, [NOISE, band], [1.0, 1.0])
    with pytest.raises(ExtrapolationError, match=r"u1 is 2\.09"):
        sobol_indices(surrogate, [NOISE, band], [1.9])
    with pytest.raises(InvalidInput, match="names of the box"):
        sobol_indices_over_box(surrogate, cube(2))
    with pytest.raises(ExtrapolationError, match="s is 10"):
        sobol_indices_over_box(surrogate, Box(("s", "u1"), [10.0, 1.0], [20.0, 1.5]))
