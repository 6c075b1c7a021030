"""Sentences and table rows of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.drive.analysis import DriveFinding
from pymoo_hdte.discrepancy.drive.evidence import PARTS
from pymoo_hdte.discrepancy.drive.gap import Gap
from pymoo_hdte.discrepancy.drive.parameters import base_unit, words_of
from pymoo_hdte.discrepancy.drive.proof import Proof
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    adequate,
    explains,
    unexplained,
)
from pymoo_hdte.discrepancy.engine.verdict import Verdict
from pymoo_hdte.discrepancy.report.gap_words import percent
from pymoo_hdte.effects.sentences import in_words
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

METRICS = {
    "mae": "mean absolute error",
    "rmse": "root mean square error",
    "mape_percent": "mean absolute error [%]",
    "max_error": "largest error",
    "r2": "R²",
    "mean_error": "mean error",
}

STATUSES = {
    "adequate": "nothing missing",
    "named": "found",
    "class": "one of several",
    "parameter": "believed value wrong",
    "unlisted": "unknown effect",
    "partial": "found in part",
}
"""Words for the status of a verdict."""

_NORMAL_95 = 1.96


@dataclass(frozen=True)
class ParameterRow:
    """A fitted base parameter; ``None`` where there is no believed value or no bound."""

    name: str
    unit: str
    believed: float | None
    value: float
    half_width: float
    lower: float | None
    upper: float | None
    at_bound: bool


@dataclass(frozen=True)
class EffectRow:
    """A parameter of a named effect with its 95 % interval."""

    effect: str
    parameter: str
    value: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class HypothesisRow:
    """Evidence for a set of effects; ``bic`` above that of the best, what is explained in words."""

    label: str
    role: str
    chi_square: float
    explained: str
    bic: float
    at_bounds: str


def certainty(finding: DriveFinding) -> str:
    """Return how sure the verdict is, in words."""
    verdict = finding.verdict
    limit = adequate(verdict.degrees_of_freedom, verdict.rules)
    residual = verdict.base.chi_square / verdict.degrees_of_freedom
    if verdict.status == "adequate":
        return (
            "The misfit of the believed drive, fitted within its tolerances, has "
            f"{residual:.2f} times the variance of the noise; up to {limit:.2f} counts as noise. "
            f"An effect too small for these records may still be there. {_probably(verdict)}"
        )
    if verdict.chosen is None:
        return "That something is missing is certain; no effect was there to be tried."
    share = percent(verdict.chosen.explained)
    if not verdict.chosen.listed:
        return (
            f"No effect of the list is as likely: this explains {share} of the misfit. An error of "
            "the encoder takes no part in the motion of the drive."
        )
    if verdict.status == "unlisted":
        return (
            "That something is missing is certain; what it is, is not. The nearest known effect "
            f"explains {share} of the misfit, {_too_little(finding, verdict.chosen)}."
            + "".join(f" Against it: {in_words(one)}." for one in verdict.doubts)
        )
    return " ".join(_evidence(finding, verdict.chosen, share))


def _too_little(finding: DriveFinding, nearest: Hypothesis) -> str:
    """Return why the nearest effect is not named."""
    residual = unexplained(finding.data, finding.verdict.base, nearest.fit)
    if residual.any():
        parts = [
            part.replace("_", " ") for part, missed in zip(PARTS, residual, strict=True) if missed
        ]
        return f"but not what shows in {' and '.join(f'the {part}' for part in parts)}"
    rules = finding.verdict.rules
    if explains(finding.data, nearest, finding.verdict.base, finding.verdict.degrees_of_freedom):
        return "but a name needs more than that"
    share = rules.exact_share if nearest.exact else rules.explained_share
    return f"where a name takes {100.0 * share:g} %, or what is left to be noise"


def _evidence(finding: DriveFinding, chosen: Hypothesis, share: str) -> list[str]:
    verdict = finding.verdict
    after = chosen.fit.chi_square / verdict.degrees_of_freedom
    words = [
        f"It explains {share} of the misfit that is not noise; what is left has {after:.3g} times "
        "the variance of the noise."
    ]
    if verdict.leaves_more_than_noise:
        words.append(
            "That is more than noise: its form is not quite right or more is missing, and values "
            "may be off by more than their intervals say."
        )
    hypotheses = [
        hypothesis
        for hypothesis in verdict.alternatives
        if _names(hypothesis) != _names(chosen)
        and len(hypothesis.candidates) == len(chosen.candidates)
    ]
    if verdict.equivalent:
        shares = ", ".join(percent(hypothesis.explained) for hypothesis in verdict.equivalent)
        words.append(f"What these data cannot tell from it explains {shares}.")
    elif hypotheses:
        best = min(hypotheses, key=lambda hypothesis: hypothesis.bic)
        words.append(f"The next best, {in_words(best.label)}, explains {percent(best.explained)}.")
    if chosen.fit.at_bounds:
        orders = finding.campaign.believed.error_orders
        names = ", ".join(words_of(name, orders) for name in chosen.fit.at_bounds)
        words.append(f"At the bound of its range, and therefore uncertain: {names}.")
    return [*words, _probably(verdict)]


def _probably(verdict: Verdict) -> str:
    """Return the probability that a verdict is right, in words."""
    what = {
        "adequate": "nothing of the list is missing",
        "class": "one of these is the cause",
        "partial": "what is named is missing, if not all",
    }.get(verdict.status, "this is the cause")
    whole = int(100.0 * (verdict.probability or 0.0))
    return (
        f"The probability that {what} is {whole} %, by the evidence of "
        "everything that was compared and by how often such verdicts were right on campaigns with "
        "a known truth."
    )


def effect_rows(effects: Sequence[Mapping[str, Any]]) -> list[EffectRow]:
    """Return the parameters of the effects of a verdict document; angles in arcsec."""
    rows = []
    for effect in effects:
        where = "" if effect["order"] is None else f", order {effect['order']:.4g}"
        for name, quantity in effect["parameters"].items():
            angle = quantity["unit"] == "rad" and not name.endswith("phase")
            size, unit = (ARCSEC, "arcsec") if angle else (1.0, _shown(quantity["unit"]))
            value, low, high = (
                number / size for number in (quantity["value"], *quantity["interval95"])
            )
            label = f"{effect['name'].replace('_', ' ')} ({effect['port']}{where})"
            rows.append(EffectRow(label, name.replace("_", " "), value, low, high, unit))
    return rows


def hypothesis_rows(verdict: Verdict) -> list[HypothesisRow]:
    """Return the evidence of all fitted hypotheses, the chosen one first."""
    hypotheses = [] if verdict.chosen is None else [verdict.chosen]
    hypotheses += [
        hypothesis for hypothesis in verdict.alternatives if hypothesis is not verdict.chosen
    ]
    if not hypotheses:
        return []
    best = min(hypothesis.bic for hypothesis in hypotheses)
    return [
        HypothesisRow(
            in_words(hypothesis.label),
            _role(verdict, hypothesis),
            hypothesis.fit.chi_square,
            percent(hypothesis.explained),
            hypothesis.bic - best,
            ", ".join(name.replace("_", " ") for name in hypothesis.fit.at_bounds) or "none",
        )
        for hypothesis in hypotheses
    ]


def parameter_rows(finding: DriveFinding) -> list[ParameterRow]:
    """Return the base parameters of the accepted fit."""
    fitted = finding.verdict.accepted
    # Without influence on a residual there is no interval; variances may be below zero by rounding.
    known = np.any(fitted.jacobian != 0.0, axis=0)
    variances = np.where(known, np.maximum(np.diag(fitted.covariance), 0.0), np.nan)
    half_widths = _NORMAL_95 * np.sqrt(variances)
    base = fitted.parameters[: len(finding.data.base)]
    return [
        _parameter_row(finding.campaign, parameter, value, half_width, fitted.at_bounds)
        for parameter, value, half_width in zip(
            base, fitted.values.tolist(), half_widths.tolist(), strict=False
        )
    ]


def metric_rows(proof: Proof | None) -> list[tuple[str, float, float]]:
    """Return the paper's metrics of the peak-to-peak: name, before, after."""
    if proof is None or proof.metrics is None:
        return []
    before, after = proof.metrics
    rows = [(word, getattr(before, name), getattr(after, name)) for name, word in METRICS.items()]
    ends = zip(
        ("lower", "upper"), before.mean_error_interval, after.mean_error_interval, strict=True
    )
    return rows + [(f"mean error, {end} end (95 %)", one, two) for end, one, two in ends]


def record_rows(
    campaign: Campaign, proof: Proof | None
) -> list[tuple[str, str, float, float, int, Gap | None]]:
    """Return name, role, speed (r/min), load (N m), rows and, where held out, gap of records."""
    gaps = {} if proof is None else dict(zip(proof.records, proof.by_record, strict=True))
    return [
        (
            record.name,
            record.role.replace("_", " "),
            record.input_speed / REVOLUTION_PER_MINUTE,
            record.load_torque,
            len(record.time),
            gaps.get(record.name),
        )
        for record in campaign.running
    ]


def _parameter_row(
    campaign: Campaign,
    parameter: Parameter,
    value: float,
    half_width: float,
    at_bounds: tuple[str, ...],
) -> ParameterRow:
    name, unit, size = parameter.name, _shown(base_unit(parameter.name)), 1.0
    if name.startswith(("error_amplitude_", "error_phase_")):
        kind, line = name.rsplit("_", 1)
        unit, size = ("arcsec", ARCSEC) if kind == "error_amplitude" else ("rad", 1.0)
        name = f"{kind} of order {campaign.believed.error_orders[int(line)]:g}"
    elif "." in name:
        name = words_of(name, ())
    elif name == "offset":
        unit, size = "arcsec", ARCSEC
    # Phases and the constant of the encoders have no believed value.
    free = parameter.name == "offset" or parameter.name.startswith("error_phase_")
    return ParameterRow(
        name.replace("_", " "),
        unit,
        None if free else parameter.start / size,
        value / size,
        half_width / size,
        None if free else parameter.lower / size,
        None if free else parameter.upper / size,
        parameter.name in at_bounds,
    )


def _shown(unit: str) -> str:
    """Return a unit such as N.m.s2/rad2 in its usual notation."""
    if unit == "1":
        return ""
    return unit.replace(".", " ").replace("2", "²").replace("3", "³")


def _role(verdict: Verdict, hypothesis: Hypothesis) -> str:
    if hypothesis is verdict.chosen:
        return "best known, but not enough" if verdict.status == "unlisted" else "chosen"
    return "cannot be told apart" if hypothesis in verdict.equivalent else "rejected"


def _names(hypothesis: Hypothesis) -> set[str]:
    return {candidate.name for candidate in hypothesis.candidates}
