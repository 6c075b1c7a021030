"""A mesh stiffness that varies with the input angle at any order."""

from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    floquet_multipliers,
    harmonic_balance,
    preset,
    quasi_static_torsion,
    simulate_drive,
)
from pymoo_hdte.drive._effects import effect_from_fields
from pymoo_hdte.effects.stiffness import PeriodicStiffness
from pymoo_hdte.units import ARCSEC


def plain(name="published"):
    """Return a preset with a constant stiffness."""
    model = preset(name)
    kept = [effect for effect in model.effects if effect.name != MeshStiffnessVariation.name]
    return replace(model, effects=tuple(kept))


def varying(model, *variations):
    return replace(model, effects=(*model.effects, *variations))


def nominal(model):
    return model.coefficients(model.nominal[None])


def test_order_two_as_a_law_is_order_two_as_a_coefficient():
    model = plain("resonant")
    by_coefficient = nominal(varying(model, MeshStiffnessVariation(0.1, 0.7)))
    law = PeriodicStiffness(2.0, 0.7, 0.1)
    by_law = replace(nominal(model), laws=(("mesh", law),))
    assert by_coefficient.laws == ()
    expected, found = harmonic_balance(by_coefficient), harmonic_balance(by_law)
    assert np.all(found.converged)
    # The law asks the torus for an order that the coefficient takes as granted.
    torsion = found.torsion[:, np.isin(found.torus.orders, expected.torus.orders)]
    size = np.abs(expected.torsion).max()
    assert torsion == pytest.approx(expected.torsion, abs=1e-9 * size)
    assert floquet_multipliers(by_law) == pytest.approx(floquet_multipliers(by_coefficient))
    # A phase is one against another line: beside order 4 it decides how far motions grow.
    other = ("mesh", PeriodicStiffness(4.0, 0.2, 0.3))
    both = [
        replace(one, laws=(*one.laws, other), input_speed=1.5 * one.input_speed)
        for one in (by_law, by_coefficient)
    ]
    by_law, by_coefficient = (np.sort_complex(floquet_multipliers(one)[0]) for one in both)
    assert by_coefficient == pytest.approx(by_law, rel=1e-9)


@pytest.mark.parametrize("order", others_at_night([1.0, 4.0, 2.02], 2.02))
def test_other_orders_agree_with_the_integrator_along_the_whole_turn(order):
    model = varying(plain("resonant"), MeshStiffnessVariation(0.05, 0.7, order))
    run = simulate_drive(model, model.nominal, settle=12.0)
    balance = harmonic_balance(nominal(model))
    expected = balance.spectrum().at(run.input_angle)[0]
    assert run.transmission_error == pytest.approx(expected, abs=1e-3 * ARCSEC)


def test_a_slow_drive_follows_its_stiffness():
    """At rest K (1 + depth cos) d is the load: the torsion is the load over the stiffness."""
    model = varying(plain(), MeshStiffnessVariation(0.1, 0.3, 4.0)).at(0.1, 40.0)
    coefficients = nominal(model)
    balance = harmonic_balance(coefficients)
    angle = np.linspace(0.0, 2 * np.pi, 50)
    stiffness = coefficients.stiffness[0] * (1.0 + 0.1 * np.cos(4.0 * angle + 0.3))
    expected = coefficients.mean_mesh_torque / stiffness
    lines = np.exp(1j * np.outer(balance.torus.orders, angle))
    found = (balance.torsion[0] @ lines).real
    # Of the powers of half the depth, the kept harmonics miss the third, twice 1.25e-4, and higher.
    assert found == pytest.approx(expected, rel=5e-4)


def test_no_depth_is_nothing():
    model = plain("resonant")
    idle = varying(model, MeshStiffnessVariation(0.0, 0.7, 4.0))
    angle = np.linspace(0.0, 2 * np.pi * model.sheet.ratio, 500)
    found = harmonic_balance(nominal(idle)).spectrum().at(angle)
    assert found == pytest.approx(
        harmonic_balance(nominal(model)).spectrum().at(angle), abs=1e-6 * ARCSEC
    )


def test_several_orders_stand_side_by_side_but_none_twice():
    first, second = MeshStiffnessVariation(0.05, 0.0), MeshStiffnessVariation(0.02, 1.0, 4.0)
    coefficients = nominal(varying(plain(), first, second))
    assert [law.order for law in coefficients.stiffness_variations] == [2.0, 4.0]
    with pytest.raises(InvalidInput, match="each effect once"):
        varying(plain(), second, replace(second, depth=0.1))


@pytest.mark.parametrize("order", [2.0, 4.0, 0.5])
def test_the_order_survives_the_table_and_two_is_left_unsaid(order):
    effect = MeshStiffnessVariation(0.05, 0.3, order)
    table = effect.to_dict()
    assert ("order" in table) == (order != 2.0)
    assert effect_from_fields(Fields(table, "effect")) == effect


@pytest.mark.parametrize("order", [0.0, -2.0, np.nan, "two"])
def test_a_bad_order_is_named(order):
    with pytest.raises(InvalidInput, match=r"mesh_stiffness_variation\.order"):
        MeshStiffnessVariation(0.05, 0.3, order)


def test_the_locked_input_has_the_mean_stiffness():
    """Its angle is not known, so no order of the variation may enter by its phase."""
    torque = np.array([0.0, 20.0, -20.0])
    expected = quasi_static_torsion(nominal(plain()), torque)
    for order in (2.0, 4.0):
        model = varying(plain(), MeshStiffnessVariation(0.2, 0.0, order))
        assert quasi_static_torsion(nominal(model), torque) == pytest.approx(expected)


def test_parametric_resonance_is_found_at_any_order():
    """Order 4 at half the speed pumps as order 2 does, with the losses of twice the angle."""
    light = (LoadInertia(0.395), DampingReference(0.01))
    model = replace(preset("published"), effects=light)
    two = varying(model, MeshStiffnessVariation(0.3, 0.0)).at(280.0, 40.0)
    four = varying(model, MeshStiffnessVariation(0.3, 0.0, 4.0)).at(140.0, 40.0)
    expected = np.sort_complex(floquet_multipliers(nominal(two))[0])
    assert np.sort_complex(floquet_multipliers(nominal(four))[0]) == pytest.approx(expected)
    with pytest.raises(UnstableDrive):
        four.dte_arcsec(four.nominal[None])


@pytest.mark.parametrize(("order", "periods"), [(3.0, 4), (1.5, 8), (4.0, 1)])
def test_multipliers_of_orders_together_belong_to_their_common_period(order, periods):
    """A second order of no depth only lengthens the period: the multipliers are powers."""
    model = plain("resonant")
    alone = nominal(varying(model, MeshStiffnessVariation(0.1, 0.7, 4.0)))
    idle = PeriodicStiffness(order, 0.0, 0.0)
    both = replace(alone, laws=(*alone.laws, ("mesh", idle)))
    expected = np.sort(np.abs(floquet_multipliers(alone)[0]) ** periods)
    assert np.sort(np.abs(floquet_multipliers(both)[0])) == pytest.approx(expected, rel=1e-4)
