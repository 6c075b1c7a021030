"""Plans of campaigns: closed forms of power, its properties, and what certain effects ask for."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ncx2
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.separation import noncentrality_for, power, unimitated
from pymoo_hdte.discrepancy._plan import changes
from pymoo_hdte.discrepancy._plan.changes import signatures_of
from pymoo_hdte.discrepancy._plan.choice import Aims, smallest_set
from pymoo_hdte.discrepancy._plan.imagined import (
    imagined_campaign,
    imagined_data,
    possible_tests,
)
from pymoo_hdte.discrepancy._plan.limits import PlanLimits, read_limits
from pymoo_hdte.discrepancy._plan.plan import chance_words, plan_tests
from pymoo_hdte.discrepancy._plan.signatures import Signatures, is_rival
from pymoo_hdte.drive import preset
from pymoo_hdte.drive._effects import LawAtPort
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

LIMITS = PlanLimits(
    rig=RIG,
    speeds=tuple(speed * REVOLUTION_PER_MINUTE for speed in (50.0, 1500.0)),
    loads=(20.0, 40.0),
    sample_rate=1000.0,
    most_records=12,
)


def made(signatures, rivals=(), base=(), known=()):
    """Signatures from arrays (n_tests, f): one effect a:p, b:p ... each, rivals r:p, s:p ..."""
    shape = np.shape(signatures[0])
    return Signatures.of(
        [f"{name}:p" for name, _ in zip("abcd", signatures, strict=False)],
        list(signatures),
        [(f"{name}:p", forms) for name, forms in zip("rstu", rivals, strict=False)],
        np.array(base).reshape(-1, *shape),
        np.array(known),
    )


def counts(*numbers):
    return np.array(numbers)


@given(st.floats(0.0, 300.0), st.floats(0.5, 40.0))
def test_power_is_that_of_the_noncentral_chi_square(noncentrality, threshold):
    expected = ncx2.sf(threshold, 1, max(noncentrality, 1e-12))
    assert power(noncentrality, threshold) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_the_noncentrality_for_a_power_gives_that_power():
    for wanted in (0.5, 0.9, 0.999):
        assert power(noncentrality_for(wanted, 10.0), 10.0) == pytest.approx(wanted)


def test_what_is_left_beside_a_parameter_that_is_known_to_some_extent():
    """Difference 3, its unknown imitates it with slope 2 and is known to 1: 9 / (1 + 4)."""
    columns = np.array([[3.0, 2.0]])
    assert unimitated(columns.T @ columns + np.diag([0.0, 1.0]), 1) == pytest.approx(9.0 / 5.0)


def test_base_and_rival_leave_what_is_orthogonal_to_both():
    """(3, 4, 5) beside a base along the first axis and a rival along the second leaves 25."""
    effect, base, rival = np.array([[3.0, 4.0, 5.0]]), [[[1.0, 0.0, 0.0]]], [[0.0, 2.0, 0.0]]
    found = made([effect], [[([np.array(rival)], False)]], base, [1e-12])
    alone, beside = found.noncentralities(counts(1))
    assert alone == pytest.approx([41.0])
    assert beside == pytest.approx(np.array([[25.0]]))
    # Twice the same test is twice the information.
    assert found.noncentralities(counts(2))[1] == pytest.approx(np.array([[50.0]]))


def test_a_strength_that_cannot_be_negative_imitates_nothing_of_the_other_sign():
    effect, opposite = np.array([[3.0, 4.0]]), np.array([[0.0, -2.0]])
    for one_sided, left in ((False, 9.0), (True, 25.0)):
        found = made([effect], [[([opposite], one_sided)]])
        assert found.noncentralities(counts(1))[1] == pytest.approx(np.array([[left]]))


def test_of_several_forms_the_best_imitation_counts():
    effect = np.array([[3.0, 4.0]])
    forms = [([np.array([[1.0, 0.0]])], True), ([np.array([[0.0, 1.0]])], True)]
    assert made([effect], [forms]).noncentralities(counts(1))[1] == pytest.approx(np.array([[9.0]]))


def test_where_the_drive_rattles_nothing_tells_a_clearance_from_others():
    """Effect b has a clearance: of two tests only the second, which is loaded, counts."""
    one, other = np.array([[3.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 3.0], [0.0, 2.0]])
    rivals = [[([one], True)], [([other], True)]]
    found = Signatures.of(
        ["a:p", "b:p"],
        [one, other],
        [("a:p", rivals[0]), ("b:p", rivals[1])],
        np.zeros((0, 2, 2)),
        np.zeros(0),
    )
    held = replace(found, held=np.array([False, True]), rattling=frozenset(["b:p"]))
    alone, beside = held.noncentralities(counts(1, 1))
    assert alone == pytest.approx([10.0, 4.0])
    assert [beside[0, 1], beside[1, 0]] == pytest.approx([1.0, 4.0])


def random_signatures(rng, n_tests=4, size=3):
    def array():
        return rng.normal(scale=3.0, size=(n_tests, size))

    rivals = [[([array(), array()], True), ([array()], True)], [([array(), array()], False)]]
    return [array(), array()], rivals, [array(), array()], [0.3, 2.0]


@given(st.integers(0, 2**32 - 1), st.floats(1.0, 5.0))
def test_a_test_never_takes_power_away_and_noise_never_gives_any(seed, noise):
    rng = np.random.default_rng(seed)
    effects, rivals, base, known = random_signatures(rng)
    found = made(effects, rivals, base, known)
    noisier = made(
        [one / noise for one in effects],
        [[([one / noise for one in ones], sided) for ones, sided in forms] for forms in rivals],
        [one / noise for one in base],
        known,
    )
    few = rng.integers(0, 3, 4)
    more = few + np.eye(4, dtype=int)[rng.integers(4)]
    for less, larger in (
        (found.noncentralities(few), found.noncentralities(more)),
        (noisier.noncentralities(few), found.noncentralities(few)),
    ):
        for one, other in zip(less, larger, strict=True):
            assert np.all(one <= other * (1.0 + 1e-6) + 1e-6)


def test_the_smallest_set_leaves_out_what_tells_nothing():
    """Test 0 tells nothing, 1 shows the effect, 2 tells it from the rival; 2 does both."""
    effect = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]])
    rival = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    aims = Aims(made([effect], [[([rival], True)]]), 0.9)
    assert smallest_set(aims, 5).tolist() == [0, 0, 1]
    # A third of it leaves 9 a test beside the rival; a power of 0.9 takes (10^0.5 + 1.28)^2 = 19.7.
    third = Aims(made([effect / 3.0], [[([rival], True)]]), 0.9)
    assert smallest_set(third, 5).tolist() == [0, 0, 3]


def test_nothing_is_measured_for_what_no_test_tells():
    effect = np.array([[0.1], [0.2]])
    aims = Aims(made([effect]), 0.9)
    assert smallest_set(aims, 5).tolist() == [0, 0]


def test_a_wider_law_is_no_rival_of_its_special_case():
    assert not is_rival("coulomb_friction:input", "stribeck_friction:input")
    assert is_rival("stribeck_friction:input", "coulomb_friction:input")
    assert is_rival("coulomb_friction:input", "stribeck_friction:output")


@pytest.fixture
def only(monkeypatch):
    """Return the powers of all pairs of some effects, with all tests within limits made once."""

    def powers(limits, *names):
        candidates = changes.drive_candidates
        monkeypatch.setattr(
            changes,
            "drive_candidates",
            lambda *given: [one for one in candidates(*given) if one.name in names],
        )
        tests = possible_tests(limits)
        rng = np.random.default_rng(0)
        campaign = imagined_campaign(BELIEVED, limits, tests, rng)
        found = signatures_of(imagined_data(campaign, limits, ()), limits, 40.0)
        alone, beside = Aims(found, 0.9).powers(np.ones(len(tests), dtype=int))
        monkeypatch.undo()
        shown = dict(zip(found.effects, alone, strict=True))
        pairs = {
            (one, other): beside[k, j]
            for k, one in enumerate(found.effects)
            for j, other in enumerate(found.rivals)
        }
        return shown, pairs

    return powers


def test_play_is_told_from_a_soft_wind_up_by_a_sweep_only(only):
    pair = "backlash:mesh", "soft_windup:mesh"
    _, running = only(LIMITS, "backlash", "soft_windup")
    _, swept = only(replace(LIMITS, sweeps=(20.0,)), "backlash", "soft_windup")
    assert running[pair] < 0.5
    assert swept[pair] > 0.99


def test_dry_friction_is_told_from_a_zero_of_the_sensor_by_both_directions(only):
    """A friction of half the zero error hides in it, until the motion turns and the zero stays."""
    rig = replace(RIG, input_torque_zero=0.1)
    friction = LawAtPort("coulomb_friction", "input", CoulombFriction(0.05))
    one_way = replace(LIMITS, rig=rig, effects=(friction,))
    both = replace(one_way, directions=("forward", "reverse"))
    label = "coulomb_friction:input"
    assert only(one_way, "coulomb_friction")[0][label] < 0.1
    assert only(both, "coulomb_friction")[0][label] > 0.99


def test_a_channel_that_is_not_measured_tells_nothing(only):
    label = "coulomb_friction:input"
    blind = replace(LIMITS, channels=("transmission_error",))
    assert only(LIMITS, "coulomb_friction")[0][label] > 0.99
    assert only(blind, "coulomb_friction")[0][label] < 0.1


def test_the_plan_of_a_drive_says_what_no_test_tells(monkeypatch):
    names = ("coulomb_friction", "backlash", "soft_windup")
    candidates = changes.drive_candidates
    monkeypatch.setattr(
        changes,
        "drive_candidates",
        lambda *given: [one for one in candidates(*given) if one.name in names],
    )
    plan = plan_tests(preset("calibrated"), LIMITS)
    assert any("No test within the limits" in one and "backlash" in one for one in plan.missed)
    assert not any(one.kind == "torsion_sweep" for one in plan.tests)
    swept = plan_tests(preset("calibrated"), replace(LIMITS, sweeps=(20.0,)))
    assert any(one.kind == "torsion_sweep" for one in swept.tests)
    assert not swept.missed
    assert all(one.power >= 0.9 for one in (*swept.detected, *swept.separated))
    assert len(swept.tests) + len(swept.held_out) <= LIMITS.most_records


LIMITS_FILE = """input_speeds_rpm = [50, 1500]
load_torques_Nm = [20, 40]
sample_rate_Hz = 1000
most_records = 12
[rig]
proportional_Nms_per_rad = 0.02
integral_Nm_per_rad = 0.5
angle_noise_arcsec = 0.7
input_torque_noise_Nm = 0.003
output_torque_noise_Nm = 0.2
repeatability_arcsec = 0.3
torsion_angle_noise_arcsec = 0.204
"""


def test_a_file_of_limits_is_read(tmp_path):
    path = tmp_path / "limits.toml"
    path.write_text(LIMITS_FILE)
    found = read_limits(path)
    assert found.speeds == pytest.approx(LIMITS.speeds)
    assert replace(found, speeds=LIMITS.speeds, rig=RIG) == LIMITS
    for old, new, field in (
        ("[50, 1500]", "[50, -1]", "line 1: input_speeds_rpm"),
        ("[20, 40]", "[20, 20]", "load_torques_Nm"),
        ("most_records = 12", "most_records = 2", "most_records"),
        ("sample_rate_Hz", 'directions = ["up"]\nsample_rate_Hz', "directions"),
        ("angle_noise_arcsec = 0.7", "angle_noise_arcsec = 0", "rig.angle_noise_arcsec"),
    ):
        path.write_text(LIMITS_FILE.replace(old, new, 1))
        with pytest.raises(InvalidInput, match=r"limits\.toml") as refused:
            read_limits(path)
        assert field in str(refused.value)


@given(st.integers(1, 99), st.floats(0.0, 1.0))
def test_a_chance_is_shown_as_what_it_reaches_and_no_more(percent, chance):
    shown = chance_words(chance)
    if shown == "less than 1 %":
        assert chance < 0.01
    elif shown != "over 99 %":
        assert int(shown.removesuffix(" %")) == pytest.approx(100.0 * chance - 0.5, abs=0.5 + 1e-6)
        assert int(shown.removesuffix(" %")) <= 100.0 * chance + 1e-6
    # What a plan asks for is itself shown in full.
    assert chance_words(percent / 100.0) == f"{percent} %"
