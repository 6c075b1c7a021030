"""A line of the static error that grows with the load: closed forms, solvers, robust problem."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    KinematicErrorLine,
    KinematicReaction,
    LoadDependentError,
    harmonic_balance,
    preset,
)
from pymoo_hdte.drive.dte_map import critical_speeds
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.units import ARCSEC

LINE = LoadDependentError(3.0, 2.0 * ARCSEC, 0.7, reference=40.0)


def with_effects(model, *effects):
    return replace(model, effects=(*model.effects, *effects))


def line_of(model, order):
    """Return the phasor of an order of the transmission error, rad."""
    balance = harmonic_balance(model.coefficients(model.nominal[None]))
    place, _ = balance.torus.place(order)
    return balance.transmission_error[0, place]


@pytest.mark.parametrize("load", [0.0, 10.0, 40.0])
def test_slowly_turned_the_line_is_the_share_of_the_load(load):
    """Far below resonance theta_d follows theta_s: amplitude (T_L / reference) of a sine."""
    model = preset("published").at(1.0, load)
    expected = -1j * LINE.amplitude * load / 40.0 * np.exp(1j * LINE.phase)
    assert line_of(with_effects(model, LINE), 3.0) == pytest.approx(expected, abs=1e-4 * ARCSEC)


@pytest.mark.parametrize("name", ["published", "calibrated"])
@pytest.mark.parametrize("load", [10.0, 30.0])
@pytest.mark.parametrize("beside", [(), (KinematicReaction(),)])
def test_at_one_load_it_is_a_line_of_its_size(name, load, beside):
    """By the transfer function, Hill's method and harmonic balance alike."""
    model = with_effects(preset(name).at(180.0, load), *beside)
    same = KinematicErrorLine(3.0, LINE.amplitude * load / 40.0, LINE.phase)
    rows = model.nominal * np.array([[0.9], [1.1]])
    growing, fixed = (with_effects(model, line).steady_state(rows) for line in (LINE, same))
    assert growing.orders == pytest.approx(fixed.orders)
    assert growing.phasors == pytest.approx(fixed.phasors, rel=1e-9, abs=1e-15)


def test_one_solution_holds_all_loads():
    """As in a campaign, where each record has a load of its own, which may pull back."""
    model = with_effects(preset("published").at(1.0, 40.0), LINE)
    coefficients = model.coefficients(np.repeat(model.nominal[None], 3, axis=0))
    loads = np.array([-20.0, 20.0, 40.0])
    balance = harmonic_balance(coefficients, load_torque=loads)
    place, _ = balance.torus.place(3.0)
    found = balance.transmission_error[:, place]
    assert found / found[2] == pytest.approx(loads / 40.0, rel=1e-3)


def test_it_excites_a_resonance_and_scatters_in_the_robust_problem():
    calm = preset("calibrated")
    model = with_effects(calm, LINE)
    assert 3.0 in [order for order, _ in critical_speeds(model)]
    design = model.nominal[None, 1:]
    difference = RobustDTE(model, order=1).evaluate(design) - RobustDTE(calm, order=1).evaluate(
        design
    )
    assert np.all(np.isfinite(difference))
    assert np.any(difference != 0.0)


@pytest.mark.parametrize("wrong", [{"order": 0.0}, {"reference": 0.0}, {"amplitude": np.nan}])
def test_numbers_that_mean_nothing_are_refused(wrong):
    with pytest.raises(InvalidInput, match=r"load_dependent_error\."):
        replace(LINE, **wrong)
