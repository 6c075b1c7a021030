"""Dry friction of the output whose contacts bend before they slip."""

from dataclasses import replace

import numpy as np
import pytest
from drive_mechanism import drive_mechanism

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    LawAtPort,
    harmonic_balance,
    mean_torsion,
    preset,
    quasi_static_torsion,
)
from pymoo_hdte.drive._effects import DriveSizes, PreslidingFriction
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.mechanism.effects import law_effects

LEVEL, WAY, SPREAD = 1.5, 4e-5, 1.4
SWEEP = np.concatenate([np.linspace(a, b, 200) for a, b in [(0, 40), (40, -40), (-40, 40)]])
BENDING = PreslidingFriction(LEVEL, WAY, SPREAD)


def with_law(name, port, law):
    model = preset("calibrated").at(200.0, 20.0)
    model = replace(model, effects=(*model.effects, LawAtPort(name, port, law)))
    return model.coefficients(model.nominal[None])


def test_with_the_input_locked_contacts_of_the_output_are_springs_across_the_mesh():
    bending = with_law("presliding_friction", "output", BENDING)
    springs = with_law("hysteresis", "mesh", MaxwellSlip(LEVEL, WAY, SPREAD))
    assert quasi_static_torsion(bending, SWEEP) == pytest.approx(
        quasi_static_torsion(springs, SWEEP), rel=1e-12
    )


def test_contacts_that_hardly_bend_hold_the_torsion_until_they_slip():
    """The torsion differs from that beside dry friction by no more than the way of the contacts."""
    dry = mean_torsion(with_law("coulomb_friction", "output", CoulombFriction(LEVEL)), SWEEP)
    for way in (1e-6, 1e-7, 1e-8):
        law = PreslidingFriction(LEVEL, way)
        bending = mean_torsion(with_law("presliding_friction", "output", law), SWEEP)
        assert 0.0 < np.abs(bending - dry).max() <= 2.0 * way


def test_in_a_record_that_turns_on_they_are_dry_friction():
    bending = harmonic_balance(with_law("presliding_friction", "output", BENDING))
    dry = harmonic_balance(with_law("coulomb_friction", "output", CoulombFriction(LEVEL)))
    assert np.array_equal(bending.transmission_error, dry.transmission_error)


@pytest.mark.parametrize("field", ["torsion", "spread"])
def test_a_way_has_to_be_positive(field):
    with pytest.raises(InvalidInput, match=f"presliding_friction.{field}"):
        replace(BENDING, **{field: 0.0})


def test_it_is_sought_where_a_sweep_shows_it_only():
    """Records that turn on show dry friction; at a port of another mechanism it is hysteresis."""
    sizes = {"force": 1.0, "residual": 0.1, "largest": 5.0, "speed": 1.0, "travel": 0.1}
    effect = effect_named("presliding_friction")
    assert effect.guesses(Sizes(**sizes)) == []
    assert effect.guesses(DriveSizes(**sizes)) == []
    assert len(effect.guesses(DriveSizes(**sizes, swept=True))) == 1


def test_a_mechanism_refuses_it_and_says_what_to_take():
    assert "presliding_friction" not in {one.name for one in law_effects()}
    linear = replace(preset("published"), effects=())
    law = LawAtPort("presliding_friction", "output", BENDING)
    assert drive_mechanism(linear, linear.nominal)[1] == ()
    with pytest.raises(InvalidInput, match="hysteresis"):
        drive_mechanism(replace(linear, effects=(law,)), linear.nominal)
