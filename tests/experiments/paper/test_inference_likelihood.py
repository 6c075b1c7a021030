"""Likelihood of the published numbers: fast model, exact moments, covariance of common draws."""

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss
from numpy.polynomial.legendre import leggauss

from experiments.paper.calibrating.ladder import EFFECTS, KNOWN, NARROW, WIDE, Candidate
from experiments.paper.calibrating.predictions import surrogate_moments
from experiments.paper.inference.closures import CLOSURES
from experiments.paper.inference.likelihood import (
    BAND,
    DRAWS,
    READING,
    TARGETS,
    box_axes,
    depths,
    evaluate,
    least_deviance,
    residuals_of,
)
from experiments.paper.inference.moments import (
    JointValues,
    TensorSurrogate,
    place,
    sampling_covariance,
)
from experiments.paper.inference.rungs import (
    COLUMNS,
    Rung,
    all_rungs,
    dte_arcsec,
    rung_named,
)
from experiments.paper.scatter import gauss_rule
from experiments.published_values import TABLE_9
from pymoo_hdte.drive import preset
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.surrogate.tensor import TensorPolynomial
from pymoo_hdte.units import ARCSEC

FULL = Candidate(EFFECTS, "semi_amplitude", NARROW)


def calibrated():
    """Return the rung and the parameters of the preset."""
    model = preset("calibrated")
    error, (inertia, damping, stiffness) = model.kinematic_error, model.effects
    return Rung(FULL), {
        "amplitude_1": error.amplitudes[0],
        "amplitude_2.02": error.amplitudes[2],
        "phase_2": error.phases[1],
        "phase_2.02": error.phases[2],
        "std_arcsec": error.std / ARCSEC,
        "load_inertia": inertia.inertia,
        "damping_factor": damping.factor,
        "depth": stiffness.depth,
        "phase": stiffness.phase,
    }


@pytest.mark.nightly
@pytest.mark.parametrize("number", range(len(KNOWN)))
@pytest.mark.parametrize("reading", ["peak_to_peak", "semi_amplitude"])
def test_the_fast_dte_is_that_of_the_drive_model(number, reading):
    rung = Rung(Candidate(EFFECTS, reading, NARROW))
    model = rung.model(KNOWN[number])
    designs = model.nominal * np.random.default_rng(number).uniform(0.65, 1.35, (40, 5))
    designs[:, 3] = model.nominal[3]
    found = dte_arcsec(rung, KNOWN[number], designs[:, COLUMNS])
    assert found == pytest.approx(model.dte_arcsec(designs), rel=5e-5)


def test_a_gauss_rule_of_few_nodes_is_exact_for_its_measure():
    nodes, weights = leggauss(40)
    few, few_weights = gauss_rule((nodes, weights / 2.0), 5)
    assert few == pytest.approx(leggauss(5)[0], abs=1e-12)
    assert few_weights == pytest.approx(leggauss(5)[1] / 2.0)
    wide = TruncatedNormal(0.0, 1.0, 10.0).quadrature(14)
    assert gauss_rule(wide, 7)[0] == pytest.approx(hermegauss(7)[0], abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("bands", [NARROW, WIDE])
def test_moments_are_those_of_the_calibration(bands):
    rung, parameters = Rung(Candidate(EFFECTS, "semi_amplitude", bands)), KNOWN[5]
    surrogate = TensorSurrogate.fit(rung, parameters)
    joint = surrogate.joint(bands)
    expected = surrogate_moments(rung.model(parameters), bands, 3)
    assert joint.means == pytest.approx(
        [expected[f"mean_{name}"] for name in ("initial", *TABLE_9)], abs=3e-3
    )
    assert joint.stds == pytest.approx(
        [expected[f"std_{name}"] for name in ("initial", *TABLE_9)], abs=3e-3
    )
    assert surrogate.box_std(bands) == pytest.approx(expected["box_std"], abs=3e-3)


def test_moments_over_the_box_are_those_of_the_robust_problem():
    rung, parameters = calibrated()
    surrogate = TensorSurrogate.fit(rung, parameters)
    stiffness, inertia, damping = box_axes(surrogate, 3)
    mean, std = surrogate.on_designs((stiffness, inertia, damping), BAND)
    problem = RobustDTE("calibrated")
    design = [stiffness[2], inertia[0], problem.nominal[2], damping[1]]
    expected = problem.evaluate(np.array([design]))[0]
    assert (mean[2, 0, 1], std[2, 0, 1]) == pytest.approx(expected, abs=3e-3)


def test_the_covariance_is_that_of_simulated_common_draws():
    """1000 times 300 common draws, compared along every direction, the narrowest too."""
    rung, parameters = calibrated()
    surrogate = TensorSurrogate.fit(rung, parameters)
    n, repeats = 300, 1000
    covariance = sampling_covariance(surrogate.joint(NARROW), n, (0, 0, 0, 0))
    rng = np.random.default_rng(1)
    polynomial, model = TensorPolynomial(surrogate.coefficients[None]), surrogate.model
    spread = TruncatedNormal(model.nominal[0], model.kinematic_error.std)
    theta_s = spread.sample(rng, n * repeats)
    factors = rng.uniform(1.0 - BAND, 1.0 + BAND, (3, n * repeats))
    drawn = []
    for name in ("initial", *TABLE_9):
        points = np.vstack([theta_s, place(model, name)[0][:, None] * factors])
        drawn.append(polynomial(surrogate.box.to_cube(points.T).T)[0].reshape(repeats, n))
    statistics = np.vstack([[v.mean(axis=1) for v in drawn], [v.std(axis=1) for v in drawn]])
    factor = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(factor, statistics - statistics.mean(axis=1, keepdims=True))
    assert np.cov(whitened) == pytest.approx(np.eye(8), abs=0.2)


def test_the_covariance_of_normal_values_is_the_textbooks():
    nodes, weights = hermegauss(9)
    x, y = np.meshgrid(nodes, nodes, indexing="ij")
    joint = JointValues(
        np.array([3.0 * x, 0.8 * x + 0.6 * y]).reshape(2, -1),
        np.outer(weights, weights).ravel() / weights.sum() ** 2,
    )
    found = sampling_covariance(joint, 100, (0, 0))
    # Var mean = s^2/N, cov of means = rho s1 s2/N, var std = s^2/2N, of stds rho^2 s1 s2/2N.
    expected = np.zeros((4, 4))
    expected[:2, :2] = [[9.0, 2.4], [2.4, 1.0]]
    expected[2:, 2:] = [[4.5, 0.96], [0.96, 0.5]]
    assert found == pytest.approx(expected / 100.0, abs=1e-12)
    assert np.all(sampling_covariance(joint, 100, (0, 1))[[0, 2], [1, 3]] == 0.0)


def test_what_the_text_leaves_open_is_what_the_interval_of_theta_s_moves():
    rung, parameters = calibrated()
    moments = [
        np.concatenate([joint.means, joint.stds])
        for joint in (
            TensorSurrogate.fit(rung, parameters, bands=bands).joint(NARROW)
            for bands in (WIDE, NARROW)
        )
    ]
    half = np.sqrt(np.mean((moments[1] - moments[0]) ** 2)) / 2.0
    assert round(half, 2) == READING


@pytest.mark.parametrize("target", TARGETS)
def test_residuals_are_the_deviance(target):
    rung, parameters = calibrated()
    found = evaluate(rung, parameters)
    residuals = residuals_of(rung, target, rung.searched(parameters))
    assert least_deviance(residuals) == pytest.approx(found.deviance(target))
    assert found.chi_square("independent") == pytest.approx(0.6, abs=0.02)
    assert DRAWS == (0, 1, 1, 1)


def test_a_dominated_optimum_has_a_depth():
    rung, parameters = calibrated()
    surrogate = TensorSurrogate.fit(rung, parameters)
    mean, _ = surrogate.on_designs(box_axes(surrogate, 5), BAND)
    best = np.array([[mean.min() - 0.01, 99.0], [mean.min() + 1.0, 99.0]])
    found = depths(surrogate, best, 5)
    assert found[0] == 0.0
    assert found[1] == pytest.approx(1.0 / 0.952)


@pytest.mark.parametrize("name", CLOSURES)
def test_a_closure_does_nothing_at_its_lower_bound(name):
    rung, parameters = calibrated()
    low = {key: bounds[0] for key, bounds in CLOSURES[name].bounds.items()}
    rng = np.random.default_rng(1)
    points = rung.model(parameters).nominal[COLUMNS] * rng.uniform(0.7, 1.3, (10, 4))
    closed = dte_arcsec(Rung(FULL, (name,)), parameters | low, points)
    assert closed == pytest.approx(dte_arcsec(rung, parameters, points), rel=1e-12)


def test_closures_do_what_they_state():
    rung, parameters = calibrated()
    nominal = rung.model(parameters).nominal[COLUMNS]
    stiffer = nominal * np.array([1.0, 1.21, 1.0, 1.0])

    def seen(name, point, **values):
        return dte_arcsec(Rung(FULL, (name,)), parameters | values, point[None])[0]

    def plain(point):
        return dte_arcsec(rung, parameters, point[None])[0]

    torsion = seen("torsion", nominal, torsion_share=0.05) - plain(nominal)
    assert torsion == pytest.approx(0.05 * 40.0 / 2.583e4 / ARCSEC)
    smaller = stiffer * np.array([1.0 / 1.1, 1.0, 1.0, 1.0])
    assert seen("averaging", stiffer, averaging_exponent=0.5) == pytest.approx(plain(smaller))
    damped = stiffer * np.array([1.0, 1.0, 1.0, 1.21**2])
    assert seen("preload", stiffer, preload_exponent=2.0) == pytest.approx(plain(damped))
    gap = nominal[0] * nominal[1] / 40.0
    softer = nominal * np.array([1.0, 1.0 / (1.0 + 0.5 * gap), 1.0, 1.0])
    assert seen("sharing", nominal, sharing=0.5) == pytest.approx(plain(softer))
    early, late = (
        seen("startup", nominal, startup_share=0.1, startup_time=time) - plain(nominal)
        for time in (0.0, 0.05)
    )
    assert early == pytest.approx(0.1 * 40.0 / 2.583e4 / ARCSEC)
    inertia = 1.0 / (1.0 / (1.97e-4 * 101**2) + 1.0 / (8.505e-4 + parameters["load_inertia"]))
    decay = parameters["damping_factor"] * 101**2 * 4.465e-4 / (2.0 * inertia)
    assert late / early == pytest.approx(np.exp(-decay * 0.05))


def test_rungs_come_back_from_their_names_and_parameters_from_the_search_space():
    names = [rung.name for rung in all_rungs()]
    assert len(set(names)) == len(names) == 32 + 2 * (len(CLOSURES) + 3)
    for rung in all_rungs()[::7]:
        assert rung_named(rung.name) == rung
        low, high = rung.limits
        middle = (low + high) / 2.0
        assert rung.searched(rung.physical(middle)) == pytest.approx(middle)
