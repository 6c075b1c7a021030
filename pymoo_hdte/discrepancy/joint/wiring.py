"""Signs, ratios and moments of reading by which a measured torsion would be none of the gear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.joint.analysis import JointFinding
from pymoo_hdte.mechanism.balances import quantity_names

Values = NDArray[np.float64]


def wiring_doubts(finding: JointFinding) -> list[str]:
    """Return what may be wrong with the encoders of a joint, in sentences.

    Nothing where the spring alone, or a friction named ahead of the gear, is the better answer.

    Parameters
    ----------
    finding : JointFinding
    """
    torsion = finding.torsion
    if torsion.verdict.status == "adequate":
        return []
    motor, load = finding.joint.motor, finding.joint.load
    torque, acceleration, speed, angle, twist = _signals(finding)
    rules, ones = torsion.data.rules, np.ones_like(twist)
    left = float(torsion.base_misfit[0]) / finding.stiffness
    if left**2 >= rules.main_share * float(np.var(twist)):
        (slope, _), share = _explained(twist, [angle], [ones])
        if share >= rules.explained_share:
            return [
                f"The angle of {motor} is {1.0 + slope:.4g} times that of {load}, where a gear "
                "turns both alike: the sign or the ratio of one of their columns may be wrong."
            ]
        (slope, _), share = _explained(twist, [torque], [ones])
        if slope < 0.0 and share >= rules.explained_share:
            return [
                f"The torsion falls as the torque rises: {motor} and {load} may be exchanged, or "
                "the sign of the torque or of both angles be wrong."
            ]
    if torsion.verdict.status != "unlisted":
        return []
    (drag, spring, *_), share = _explained(torque, [speed], [twist, acceleration, ones])
    if drag < 0.0 < spring and share >= rules.explained_share:
        return [
            "What is left is in proportion to the speed, and drives, as no friction does: the "
            f"encoder of {motor} may be read {-1e3 * drag / spring:.2g} ms after that of {load}."
        ]
    return []


def _explained(wanted: Values, by: list[Values], beside: list[Values]) -> tuple[Values, float]:
    """Return the coefficients of signals in another one, and the share that the first explain.

    Of the power that is left beside the others; those have no share of their own.
    """
    fits = []
    for signals in (beside, [*by, *beside]):
        columns = np.column_stack(signals)
        coefficients = np.asarray(np.linalg.lstsq(columns, wanted, rcond=None)[0])
        fits.append((coefficients, float(np.sum((wanted - columns @ coefficients) ** 2))))
    (_, before), (coefficients, after) = fits
    return coefficients, 1.0 - after / before if before > 0.0 else 0.0


def _signals(finding: JointFinding) -> tuple[Values, ...]:
    """Return torque of the motor, its acceleration and speed, angle of the load, and torsion.

    Of all fitted records behind each other, SI, each of shape (n,).
    """
    torsion, joint = finding.torsion, finding.joint
    shaft, names = torsion.mechanism.ports[0].name, quantity_names(torsion.mechanism)
    found = []
    for balance in torsion.data.spectra:
        motor, twist = balance.ports[shaft], balance.ports[joint.gear.name].position
        torque = sum(
            one.gain.value * balance.in_time(balance.terms[0, names.index(f"gain of {one.name}")])
            for one in torsion.mechanism.inputs
        )
        inertial = balance.terms[0, names.index(f"inertia of {joint.motor}")]
        signals = torque, -balance.in_time(inertial), motor.speed, motor.position - twist, twist
        found.append(np.array(signals))
    return tuple(np.concatenate(found, axis=1))
