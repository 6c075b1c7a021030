"""Twins of a real torsion: on the measured motion what is hidden in a gear is named."""

from functools import cache

import numpy as np
import pytest

from experiments.studies.measured.rigs import MEASURED, RIGS
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import joint_of, torsion_half
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._report.torsion import torsion_document
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding
from pymoo_hdte.discrepancy._verdicts.joint_torsion import examine_torsion
from pymoo_hdte.discrepancy._verdicts.validation_torsion import (
    torsion_after_held_out_test,
    torsion_errors,
)
from pymoo_hdte.drive._effects.static_error import KinematicTorsion
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.stiffness import HardeningStiffness
from pymoo_hdte.mechanism import Record
from pymoo_hdte.mechanism.motion import motion_of, smooth
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force
from pymoo_hdte.units import ARCSEC

STIFFNESS, INERTIA, ZERO = 3e4, 1.0, 1.0
NOISE = {"motor": 2e-6, "load": 2e-6, "torque": 0.2}
STEPS = 300


@cache
def measured():
    """Return the joint of a rig, its measured records, and the cutoff."""
    folder = MEASURED / "lara8_j3"
    if not folder.is_dir():
        pytest.skip(f"the measurements are not at {folder}")
    rig = read_rig(RIGS / "lara8_joint_3.toml", folder)
    return joint_of(rig.mechanism), rig.records, rig.cutoff


def twin(record, law, cutoff, generator):
    """Return a record of the measured motion and torque with the motor's angle of a known gear."""
    load = motion_of(record.channels["load"], record.step, cutoff / 2.0).position
    wanted = smooth(record.channels["torque"], record.step, cutoff / 2.0)
    torsion = wanted / STIFFNESS
    for _ in range(STEPS):
        motion = PortMotion(torsion, np.gradient(torsion), None, load + torsion + ZERO)
        added = 0.0 if law is None else law_force(law, motion, STIFFNESS)
        torsion = torsion + 0.5 * (wanted - STIFFNESS * torsion - added) / STIFFNESS
    motor = load + torsion
    inertial = INERTIA * np.gradient(np.gradient(motor, record.step), record.step)
    channels = {"motor": motor + ZERO, "load": load, "torque": wanted + inertial}
    for name, size in NOISE.items():
        channels[name] = channels[name] + size * generator.standard_normal(len(load))
    # At the ends difference quotients have one side only.
    inner = {name: one[5:-5] for name, one in channels.items()}
    return Record(record.name, record.role, record.time[5:-5], inner)


def examined(law):
    """Return the finding on the twins of all records, and the verdict after the held-out test."""
    joint, records, cutoff = measured()
    generator = np.random.default_rng(3)
    twins = [twin(one, law, cutoff, generator) for one in records]
    finding = examine_torsion(torsion_half(joint, twins, ()), joint, cutoff)
    return finding, torsion_after_held_out_test(finding, torsion_errors(finding))


def test_a_twin_with_nothing_missing_is_adequate():
    finding, verdict = examined(None)
    assert verdict.status == "adequate"
    assert finding.accepted.values[1] == pytest.approx(STIFFNESS, rel=0.02)


@pytest.mark.parametrize(
    ("law", "name", "statuses"),
    [
        (KinematicTorsion(3.0, 0.5, 2e-4), "kinematic_error", ("named",)),
        pytest.param(
            HardeningStiffness(coefficient=1.5e9),
            "hardening_stiffness",
            ("named",),
            marks=pytest.mark.nightly,
        ),
        # One sweep winds the gear once to and fro, so that this is certain in part only.
        pytest.param(
            MaxwellSlip(15.0, 8e-4, 1.5),
            "hysteresis",
            ("named", "partial"),
            marks=pytest.mark.nightly,
        ),
    ],
    ids=("kinematic", "cubic", "hysteresis"),
)
def test_what_a_twin_hides_is_named(law, name, statuses):
    finding, verdict = examined(law)
    assert verdict.status in statuses
    assert [one.name for one in verdict.accepted.candidates] == [name]
    if isinstance(law, KinematicTorsion):
        both = JointFinding(measured()[0], finding, finding, ())
        (effect,) = torsion_document(both)["effects"]
        size, phase = (effect["parameters"][one] for one in ("amplitude", "amplitude_phase"))
        assert (size["unit"], phase["unit"]) == ("arcsec", "rad")
        assert size["value"] == pytest.approx(law.amplitude / ARCSEC, rel=0.05)
        assert np.cos(phase["value"] - law.phase) == pytest.approx(1.0, abs=0.01)
