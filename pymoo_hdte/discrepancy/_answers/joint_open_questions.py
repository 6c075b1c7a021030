"""What records of a joint with two encoders leave open, and the test that settles it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.candidates import turns_back
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import fitted_values, share_removed
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding
from pymoo_hdte.discrepancy._verdicts.joint_torsion import errors_of
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.law import Law, PortState, periodic_phase
from pymoo_hdte.mechanism.balances import quantity_names
from pymoo_hdte.units import ARCSEC

_MOST_TOLD = 4


def near_by(finding: JointFinding) -> list[Hypothesis]:
    """Return sets of effects that explain most of the torsion that was fitted, the best first.

    All of them are what these records do not rule out while none is named; else those that are as
    good as the named one.
    """
    torsion = finding.torsion
    verdict, least = torsion.verdict, torsion.data.rules.partial_share
    if verdict.accepted is not verdict.base:
        return list(verdict.equivalent)
    every = [
        hypothesis
        for hypothesis in (verdict.chosen, *verdict.alternatives)
        if hypothesis is not None
    ]
    competing = [
        hypothesis
        for hypothesis in sorted(every, key=lambda hypothesis: hypothesis.bic)
        if all(candidate.releases is None for candidate in hypothesis.candidates)
        and share_removed(torsion.sensors, torsion.data, verdict.base, hypothesis.fit) >= least
    ]
    return competing[:_MOST_TOLD]


def open_by_motion(finding: JointFinding) -> list[str]:
    """Return what the motion of the joint leaves open, with what may be wrong of its encoders."""
    torsion, gear = finding.torsion, finding.joint.gear.name
    shaft = torsion.mechanism.ports[0].name
    sentences = [
        *wiring_caveats(finding),
        "The zeros of the two encoders are not known: a constant torque ahead of the gear, or a "
        "constant error of it, is part of them. Held-out records are compared about their means.",
    ]
    if not turns_back(torsion.data, shaft):
        sentences.append(
            "The joint turns one way only: dry friction ahead of the gear is part of the zeros, "
            "and hysteresis of the gear shows only as far as the torque rises and falls."
        )
    elif not turns_back(torsion.data, gear):
        sentences.append(
            "The torque only rises or only falls: hysteresis of the gear does not show."
        )
    return sentences


def open_by_twins(finding: JointFinding) -> list[str]:
    """Return what looks alike in the torsion: friction and delay, errors and ripple of an order."""
    return [*_delay(finding), *_in_both(finding), *finding.torsion.ripples.limits]


def _in_both(finding: JointFinding) -> list[str]:
    """Return which orders beyond the band vary both the torque and the torsion."""
    shared = [
        line.order
        for line, _ in errors_of(finding.torsion.ripples)
        if any(abs(line.order - r.order) <= r.resolution for r in finding.torque.ripples.lines)
    ]
    if not shared:
        return []
    orders = ", ".join(f"{order:.5g}" for order in shared)
    return [
        f"Order {orders} varies the torque as well: an error of the gear shakes the motor, and its "
        "torque then grows with the square of the speed; a ripple of the motor's torque does not."
    ]


def _delay(finding: JointFinding) -> list[str]:
    """Return that a viscous friction ahead of the gear may be the delay of an encoder."""
    torsion = finding.torsion
    sets = (torsion.verdict.chosen, *near_by(finding))
    fits = [hypothesis.fit for hypothesis in sets if hypothesis is not None]
    levels = [
        _slope(finding, effect.law)
        for fit in fits
        for effect in fit.effects
        if effect_named(effect.name).slows
    ]
    if not levels:
        return []
    late = 1e3 * levels[0] / finding.stiffness
    whole = fitted_values(finding.torque.mechanism, finding.torque.accepted)
    damping = sum(value for name, value in whole.items() if name.startswith("damping of "))
    text = (
        f"A torsion proportional to the speed may be friction ahead of the gear, "
        f"{levels[0]:.3g} N.m.s/rad, or the load's encoder is read {late:.2g} ms after the "
        "motor's: the angles cannot separate these."
    )
    if 0.0 < damping < levels[0]:
        text += (
            f" The viscous friction of the whole joint is only {damping:.3g}, so it cannot "
            "all be friction."
        )
    return [text]


def _slope(finding: JointFinding, law: Law) -> float:
    """Return the torque of a law over the speed at the largest speed, N.m.s/rad."""
    shaft = finding.torsion.mechanism.ports[0].name
    speed = max(
        float(np.abs(balance.ports[shaft].speed).max()) for balance in finding.torsion.data.spectra
    )
    zeros = np.zeros(1)
    state = PortState(zeros, np.array([speed]), periodic_phase(zeros), zeros, load=zeros)
    return float(law.respond(state).torque[0]) / speed


def torsion_test(finding: JointFinding) -> str:
    """Return the test that best settles what is open of the torsion."""
    torsion = finding.torsion
    gear, shaft = finding.joint.gear.name, torsion.mechanism.ports[0].name
    chosen = torsion.verdict.chosen
    sets = [hypothesis for hypothesis in (chosen, *near_by(finding)) if hypothesis is not None]
    effects = [
        candidate.effect
        for hypothesis in sets
        for candidate in hypothesis.candidates
        if candidate.effect
    ]
    wide = (
        max(float(np.ptp(balance.ports[gear].position)) for balance in torsion.data.spectra)
        / ARCSEC
    )
    tests = []
    if not turns_back(torsion.data, shaft):
        tests.append(
            "Run the same sweep backwards as well: what keeps its sign is compliance or an error "
            "of the gear, what turns it is friction or hysteresis."
        )
    if any(effect.lags for effect in effects) or not tests:
        tests.append(
            f"Stop at a few angles and reverse slowly until the torsion has changed by some "
            f"{round(0.1 * wide)} arcseconds: friction ahead of the gear turns with the direction "
            "at once, hysteresis only over a torsion of its own."
        )
    if any(effect.with_load for effect in effects):
        tests.append(
            "Repeat the sweep with another load: an error of the gear stays over the angle, "
            "compliance, wind-up and friction that grows with the load follow the torque."
        )
    if any(effect.slows for effect in effects):
        tests.append(
            "Repeat it at a third of the speed and read the encoders in the other order: a delay "
            "turns its sign, friction does not."
        )
    return " ".join(tests)


Values = NDArray[np.float64]


def wiring_caveats(finding: JointFinding) -> list[str]:
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
    misfit = float(torsion.base_misfit[0]) / finding.stiffness
    if misfit**2 >= rules.main_share * float(np.var(twist)):
        (slope, _), share = _explained(twist, [angle], [ones])
        if share >= rules.explained_share:
            told = (
                f"The angle of {motor} is {1.0 + slope:.4g} times that of {load}, where a gear "
                "turns both alike: the sign or the ratio of one of their columns may be wrong."
            )
            if slope > -1.0:
                stated = finding.joint.kind.ratio
                told += f" They agree at a ratio of {(1.0 + slope) * stated:.3g} for {stated:.4g}."
            return [told]
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
            "The residual is proportional to the speed and drives, as no friction does: the "
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
    by_record = []
    for balance in torsion.data.spectra:
        motor, twist = balance.ports[shaft], balance.ports[joint.gear.name].position
        torque = sum(
            actuator.gain.value
            * balance.in_time(balance.terms[0, names.index(f"gain of {actuator.name}")])
            for actuator in torsion.mechanism.inputs
        )
        inertial = balance.terms[0, names.index(f"inertia of {joint.motor}")]
        signals = torque, -balance.in_time(inertial), motor.speed, motor.position - twist, twist
        by_record.append(np.array(signals))
    return tuple(np.concatenate(by_record, axis=1))
