"""``verdict.json`` of measured records, and the sentences of their report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pymoo_hdte._reports.html import number, percent
from pymoo_hdte.discrepancy._answers.next_test_mechanism import NextTest
from pymoo_hdte.discrepancy._answers.where.balances import locate_in_mechanism
from pymoo_hdte.discrepancy._evidence.force_balances.candidates import turns_back
from pymoo_hdte.discrepancy._evidence.force_balances.lower_band import moved_by_band
from pymoo_hdte.discrepancy._report.document import (
    SCHEMA_VERSION,
    sentence,
    versions,
    with_believed_effects,
)
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities, ripples
from pymoo_hdte.discrepancy._report.words import in_a_sentence
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, label_of
from pymoo_hdte.discrepancy._selection.reason import NOT_VALIDATED, Reason
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import (
    MechanismPredictionError,
    sentences_on_rest,
)
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.mechanism.effects import table_of
from pymoo_hdte.mechanism.quantity_units import unit_of
from pymoo_hdte.mechanism.resampling import share_beyond


def mechanism_verdict_document(
    title: str,
    finding: MechanismFinding,
    errors: Sequence[MechanismPredictionError],
    test: NextTest,
) -> dict[str, Any]:
    """Return the verdict as plain types.

    Parameters
    ----------
    title : str
    finding : MechanismFinding
    errors : sequence of MechanismPredictionError
        Of held-out records; empty where there are none.
    test : NextTest
    """
    verdict = finding.verdict
    return {
        "schema_version": SCHEMA_VERSION,
        "campaign": title,
        "status": verdict.status,
        "sentence": _sentence(finding),
        "reasons": [reason.as_dict() for reason in verdict.reasons],
        "effects": [*effects(finding), *ripples(finding)],
        "offered": offered(finding),
        "alternatives": [
            evidence(finding, hypothesis)
            for hypothesis in sorted(verdict.alternatives, key=_by_bic)
        ],
        "base": quantities(finding),
        **with_believed_effects([table_of(effect) for effect in finding.believed]),
        "band": band(finding),
        "location": locate_in_mechanism(finding).summary(),
        "remainder": unexplained(finding),
        "limits": limits(finding),
        "record_remarks": record_remarks(finding),
        "held_out": [error.as_dict() for error in errors]
        or {"reason": "no record was held out, so the correction is not validated"},
        "next_experiment": test.as_dict(),
        "versions": versions(),
    }


def _sentence(finding: MechanismFinding) -> str:
    verdict, beyond = finding.verdict, finding.ripples.sentence
    if verdict.status == "adequate":
        return (
            "Nothing is missing: the nominal mechanism explains the records within its tolerances."
        )
    if verdict.status == "named" and verdict.chosen is None:
        return beyond
    return f"{sentence(verdict)} {beyond}".strip()


def offered(finding: MechanismFinding) -> list[dict[str, Any]]:
    """Return further effects beside the named ones for which the data are weak evidence.

    They improve the fit significantly, but remove too little to be named.
    """
    chosen, rules = finding.verdict.chosen, finding.data.rules
    if chosen is None or finding.accepted is not chosen.fit:
        return []
    offers, named = [], label_of(chosen.candidates)
    for hypothesis in sorted(finding.verdict.alternatives, key=_by_bic):
        added = [candidate for candidate in hypothesis.candidates if candidate.label not in named]
        removes = 1.0 - hypothesis.fit.chi_square / chosen.fit.chi_square
        if len(added) == 1 and named < label_of(hypothesis.candidates):
            gain = chosen.bic - hypothesis.bic
            if gain > rules.bic_gain and removes > rules.offered_share:
                offers.append({"name": added[0].name, "port": added[0].port, "removes": removes})
    return offers


def unexplained(finding: MechanismFinding) -> dict[str, Any]:
    """Return the residual of the accepted model, and its share of the misfit in words."""
    after, noise = finding.unexplained, finding.sensor_noise
    size = ", ".join(
        f"{size:.3g} {unit_of(finding.mechanism, name)} in the {finding.data.what(name)} "
        f"({size / max(floor, 1e-300):.2g} times the sensor noise)"
        for name, size, floor in zip(finding.data.names, after, noise, strict=True)
    )
    named = bool(finding.accepted.candidates)
    removed = finding.share_removed if named else 0.0
    words = f"The residual is {size}."
    if named:
        residual = "The residual is" if np.all(after <= noise) else "The unexplained residual is"
        words = (
            f"The correction removes {percent(removed)} of the misfit's power beyond sensor "
            f"noise. {residual} {size}."
        )
    return {
        "sentence": words,
        "share_removed": removed,
        "left": dict(zip(finding.data.names, after.tolist(), strict=True)),
    }


def band(finding: MechanismFinding) -> dict[str, Any]:
    """Return the band that is used, Hz, the largest shares of power beyond it, and a sentence.

    Of the motion of a coordinate, and of a force by an input or at a sensor, in a training record;
    but for their means.
    """
    mechanism, cutoff = finding.mechanism, finding.cutoff
    read = [port.name for port in mechanism.ports if port.read]
    of_forces = [*(actuator.name for actuator in mechanism.inputs), *read]

    def largest(names: Sequence[str]) -> float:
        shares = (
            share_beyond(record.channels[name], record.step, cutoff)
            for record in finding.records
            for name in names
            if record.role == "train"
        )
        return max(shares, default=0.0)

    motion, force = largest(tuple(mechanism.coordinates)), largest(of_forces)

    def power(share: float) -> str:
        return "less than 0.01 %" if share < 1e-4 else f"{number(100.0 * share, 2)} %"

    much = max(motion, force) > finding.data.rules.band_share
    return {
        "cutoff_Hz": cutoff,
        "share_of_motion_beyond": motion,
        "share_of_force_beyond": force,
        "sentence": f"Model and records are compared up to {cutoff:.3g} Hz; beyond lie "
        f"{power(motion)} of the motion's power and {power(force)} of the forces' power"
        f"{', where only ripple is looked for' if much else ''}.",
    }


def limits(finding: MechanismFinding) -> list[str]:
    """Return the limits of these records, in sentences."""
    sentences = [
        f"The {port.name} moves in one direction only: these records cannot separate Coulomb "
        "friction from a constant force or a sensor's offset."
        for port in finding.mechanism.ports
        if not port.read and not turns_back(finding.data, port.name)
    ]
    sentences += sentences_on_rest(finding)
    sentences += [
        f"The force per unit of {actuator.name} is not known, so masses, springs, dampers and "
        f"forces are in units of {actuator.name}: their ratios are determined, their absolute "
        "sizes are not."
        for actuator in finding.mechanism.inputs
        if not actuator.scaled
    ]
    sentences += [
        f"The inertial force of {name} is smaller than the residual of its force balance. A "
        "simulation of its motion therefore says little; the held-out force balance validates."
        for name in finding.mechanism.coordinates
        if name in finding.judged_by_balance and finding.simulated
    ]
    sentences += _moved_by_band(finding)
    sentences += _delays_told(finding)
    sentences += _gains_told(finding)
    sentences += _not_validated(finding)
    if not any(record.role == "held_out" for record in finding.records):
        sentences.append("No record was held out: the correction is not validated.")
    if any(finding.accepted.bound_sides[: len(finding.data.base)]):
        names = [n for n in finding.accepted.at_bounds if n in finding.mechanism.quantities]
        if names:
            sentences.append(f"At the bound of its tolerance: {', '.join(names)}.")
    return [*sentences, *finding.ripples.limits]


def _moved_by_band(finding: MechanismFinding) -> list[str]:
    """Return a sentence on values that the lower half of the band puts elsewhere."""
    fitted = finding.accepted
    moved = moved_by_band(finding.data, fitted)
    if not moved:
        return []
    of_effects = {
        row: f"{fitted.parameters[row].name} of {in_words(candidate.label)}"
        for candidate, place in fitted.places
        for row in range(place.start, place.stop)
    }
    told = ", ".join(
        f"{of_effects.get(one.place, fitted.parameters[one.place].name)} "
        f"({number(one.value, 3)} for {number(float(fitted.values[one.place]), 3)})"
        for one in moved
    )
    return [
        f"Fitted to the lower half of the band alone, values leave their intervals: {told}, SI. "
        "They depend on the cutoff; something may be missing that shows at higher frequencies."
    ]


def _delays_told(finding: MechanismFinding) -> list[str]:
    """Return a sentence on each delay of an input whose interval excludes zero."""
    sentences = []
    for delay in finding.delays:
        if delay.evident:
            middle, spread = 1e3 * abs(delay.value), 1e3 * delay.spread
            sentences.append(
                f"{delay.input} acts {middle:.3g} ms {'later' if delay.value > 0.0 else 'earlier'} "
                f"than its column says ({middle - spread:.3g} to {middle + spread:.3g}, "
                f"{abs(delay.samples):.2g} samples), by the phase of the force balance. It is "
                f"not corrected; inputs.{delay.input}.delay in the rig's file does so."
            )
    return sentences


def _gains_told(finding: MechanismFinding) -> list[str]:
    """Return a sentence on each gain of an input whose interval excludes one."""
    sentences = []
    for gain in finding.gains:
        if gain.evident:
            lower, upper = gain.lower, gain.upper
            times = f"{lower:.3g} to {upper:.3g}" if upper < np.inf else f"at least {lower:.3g}"
            stated = " and ".join(gain.quantities)
            sentences.append(
                f"{gain.input} is {times} times what its column says (95 %), if the stated "
                f"{stated} {'is' if len(gain.quantities) == 1 else 'are'} right. It is not "
                f"corrected; a tolerance for inputs.{gain.input}.gain in the rig's file, beside an "
                "inertia or a stiffness without one, does so."
            )
    return sentences


def _not_validated(finding: MechanismFinding) -> list[str]:
    """Return a sentence on what the held-out records forbid to name, if they do."""
    chosen = finding.verdict.chosen
    if chosen is None or not finding.verdict.has_reason(NOT_VALIDATED):
        return []
    sizes = []
    for name in finding.mechanism.coordinates:
        if name in finding.judged_by_balance:
            sizes.append(f"the force balance of {name} comes no nearer to zero")
            continue
        before, after, _ = (
            np.mean([record.powers(name) for record in finding.simulated], axis=0) ** 0.5
        )
        sizes.append(f"{name} by simulation, {before:.3g} without it and {after:.3g} with it")
    return [
        f"{in_words(chosen.label)} would explain the records that were fitted, but "
        f"{in_a_sentence(Reason(NOT_VALIDATED))}: {', '.join(sizes)} (root mean square, SI)."
    ]


def record_remarks(finding: MechanismFinding) -> list[str]:
    """Return how the rows of records were read where they could not be taken as they are."""
    sentences = [
        f"Rows of {record.name} with values that are not finite: {record.dropped}. They are left "
        "out at the ends and interpolated inside."
        for record in finding.records
        if record.dropped
    ]
    return sentences + [f"{r.name}: {remark}" for r in finding.records for remark in r.remarks]


def _by_bic(hypothesis: Hypothesis) -> float:
    return hypothesis.bic


def evidence(finding: MechanismFinding, hypothesis: Hypothesis) -> dict[str, Any]:
    """Return how a set of effects compares with the chosen one."""
    chosen = finding.verdict.chosen
    return {
        "effects": [{"name": c.name, "port": c.port} for c in hypothesis.candidates],
        "label": in_words(hypothesis.label),
        "bic_gap": hypothesis.bic - chosen.bic if chosen else None,
        "explained": hypothesis.explained,
        "equivalent": hypothesis in finding.verdict.equivalent,
        "role": _role(finding, hypothesis),
    }


def _role(finding: MechanismFinding, hypothesis: Hypothesis) -> str:
    chosen = finding.verdict.chosen
    if hypothesis is chosen:
        return "chosen"
    if hypothesis in finding.verdict.equivalent:
        return "as good"
    return "richer, hardly better" if chosen and hypothesis.bic < chosen.bic else "rejected"
