"""The verdict as a document of plain types, for ``verdict.json``: SI values with their units."""

from __future__ import annotations

import platform
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.bench_faults import BenchFault, bench_faults
from pymoo_hdte.discrepancy._answers.next_test_drive import Proposal
from pymoo_hdte.discrepancy._answers.where.map import Location
from pymoo_hdte.discrepancy._answers.where.relevance import relevance
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import PARTS
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_unit, labels_by_order
from pymoo_hdte.discrepancy._report.words import BENCH_FAULTS, caveats, what_is_missing
from pymoo_hdte.discrepancy._selection.candidate import Candidate, labels_apart
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    adequate,
    expected_values,
    label_of,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.stated_sensors import scale_error, shares_scale
from pymoo_hdte.effects.unknowns import Parameter, line_with_variance, number_of

SCHEMA_VERSION = 1
"""Version of ``verdict.json``: raised when a field is removed or changes name, type or meaning."""

UnitOf = Callable[[str], str]
"""From the name of an unknown of a base to its SI unit."""
_DEVIATIONS = 1.959964
"""Half-width of a central 95 % interval of a normal value, in standard deviations."""


def verdict_document(
    finding: DriveFinding,
    location: Location,
    held_out: Mapping[str, Any] | None,
    proposal: Proposal,
) -> dict[str, Any]:
    """Return the verdict with its evidence, as types that `json.dumps` accepts.

    Parameters
    ----------
    finding : DriveFinding
    location : Location
    held_out : mapping or None
        ``before``, ``after``, ``noise_floor``, ``unit`` and more, of plain types; None where no
        record was held out.
    proposal : Proposal
    """
    verdict = finding.verdict
    matters, orders = relevance(finding, location), finding.campaign.believed.error_orders
    absent = {"reason": "no held-out record can be predicted, so the correction is not validated"}
    return {
        "schema_version": SCHEMA_VERSION,
        "campaign": finding.campaign.title,
        "status": verdict.status,
        "sentence": sentence(verdict, orders),
        "probability": verdict.probability,
        "doubts": caveats(verdict, orders),
        "reasons": [reason.as_dict() for reason in verdict.reasons],
        "effects": effects_of(verdict),
        "nuisances": nuisances_of(finding),
        "relevance": None if matters is None else matters.as_dict(),
        "alternatives": alternatives_of(verdict),
        "base": {
            "chi_square": verdict.base.chi_square,
            "degrees_of_freedom": verdict.degrees_of_freedom,
            "parameters": base_parameters(
                verdict.accepted, verdict.rules, but=finding.data.bench.unknowns
            ),
        },
        "residual_over_noise": residual_of_parts(finding),
        **with_believed_effects([effect.to_dict() for effect in finding.campaign.believed.effects]),
        "held_out": absent if held_out is None else dict(held_out),
        "next_experiment": proposal.as_dict(),
        "location": location.summary(),
        **finding.rows.as_dict(),
        "versions": versions("numba"),
    }


def versions(*others: str) -> dict[str, str]:
    """Return the versions of Python, of what every verdict needs, and of other packages."""
    packages = ("pymoo-hdte", "numpy", "scipy", *others)
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def with_believed_effects(effects: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the field ``believed_effects``, of plain types, if there are any."""
    return {"believed_effects": [dict(effect) for effect in effects]} if effects else {}


def believed_in_words(document: Mapping[str, Any]) -> list[str]:
    """Return the believed effects of a verdict's document, each with its numbers."""
    texts = []
    for effect in document.get("believed_effects", ()):
        parts = [
            f"{name} {value['value']:.4g} {value['unit']}"
            if isinstance(value, Mapping)
            else f"{name} {value:.4g}"
            for name, value in effect.items()
            if name not in ("name", "port")
        ]
        where = f" ({effect['port']})" if "port" in effect else ""
        texts.append(f"{effect['name']}{where}: {', '.join(parts)}".replace("_", " "))
    return texts


def sentence(
    verdict: Verdict, error_orders: Sequence[float] = (), nominal: str = "nominal drive"
) -> str:
    """Return the verdict in words; lines of the static error of a drive by their orders."""
    chosen = verdict.chosen
    if verdict.status == "adequate":
        explains = f"the {nominal} explains the records within its tolerances"
        return f"Nothing is shown to be missing: {explains}."
    if chosen is None:
        return "Something is missing that no effect in the library explains."
    what = what_is_missing(chosen.candidates)
    if not chosen.listed:
        return f"What is missing is outside the library. {what}"
    if verdict.status == "unlisted":
        missing = "Something is missing that no effect in the library explains"
        if not verdict.comes_near:
            return f"{missing}, not even half of it."
        return f"{missing}. The nearest is {labels_by_order(chosen.label, error_orders)}."
    if verdict.status == "class" and verdict.equivalent:
        what = f"{what} {_or_else([chosen, *verdict.equivalent], error_orders)}"
    if verdict.reasons:
        against = "; ".join(caveats(verdict, error_orders))
        return f"{what} With caveats: {against}."
    return what


def _or_else(sets: Sequence[Hypothesis], error_orders: Sequence[float]) -> str:
    """Return in words what the sets of a class say beside the first; what all share is left out.

    A part of the first is told with it because it leaves doubts alone.
    """
    labels = labels_apart([hypothesis.candidates for hypothesis in sets])
    chosen, *others = (labels_by_order(label, error_orders) for label in labels)
    whole = label_of(sets[0].candidates)
    alone = [
        " alone, with caveats" * (label_of(hypothesis.candidates) < whole)
        for hypothesis in sets[1:]
    ]
    listed = " or from ".join(label + how for label, how in zip(others, alone, strict=True))
    return f"These data cannot distinguish {chosen} from {listed}."


def residual_of_parts(finding: DriveFinding) -> dict[str, dict[str, float]]:
    """Return for each part of the data how large misfits are, in multiples of the noise.

    Root mean squares of the residuals of the believed drive and of the accepted model; the noise
    is that of the sensors and of the repeatability of the static error.
    """
    by_channel = {}
    fits = {"before": finding.verdict.base, "after": finding.verdict.accepted}
    sizes = {}
    for when, fitted in fits.items():
        excess = finding.data.excess(fitted)
        degrees_of_freedom = excess.degrees_of_freedom.sum(axis=0)
        ratio = excess.of_parts / np.maximum(degrees_of_freedom, 1.0) + 1.0
        sizes[when] = np.where(degrees_of_freedom > 0.0, np.sqrt(np.maximum(ratio, 0.0)), np.nan)
    for place, part in enumerate(PARTS):
        if np.isfinite(sizes["before"][place]):
            by_channel[part] = {when: float(size[place]) for when, size in sizes.items()}
    return by_channel


def effects_of(verdict: Verdict, unit_of: UnitOf = base_unit) -> list[dict[str, Any]]:
    """Return the accepted effects; none unless the verdict names or classes them.

    Parameters
    ----------
    verdict : Verdict
    unit_of : callable
        From an unknown of the base to its SI unit.
    """
    fitted, documents = verdict.accepted, []
    for candidate, place in fitted.places:
        rows, accuracy = range(place.start, place.stop), _accuracy(candidate, verdict)
        bounded = [fitted.parameters[row].name for row in rows if fitted.bound_sides[row] != 0.0]
        documents.append(
            {
                "name": candidate.name,
                "port": candidate.port,
                "order": candidate.order,
                "sentence": candidate.sentence,
                "parameters": _parameters(
                    candidate, fitted, rows, verdict.rules, accuracy, unit_of
                ),
                "at_bound": bounded,
                "explained": verdict.chosen.explained if verdict.chosen else None,
            }
        )
    return documents


def nuisances_of(finding: DriveFinding) -> list[dict[str, Any]]:
    """Return the nuisances of the bench, which are no part of what is missing in the drive."""
    verdict, fitted = finding.verdict, finding.verdict.accepted
    documents = []
    for nuisance, place in finding.nuisances:
        rows = range(place.start, place.stop)
        own = list(fitted.parameters)
        own[place] = nuisance.parameters
        named = replace(fitted, parameters=tuple(own))
        accuracy = verdict.rules.exact_model_accuracy
        documents.append(
            {
                "name": nuisance.name,
                "port": nuisance.port,
                "order": nuisance.order,
                "sentence": nuisance.sentence,
                "parameters": _parameters(
                    nuisance, named, rows, verdict.rules, accuracy, base_unit
                ),
            }
        )
    return [*documents, *map(_fault_of_bench, bench_faults(finding))]


def _fault_of_bench(fault: BenchFault) -> dict[str, Any]:
    """Return a fault of the bench in the form of a nuisance that is an effect."""
    told = {"value": quantity(fault.value, fault.variance, fault.unit)} if fault.unit else {}
    return {
        "name": fault.name,
        "port": " ".join(fault.where),
        "order": None,
        "sentence": BENCH_FAULTS[fault.name](fault),
        "parameters": told,
    }


def _accuracy(candidate: Candidate, verdict: Verdict) -> float:
    """Return how closely the values of an effect are known at best, as a relative half-width.

    No closer than the model predicts the effect. And where a law of no exact form leaves more than
    noise, the real law has another form: a standard deviation of its values is the share that it
    leaves of the misfit's amplitude, beyond what may be noise. It counts up to what the form of a
    curve may leave: an effect that explains less is named in part, and what is told is its size.
    """
    rules, chosen, freedom = verdict.rules, verdict.chosen, verdict.degrees_of_freedom
    accuracy = rules.model_accuracy if candidate.remembers else rules.exact_model_accuracy
    if chosen is None or candidate.exact or not verdict.leaves_more_than_noise:
        return accuracy
    beyond = chosen.fit.chi_square - adequate(freedom, rules) * freedom
    unexplained = min(beyond / (verdict.base.chi_square - freedom), 1.0 - rules.explained_share)
    return float(np.hypot(accuracy, _DEVIATIONS * np.sqrt(unexplained)))


def _parameters(
    candidate: Candidate,
    fitted: Fit,
    rows: Sequence[int],
    rules: Rules,
    accuracy: float,
    unit_of: UnitOf,
) -> dict[str, Any]:
    """Return values with intervals; cosine and sine part as amplitude and phase.

    No value is told more closely than to a relative ``accuracy``, however little noise there is.

    Torques, and what is found from them, are known no closer than the scale of their sensors.

    For a base parameter out of tolerance, its fitted value.

    The phase is that of amplitude cos(order theta_in + phase), in the direction of the part fitted.
    """
    parameters: dict[str, Any] = {}
    if candidate.releases is not None:
        rows = [[parameter.name for parameter in fitted.parameters].index(candidate.releases)]
    values, scale = expected_values(fitted, rules), scale_error(fitted, rules)
    for row in rows:
        parameter = fitted.parameters[row]
        shared = (
            scale
            if shares_scale(_unit(candidate, parameter.line or parameter.name, unit_of))
            else 0.0
        )
        if parameter.begins_line:
            pair = np.array([row, row + 1])
            own = (accuracy * np.hypot(*values[pair]) / _DEVIATIONS) ** 2 * np.eye(2)
            own += (shared / _DEVIATIONS) ** 2 * np.outer(values[pair], values[pair])
            covariance = fitted.covariance[np.ix_(pair, pair)] + own
            parameters |= _line(parameter.line, candidate, values[pair], covariance, unit_of)
        elif not parameter.line:
            own = float(np.hypot(accuracy, shared) * values[row] / _DEVIATIONS) ** 2
            variance = fitted.covariance[row, row] + own
            # A time or a torsion of a law is above zero, however little the data say of it.
            least = 0.0 if parameter.lower > 0.0 else -np.inf
            unit = _unit(candidate, parameter.name, unit_of)
            parameters[parameter.name] = quantity(values[row], variance, unit, least)
    return parameters


def _unit(candidate: Candidate, name: str, unit_of: UnitOf) -> str:
    return unit_of(name) if candidate.unit is None else candidate.unit(name)


def _line(
    name: str,
    candidate: Candidate,
    parts: NDArray[np.float64],
    covariance: NDArray[np.float64],
    unit_of: UnitOf,
) -> dict[str, Any]:
    """Return amplitude and phase of a line, with intervals, from its cosine and sine parts."""
    cosine, sine = parts
    amplitude, phase = line_with_variance(cosine, sine, covariance)
    prefix = name.removesuffix(number_of(name))
    return {
        name: quantity(*amplitude, _unit(candidate, name, unit_of)),
        f"{prefix}phase": quantity(*phase, _unit(candidate, "phase", unit_of)),
    }


def quantity(value: float, variance: float, unit: str, least: float = -np.inf) -> dict[str, Any]:
    """Return a value with its unit and its 95 % interval, which begins at ``least`` or above."""
    half = _DEVIATIONS * float(np.sqrt(max(variance, 0.0)))
    return {
        "value": float(value),
        "unit": unit,
        "interval95": [max(float(value) - half, least), float(value) + half],
    }


def base_parameters(
    fitted: Fit, rules: Rules, unit_of: UnitOf = base_unit, but: Collection[str] = ()
) -> dict[str, Any]:
    """Return the base values of a fit with units, intervals and whether they ended at a bound.

    Those of some names are left out.
    """
    parameters, scale = {}, scale_error(fitted, rules)
    for row, parameter in enumerate(fitted.parameters[: fitted.n_base]):
        if parameter.name in but:
            continue
        value, unit = fitted.values[row], unit_of(parameter.name)
        shared = scale * value / _DEVIATIONS if shares_scale(unit) else 0.0
        entry = quantity(value, fitted.covariance[row, row] + shared**2, unit)
        entry["interval95"] = _within_bounds(parameter, entry["interval95"], rules)
        parameters[parameter.name] = entry | {"at_bound": parameter.name in fitted.at_bounds}
    return parameters


def _within_bounds(parameter: Parameter, interval: list[float], rules: Rules) -> list[float]:
    """Return an interval clipped to the bounds; all between them if it is nearly as wide."""
    lower, upper = parameter.lower, parameter.upper
    if interval[1] - interval[0] > rules.undetermined_share * (upper - lower):
        return [lower, upper]
    return [max(interval[0], lower), min(interval[1], upper)]


def alternatives_of(verdict: Verdict) -> list[dict[str, Any]]:
    """Return the other sets of effects with their evidence, by rising BIC."""
    chosen = verdict.chosen

    def evidence(hypothesis: Hypothesis) -> dict[str, Any]:
        return {
            "effects": [
                {"name": candidate.name, "port": candidate.port, "order": candidate.order}
                for candidate in hypothesis.candidates
            ],
            "bic": hypothesis.bic,
            "bic_gap": hypothesis.bic - chosen.bic if chosen else None,
            "chi_square": hypothesis.fit.chi_square,
            "explained": hypothesis.explained,
            "at_bound": list(hypothesis.fit.at_bounds),
            "equivalent": hypothesis in verdict.equivalent,
        }

    return [
        evidence(hypothesis)
        for hypothesis in sorted(verdict.alternatives, key=lambda hypothesis: hypothesis.bic)
    ]
