"""Joints of robots from public logs, with loads and friction that others have identified."""

import numpy as np
import pytest

from experiments.measured.rigs import MEASURED
from pymoo_hdte.discrepancy.mechanism.analysis import examine_mechanism
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

GAINS = {1: 10.0, 4: 9.0, 6: 10.12}
"""Torque constants of joints of the UR10e, N.m/A."""
SLOWEST, FASTEST = 0.05, 1.0
"""Speeds at which friction is compared, in units of the largest one."""
TRAINED = 0.6


def read(folder, *files, **options):
    paths = [MEASURED / folder / file for file in files]
    if not all(path.is_file() for path in paths):
        pytest.skip(f"the measurements, which are no part of this software, are not in {folder}")
    return [np.loadtxt(path, delimiter=",", **options) for path in paths]


def ur10e(joint):
    """Return time, angle and torque of a joint of the UR10e, whose time stamps alternate."""
    (table,) = read("ur10e", f"joint_{joint}.csv")
    stamps, n = table[:, 0], len(table)
    even = np.linspace(stamps[0], stamps[-1], n)
    angle, current = (np.interp(even, stamps, table[:, place + joint]) for place in (0, 12))
    return even - even[0], angle, GAINS[joint] * current


def tx40():
    """Return time, angle and torque of joint 4 of the TX40, measured at its motor."""
    angle, torque = read("tx40_j4", "position.csv", "torque.csv", skiprows=1)
    return np.arange(len(angle)) / 5000.0, angle / -48.0, torque * -48.0


def verdict_on(moment, angle, torque, inertia, damping):
    """Return the verdict on the first part of a log, with wide beliefs, and the largest speed."""
    joint = Mechanism(
        {"q": BelievedValue(inertia, 1.0)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(damping, 1.0))],
        [Input("torque", {"q": 1.0})],
        angles=["q"],
    )
    end = int(TRAINED * len(moment))
    record = Record("log", "train", moment[:end], {"q": angle[:end], "torque": torque[:end]})
    verdict = examine_mechanism(joint, [record]).verdict
    return verdict, np.abs(np.gradient(angle, moment)).max()


@pytest.mark.parametrize(
    ("log", "believed", "dry", "viscous"),
    [
        pytest.param(lambda: ur10e(1), (8.0, 25.0), 13.7, 22.0, id="ur10e 1"),
        pytest.param(lambda: ur10e(6), (0.5, 3.0), 2.30, None, id="ur10e 6"),
        pytest.param(tx40, (0.1, 1.0), 2.48, 1.11, id="tx40 4", marks=pytest.mark.nightly),
    ],
)
def test_dry_friction_of_a_robot_joint_is_found(log, believed, dry, viscous):
    verdict, largest = verdict_on(*log(), *believed)
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


def test_gravity_of_a_robot_joint_is_found_beside_its_friction():
    verdict, _ = verdict_on(*ur10e(4), 1.0, 5.0)
    assert verdict.status == "named"
    laws = {one.name: one.law for one in verdict.accepted.effects}
    assert set(laws) == {"gravity", "coulomb_friction"}
    assert laws["gravity"].torque == pytest.approx(3.0, rel=0.05)
    assert laws["coulomb_friction"].level == pytest.approx(2.3, rel=0.05)
