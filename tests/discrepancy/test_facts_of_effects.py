"""What the workflow knows of an effect stands in the effect, of the package or of a user."""

from dataclasses import replace

import pytest
from measured_oscillator import EYRING_DRAG
from planted_features import CONDITIONS, ORDERS, SCALES, known_data
from virtual_rig_cases import BELIEVED

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import (
    drive_candidates,
    out_of_tolerance,
)
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.drive._effects import drive_effects
from pymoo_hdte.effects import effect_named, known_effects, registered
from pymoo_hdte.effects.friction import NonlinearDrag

DATA = known_data(CONDITIONS[::2], ORDERS)


def test_every_sought_law_of_a_drive_says_which_forms_it_may_have():
    """One that was missing in a table lived under the rules of an exact one, unnoticed."""
    silent = [one.name for one in drive_effects() if one.guess and not (one.exact or one.forms)]
    assert silent == []


def test_names_in_facts_are_those_of_effects():
    for effect in known_effects():
        for name in filter(None, (effect.form_of, effect.twin)):
            assert effect_named(name) is not effect
        if effect.twin:
            assert effect_named(effect.twin).twin == effect.name


OF_SPEED = replace(EYRING_DRAG, name="own_drag", forms="curve_of_speed", form_of="nonlinear_drag")


def sought(effect, believed=()):
    """Candidates for an effect of one's own at the input of a drive."""
    with registered(effect):
        sizes = port_sizes(BELIEVED, ORDERS.tolist(), [1.0], SCALES)
        return [one for one in drive_candidates(sizes, believed) if one.name == effect.name]


def test_another_form_of_a_believed_effect_is_not_sought():
    drag = LawAtPort("nonlinear_drag", "input", NonlinearDrag(1e-6))
    assert sought(OF_SPEED)
    assert not sought(OF_SPEED, [drag])
    assert sought(replace(OF_SPEED, form_of=""), [drag])


def test_a_covered_parameter_is_out_of_tolerance_only_beside_other_effects():
    base = DATA.base
    with registered(replace(OF_SPEED, covers="input_damping")):
        (freed,) = out_of_tolerance(base, ["input_damping"], (), together=True)
        assert out_of_tolerance(base, ["input_damping"], ()) == []
        assert freed.named_effect == ("own_drag", "input")
    (freed,) = out_of_tolerance(base, ["input_damping"], ())
    assert freed.named_effect == ("parameter", "input_damping")


@pytest.mark.parametrize("family", ["any", "curve_of_torsion"])
def test_forms_that_do_not_exist_or_are_for_other_ports_are_refused(family):
    with pytest.raises(InvalidInput, match="own_drag"):
        replace(OF_SPEED, forms=family)
