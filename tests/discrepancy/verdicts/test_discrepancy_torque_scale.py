"""A drive whose torques are all larger by a factor is the same drive, and so is its verdict."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kept_results import kept
from planted_features import SCALES, known_data
from quick_campaigns import quick_campaign
from virtual_rig_cases import BELIEVED, effect

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import flanks_held
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._records.campaign import RATED_TORQUE, torque_scale
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive

OF_TORQUE = {
    "believed": ("stiffness", "damping", "input_inertia", "input_damping", "output_damping",
                 "output_inertia", "load_inertia"),
    "rig": ("proportional", "integral", "input_torque_noise", "output_torque_noise",
            "input_torque_zero", "output_torque_zero"),
    "record": ("load_torque", "input_torque", "output_torque"),
}  # fmt: skip
"""Fields whose unit holds N.m, or kg.m2 = N.m.s2."""
ORDERS, SEEN = [1.0 / 101.0, 1.0, 2.0, 3.0, 6.0], [3.0]
EXACT_FACTORS = [2.0**5, 2.0**-4]
"""Powers of two, by which floating point multiplies without rounding."""


def scaled(thing, kind, factor):
    names = [name for name in OF_TORQUE[kind] if hasattr(thing, name)]
    return replace(thing, **{name: factor * getattr(thing, name) for name in names})


def scaled_campaign(campaign, factor):
    return replace(
        campaign,
        believed=scaled(campaign.believed, "believed", factor),
        rig=scaled(campaign.rig, "rig", factor),
        running=tuple(scaled(record, "record", factor) for record in campaign.running),
        torsion=tuple(scaled(record, "record", factor) for record in campaign.torsion),
    )


@kept
def rubbing_campaign():
    """A drive with so much dry friction that one ten times as large hits the cap of a small one."""
    campaign = quick_campaign(1, effect("input", coulomb=0.03, rounding_speed=0.2))
    few = [record for record in campaign.train if record.input_speed > 100.0]
    return replace(campaign, running=tuple(few))


def scales(factor):
    """The scales of a campaign on a drive whose torques are so much larger."""
    torques = {
        name: factor * getattr(SCALES, name)
        for name in ("torque", "motor_torque", "input_torque", "output_torque")
    }
    return replace(SCALES, **torques)


@kept
def rubbing_verdict():
    return examine_drive(rubbing_campaign()).verdict


@pytest.mark.nightly
@pytest.mark.parametrize("factor", EXACT_FACTORS)
def test_a_verdict_does_not_depend_on_the_size_of_the_drive(factor):
    verdict = rubbing_verdict()
    found = examine_drive(scaled_campaign(rubbing_campaign(), factor)).verdict
    assert found.status == verdict.status == "named"
    assert found.chosen.label == verdict.chosen.label == "coulomb_friction:input"
    assert found.chosen.fit.chi_square == verdict.chosen.fit.chi_square
    assert found.chosen.fit.values[-1] == factor * verdict.chosen.fit.values[-1]
    assert found.chosen.fit.at_bounds == verdict.chosen.fit.at_bounds
    labels = [[one.label for one in each.alternatives] for each in (found, verdict)]
    assert labels[0] == labels[1]


@pytest.mark.parametrize("factor", EXACT_FACTORS)
def test_every_candidate_is_the_same_on_a_drive_of_another_size(factor):
    usual = drive_candidates(port_sizes(BELIEVED, ORDERS, SEEN, SCALES))
    large = drive_candidates(
        port_sizes(scaled(BELIEVED, "believed", factor), ORDERS, SEEN, scales(factor))
    )
    for one, other in zip(usual, large, strict=True):
        assert one.label == other.label
        shares = []
        for before, after in zip(one.parameters, other.parameters, strict=True):
            ends = np.array([[each.lower, each.upper, each.scale] for each in (before, after)])
            # Of a torque or an inertia, of an angle, a time or a ratio, or of a compliance.
            shares.append(ends[1, 2] / ends[0, 2])
            assert shares[-1] in (factor, 1.0, 1.0 / factor)
            assert np.array_equal(ends[1], shares[-1] * ends[0])
        for start, further in zip(one.starts, other.starts, strict=True):
            assert np.array_equal(further, np.array(start) * shares)


def test_an_angle_stays_and_a_torque_grows():
    usual, large = (
        drive_candidates(
            port_sizes(scaled(BELIEVED, "believed", factor), ORDERS, SEEN, scales(factor))
        )
        for factor in (1.0, 32.0)
    )
    grown = {
        f"{one.name}/{before.name}"
        for one, other in zip(usual, large, strict=True)
        for before, after in zip(one.parameters, other.parameters, strict=True)
        if after.upper == 32.0 * before.upper
    }
    torques = {"coulomb_friction/level", "stribeck_friction/level", "stribeck_friction/excess",
               "position_dependent_friction/mean", "position_dependent_friction/level_cosine",
               "nonlinear_drag/level", "hysteresis/force", "torque_ripple/amplitude_sine",
               "load_inertia/inertia", "hardening_stiffness/coefficient"}  # fmt: skip
    assert torques <= grown
    angles = {"backlash/half_width", "kinematic_error/amplitude_cosine", "hysteresis/torsion",
              "stribeck_friction/fading", "thermal_drift/rate"}  # fmt: skip
    assert not angles & grown


@given(st.lists(st.floats(-40.0, 40.0), min_size=1, max_size=5), st.integers(-12, 12))
def test_the_scale_grows_with_all_torques(loads, power):
    factor = 2.0**power
    believed = scaled(BELIEVED, "believed", factor)
    assert torque_scale([factor * load for load in loads], believed) == factor


@pytest.mark.parametrize(
    ("loads", "scale"), [((0.0,), 1.0), ((1.0, -2.0), 1.0), ((0.0, -400.0), 8.0), ((50.0,), 1.0)]
)
def test_light_loads_do_not_make_a_small_drive(loads, scale):
    assert torque_scale(loads, BELIEVED) == scale


def test_a_soft_drive_has_the_size_of_its_loads():
    soft = replace(BELIEVED, stiffness=BELIEVED.stiffness / 100.0)
    assert torque_scale([RATED_TORQUE / 8.0], soft) == 0.125
    assert torque_scale([0.0], soft) == 2.0**-7


def test_a_load_that_holds_the_flanks_together_is_one_of_its_drive():
    data = known_data([(1000.0, load) for load in (0.0, 0.1, 0.3)])
    still = replace(data.features, values=np.zeros_like(data.features.values))
    assert flanks_held(still, 1.0, RULES).tolist() == [False, False, False]
    assert flanks_held(still, 0.25, RULES).tolist() == [False, False, True]
