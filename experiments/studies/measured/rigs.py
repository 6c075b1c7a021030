"""Measured rigs: their files and folders, and what the workflow finds in their records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.runner.committed import DATA
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import joint_of, rigid_half
from pymoo_hdte.discrepancy._records.rig_files import MeasuredMechanism, read_rig
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, examine_joint
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import (
    MechanismPredictionError,
    validate_mechanism,
)

SHARED = Path(__file__).resolve().parents[4] / "shared"
"""Folder of the measurements, which are not part of the project."""
MEASURED = SHARED / "measured"
RIGS = DATA


@dataclass(frozen=True, eq=False)
class Study:
    """A rig, what the workflow finds in its records, and the validation.

    Of a joint with two encoders the rig, the finding and the validation are those of its torques;
    ``joint`` has the torsion as well.
    """

    rig: MeasuredMechanism
    finding: MechanismFinding
    errors: tuple[MechanismPredictionError, ...]
    joint: JointFinding | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that the verdict names, in its order."""
        return tuple(candidate.name for candidate in self.finding.accepted.candidates)

    @property
    def status(self) -> str:
        """Of the verdict; of a joint, of both verdicts."""
        return self.joint.status if self.joint else self.finding.verdict.status


def study(name: str, folder: str) -> Study | None:
    """Return the study of records in a folder of `SHARED`, if it is there.

    They are described by the ``rig.toml`` beside them, or else by ``data/<name>.toml``.
    """
    records = SHARED / folder
    if not records.is_dir():
        return None
    beside = records / "rig.toml"
    rig = read_rig(beside if beside.is_file() else RIGS / f"{name}.toml", records)
    believed = rig.records, rig.cutoff, rig.effects
    joint = joint_of(rig.mechanism)
    if joint is None:
        finding = examine_mechanism(rig.mechanism, *believed)
        return Study(rig, finding, validate_mechanism(finding))
    halves = examine_joint(joint, *believed)
    return Study(torques_of(rig), halves.torque, validate_mechanism(halves.torque), halves)


def torques_of(rig: MeasuredMechanism) -> MeasuredMechanism:
    """Return a joint with two encoders as a rigid body, and any other rig as it is."""
    joint = joint_of(rig.mechanism)
    if joint is None:
        return rig
    half = rigid_half(joint, rig.records, rig.effects)
    return replace(rig, mechanism=half.mechanism, records=half.records, effects=half.known)


def fitted_values(machine: Study) -> dict[str, Any]:
    """Return values with intervals by parameter, those of effects with the effect's name."""
    values = dict(quantities(machine.finding))
    for effect in effects(machine.finding):
        for name, value in effect["parameters"].items():
            values[f"{effect['name'].replace('_', ' ')}: {name.replace('_', ' ')}"] = value
    return values
