"""Real logs of which a verdict was once lost or wrong: each ends with an answer or a reason.

What their machines have is known by least squares or from their authors; what may still be named
beside it is no fault.
"""

import pytest
from places import SHARED

from pymoo_hdte.discrepancy import analyse, read_rig
from pymoo_hdte.discrepancy._selection.reason import RICHER_LEAVES_LESS

LOGS = SHARED / "cases" / "real"
UNQUALIFIED = ("named", "parameter")

pytestmark = pytest.mark.nightly


def analysed(name):
    folder = LOGS / name
    if not folder.is_dir():
        pytest.skip(f"needs {folder}, which is no part of the project")
    return analyse(read_rig(folder))


@pytest.mark.parametrize(
    "name",
    [
        *("damper_vote", "delayed_torque", "inertia_zero", "kinova5_missing_is_certain"),
        *("one_way_push", "rests_and_breakaway", "vote_kills_gravity"),
        *(f"rest_hides_coulomb/rest_{seconds}s" for seconds in (0, 10, 20)),
    ],
)
def test_a_log_ends_with_an_answer(name, tmp_path):
    analysis = analysed(name)
    document = analysis.report(tmp_path / "report")
    assert document["status"] == analysis.verdict.status
    assert (tmp_path / "report" / "verdict.json").is_file()


def test_a_pendulum_that_has_no_slow_motion_is_known_where_it_swings():
    """It was refused: its angle is not above the noise at the lowest frequencies."""
    verdict = analysed("pendulum_30Hz_refused").verdict
    assert [effect.name for effect in verdict.accepted.effects] == ["gravity"]


def test_effects_that_make_the_held_out_motion_worse_are_not_named():
    assert analysed("named_though_gap_grows").verdict.status not in UNQUALIFIED


def test_an_effect_beside_which_another_removes_most_of_the_rest_is_no_plain_name():
    """Gravity is 98 % of the misfit; dry friction removes five sixths of what it leaves."""
    verdict = analysed("gravity_hides_coulomb").verdict
    assert [effect.name for effect in verdict.accepted.effects] == ["gravity"]
    assert verdict.status == "partial"
    (reason,) = (reason for reason in verdict.reasons if reason.code == RICHER_LEAVES_LESS)
    assert set(reason.effect.split("+")) == {"gravity:bearing", "coulomb_friction:bearing"}


def test_an_order_beyond_the_band_at_its_bound_is_named_nowhere(tmp_path):
    analysed("lara8_order_3131").report(tmp_path / "report")
    assert "3131" not in (tmp_path / "report" / "verdict.json").read_text()
