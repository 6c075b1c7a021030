"""Joints of robots from public logs, with loads and friction that others have identified."""

import numpy as np
import pytest

from experiments.studies.measured.known_answers import KNOWN_RIGS
from experiments.studies.measured.rigs import RIGS, SHARED
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism

SLOWEST, FASTEST = 0.05, 1.0
"""Speeds at which friction is compared, in units of the largest one."""


def verdict_on(name):
    """Return the verdict on the first part of a log, and the largest speed there."""
    folder = SHARED / next(rig.folder for rig in KNOWN_RIGS if rig.name == name)
    if not folder.is_dir():
        pytest.skip(f"the measurements, which are no part of this software, are not in {folder}")
    rig = read_rig(RIGS / f"{name}.toml", folder)
    train = [record for record in rig.records if record.role == "train"]
    finding = examine_mechanism(rig.mechanism, train, rig.cutoff, rig.effects)
    speeds = [np.abs(one.ports["bearing"].speed).max() for one in finding.data.spectra]
    return finding.verdict, max(speeds)


@pytest.mark.parametrize(
    ("name", "dry", "viscous"),
    [
        ("ur10e_joint_1", 13.7, 22.0),
        pytest.param("ur10e_joint_6", 2.30, None, marks=pytest.mark.nightly),
        pytest.param(
            *("tx40_joint_4", 2.48, 1.11),
            marks=[
                pytest.mark.nightly,
                pytest.mark.xfail(
                    strict=True, reason="drag of the power 0.36 fits the log better than both"
                ),
            ],
        ),
    ],
)
def test_dry_friction_of_a_robot_joint_is_found(name, dry, viscous):
    verdict, largest = verdict_on(name)
    assert verdict.status in ("named", "partial")
    assert [one.name for one in verdict.accepted.candidates] == ["coulomb_friction"]
    values = dict(
        zip((one.name for one in verdict.accepted.parameters), verdict.accepted.values, strict=True)
    )
    assert values["level"] == pytest.approx(dry, rel=0.06)
    if viscous is not None:
        speed = largest * np.linspace(SLOWEST, FASTEST, 20)
        found = values["level"] + values["damping of bearing"] * speed
        assert found == pytest.approx(dry + viscous * speed, rel=0.05)


@pytest.mark.nightly
def test_gravity_of_a_robot_joint_is_found_beside_its_friction():
    verdict, _ = verdict_on("ur10e_joint_4")
    assert verdict.status == "named"
    laws = {one.name: one.law for one in verdict.accepted.effects}
    assert set(laws) == {"gravity", "coulomb_friction"}
    assert laws["gravity"].torque == pytest.approx(3.0, rel=0.05)
    assert laws["coulomb_friction"].level == pytest.approx(2.3, rel=0.05)
