"""The torsion of a joint with two encoders in ``verdict.json``, and its part of the page."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import norm

from pymoo_hdte._reports.figures import AFTER, BEFORE, GREY
from pymoo_hdte.discrepancy._answers.joint_open_questions import (
    near_by,
    open_by_motion,
    open_by_twins,
    torsion_test,
)
from pymoo_hdte.discrepancy._report.document import sentence
from pymoo_hdte.discrepancy._report.mechanism_document import evidence, offered
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities
from pymoo_hdte.discrepancy._report.plots_mechanism import motor_torque
from pymoo_hdte.discrepancy._report.words import in_a_sentence
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.reason import NOT_VALIDATED, Reason
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding
from pymoo_hdte.discrepancy._verdicts.joint_torsion import KINEMATIC, errors_of
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import sentences_on_rest
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.units import ARCSEC

_CENTRAL = float(norm.ppf(0.975))


def torsion_document(finding: JointFinding) -> dict[str, Any]:
    """Return the verdict on the torsion of a joint as plain types.

    Parameters
    ----------
    finding : JointFinding
    """
    torsion = finding.torsion
    alternatives = sorted(torsion.verdict.alternatives, key=lambda hypothesis: hypothesis.bic)
    return {
        "gear": finding.joint.gear.name,
        "status": torsion.verdict.status,
        "sentence": torsion_sentence(finding),
        "reasons": [reason.as_dict() for reason in torsion.verdict.reasons],
        "effects": _effects(finding),
        "location": _location(finding),
        "offered": offered(torsion),
        "alternatives": [evidence(torsion, hypothesis) for hypothesis in alternatives],
        "not_ruled_out": [in_words(hypothesis.label) for hypothesis in near_by(finding)],
        "base": quantities(torsion),
        "remainder": _unexplained(finding),
        "limits": torsion_limits(finding),
        "held_out": [
            {
                "record": error.record,
                "before_arcsec": error.before / ARCSEC,
                "after_arcsec": error.after / ARCSEC,
                "noise_floor_arcsec": error.noise_floor / ARCSEC,
                "before_Nm": error.before * finding.stiffness,
                "after_Nm": error.after * finding.stiffness,
                "shrinkage": error.shrinkage,
            }
            for error in finding.errors
        ],
        "proof": _validation(finding),
        "next_experiment": torsion_test(finding),
    }


def torsion_limits(finding: JointFinding) -> list[str]:
    """Return what the records cannot tell of the torsion, in sentences."""
    of_names, of_rest = _unnamed(finding), sentences_on_rest(finding.torsion)
    return [*open_by_motion(finding), *of_names, *of_rest, *open_by_twins(finding)]


def _unnamed(finding: JointFinding) -> list[str]:
    """Return which effects explain the torsion that was fitted, where none of them is named."""
    verdict, competing = finding.torsion.verdict, near_by(finding)
    if verdict.accepted is not verdict.base or not competing:
        return []
    words = "; or ".join(in_words(hypothesis.label) for hypothesis in competing)
    text = f"The fitted records could be explained by {words}"
    if verdict.has_reason(NOT_VALIDATED):
        text += f"; but {in_a_sentence(Reason(NOT_VALIDATED))} with the best of them"
    return [f"{text}. None is named."]


def torsion_sentence(finding: JointFinding) -> str:
    """Return the verdict on the torsion in words."""
    torsion, gear = finding.torsion, finding.joint.gear.name
    verdict = torsion.verdict
    lines = " ".join(
        f"The {gear} errs with its angle, order {line.words}."
        for line, _ in errors_of(torsion.ripples)
    )
    if verdict.status == "adequate":
        return f"Nothing is missing in the torsion of the {gear}: its spring explains it."
    if verdict.chosen is None and verdict.status == "named":
        return lines
    words = sentence(verdict)
    if verdict.rivals_beyond:
        words = " ".join(candidate.sentence for candidate in verdict.accepted.candidates)
        words += " These data cannot distinguish it from a time delay between the two encoders."
    return f"{words} {lines}".strip()


def _location(finding: JointFinding) -> str:
    torsion, gear = finding.torsion, finding.joint.gear.name
    if torsion.verdict.status == "adequate":
        return f"Not in the torsion of the {gear}."
    off, noise = (
        float(torque[0]) / finding.stiffness / ARCSEC
        for torque in (torsion.base_misfit, torsion.sensor_noise)
    )
    return f"In the torsion of the {gear} (error {off:.3g} arcseconds, sensor noise {noise:.2g})."


def _effects(finding: JointFinding) -> list[dict[str, Any]]:
    """Return the named effects, angles in arcseconds, with the torsion that their laws make."""
    torsion = finding.torsion
    documents = []
    parts = zip(
        torsion.accepted.candidates,
        torsion.accepted.effects_by_candidate,
        effects(torsion),
        strict=True,
    )
    for candidate, laws, entry in parts:
        parameters = {
            name: _shown(value, _unit(candidate, name))
            for name, value in entry["parameters"].items()
        }
        # A believed value outside its tolerance is no torque of its own.
        size = _size(finding, laws) if laws else {}
        documents.append(entry | {"parameters": parameters, **size})
    for ripple, part in errors_of(torsion.ripples):
        amplitude, variance = part.values["amplitude"]
        line = {"value": amplitude, "interval95": _about(amplitude, variance)}
        documents.append(
            {
                "name": KINEMATIC,
                "port": ripple.port,
                "sentence": f"The {ripple.port} errs with its angle, order {ripple.words}.",
                "parameters": {
                    "order": {
                        "value": ripple.order,
                        "interval95": _about(ripple.order, ripple.variance),
                    }
                    | {"unit": "1", "at_bound": False},
                    "amplitude": _shown({**line, "at_bound": False}, "arcsec"),
                },
                "at_bound": [],
                "rms_arcsec": amplitude / 2.0**0.5 / ARCSEC,
                "rms_Nm": amplitude / 2.0**0.5 * finding.stiffness,
            }
        )
    return documents


def _about(value: float, variance: float) -> list[float]:
    half = _CENTRAL * variance**0.5
    return [value - half, value + half]


def _unit(candidate: Candidate, name: str) -> str:
    """Return the unit of a parameter of a candidate.

    An angle of the gear is in arcseconds, a phase is not.
    """
    if candidate.unit is None:
        return "SI"
    unit = "phase" if name.endswith("phase") else candidate.unit(name)
    return {"rad": "arcsec", "phase": "rad"}.get(unit, unit)


def _shown(parameter: dict[str, Any], unit: str) -> dict[str, Any]:
    """Return a parameter, which is in SI, in its unit."""
    factor = 1.0 / ARCSEC if unit == "arcsec" else 1.0
    ends = [factor * end for end in parameter["interval95"]]
    return parameter | {"value": factor * parameter["value"], "interval95": ends, "unit": unit}


def _size(finding: JointFinding, laws: tuple[LawAt, ...]) -> dict[str, float]:
    """Return the root mean square of what effects add to the torsion, about its mean."""
    torsion, gear = finding.torsion, finding.joint.gear.name
    values = dict(
        zip(
            (parameter.name for parameter in torsion.accepted.parameters),
            torsion.accepted.values,
            strict=True,
        )
    )
    power, count = 0.0, 0
    for balance in torsion.data.spectra:
        at = {gear: finding.stiffness}, {gear: float(values[f"zero of {gear}"])}
        force = balance.in_time(balance.forces(laws, *at)[0])[balance.moving.whole]
        power, count = power + float(np.sum((force - force.mean()) ** 2)), count + len(force)
    size = (power / count) ** 0.5
    return {"rms_Nm": size, "rms_arcsec": size / finding.stiffness / ARCSEC}


def _unexplained(finding: JointFinding) -> dict[str, Any]:
    torsion = finding.torsion
    (unexplained,), (noise,) = torsion.unexplained.tolist(), torsion.sensor_noise.tolist()
    arcseconds = unexplained / finding.stiffness / ARCSEC
    named = bool(torsion.accepted.candidates)
    removed = torsion.share_removed if named else 0.0
    words = f"The residual is {arcseconds:.3g} arcseconds of torsion, {unexplained:.3g} N.m"
    if named:
        words = f"The correction removes {100.0 * removed:.3g} % of the misfit's power and leaves "
        words += f"{arcseconds:.3g} arcseconds of torsion, {unexplained:.3g} N.m"
    words += f" over its stiffness ({unexplained / max(noise, 1e-300):.2g} times the sensor noise)."
    return {
        "sentence": words,
        "share_removed": removed,
        "left_Nm": unexplained,
        "left_arcsec": arcseconds,
    }


def _validation(finding: JointFinding) -> str:
    if not finding.errors:
        return "No record was held out, so the correction is not validated."
    before, after, floor = (
        float(np.sqrt(np.mean([getattr(error, side) ** 2 for error in finding.errors]))) / ARCSEC
        for side in ("before", "after", "noise_floor")
    )
    measured = (
        float(np.sqrt(np.mean([np.var(error.measured) for error in finding.errors]))) / ARCSEC
    )
    size = f"of {measured:.3g} arcseconds measured; encoder noise is {floor:.2g}"
    if not finding.torsion.accepted.candidates:
        return f"Nothing was added. The error of the held-out torsion is {before:.3g} {size}."
    how = "falls" if after < before else "does not fall,"
    return f"The error of the held-out torsion {how} from {before:.3g} to {after:.3g} {size}."


_POINTS = 1500


def torsion_picture(finding: JointFinding) -> Figure:
    """Draw the torsion over the motor's torque and the angle; below, what models leave of it.

    Of the records that were fitted; and, grey, of those held out.
    """
    torsion, gear = finding.torsion, finding.joint.gear.name
    figure = Figure(figsize=(8.4, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=(3, 2))
    fits = [(torsion.verdict.base, BEFORE, ".", "before")]
    if torsion.accepted.candidates:
        fits.append((torsion.accepted, AFTER, "x", "after"))
    coefficients = [torsion.data.coefficients(fit.residuals) for fit, *_ in fits]
    for record, balance in enumerate(torsion.data.spectra):
        motion = balance.ports[gear]
        over = motor_torque(finding, balance), motion.shaft
        stride = slice(None, None, max(1, len(balance.time) * len(torsion.data.spectra) // _POINTS))
        for column, x in enumerate(over):
            axes[0, column].plot(
                x[stride], motion.position[stride] / ARCSEC, "-", color=GREY, lw=1.2,
                label="measured" if record == 0 else None,
            )  # fmt: skip
            for (_, colour, marker, label), spectrum in zip(fits, coefficients, strict=True):
                angle = balance.in_time(spectrum[record][0]) / finding.stiffness / ARCSEC
                axes[1, column].plot(
                    x[stride], angle[stride], marker, ms=3, color=colour, alpha=0.6,
                    label=label if record == 0 else None,
                )  # fmt: skip
    axes[0, 0].set_ylabel(f"torsion of {gear} [arcsec]")
    axes[1, 0].set_ylabel("residual [arcsec]")
    axes[1, 0].set_xlabel("torque of the motor, at the output [N.m]")
    axes[1, 1].set_xlabel("angle [rad]")
    for axis in axes.flat:
        _plain(axis)
    for row in (0, 1):
        axes[row, 0].legend(frameon=False, fontsize=8)
    return figure


def _plain(axis: Axes) -> None:
    axis.spines[["top", "right"]].set_visible(False)
