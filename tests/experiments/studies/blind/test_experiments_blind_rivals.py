"""Simpler tools: regressions of known support, planted misfits, planted effects."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from night import others_at_night
from planted_balances import EFFECTS, swept
from planted_features import analysed, known_data, measured

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.units import ARCSEC

pytest.importorskip("pysindy", reason="needs the extra blind")

from experiments.studies.blind.simpler_tools import (
    explained,
    held_out_misfit,
    largest_residual_rule,
    sparse_regression,
    stlsq_support,
)
from experiments.studies.blind.torque_balances import Regression


def planted(effects=(), seed=1):
    """What the tools use of an analysis: two noisy campaigns of one drive."""
    rng = np.random.default_rng(seed)
    train, _ = measured(effects, rng, stiffness=1.04)
    held_out, _ = measured(effects, rng, stiffness=1.04)
    verdict = analysed(train).verdict
    return SimpleNamespace(data=train, verdict=verdict, held_out=held_out)


def test_thresholded_least_squares_finds_the_known_support():
    rng = np.random.default_rng(4)
    columns = np.linalg.qr(rng.standard_normal((200, 12)))[0] + 0.02 * rng.standard_normal(
        (200, 12)
    )
    columns /= np.linalg.norm(columns, axis=0)
    truth = np.zeros(12)
    truth[[2, 5, 9]] = 30.0, -8.0, 15.0
    target = columns @ truth + rng.standard_normal(200)
    assert np.flatnonzero(stlsq_support(columns, target, 5.0)).tolist() == [2, 5, 9]
    assert np.flatnonzero(stlsq_support(columns, target, 12.0)).tolist() == [2, 9]
    assert not stlsq_support(columns, target, 100.0).any()


@pytest.mark.parametrize("seed", range(10))
def test_thresholded_least_squares_by_hand(seed):
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((60, 8)) @ (np.eye(8) + 0.4 * rng.standard_normal((8, 8)))
    columns /= np.linalg.norm(columns, axis=0)
    target = columns @ np.where(rng.random(8) < 0.5, 0.0, 10.0 * rng.standard_normal(8))
    target += rng.standard_normal(60)
    kept = np.ones(8, dtype=bool)
    for _ in range(20):
        part, ridge = columns[:, kept], 0.05
        solution = np.zeros(8)
        solution[kept] = np.linalg.solve(
            part.T @ part + ridge * np.eye(kept.sum()), part.T @ target
        )
        if np.array_equal(np.abs(solution) >= 3.0, kept):
            break
        kept = np.abs(solution) >= 3.0
    assert np.array_equal(stlsq_support(columns, target, 3.0), kept)


def test_a_coefficient_that_cannot_be_negative_explains_nothing_there():
    column = np.array([[1.0], [2.0], [2.0]])
    assert explained(column, -column[:, 0]) == pytest.approx(9.0)
    assert explained(column, -column[:, 0], np.array([True])) == pytest.approx(0.0, abs=1e-12)
    assert explained(column, column[:, 0], np.array([True])) == pytest.approx(9.0)
    assert explained(column[:, :0], column[:, 0]) == 0.0


def test_the_misfit_of_held_out_records_in_closed_form():
    base, library = np.array([[1.0], [0.0], [0.0]]), np.array([[0.0], [1.0], [0.0]])
    records = np.array([0, 0, 1])
    train = Regression(np.array([2.0, 3.0, 0.0]), base, library, records)
    test = Regression(np.array([2.0 + np.e, 3.0, np.e**2]), base, library, records)
    both, none = np.array([True]), np.array([False])
    # Record 0 leaves e^2 in two rows, record 1 e^4 in one.
    assert held_out_misfit(train, test, both) == pytest.approx((2 * (2 - np.log(2)) + 4) / 3)
    alone = np.log((np.e**2 + 9.0) / 2.0)
    assert held_out_misfit(train, test, none) == pytest.approx((2 * alone + 4) / 3)


@pytest.mark.parametrize("seed", [1, 2])
def test_both_tools_call_a_clean_campaign_adequate(seed):
    analysis = planted(seed=seed)
    assert largest_residual_rule(analysis) == "adequate"
    assert sparse_regression(analysis) == "adequate"


@pytest.mark.parametrize(
    "name",
    others_at_night(
        ["eccentricity", "hardening_stiffness", "load_inertia", "thermal_drift", "torque_ripple"],
        "eccentricity",
    ),
)
def test_sparse_regression_names_a_planted_effect(name):
    assert sparse_regression(planted((EFFECTS[name],))) == name


@pytest.mark.parametrize("seed", others_at_night([1, 2, 3], 1))
def test_sparse_regression_does_not_call_adequate_what_only_a_wrong_damping_explains(seed):
    """At two speeds a drag is a damping, but one far beyond its tolerance: no term holds it.

    What is said instead depends on where the base fit left what no record determines.
    """
    assert sparse_regression(planted((EFFECTS["nonlinear_drag"],), seed)) != "adequate"


def test_sparse_regression_says_so_when_no_term_explains_a_misfit():
    analysis = planted()
    rng, data = np.random.default_rng(5), analysis.data
    stray = np.zeros_like(data.features.values)
    stray[:, data.features.places(0)[1:]] = 3.0 * ARCSEC * rng.standard_normal((10, 5, 2))
    analysis.data = replace(
        data, features=replace(data.features, values=data.features.values + stray)
    )
    assert sparse_regression(analysis) == "unlisted"


def test_without_held_out_records_there_is_no_threshold():
    analysis = planted()
    analysis.held_out = None
    with pytest.raises(InvalidInput, match="held_out records"):
        sparse_regression(analysis)


def at_truth(change, torsion=()):
    """An analysis whose base is the truth, and whose features are that and a change."""
    data, truth = measured(rng=np.random.default_rng(6))
    values = data.features.values + change(data)
    data = replace(data, features=replace(data.features, values=values), torsion=torsion)
    return SimpleNamespace(data=data, verdict=SimpleNamespace(base=SimpleNamespace(values=truth)))


@pytest.mark.parametrize(
    ("channel", "order", "size", "name"),
    [
        (0, 1.0 / 101.0, 2.0 * ARCSEC, "eccentricity"),
        (0, 1.0, 5.0 * ARCSEC, "clearance_variation"),
        (0, 2.0, 5.0 * ARCSEC, "mesh_stiffness_variation"),
        (0, 6.0, 2.0 * ARCSEC, "kinematic_error"),
        (1, 1.0, 0.05, "position_dependent_friction"),
        (1, 2.02, 0.05, "kinematic_reaction"),
        (1, 6.0, 0.05, "torque_ripple"),
        (2, 2.0, 2.0, "load_inertia"),
        (2, 3.0, 2.0, "unlisted"),
    ],
)
def test_the_rule_looks_the_worst_line_up(channel, order, size, name):
    def change(data):
        line = int(np.argmin(np.abs(data.features.orders - order)))
        found = np.zeros_like(data.features.values)
        found[:, data.features.places(channel)[line]] = size
        return found

    assert largest_residual_rule(at_truth(change)) == name


@pytest.mark.parametrize(
    ("place", "follows", "name"),
    [
        (0, lambda c: 30 * ARCSEC * c.elapsed / 900.0, "thermal_drift"),
        (0, lambda c: 30 * ARCSEC * np.tanh(c.output_torque / 5.0), "soft_windup"),
        (1, lambda c: 0.05 * (c.input_speed / 209.0) ** 2, "nonlinear_drag"),
        (1, lambda c: 0.05 * np.exp(-c.input_speed / 10.0), "stribeck_friction"),
    ],
)
def test_the_rule_looks_up_what_a_mean_follows(place, follows, name):
    def change(data):
        found = np.zeros_like(data.features.values)
        found[:, place] = follows(data.features.conditions)
        return found

    assert largest_residual_rule(at_truth(change)) == name


def test_the_rule_takes_an_unlikely_zero_for_dry_friction():
    analysis = at_truth(lambda data: 0.0)
    layout = Layout(analysis.data.base)
    values = analysis.verdict.base.values.copy()
    place = layout.index("input_torque_zero")
    values[place] = 5.0 * analysis.data.base[place].prior
    # The reading moves with its zero, so that the zero is all that is unlikely.
    features = analysis.data.features.values.copy()
    features[:, 1] += values[place]
    data = analysis.data
    analysis.data = replace(data, features=replace(data.features, values=features))
    analysis.verdict.base.values = values
    assert largest_residual_rule(analysis) == "coulomb_friction"


@pytest.mark.parametrize(
    ("name", "bend"),
    [
        ("hysteresis", lambda t, rising: -0.5 * rising),
        ("backlash", lambda t, rising: 0.5 * np.sign(t)),
        ("soft_windup", lambda t, rising: 2.0 * np.tanh(t / 8.0)),
        ("hardening_stiffness", lambda t, rising: -3.0 * (t / 40.0) ** 3),
    ],
)
def test_the_rule_looks_at_the_shape_of_the_sweep(name, bend):
    truth = Layout(known_data().base).array("start")

    def torsion(torque):
        rising = np.sign(np.gradient(torque))
        return (torque + bend(torque, rising)) / truth[0]

    analysis = at_truth(lambda data: 0.0)
    analysis.data = swept(analysis.data, torsion)
    assert largest_residual_rule(analysis) == name
