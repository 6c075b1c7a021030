"""Sentences and table rows of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.drive.analysis import DriveFinding
from pymoo_hdte.discrepancy.drive.gap import Gap
from pymoo_hdte.discrepancy.drive.parameters import base_unit, words_of
from pymoo_hdte.discrepancy.drive.proof import Proof
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
)
from pymoo_hdte.discrepancy.engine.verdict import Verdict
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.reports.html import percent
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
    """A parameter of a named effect with its 95 % interval; of none if it is a believed value."""

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


def effect_rows(effects: Sequence[Mapping[str, Any]]) -> list[EffectRow]:
    """Return the parameters of the effects of a verdict document; angles in arcsec."""
    rows = []
    for effect in effects:
        where = "" if effect["order"] is None else f", order {effect['order']:.4g}"
        of_effect = f"{effect['name'].replace('_', ' ')} ({effect['port']}{where})"
        label = "" if effect["name"] == "parameter" else of_effect
        for name, quantity in effect["parameters"].items():
            angle = quantity["unit"] == "rad" and not name.endswith("phase")
            size, unit = (ARCSEC, "arcsec") if angle else (1.0, _shown(quantity["unit"]))
            value, low, high = (
                number / size for number in (quantity["value"], *quantity["interval95"])
            )
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
    """Return name, role, speed (r/min), load (N.m), rows and, where held out, gap of records."""
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
    """Return a unit as the reader meets it everywhere, nothing for a pure number."""
    return "" if unit == "1" else unit


def _role(verdict: Verdict, hypothesis: Hypothesis) -> str:
    if hypothesis is verdict.chosen:
        return "best known, but not enough" if verdict.status == "unlisted" else "chosen"
    return "cannot be told apart" if hypothesis in verdict.equivalent else "rejected"
