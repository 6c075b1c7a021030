"""From records of a joint with two encoders to one verdict: on its torques and on its torsion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import (
    Joint,
    rigid_half,
    torsion_half,
)
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import check_signals
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import fitted_values
from pymoo_hdte.discrepancy._records.rig_model import MechanismModel
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts.joint_torsion import examine_torsion, lines_of
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import Progress, laws_of
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import MechanismPredictionError
from pymoo_hdte.discrepancy._verdicts.validation_torsion import (
    stiffness_of,
    torsion_after_held_out_test,
    torsion_errors,
    without_unvalidated_lines,
)
from pymoo_hdte.drive._effects.static_error import KinematicTorsion
from pymoo_hdte.mechanism import ErrorLine, LawAt, Mechanism, Port, Record

_WORST_FIRST = ("partial", "class", "parameter", "named")


@dataclass(frozen=True, eq=False)
class JointFinding:
    """The result of the analysis of a joint with two encoders.

    Attributes
    ----------
    joint : Joint
    torque : MechanismFinding
        On the balance of torques of the joint as a rigid body, with its held-out simulation.
    torsion : MechanismFinding
        On the torsion of the gear: in N.m of its output, its ripples in rad.
    errors : tuple of MechanismPredictionError
        Of the torsion of held-out records, rad.
    """

    joint: Joint
    torque: MechanismFinding
    torsion: MechanismFinding
    errors: tuple[MechanismPredictionError, ...]

    @property
    def status(self) -> str:
        """Both verdicts in one: of `engine.verdict.STATUSES`.

        One that names nothing beside another that does leaves the whole ``"partial"``.
        """
        statuses = {self.torque.verdict.status, self.torsion.verdict.status}
        if "unlisted" in statuses:
            return "unlisted" if statuses <= {"unlisted", "adequate"} else "partial"
        return next((status for status in _WORST_FIRST if status in statuses), "adequate")

    @property
    def stiffness(self) -> float:
        """Fitted stiffness of the gear, N.m/rad."""
        return stiffness_of(self.torsion.accepted, self.joint.gear)


def examine_joint(
    joint: Joint,
    records: Sequence[Record],
    cutoff: float | None = None,
    known: Sequence[LawAt] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> JointFinding:
    """Return the verdict on records of a joint with two encoders.

    Gravity and the friction of both sides show in the balance of torques, in which the gear's
    torque cancels; compliance, hysteresis and errors of the gear show in its torsion, with the
    friction ahead of it.

    Parameters
    ----------
    joint : Joint
        From `joint_of`.
    records, cutoff, known, rules, progress
        As of `examine_mechanism`.

    Returns
    -------
    JointFinding

    Raises
    ------
    InvalidInput
        See `examine_mechanism`; also if no input acts on the motor.
    """
    check_signals(joint.mechanism, records)
    rigid = rigid_half(joint, records, known)
    torque = examine_mechanism(rigid.mechanism, rigid.records, cutoff, rigid.known, rules, progress)
    torsion = examine_torsion(torsion_half(joint, records, known), joint, torque.cutoff, rules)
    errors = torsion_errors(torsion)
    verdict = torsion_after_held_out_test(torsion, errors)
    slows = any(
        candidate.effect and candidate.effect.slows for candidate in verdict.accepted.candidates
    )
    if verdict.status == "named" and slows:
        verdict = replace(verdict, rivals_beyond=("encoder_delay",))
    verdict = without_unvalidated_lines(verdict, torsion.accepted, errors)
    validated = replace(torsion, verdict=verdict)
    if validated.accepted is not torsion.accepted:
        errors = torsion_errors(validated)
    return JointFinding(joint, torque, validated, errors)


def revised_joint(title: str, finding: JointFinding) -> MechanismModel:
    """Return the joint with fitted values, believed effects, and those that are named.

    What the torsion shows ahead of the gear stands at the motor and no more at the load.

    Parameters
    ----------
    title : str
        Of the records.
    finding : JointFinding
    """
    joint, torque, torsion = finding.joint, finding.torque, finding.torsion
    whole, ahead = (fitted_values(half.mechanism, half.accepted) for half in (torque, torsion))
    motor, load = joint.side(joint.motor), joint.side(joint.load)
    laws = (*laws_of(torsion.accepted.effects), *lines_of(torsion.ripples))
    errors = [law.law for law in laws if isinstance(law.law, KinematicTorsion)]
    ours = [law for law in laws if not isinstance(law.law, KinematicTorsion)]
    moved = {law.name for law in ours if law.port != joint.gear.name}
    of_torque = (*laws_of(torque.accepted.effects), *torque.ripples.laws)
    theirs = [replace(law, port=load.name) for law in of_torque if law.name not in moved]
    lines = tuple(
        # An error is a sum of sines of the input's angle.
        ErrorLine(joint.motor, law.order, law.amplitude, law.phase + math.pi / 2.0)
        for law in errors
    )
    gear = replace(joint.gear, error=(*joint.gear.error, *lines))
    ports = {port.name: port for port in (*joint.mechanism.ports, gear)}
    effects = (*finding.torque.believed, *torsion.believed)
    believed = list(dict.fromkeys(effects))
    for law in (*theirs, *ours, *believed):
        ports.setdefault(law.port, motor if law.port == motor.name else load)
    if any(law.law.loaded for law in ours):
        ports[motor.name] = replace(ports[motor.name], load=torsion.mechanism.ports[0].load)
    mechanism = _with_ports(joint.mechanism, list(ports.values()))
    values = _values(finding, whole, ahead)
    revised = mechanism.with_values(values, exactly=False)
    return MechanismModel(
        f"{title}, revised", revised, (*believed, *theirs, *ours), finding.torque.cutoff
    )


def _with_ports(mechanism: Mechanism, ports: Sequence[Port]) -> Mechanism:
    return replace(mechanism, ports=ports)


def _values(
    finding: JointFinding, whole: dict[str, float], ahead: dict[str, float]
) -> dict[str, float]:
    """Return the fitted values of both sides; the load has what the motor has not."""
    joint = finding.joint
    values = dict(ahead)
    motor, load = joint.side(joint.motor).name, joint.side(joint.load).name
    of_motor, of_load = f"inertia of {joint.motor}", f"inertia of {joint.load}"
    own = values.get(of_motor, joint.mechanism.inertias[joint.motor].value)
    of_rest = (
        whole.get(of_load, sum(inertia.value for inertia in joint.mechanism.inertias.values()))
        - own
    )
    # Neither is below a tenth of the whole: a difference of two fits may be below zero.
    values[of_load] = max(of_rest, 0.1 * (of_rest + own))
    total = whole.get(f"damping of {load}")
    if total is not None and load in joint.mechanism.port_names:
        values[f"damping of {load}"] = max(total - values.get(f"damping of {motor}", 0.0), 0.0)
    return values
