"""Joints with two encoders whose rig files are rough or wrong: stiffness, signs, errors, delays."""

from dataclasses import replace

import numpy as np
import pytest
from made_joint import ARCSECOND, STIFFNESS, Hidden, believed, record, records

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.joint_open_questions import wiring_caveats
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import joint_of, torsion_half
from pymoo_hdte.discrepancy._report.torsion import torsion_document
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, examine_joint
from pymoo_hdte.discrepancy._verdicts.joint_torsion import examine_torsion
from pymoo_hdte.discrepancy._verdicts.validation_torsion import (
    torsion_after_held_out_test,
    torsion_errors,
)
from pymoo_hdte.effects.stiffness import SoftWindup
from pymoo_hdte.mechanism import BelievedValue, ErrorLine

CUTOFF = 5.0


def roughly_stiff(value, factor=30.0):
    """Return the joint whose stiffness is known roughly only."""
    gear, bearing = believed().ports
    stated = replace(gear, stiffness=BelievedValue(value, factor=factor))
    return joint_of(replace(believed(), ports=[stated, bearing]))


def test_a_stiffness_stated_far_too_low_makes_no_discrepancy():
    joint = roughly_stiff(0.1 * STIFFNESS)
    finding = examine_torsion(torsion_half(joint, records(Hidden()), ()), joint, CUTOFF)
    assert finding.verdict.status == "adequate"


@pytest.mark.nightly
def test_a_stiffness_stated_far_too_high_hides_no_discrepancy():
    joint = roughly_stiff(10.0 * STIFFNESS)
    hidden = Hidden(SoftWindup(0.02, 6e-4, 3.0))
    finding = examine_torsion(torsion_half(joint, records(hidden), ()), joint, CUTOFF)
    assert finding.verdict.status == "named"


@pytest.mark.nightly
def test_a_stiffness_outside_its_tolerance_makes_no_torsion_of_its_own():
    joint = roughly_stiff(5.0 * STIFFNESS, 2.0)
    half = torsion_half(joint, [record(Hidden(), "train")], ())
    finding = examine_torsion(half, joint, CUTOFF)
    (effect,) = torsion_document(JointFinding(joint, finding, finding, ()))["effects"]
    assert finding.verdict.status == "parameter"
    assert effect["parameters"]["stiffness of gear"]["value"] == pytest.approx(STIFFNESS, rel=1e-3)
    assert "rms_arcsec" not in effect


def test_a_mean_torque_far_above_its_variation_is_part_of_the_zero():
    joint, few = joint_of(believed()), record(Hidden(), "train", 4.0)
    torque = few.channels["torque"]
    assert np.mean(torque) > 3.0 * np.std(torque)
    finding = examine_torsion(torsion_half(joint, [few], ()), joint, CUTOFF)
    assert not finding.verdict.base.at_bounds
    assert finding.verdict.status == "adequate"


def test_the_held_out_test_does_not_depend_on_the_stated_stiffness():
    train, _ = records(Hidden(SoftWindup(0.015, 6e-4, 3.0)))
    _, other = records(Hidden())
    joint = roughly_stiff(0.1 * STIFFNESS)
    finding = examine_torsion(torsion_half(joint, [train, other], ()), joint, CUTOFF)
    assert finding.verdict.status == "named"
    assert torsion_after_held_out_test(finding, torsion_errors(finding)).status == "unlisted"


@pytest.mark.parametrize(
    ("hidden", "instead", "words"),
    [
        pytest.param(Hidden(), {"motor": -1.0}, "motor is -0.999", marks=pytest.mark.nightly),
        pytest.param(Hidden(), {"motor": 1.01}, "motor is 1.009", marks=pytest.mark.nightly),
        (Hidden(), {"motor": 121.0 / 101.0}, "agree at a ratio of 121 for 101."),
        pytest.param(
            Hidden(), {"torque": -1.0}, "falls as the torque rises", marks=pytest.mark.nightly
        ),
        (Hidden(late=-1e-3), {}, "motor may be read 1 ms after"),
    ],
    ids=("sign", "ratio", "another ratio", "torque", "late"),
)
def test_what_is_wrong_with_the_encoders_is_said_and_no_effect_is_certain(hidden, instead, words):
    joint, train = joint_of(believed()), record(hidden, "train")
    channels = {name: instead.get(name, 1.0) * one for name, one in train.channels.items()}
    half = torsion_half(joint, [replace(train, channels=channels)], ())
    finding = examine_torsion(half, joint, CUTOFF)
    assert finding.verdict.status in ("unlisted", "partial")
    (told,) = wiring_caveats(JointFinding(joint, finding, finding, ()))
    assert words in told


@pytest.mark.parametrize("place", [0, 1], ids=("fitted", "held out"))
def test_an_encoder_of_the_motor_that_stands_still_is_refused(place):
    dead = records(Hidden())
    still = {**dead[place].channels, "motor": np.full(len(dead[place].time), 7.0)}
    dead[place] = replace(dead[place], channels=still)
    with pytest.raises(InvalidInput, match="channel motor of"):
        examine_joint(joint_of(believed()), dead, CUTOFF)


@pytest.mark.parametrize(
    ("coordinate", "zero", "order"),
    [("motor", 7.0, 2.0), ("load", 0.0, 2.0), ("motor", 7.0, 202.0)],
)
def test_a_believed_error_of_the_gear_is_no_discrepancy(coordinate, zero, order):
    # made_joint takes 20" cos(order q + 0.7) from the motor's angle, of which 7 rad are the zero.
    line = ErrorLine(coordinate, order, 20.0 * ARCSECOND, 0.7 - order * zero + np.pi / 2.0)
    joint = joint_of(believed(error=(line,)))
    half = torsion_half(joint, records(Hidden(order=order, amplitude=20.0 * ARCSECOND)), ())
    assert examine_torsion(half, joint, CUTOFF).verdict.status == "adequate"
