"""A play in one of two zones of engagement is told from one in both, and from a soft start."""

from dataclasses import replace

import pytest
from quick_campaigns import campaign_with

from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.effects.load_sharing import UnevenSharing
from pymoo_hdte.units import ARCSEC

NAME = "uneven_load_sharing"


def verdict(half_width, variation):
    """Return what is said of a rig with such a play, without its sweep, which does not have it."""
    law = UnevenSharing(1.0, 0.3, half_width * ARCSEC, variation * ARCSEC)
    changed = campaign_with(LawAtPort(NAME, "mesh", law))
    return analyse(replace(changed, torsion=())).verdict


@pytest.mark.slow
def test_one_that_varies_is_named_with_its_size():
    found = verdict(3.0, 2.0)
    assert found.status == "named"
    (effect,) = found.chosen.fit.effects
    assert effect.name == NAME
    assert effect.law.half_width == pytest.approx(3.0 * ARCSEC, rel=0.1)
    assert effect.law.variation == pytest.approx(2.0 * ARCSEC, rel=0.1)


@pytest.mark.nightly
@pytest.mark.xfail(strict=True, reason="a soft start, which has an unknown less, is plainly named")
def test_one_that_is_the_same_at_all_angles_is_a_soft_start_as_well():
    """Half of the stiffness up to a corner: nothing tells the two, and the verdict has both."""
    found = verdict(3.0, 0.0)
    assert found.status == "class"
    sets = [found.chosen, *found.equivalent]
    assert {one.name for member in sets for one in member.candidates} == {NAME, "soft_windup"}
