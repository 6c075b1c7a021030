"""First-order signatures: what a candidate could remove, in closed form and by a fit."""

from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from planted_features import CONDITIONS, known_data, library, listed, measured, with_sweep

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import out_of_tolerance
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.screening import screen
from pymoo_hdte.discrepancy._verdicts.rattling import leading_sweep_effect
from pymoo_hdte.units import ARCSEC

SEEN = [3.0, 6.0]
FEW = CONDITIONS[::2]
SPEEDS = [*FEW, (600.0, 0.0), (1000.0, 40.0), (1400.0, 20.0)]
"""So many speeds that two powers of the speed differ."""
PLANTED = {
    "torque_ripple:input@3": (0.002, 0.001, 0.0, 0.001),
    "kinematic_error:mesh@3": (0.3 * ARCSEC, 0.2 * ARCSEC, 0.1 * ARCSEC, 0.0),
    "eccentricity:sensor@0.009901": (0.3 * ARCSEC, 0.2 * ARCSEC),
    "hardening_stiffness:mesh": (1e9,),
    "soft_windup:mesh": (0.1, 3e-4, 3.0),
    "nonlinear_drag:input": (0.0088, 2.0),
    "nonlinear_drag/sublinear:input": (0.02, 0.5),
    "load_dependent_friction:input": (0.1,),
    "kinematic_reaction:input": (1.0,),
    "thermal_drift:sensor": (2e-8, 1000.0),
    "load_inertia:output": (0.03,),
}


NOW = ("kinematic_error:mesh@3",)
"""A line; curves are longer."""


def of_label(data, label):
    (found,) = (candidate for candidate in library(data, SEEN) if candidate.label == label)
    return found


@pytest.mark.parametrize("label", others_at_night(PLANTED, *NOW))
def test_nothing_removes_more_to_first_order_than_the_planted_effect(label):
    """But for rounding of a hundredth: an inertia behind a stiff shaft is an inertia."""
    effects = of_label(known_data(), label).build(PLANTED[label])
    data, _ = measured(effects, np.random.default_rng(1), known_data(SPEEDS))
    screened = screen(data, fit(data), library(data, SEEN))
    (own,) = (effect for effect in screened if effect.candidate.label == label)
    assert own.reduction > 0.99 * screened[0].reduction


def test_reduction_by_a_line_is_that_of_linear_least_squares():
    data = known_data(FEW)
    line = listed(data, "torque_ripple", [6.0])
    planted = np.array([1e-4, -3e-4])
    data, _ = measured(line.build(planted), np.random.default_rng(2), data)
    base = fit(data)
    (found,) = screen(data, base, (line,))
    values = base.values[None]
    plain = data.predict(values, ())[0]
    moved = [data.predict(values, line.build(start))[0] for start in line.starts]
    columns = np.array([data.whiten(one - plain) for one in moved]) / line.parameters[0].scale
    rest = len(base.residuals) - len(columns[0])
    signature = np.pad(columns.T, ((0, rest), (0, 0)))
    free = base.jacobian[:, base.bound_sides == 0.0]
    less, more = (
        np.linalg.lstsq(matrix, -base.residuals, rcond=None)
        for matrix in (free, np.hstack([free, signature]))
    )
    assert found.reduction == pytest.approx(less[1][0] - more[1][0], rel=1e-6)
    assert found.start == pytest.approx(more[0][-2:], rel=1e-6)
    # And that is what a fit then finds.
    fitted = fit(data, (line,), np.append(base.values, found.start))
    assert found.reduction == pytest.approx(base.chi_square - fitted.chi_square, rel=0.02)
    assert found.start == pytest.approx(planted, abs=0.1 * np.hypot(*planted))


def test_a_gain_comes_back_from_its_bound_with_the_friction_that_drove_it_there():
    """With the gain held there, friction seemed to remove less than half of what it does."""
    data = known_data(FEW, [1.0, 2.0, 2.02, 6.0])
    ripple, friction = (
        listed(data, name, [6.0]) for name in ("torque_ripple", "load_dependent_friction")
    )
    hidden = (*ripple.build((3e-3, 1e-3)), *friction.build((0.1,)))
    data, _ = measured(hidden, np.random.default_rng(1), data)
    beside = fit(data, (ripple,))
    assert "output_torque_gain" in beside.at_bounds
    (found,) = screen(data, beside, (friction,))
    both = fit(data, (ripple, friction), np.append(beside.values, found.start))
    assert found.reduction == pytest.approx(beside.chi_square - both.chi_square, rel=0.02)
    assert found.start == pytest.approx([0.1], rel=0.1)


@pytest.mark.nightly
def test_noise_gives_a_candidate_its_share_by_chance():
    """The reduction by two unknowns is a chi-square of two degrees of freedom."""
    data = known_data(FEW)
    line = listed(data, "torque_ripple", [6.0])
    rng = np.random.default_rng(3)
    found = []
    for _ in range(20):
        noisy, _ = measured((), rng, data)
        (screened,) = screen(noisy, fit(noisy), (line,))
        found.append(screened.reduction)
    assert np.mean(found) == pytest.approx(2.0, abs=3.5 * 2.0 / np.sqrt(20))
    assert np.min(found) > 0.0


@pytest.mark.parametrize("factor", [1.13, 0.87])
def test_a_freed_parameter_removes_what_was_predicted(factor):
    data, _ = measured((), np.random.default_rng(4), known_data(FEW), stiffness=factor)
    base = fit(data)
    (stiffness,) = (
        one
        for one in out_of_tolerance(base.parameters, base.at_bounds, ())
        if one.releases == "stiffness"
    )
    (found,) = screen(data, base, (stiffness,))
    freed = fit(data, (stiffness,), base.values)
    assert found.reduction == pytest.approx(base.chi_square - freed.chi_square, rel=0.15)


def test_a_parameter_that_would_go_inward_removes_nothing():
    data, _ = measured((), np.random.default_rng(4), known_data(FEW), stiffness=1.13)
    base = fit(data)
    (stiffness,) = (
        one
        for one in out_of_tolerance(base.parameters, base.at_bounds, ())
        if one.releases == "stiffness"
    )
    mirrored = replace(base, residuals=-base.residuals)
    (found,) = screen(data, mirrored, (stiffness,))
    assert found.reduction == 0.0


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("backlash", (4 * ARCSEC,)),
        ("soft_windup", (0.3, 3e-4, 3.0)),
        ("hysteresis", (1.0, 3e-4, 1.5)),
    ],
)
def test_a_sweep_speaks_for_what_it_shows(name, values):
    rng = np.random.default_rng(5)
    data, _ = measured((), rng, known_data(FEW))
    effects = listed(data, name).build(values)
    data = with_sweep(data, effects, rng)
    assert leading_sweep_effect(data, fit(data), library(data)) == name


def test_a_clean_sweep_and_none_speak_for_nothing():
    rng = np.random.default_rng(6)
    data, _ = measured((), rng, known_data(FEW), stiffness=1.04)
    base = fit(data)
    assert leading_sweep_effect(data, base, library(data)) is None
    swept = with_sweep(data, (), rng, stiffness=1.04, locked_stiffness=0.95)
    assert leading_sweep_effect(swept, fit(swept), library(data)) is None


def test_a_record_in_which_the_drive_would_rattle_says_nothing_of_a_clearance():
    """Predicted without any law, it would show the laws that the fit has already."""
    soft, play = (of_label(known_data(), label) for label in ("soft_windup:mesh", "backlash:mesh"))
    values = (0.3, 3e-4, 3.0)
    known = known_data([*FEW, (1000.0, 0.0)])
    data, _ = measured(soft.build(values), np.random.default_rng(1), known)
    fitted = fit(data, (soft,), np.append(fit(data).values, values), 1)
    added = play.build(play.starts[0])
    base = fitted.values[None, : len(data.base)]
    held = data.prediction(base, (*fitted.effects, *added)).balance.converged
    assert not held.all()
    assert np.all(data.features.conditions.output_torque[~held] < 1.0)
    n_records, n_features = data.features.values.shape
    change = data.response(fitted)(added)[: n_records * n_features]
    of_record = np.abs(change.reshape(n_records, n_features)).max(axis=1)
    assert np.all(of_record[~held] == 0.0)
    assert np.all(of_record[held] > 0.0)
