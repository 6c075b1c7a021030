"""Node noise: its covariance against simulation, its bound from Table 5, and the rigid drive."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from experiments.paper.calibrating.data import read_outcomes
from experiments.paper.calibrating.ladder import EFFECTS, NARROW, WIDE, Candidate
from experiments.paper.calibrating.predictions import BAND, uncertain_box
from experiments.paper.calibrating.rigid import RigidDrive
from experiments.paper.calibrating.tables import best_rungs
from experiments.paper.inference import likelihood
from experiments.paper.inference.likelihood import FITTED, OBSERVED, Evaluation, evaluate
from experiments.paper.inference.moments import DESIGNS, TensorSurrogate
from experiments.paper.inference.node_noise import (
    LARGEST,
    growth_of_rmse,
    node_values,
    published_influence,
    share_of_noise,
)
from experiments.paper.inference.rungs import RIGID, Rung, all_rungs, noisy_rungs
from experiments.paper.inference.verdicts import (
    WITHIN,
    noise_that_excuses,
    noisy_choice,
    step_errors,
    uncertainty_of_steps,
)
from experiments.published_values import TABLE_5, TABLE_9
from experiments.runner.committed import committed_file
from pymoo_hdte.drive import preset
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, TruncatedNormal
from pymoo_hdte.surrogate.tensor import coefficients_from_nodes
from pymoo_hdte.units import ARCSEC

FULL = Candidate(EFFECTS, "semi_amplitude", NARROW)
CALIBRATED = best_rungs(read_outcomes(committed_file("calibration.csv", "calibration")), "table8")[
    0
].parameters
"""What the preset is rounded from."""
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


@pytest.mark.nightly
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
    # The steps between the optima, from what was drawn: means first.
    steps = np.diff(drawn.reshape(n, 2, 4)[:, :, 1:], axis=2).std(axis=0).ravel()
    found = evaluate(rung, parameters, front=False)
    without, noisy = (uncertainty_of_steps(found, node_noise=noise) for noise in (0.0, size))
    assert steps == pytest.approx(np.sqrt(noisy**2 - without**2), rel=0.15)


def test_noise_of_an_arcsec_moves_the_reversed_step_by_a_quarter_of_one():
    rung, parameters = Rung(FULL), CALIBRATED
    found = evaluate(rung, parameters, front=False)
    mean, std = uncertainty_of_steps(found, node_noise=1.0)[[1, 3]]
    assert (mean, std) == pytest.approx((0.30, 0.20), abs=0.03)
    assert np.abs(step_errors(found, node_noise=1.0)[[1, 3]]) == pytest.approx([1.6, 0.8], abs=0.1)
    assert np.abs(step_errors(found)[[1, 3]]).min() > 3.0
    for place, needed in enumerate(noise_that_excuses(found)):
        misses = abs(step_errors(found, node_noise=needed)[place])
        assert misses == pytest.approx(WITHIN) if needed > 0.0 else misses <= WITHIN


@pytest.mark.parametrize("bands", [NARROW, WIDE])
def test_derivatives_by_the_nodes_obey_shift_and_scale(bands):
    """A constant moves means alone; moments are homogeneous of degree one in the values."""
    rung = Rung(Candidate(EFFECTS, "semi_amplitude", bands))
    surrogate = TensorSurrogate.fit(rung, CALIBRATED)
    derivatives = published_influence(surrogate, bands)
    assert derivatives.sum(axis=1) == pytest.approx([1.0] * 4 + [0.0] * 5, abs=1e-10)
    five = np.broadcast_to(np.expand_dims(node_values(surrogate), 3), (4,) * 5).ravel()
    predicted = evaluate(rung, CALIBRATED, front=False).predicted
    assert derivatives @ five == pytest.approx(predicted, abs=1e-8)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_noise_of_an_interpolant_is_its_closed_form(order):
    p = order + 1
    nodes, weights = leggauss(2 * p)
    cardinal = np.array(
        [np.polynomial.chebyshev.chebval(nodes, coefficients_from_nodes(e)) for e in np.eye(p)]
    )
    assert share_of_noise(order, 1) == pytest.approx((cardinal**2).sum(axis=0) @ weights / 2.0)
    assert share_of_noise(order) == pytest.approx(share_of_noise(order, 1) ** 5)
    # And by simulation: runs with noise of size 1 at nodes and test points, nothing else.
    rng = np.random.default_rng(order)
    box = Box(tuple("abcde"), -np.ones(5), np.ones(5))
    squares = []
    for _ in range(20):
        series = coefficients_from_nodes(rng.standard_normal((p,) * 5))
        points = rng.uniform(-1.0, 1.0, (500, 5))
        error = ChebyshevSurrogate(box, series)(points) - rng.standard_normal(500)
        squares.append(np.mean(error**2))
    assert np.mean(squares) == pytest.approx(1.0 + share_of_noise(order), rel=0.05)


def test_table_5_bounds_the_noise_and_its_last_row_is_more_than_noise():
    assert LARGEST**2 * (1.0 + share_of_noise(3)) == pytest.approx(TABLE_5[3].rmse_arcsec ** 2)
    assert growth_of_rmse() < 1.02 < TABLE_5[4].rmse_arcsec / TABLE_5[3].rmse_arcsec


@pytest.mark.parametrize("seed", range(4))
def test_the_size_of_the_noise_is_the_likeliest(seed, monkeypatch):
    rung = Rung(Candidate((), "semi_amplitude", WIDE), RIGID)
    found = evaluate(rung, {"std_arcsec": 8.4, "torsion_share": 0.05}, front=False)
    rng = np.random.default_rng(seed)
    made = rng.multivariate_normal(found.predicted, found.covariance_with(0.7))
    monkeypatch.setattr(likelihood, "OBSERVED", made)
    misfit = found.predicted - made

    def deviance(size):
        covariance = found.covariance_with(size)
        logarithm = np.linalg.slogdet(2.0 * np.pi * covariance)[1]
        return misfit @ np.linalg.solve(covariance, misfit) + logarithm

    tried = [deviance(size) for size in np.linspace(0.0, LARGEST, 200)]
    assert found.deviance("noise") == pytest.approx(deviance(found.node_noise))
    assert found.deviance("noise") <= min(tried) + 1e-6
    assert 0.2 < found.node_noise <= LARGEST


def test_without_noise_the_noisy_likelihood_is_the_common_one():
    found = evaluate(Rung(FULL), CALIBRATED, front=False)
    quiet = Evaluation(OBSERVED, found.covariance, found.depths, found.influence)
    assert quiet.node_noise == pytest.approx(0.0, abs=1e-6)
    assert quiet.deviance("noise") == pytest.approx(quiet.deviance("common"))


def test_noise_spreads_what_would_be_chosen():
    rung = Rung(Candidate((), "semi_amplitude", WIDE), RIGID)
    parameters = {"std_arcsec": 8.4, "torsion_share": 0.05}
    still, noisy = (noisy_choice(rung, parameters, size, 50) for size in (0.0, 1.0))
    # A rigid drive has one best design, the stiffest, and no front to speak of.
    assert still.ranges[:2] == pytest.approx(0.0, abs=0.05)
    assert still.ranges[2:] == pytest.approx(1.25)
    assert not still.holds_the_published
    assert np.ptp(noisy.ranges, axis=1)[:2].min() > 0.5


class TestRigidRung:
    def test_it_has_two_parameters_and_no_shape(self):
        rungs = [rung for rung in all_rungs() if rung.closures == RIGID]
        rungs = [rung for rung in rungs if not rung.candidate.effects]
        assert {rung.candidate.bands for rung in rungs} == {NARROW, WIDE}
        assert set(rungs) < set(noisy_rungs())
        for rung in rungs:
            assert list(rung.bounds) == ["std_arcsec", "torsion_share"]
            shape = rung.model({"std_arcsec": 8.0, "torsion_share": 0.05}).kinematic_error
            printed = preset("published").kinematic_error
            ratio = np.array(shape.amplitudes) / printed.amplitudes
            assert ratio == pytest.approx(ratio[0])
            assert np.subtract(shape.phases, printed.phases) == pytest.approx(0.0)
            assert shape.std == pytest.approx(8.0 * ARCSEC)

    def test_the_shape_that_is_left_out_does_nothing(self):
        """Any shape within the ladder's ranges moves the DTE by half a percent at most."""
        candidate = Candidate((), "semi_amplitude", WIDE)
        low, high = np.array(list(candidate.bounds.values())).T
        places = np.random.default_rng(1).uniform(low, high, (10, len(low)))
        nominal = preset("published").nominal[None]
        values = [
            candidate.model(candidate.physical(place)).dte_arcsec(nominal)[0] for place in places
        ]
        assert np.ptp(values) < 0.005 * np.mean(values)

    @pytest.mark.parametrize("bands", [NARROW, WIDE])
    def test_its_moments_are_the_closed_forms(self, bands):
        drive = RigidDrive(0.05, 8.2, bands)
        rung = Rung(Candidate((), "semi_amplitude", bands), RIGID)
        parameters = {"std_arcsec": drive.std_arcsec, "torsion_share": drive.torsion_share}
        found = evaluate(rung, parameters, front=False).predicted
        closed = drive.predict()
        # The gain varies by 1e-4 over the designs, and the surrogate of 1/K is of order 3.
        assert found == pytest.approx([closed[name] for name in FITTED], abs=0.1)
