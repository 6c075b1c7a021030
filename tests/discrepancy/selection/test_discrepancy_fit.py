"""The joint fit: its derivatives, its statistics, its bounds."""

from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from planted_features import CONDITIONS, known_data, listed, measured, with_sweep
from scipy.stats import chi2, kstest

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import out_of_tolerance
from pymoo_hdte.discrepancy._evidence.order_lines.objective import LOST, Objective
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import expected_values
from pymoo_hdte.discrepancy._selection.released import gain_of_released
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.units import ARCSEC

FEW = CONDITIONS[::2]


@pytest.fixture(scope="module")
def swept():
    """Few records and a torsion sweep of a drive with a line that the base does not hold."""
    line = listed(known_data(), "kinematic_error", [3.0])
    effects = line.build((2.0 * ARCSEC, 0.5 * ARCSEC, 0.0, 0.2 * ARCSEC))
    rng = np.random.default_rng(1)
    data, _ = measured(effects, rng, known_data(FEW), stiffness=1.04)
    return with_sweep(data, rng=rng, stiffness=1.04)


def central_differences(objective, values, step):
    """Derivatives of the residuals by parameters in units of their scale, shape (k, n)."""
    columns = []
    for place, scale in enumerate(objective.scale):
        away = np.zeros(len(values))
        away[place] = step * scale
        rise = objective.residuals(values + away) - objective.residuals(values - away)
        columns.append(rise / (2.0 * step))
    return np.array(columns).T


@pytest.mark.parametrize("names", [(), ("kinematic_error",), ("soft_windup", "load_inertia")])
def test_jacobian_is_that_of_the_residuals(swept, names):
    objective = Objective(swept, [listed(swept, name, [3.0]) for name in names])
    values = objective.start + 0.1 * objective.scale
    found = objective.jacobian(values)
    expected = central_differences(objective, values, 2e-3)
    error = np.linalg.norm(found - expected, axis=0)
    # Forward quotients are off by half a step of curvature.
    assert np.all(error < 5e-3 * np.linalg.norm(expected, axis=0) + 1e-2)
    kept = Objective(swept, objective.candidates, objective.slopes_at(values))
    assert kept.jacobian(values) == pytest.approx(found, abs=1e-2)


def test_derivatives_do_not_depend_on_the_way_there():
    """What Newton's method leaves of a steady state must be far below the step of a quotient.

    Where states arrived by their torsion alone, whatever the speed did, derivatives by a sensor's
    gain were wrong by more than their size.
    """
    data = known_data(FEW, [1.0, 2.0, 2.02, 6.0])
    data, _ = measured((), np.random.default_rng(1), data)
    ripple = listed(data, "torque_ripple", [6.0])
    objective, other = Objective(data, (ripple,)), Objective(data, (ripple,))
    values = objective.start
    from_rest = other.jacobian(values)
    objective.residuals(values)
    errors = np.abs(objective.jacobian(values) - from_rest).max(axis=0)
    assert np.all(errors < 5e-3 * np.abs(from_rest).max(axis=0))


def test_derivatives_by_the_phase_of_a_weak_line_are_as_exact():
    """A step so small that it changes a line by what Newton's method leaves hid a way down."""
    objective = Objective(known_data(FEW), ())
    found = objective.jacobian(objective.start)
    expected = central_differences(objective, objective.start, 2e-3)
    for place in objective.lines.ravel():
        error = np.linalg.norm(found[:, place] - expected[:, place])
        assert error < 1e-3 * np.linalg.norm(expected[:, place]), objective.parameters[place].name


@pytest.mark.parametrize("place", [0, -1])
def test_a_fit_begins_where_its_derivatives_foretell(swept, place):
    """Of the stiffness, and of a strength at its upper bound, from where the step goes down."""
    soft = listed(swept, "soft_windup")
    objective = Objective(swept, (soft,))
    values = objective.start.copy()
    values[-3] = objective.upper[-3]
    values[-1] = objective.upper[-1]
    objective.residuals(values)
    objective.jacobian(values)
    there = values.copy()
    there[place] -= 0.05 * objective.scale[place]
    begins, was = objective._states.at(there), objective._states.motion
    assert begins.tangents is not None
    objective.residuals(there)
    arrived = objective._states.motion
    left = np.abs(begins.torsion - arrived.torsion).sum()
    assert left < 0.2 * np.abs(was.torsion - arrived.torsion).sum()


def test_kept_slopes_stand_for_the_features_of_the_base_only(swept):
    line = listed(swept, "kinematic_error", [3.0])
    renewed = Objective(swept, (line,))
    kept = Objective(swept, (line,), np.zeros((len(swept.base), *swept.features.values.shape)))
    values = renewed.start + 0.1 * renewed.scale
    full, part = renewed.jacobian(values), kept.jacobian(values)
    n_base, n_features = len(swept.base), swept.features.values.size
    assert np.all(part[:n_features, :n_base] == 0.0)
    assert np.any(full[:n_features, :n_base] != 0.0)
    assert part[n_features:] == pytest.approx(full[n_features:], abs=1e-9)
    assert part[:, n_base:] == pytest.approx(full[:, n_base:], abs=1e-2)


def test_nothing_is_tried_beyond_a_bound(swept):
    """A softening above 0.9 or a dry friction below zero is no model."""
    tried = []
    soft = listed(swept, "soft_windup")

    def watched(values):
        tried.append(values)
        return soft.build(values)

    objective = Objective(swept, (replace(soft, build=watched),))
    lower, upper = objective.lower[-3:], objective.upper[-3:]
    for corner in (lower, upper):
        objective.jacobian(np.append(objective.start[:-3], corner))
    assert np.all(np.array(tried) >= lower)
    assert np.all(np.array(tried) <= upper)


def test_whitened_noise_has_unit_covariance():
    data = known_data(FEW)
    features = data.features.values.shape[1]
    for record in range(len(FEW)):
        units = np.zeros((features, len(FEW), features))
        units[:, record] = np.eye(features)
        white = data.whiten(units).reshape(features, len(FEW), features)
        matrix = white[:, record].T
        assert matrix @ data.covariance[record] @ matrix.T == pytest.approx(
            np.eye(features), abs=1e-8
        )
        assert np.count_nonzero(np.delete(white, record, axis=1)) == 0


def test_repeatability_is_the_rms_of_the_change_of_the_static_error():
    """At 10 rpm the transmission error is the static error: nothing is magnified."""
    data = known_data(CONDITIONS[:1])
    added = (data.covariance - data.features.covariance)[0]
    lines = data.features.places(0).ravel()
    # A line of amplitude a has the mean square a^2 / 2.
    mean_square = np.trace(added[np.ix_(lines, lines)]) / 2.0
    assert np.sqrt(mean_square) == pytest.approx(data.campaign.rig.repeatability, rel=1e-3)


@pytest.fixture(scope="module", params=others_at_night([40, 60], 40))
def repeated(request):
    """So many campaigns on drives whose torque sensors err as they are said to: (truth, fit)."""
    data, rng = known_data(FEW), np.random.default_rng(12)
    layout = Layout(data.base)
    drawn = np.array(["_torque_" in parameter.name for parameter in data.base])
    prior = np.where(drawn, layout.array("prior"), 0.0)
    found = []
    for _ in range(request.param):
        truth = layout.array("start") + prior * rng.standard_normal(len(layout))
        truth[layout.index("stiffness")] *= rng.uniform(0.95, 1.05)
        values = data.predict(truth[None], ())[0]
        values += np.einsum("rij,rj->ri", data.whiteners, rng.standard_normal(values.shape))
        planted = replace(data, features=replace(data.features, values=values))
        found.append((truth, fit(planted)))
    return found


@pytest.mark.slow
def test_a_planted_base_comes_back_with_the_scatter_that_the_fit_states(repeated):
    layout = Layout(repeated[0][1].parameters)
    reach = (layout.array("upper") - layout.array("lower")) / 2.0
    pulls = []
    for truth, fitted in repeated:
        deviation = np.sqrt(np.diag(fitted.covariance))
        # What the records hardly determine runs into its tolerance.
        told = deviation < 0.2 * reach
        pulls.append(np.where(told, (fitted.values - truth) / deviation, np.nan))
    told = np.all(np.isfinite(pulls), axis=0)
    names = {fitted.parameters[place].name for place in np.flatnonzero(told)}
    known = np.array(pulls)[:, told]
    assert names >= {"stiffness", "input_inertia", "error_amplitude_1", "error_phase_1", "offset"}
    assert np.all(np.abs(known.mean(axis=0)) < 3.5 / np.sqrt(len(known)))
    assert np.mean(known**2) == pytest.approx(1.0, abs=0.2)
    assert np.mean(np.abs(known) < 1.96) == pytest.approx(0.95, abs=0.03)


@pytest.mark.slow
def test_chi_square_of_the_truth_is_its_degrees_of_freedom(repeated):
    _, first = repeated[0]
    # A parameter that ended at a bound was as good as known.
    degrees_of_freedom = [
        len(first.residuals) - np.count_nonzero(one.bound_sides == 0.0) for _, one in repeated
    ]
    p_values = chi2.sf([one.chi_square for _, one in repeated], degrees_of_freedom)
    assert kstest(p_values, "uniform").pvalue > 0.01


@pytest.mark.parametrize(("factor", "side"), [(1.2, 1.0), (0.8, -1.0)])
def test_a_parameter_out_of_tolerance_stops_at_its_bound(factor, side):
    data, truth = measured((), np.random.default_rng(3), known_data(FEW), stiffness=factor)
    base = fit(data)
    layout = Layout(data.base)
    assert np.all(layout.array("lower") <= base.values)
    assert np.all(base.values <= layout.array("upper"))
    assert base.bound_sides[layout.index("stiffness")] == side
    assert "stiffness" in base.at_bounds
    assert base.bound_sides[layout.index("offset")] == 0.0
    freed = fit(data, out_of_tolerance(data.base, ["stiffness"], ()), base.values)
    assert freed.effects == ()
    assert "stiffness" not in freed.at_bounds
    place = layout.index("stiffness")
    deviation = np.sqrt(freed.covariance[place, place])
    assert freed.values[place] == pytest.approx(truth[place], abs=4.0 * deviation)
    assert freed.chi_square < 0.5 * base.chi_square
    gain = gain_of_released(base, freed.candidates)
    assert gain == pytest.approx(base.chi_square - freed.chi_square, rel=0.1)


@pytest.mark.nightly
@pytest.mark.parametrize("share", [0.92, 1.0, 1.08])
def test_the_interval_of_an_inertia_holds_it_wherever_the_believed_one_lies(share):
    """Records show their sum only, and fits end at one end of the tolerance of the believed one."""
    speeds, loads = (150.0, 500.0, 1000.0, 1500.0, 2000.0), (5.0, 20.0, 30.0, 40.0, 10.0)
    empty = known_data(list(zip(speeds, loads, strict=True)), [1.0, 2.0, 2.02, 3.0])
    load = listed(empty, "load_inertia")
    data, _ = measured(load.build((0.05,)), np.random.default_rng(1), empty, load_inertia=share)
    base = fit(data).values
    found = min(
        (fit(data, (load,), np.append(base, start)) for start in load.starts),
        key=lambda one: one.chi_square,
    )
    deviation = np.sqrt(found.covariance[-1, -1])
    expected = expected_values(found, RULES)
    assert expected[-1] == pytest.approx(0.05, abs=1.96 * deviation)
    # What records determine stays where it is.
    stiffness = Layout(data.base).index("stiffness")
    assert expected[stiffness] == pytest.approx(found.values[stiffness], rel=1e-4)


def test_an_effect_comes_back_from_a_start_far_away():
    data = known_data(FEW)
    line = listed(data, "torque_ripple", [6.0])
    planted = np.array([0.004, -0.003])
    data, _ = measured(line.build(planted), np.random.default_rng(4), data)
    base = fit(data)
    found = fit(data, (line,), np.append(base.values, [-0.02, 0.02]))
    deviation = np.sqrt(np.diag(found.covariance))[-2:]
    assert np.all(deviation < 0.02 * np.hypot(*planted))
    assert found.values[-2:] == pytest.approx(planted, abs=4.0 * deviation.max())
    (effect,) = found.effects
    assert effect.law.amplitude == pytest.approx(np.hypot(*found.values[-2:]), rel=1e-12)


def test_without_a_sweep_the_locked_stiffness_stays_as_its_prior_has_it():
    data, _ = measured((), np.random.default_rng(5), known_data(FEW))
    base = fit(data)
    place = Layout(data.base).index("locked_stiffness")
    assert base.values[place] == pytest.approx(1.0, abs=1e-6)
    deviation = np.sqrt(base.covariance[place, place])
    # Its bounds may make it better known than its prior does, but no record does.
    assert 0.4 < deviation / data.base[place].prior < 1.0 + 1e-6
    assert data.torsion_residuals(base.values[None], ()).shape == (1, 0)


def test_a_sweep_tells_the_locked_stiffness_from_the_running_one():
    rng = np.random.default_rng(6)
    data, _ = measured((), rng, known_data(FEW), stiffness=1.03)
    data = with_sweep(data, (), rng, stiffness=1.03, locked_stiffness=0.97)
    base = fit(data)
    place = Layout(data.base).index("locked_stiffness")
    deviation = np.sqrt(base.covariance[place, place])
    assert deviation < 0.2 * data.base[place].prior
    assert base.values[place] == pytest.approx(0.97, abs=4.0 * deviation)
    # Points less one for the constant of the angle.
    assert data.torsion_residuals(base.values[None], ()).shape == (1, 59)


def test_a_sweep_that_a_model_cannot_carry_is_lost_and_no_more_than_that():
    light = known_data([(10.0, 5.0), (2000.0, 10.0), (2000.0, 0.0)])
    data = with_sweep(measured(data=light)[0])
    law = listed(data, "hardening_stiffness")
    objective = Objective(data, (law,))
    stiffness = data.campaign.believed.stiffness
    # K d - k d^3 carries no more than 2/3 K d where its slope is zero: here 25 N.m of 40.
    farthest = 25.0 / (2.0 / 3.0 * stiffness)
    values = np.append(objective.start[:-1], -stiffness / (3.0 * farthest**2))
    residuals = objective.residuals(values)
    lost = np.zeros(len(residuals), dtype=bool)
    lost[data.features.values.size :][:59] = True
    assert np.all(residuals[lost] == LOST)
    assert np.all(np.abs(residuals[~lost]) < LOST)
