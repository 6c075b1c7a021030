"""Sampled moments: Monte Carlo with common random numbers."""

import pickle

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    ExtrapolationError,
    SampledMoments,
    TruncatedNormal,
    UniformBand,
    latin_hypercube,
)

INPUTS = (UniformBand(0.1), TruncatedNormal(0.2, 0.3), UniformBand(0.05))
DESIGN_BOX = Box(("u", "v"), (1.0, 10.0), (2.0, 30.0))
DESIGNS = latin_hypercube(DESIGN_BOX, 23, 0)


@pytest.fixture(scope="module")
def surrogate():
    box = Box(("u", "theta", "v"), (0.8, -0.8, 9.0), (2.3, 1.2, 32.0))

    def function(x):
        u, theta, v = x.T
        return np.exp(-u) * np.sin(2 * theta + u) + np.log(v) * theta**2 + v / 20

    return ChebyshevSurrogate.fit(function, box, 3)


def test_every_sampled_point_is_evaluated(surrogate):
    """Redraws the samples in the documented order and works design by design."""
    moments = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 3000, 7)
    means, stds = moments(DESIGNS)
    rng = np.random.default_rng(7)
    factor_u, theta, factor_v = (entry.sample(rng, 3000) for entry in INPUTS)
    for (u, v), mean, std in zip(DESIGNS, means, stds, strict=True):
        values = surrogate(np.column_stack([u * factor_u, theta, v * factor_v]))
        assert mean == pytest.approx(values.mean(), rel=1e-13)
        assert std == pytest.approx(np.sqrt(np.mean((values - values.mean()) ** 2)), rel=1e-12)


def test_the_error_against_exact_moments_halves_with_four_times_the_samples(surrogate):
    exact = np.array(ExactMoments(surrogate, INPUTS, DESIGN_BOX)(DESIGNS[:4]))

    def error(n):
        runs = [
            SampledMoments(surrogate, INPUTS, DESIGN_BOX, n, seed)(DESIGNS[:4])
            for seed in range(200)
        ]
        return np.sqrt(np.mean((np.array(runs) - exact) ** 2, axis=(0, 2)))

    assert error(100) / error(1600) == pytest.approx(np.array([4.0, 4.0]), rel=0.2)


def test_the_mean_is_unbiased_within_four_standard_errors(surrogate):
    mean, std = ExactMoments(surrogate, INPUTS, DESIGN_BOX)(DESIGNS)
    sampled, _ = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 100_000, 3)(DESIGNS)
    assert np.all(np.abs(sampled - mean) < 4 * std / np.sqrt(100_000))


def test_a_seed_gives_its_own_bytes_again(surrogate):
    def run(seed):
        mean, std = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 500, seed)(DESIGNS)
        return mean.tobytes() + std.tobytes()

    assert run(0) == run(0)
    assert len({run(0), run(1), run(2)}) == 3


def test_calls_do_not_draw_again(surrogate):
    moments = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 500, 1)
    assert moments(DESIGNS)[0].tobytes() == moments(DESIGNS)[0].tobytes()
    other = pickle.loads(pickle.dumps(moments))
    assert moments(DESIGNS)[1].tobytes() == other(DESIGNS)[1].tobytes()


def test_all_designs_share_their_samples():
    """With additive noise, common samples cancel from every difference between designs."""
    box = Box(("u", "theta"), (0, -2), (3, 2))
    surrogate = ChebyshevSurrogate.fit(lambda x: x[:, 0] + x[:, 1], box, 1)
    inputs = (UniformBand(0.0), TruncatedNormal(0.0, 0.5))
    designs = np.linspace(0, 3, 57)[:, None]
    moments = SampledMoments(surrogate, inputs, Box(("u",), (0,), (3,)), 1000, 5)
    mean, std = moments(designs)
    assert mean - designs[:, 0] == pytest.approx(np.full(57, mean[0]), abs=1e-14)
    assert std == pytest.approx(np.full(57, std[0]), abs=1e-14)
    assert abs(mean[0]) > 1e-4


def test_a_design_does_not_depend_on_its_company(surrogate):
    moments = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 1000, 5)
    together = np.array(moments(DESIGNS))
    alone = np.array([moments(design[None]) for design in DESIGNS])[:, :, 0].T
    assert alone == pytest.approx(together, rel=1e-13)


@pytest.mark.parametrize("n_samples", [300, 20_000])
def test_gradients_are_those_of_the_sampled_moments(surrogate, n_samples):
    moments = SampledMoments(surrogate, INPUTS, DESIGN_BOX, n_samples, 2)
    designs = 0.9 * DESIGNS + 0.1 * np.array([1.5, 20.0])
    gradients = moments.gradient(designs)
    for axis, step in enumerate((1e-5, 1e-4)):
        shift = np.zeros(2)
        shift[axis] = step
        for after, before, gradient in zip(
            moments(designs + shift), moments(designs - shift), gradients, strict=True
        ):
            slope = (after - before) / (2 * step)
            assert gradient[:, axis] == pytest.approx(slope, rel=1e-6, abs=1e-8)


def test_without_scatter_the_gradient_of_the_deviation_is_zero():
    surrogate = ChebyshevSurrogate(Box(("u",), (0,), (1,)), [1.0, 2.0])
    moments = SampledMoments(surrogate, (UniformBand(0.0),), Box(("u",), (0,), (1,)), 8, 0)
    mean, std = moments([[0.25], [0.5]])
    dmean, dstd = moments.gradient([[0.25], [0.5]])
    assert mean == pytest.approx(np.array([0.0, 1.0]), abs=1e-15)
    assert np.array_equal(std, [0.0, 0.0])
    assert dmean == pytest.approx(np.array([[4.0], [4.0]]))
    assert np.array_equal(dstd, [[0.0], [0.0]])


@pytest.mark.parametrize(
    ("n_samples", "seed", "field"),
    [(1, 0, "n_samples"), (10.0, 0, "n_samples"), (10, -1, "seed"), (10, None, "seed")],
)
def test_too_few_samples_and_no_seed_are_refused(surrogate, n_samples, seed, field):
    with pytest.raises(InvalidInput) as caught:
        SampledMoments(surrogate, INPUTS, DESIGN_BOX, n_samples, seed)
    assert caught.value.field == field


def test_what_exact_moments_refuse_is_refused_here(surrogate):
    with pytest.raises(InvalidInput, match="v over the design box"):
        SampledMoments(surrogate, (*INPUTS[:2], UniformBand(0.2)), DESIGN_BOX, 10, 0)
    with pytest.raises(ExtrapolationError, match=r"u is 2\.5"):
        SampledMoments(surrogate, INPUTS, DESIGN_BOX, 10, 0)([[2.5, 20.0]])


def test_designs_are_left_as_they_were(surrogate):
    moments = SampledMoments(surrogate, INPUTS, DESIGN_BOX, 10, 0)
    designs = DESIGNS.copy()
    moments(designs)
    moments.gradient(designs)
    assert np.array_equal(designs, DESIGNS)
