"""Node noise: its covariance against simulation, its bound from Table 5, and the rigid drive."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from experiments.paper.calibrating.ladder import EFFECTS, KNOWN, NARROW, WIDE, Candidate
from experiments.paper.calibrating.predictions import BAND, PUBLISHED, uncertain_box
from experiments.paper.inference.likelihood import FITTED, OBSERVED, Evaluation, evaluate
from experiments.paper.inference.moments import DESIGNS, TensorSurrogate
from experiments.paper.inference.node_noise import (
    LARGEST,
    growth_of_rmse,
    node_values,
    published_influence,
    share_of_noise,
)
from experiments.paper.inference.noisy_front import noisy_choice
from experiments.paper.inference.rungs import RIGID, Rung, all_rungs, noisy_rungs
from experiments.paper.inference.verdicts import step_errors, uncertainty_of_steps
from experiments.published_values import TABLE_5, TABLE_9
from pymoo_hdte.drive import preset
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, TruncatedNormal
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes
from pymoo_hdte.units import ARCSEC

CALIBRATED = KNOWN[5]
"""The basin that the preset is rounded from."""
UNIFORM = leggauss(4)[0], leggauss(4)[1] / 2.0


def moments_of_noisy_surrogates(rung, parameters, noise):
    """Return the eight moments of surrogates in five variables, fitted to values with noise.

    ``noise`` is (n, 4, 4, 4, 4, 4) in arcsec; the result is (n, 8). Nothing is linearised.
    """
    model = rung.model(parameters)
    box = uncertain_box(model, WIDE)
    surrogate = TensorSurrogate.fit(rung, parameters)
    values = np.expand_dims(node_values(surrogate), 3) + noise
    series = [coefficients_from_nodes(one) for one in values]
    theta_s, weights = TruncatedNormal(0.0, 1.0).quadrature(6)
    found = []
    for name in DESIGNS:
        initial = name == "initial"
        centre = model.nominal[1:] if initial else np.array(TABLE_9[name])
        band = BAND["initial" if initial else "optimum"][rung.candidate.bands]
        axes = [model.nominal[0] + model.kinematic_error.std * theta_s]
        axes += [value * (1.0 + band * UNIFORM[0]) for value in centre]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 5)
        of_points = weights
        for _ in range(4):
            of_points = np.multiply.outer(of_points, UNIFORM[1])
        of_points = of_points.ravel()
        inside = np.clip(points, box.lower, box.upper)
        drawn = np.array([ChebyshevSurrogate(box, one)(inside) for one in series])
        means = drawn @ of_points
        found.append([means, np.sqrt((drawn - means[:, None]) ** 2 @ of_points)])
    return np.concatenate(np.moveaxis(found, 1, 0)).T


@pytest.mark.parametrize("bands", [NARROW, WIDE])
def test_the_covariance_of_node_noise_is_that_of_surrogates_fitted_to_noisy_runs(bands):
    rung = Rung(Candidate(EFFECTS, "semi_amplitude", bands))
    parameters = CALIBRATED
    size, n = 0.5, 300
    noise = size * np.random.default_rng(1).standard_normal((n, *(4,) * 5))
    drawn = moments_of_noisy_surrogates(rung, parameters, noise)
    derivatives = published_influence(TensorSurrogate.fit(rung, parameters), bands)[:8]
    linear = noise.reshape(n, -1) @ derivatives.T
    # Draw by draw: the means are linear, the standard deviations are to first order.
    exact = moments_of_noisy_surrogates(rung, parameters, np.zeros((1, *(4,) * 5)))
    assert (drawn - exact)[:, :4] == pytest.approx(linear[:, :4], abs=1e-9)
    rest = (drawn - exact - linear)[:, 4:]
    assert np.sqrt(np.mean(rest**2)) < 0.05 * linear[:, 4:].std()
    factor = np.linalg.cholesky(size**2 * derivatives @ derivatives.T)
    whitened = np.linalg.solve(factor, linear.T)
    assert np.cov(whitened) == pytest.approx(np.eye(8), abs=0.25)
