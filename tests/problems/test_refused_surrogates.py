"""A tensor surrogate that is wrong by its sign is refused, with the region, not optimised."""

import numpy as np
import pytest

from pymoo_hdte.problems import RobustDTE, RobustProblem, UntrustedSurrogate
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, ExactMoments, TruncatedNormal, UniformBand

UNITS = {"b": "m", "h": "m", "mean": "m", "std": "m"}


def cantilever(points):
    """Return the deflection in m of a cantilever of 1 m: load, modulus, width and height."""
    force, modulus, width, height = points.T
    return 4.0 * force / (modulus * width * height**3)


def moments_of(function, order, lower=0.008):
    noise = TruncatedNormal(500.0, 50.0), TruncatedNormal(2.1e11, 1e10)
    inputs = [*noise, UniformBand(0.02), UniformBand(0.02)]
    designs = Box(("b", "h"), [lower, lower], [0.05, 0.05])
    low = [*(one.support[0] for one in noise), 0.98 * lower, 0.98 * lower]
    high = [*(one.support[1] for one in noise), 0.051, 0.051]
    surrogate = ChebyshevSurrogate.fit(function, Box(("F", "E", "b", "h"), low, high), order)
    return ExactMoments(surrogate, inputs, designs)


def negative_share(moments):
    box = moments.design_box
    designs = np.random.default_rng(1).uniform(box.lower, box.upper, (2000, len(box)))
    return np.mean(moments(designs)[0] < 0.0)


def test_a_mean_below_all_values_is_refused_with_its_region():
    moments = moments_of(cantilever, order=3)
    assert negative_share(moments) == pytest.approx(0.26, abs=0.02)
    with pytest.raises(UntrustedSurrogate, match=r"mean .* is -.*allowed: .*h is ") as refusal:
        RobustProblem(moments, ("mean", "std"), UNITS)
    low, high = refusal.value.region["h"]
    assert 0.008 <= low < high <= 0.05


def test_one_that_keeps_its_sign_is_taken():
    moments = moments_of(cantilever, order=3, lower=0.04)
    assert negative_share(moments) == 0.0
    assert RobustProblem(moments, ("mean", "std"), UNITS).positive is None
    assert RobustDTE().n_obj == 2


def test_the_sign_of_a_response_can_be_declared():
    moments = moments_of(lambda points: cantilever(points) - 3e-3, order=8, lower=0.03)
    RobustProblem(moments, ("mean", "std"), UNITS)
    with pytest.raises(UntrustedSurrogate):
        RobustProblem(moments, ("mean", "std"), UNITS, positive=True)
    RobustProblem(moments_of(cantilever, order=3), ("mean", "std"), UNITS, positive=False)
