"""Sentences and table rows of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte._reports.html import percent
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import (
    labels_by_order,
    name_by_order,
    words_of,
)
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.cleaning.findings import (
    FAILED,
    NoiseFinding,
    RowFault,
    RowFindings,
)
from pymoo_hdte.discrepancy._report.document import base_parameters
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.prediction_error import PredictionError
from pymoo_hdte.discrepancy._verdicts.validation_drive import Validation
from pymoo_hdte.effects.sentence_blanks import listed
from pymoo_hdte.effects.unknowns import HARMONIC_NAMES, Parameter
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

METRICS = {
    "mae": "mean absolute error",
    "rmse": "root mean square error",
    "mape_percent": "mean absolute error [%]",
    "max_error": "largest error",
    "r2": "R²",
    "mean_error": "mean error",
}

_HARMONICS = tuple(name.replace("_", " ") for name in HARMONIC_NAMES if name)


@dataclass(frozen=True)
class ParameterRow:
    """A fitted base parameter; ``None`` where there is no believed value, interval or bound."""

    name: str
    unit: str
    believed: float | None
    value: float
    interval95: tuple[float, float] | None
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
    at_bound: bool = False

    @property
    def is_headline(self) -> bool:
        """Whether the first screen tells it: no phase, and no harmonic that may be nothing."""
        if self.parameter.endswith("phase"):
            return False
        certain = self.lower > 0.0 or self.upper < 0.0
        return certain or not self.parameter.startswith(_HARMONICS)


@dataclass(frozen=True)
class HypothesisRow:
    """Evidence for a set of effects; ``bic`` above that of the best, what is explained in words.

    Of a mechanism without ``chi_square``, and ``bic`` above that of what was chosen, if anything.
    """

    label: str
    role: str
    chi_square: float | None
    explained: str
    bic: float | None
    at_bounds: str


def effect_rows(
    effects: Sequence[Mapping[str, Any]], error_orders: Sequence[float] = ()
) -> list[EffectRow]:
    """Return the parameters of the effects of a verdict document; of a drive, angles in arcsec."""
    rows = []
    for effect in effects:
        # Only effects of a mechanism have no order, not even None.
        of_drive, order = "order" in effect, effect.get("order")
        where = "" if order is None else f", order {order:.4g}"
        of_effect = f"{effect['name'].replace('_', ' ')} ({effect['port']}{where})"
        label = "" if of_drive and effect["name"] == "parameter" else of_effect
        for name, quantity in effect["parameters"].items():
            angle = of_drive and quantity["unit"] == "rad" and not name.endswith("phase")
            size, unit = (ARCSEC, "arcsec") if angle else (1.0, _shown(quantity["unit"]))
            value, low, high = (
                number / size for number in (quantity["value"], *quantity["interval95"])
            )
            words = name_by_order(name, error_orders) if not label else name.replace("_", " ")
            at_bound = quantity.get("at_bound", False)
            rows.append(EffectRow(label, words, value, low, high, unit, at_bound))
    return rows


def hypothesis_rows(verdict: Verdict, error_orders: Sequence[float]) -> list[HypothesisRow]:
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
            labels_by_order(hypothesis.label, error_orders),
            _role(verdict, hypothesis),
            hypothesis.fit.chi_square,
            percent(hypothesis.explained),
            hypothesis.bic - best,
            ", ".join(_bounded(hypothesis.fit, error_orders)) or "none",
        )
        for hypothesis in hypotheses
    ]


def parameter_rows(finding: DriveFinding) -> list[ParameterRow]:
    """Return the base parameters of the accepted fit."""
    fitted = finding.verdict.accepted
    # Without influence on a residual there is no interval.
    known = np.any(fitted.jacobian != 0.0, axis=0)
    entries = base_parameters(fitted, finding.verdict.rules, but=finding.data.bench.unknowns)
    # With the bounds of their tolerances, also where one was freed from them.
    return [
        _parameter_row(finding.campaign, parameter, entries[parameter.name], bool(has_interval))
        for parameter, has_interval in zip(finding.data.base, known, strict=False)
        if parameter.name in entries
    ]


def mechanism_parameter_rows(
    fitted: Mapping[str, Mapping[str, Any]], nominal: Mapping[str, float]
) -> list[ParameterRow]:
    """Return the rows of fitted parameters of a verdict document, beside their nominal values."""
    return [
        ParameterRow(
            name.replace("_", " "),
            _shown(entry.get("unit", "")),
            nominal.get(name),
            entry["value"],
            tuple(entry["interval95"]),
            None,
            None,
            entry["at_bound"],
        )
        for name, entry in fitted.items()
    ]


def compared_rows(compared: Sequence[Mapping[str, Any]]) -> list[HypothesisRow]:
    """Return the evidence of a verdict document on a mechanism, without its chi-square."""
    return [
        HypothesisRow(
            entry["label"],
            entry["role"],
            None,
            percent(entry["explained"]),
            entry["bic_gap"],
            "",
        )
        for entry in compared
    ]


def metric_rows(validation: Validation | None) -> list[tuple[str, float, float]]:
    """Return the paper's metrics of the peak-to-peak: name, before, after."""
    if validation is None or validation.metrics is None:
        return []
    before, after = validation.metrics
    rows = [(word, getattr(before, name), getattr(after, name)) for name, word in METRICS.items()]
    ends = zip(
        ("lower", "upper"), before.mean_error_interval, after.mean_error_interval, strict=True
    )
    return rows + [(f"mean error, {end} end (95 %)", old, new) for end, old, new in ends]


def record_rows(
    campaign: Campaign, validation: Validation | None
) -> list[tuple[str, str, float, float, int, PredictionError | None]]:
    """Return name, role, speed (r/min), load (N.m), rows and, where held out, error of records."""
    errors = (
        {}
        if validation is None
        else dict(zip(validation.records, validation.by_record, strict=True))
    )
    return [
        (
            record.name,
            record.role.replace("_", " "),
            record.input_speed / REVOLUTION_PER_MINUTE,
            record.load_torque,
            len(record.time),
            errors.get(record.name),
        )
        for record in campaign.running
    ]


def _parameter_row(
    campaign: Campaign, parameter: Parameter, entry: Mapping[str, Any], has_interval: bool
) -> ParameterRow:
    """Return the row of a parameter from its entry in the verdict document."""
    name, unit, size = parameter.name, _shown(entry["unit"]), 1.0
    if name == "offset" or name.startswith("error_amplitude_"):
        unit, size = "arcsec", ARCSEC
    orders = campaign.believed.error_orders
    words = words_of(name, ()) if "." in name else name_by_order(name, orders)
    low, high = (end / size for end in entry["interval95"])
    # Phases and the constant of the encoders have no believed value.
    without_belief = parameter.name == "offset" or parameter.name.startswith("error_phase_")
    return ParameterRow(
        words,
        unit,
        None if without_belief else parameter.start / size,
        entry["value"] / size,
        (low, high) if has_interval else None,
        None if without_belief else parameter.lower / size,
        None if without_belief else parameter.upper / size,
        entry["at_bound"],
    )


def _bounded(fitted: Fit, error_orders: Sequence[float]) -> list[str]:
    """Return the unknowns of a fit that ended at a bound, in words."""
    return [
        name_by_order(parameter.name, error_orders)
        if row < fitted.n_base
        else parameter.name.replace("_", " ")
        for row, (parameter, side) in enumerate(
            zip(fitted.parameters, fitted.bound_sides, strict=True)
        )
        if side != 0.0
    ]


def _shown(unit: str) -> str:
    """Return a unit as the reader meets it everywhere, nothing for a pure number."""
    return "" if unit == "1" else unit


def _role(verdict: Verdict, hypothesis: Hypothesis) -> str:
    if hypothesis is verdict.chosen:
        return "nearest, not enough" if verdict.status == "unlisted" else "chosen"
    if hypothesis in verdict.equivalent:
        return "indistinguishable"
    # A verdict is about names: at another order, or in another form, they were not rejected.
    named = {said.names for said in (verdict.chosen, *verdict.equivalent) if said is not None}
    return "less likely form" if hypothesis.names in named else "rejected"


_MOST_FAULTS = 50
"""Faults that the page lists; ``verdict.json`` has all."""

_NOUNS = {
    "spike": ("spike", "spikes"),
    "jump": ("jump", "jumps"),
    "new zero": ("new zero of a sensor", "new zeros of sensors"),
    "drift": ("torque that drifts", "torques that drift"),
    "saturated": ("saturated channel", "saturated channels"),
    "settling": ("beginning that has not settled", "beginnings that have not settled"),
    "gap": ("gap", "gaps"),
    "repeated": ("run of repeated rows", "runs of repeated rows"),
    "stuck": (
        "run of rows in which a channel has failed",
        "runs of rows in which a channel has failed",
    ),
}


def rows_sentence(findings: RowFindings) -> str:
    """Return what was wrong with rows and stated noise, in words; empty if nothing was."""
    words = []
    shown = [fault for fault in findings.faults if not _hidden(fault)]
    kinds = [fault.kind for fault in shown]
    counted = [
        f"{kinds.count(kind)} {nouns[kinds.count(kind) > 1]}"
        for kind, nouns in _NOUNS.items()
        if kind in kinds
    ]
    if counted:
        records = {fault.record for fault in shown}
        where = next(iter(records)) if len(records) == 1 else f"{len(records)} records"
        words.append(f"{listed(counted)} in {where}: {_treatment(findings)}.")
    replaced = [finding for finding in findings.noise if finding.replaced]
    for zero in (finding for finding in replaced if finding.name.endswith("_zero")):
        words.append(
            f"The {_name(zero)} drifts, so its uncertainty is taken as {zero.used:.2g} {zero.unit} "
            f"instead of the stated {zero.stated:.2g} {zero.unit}."
        )
    changed = [finding for finding in replaced if not finding.name.endswith("_zero")]
    if changed:
        ratios = listed(
            [f"{finding.used / finding.stated:.2g} times ({_name(finding)})" for finding in changed]
        )
        words.append(f"The noise is {ratios} the stated one; the measured noise is used.")
    sentence = " ".join(words)
    return sentence[:1].upper() + sentence[1:]


def _hidden(fault: RowFault) -> bool:
    """Tell whether a fault is a decay that other records show."""
    return fault.kind == "settling" and fault.channel == "rows"


def _treatment(findings: RowFindings) -> str:
    done = []
    if findings.rows_left_out:
        done.append(f"{findings.rows_left_out} of {findings.n_rows} rows are left out")
    modelled = {fault.kind for fault in findings.faults if fault.treatment == "modelled"}
    if "jump" in modelled:
        done.append("jumps are fitted with the order lines")
    if "settling" in modelled:
        done.append("the decay at the beginning is fitted with the order lines")
        if hidden := sum(map(_hidden, findings.faults)):
            done[-1] += f", also in {hidden} more records, where noise may hide it"
    if "new zero" in modelled:
        done.append("records with a new zero are shifted back")
    if "drift" in modelled:
        largest = max(abs(fault.size) for fault in findings.faults if fault.kind == "drift")
        done.append(f"drifts of up to {largest:.2g} N.m are removed")
    if findings.left_out:
        done.append(f"left out as a whole: {listed(list(findings.left_out))}")
    return "; ".join(done) or "nothing had to be left out"


def fault_rows(findings: RowFindings) -> list[dict[str, Any]]:
    """Return the faults of the page, as in the verdict but for words and small angles, arcsec."""
    rows = []
    for fault in findings.faults[:_MOST_FAULTS]:
        row = fault.as_dict()
        row["channel"] = "all" if fault.channel == "rows" else fault.channel.replace("_", " ")
        row["kind"] = "repeated rows" if fault.kind == "repeated" else fault.kind
        # The size of a channel that failed is a reading, and no small angle.
        rows.append(row if fault.kind in FAILED else _small(row, "size"))
    return rows


def noise_rows(findings: RowFindings) -> list[dict[str, Any]]:
    """Return stated and found noise; angles in arcsec."""
    return [
        _small(finding.as_dict() | {"name": _name(finding)}, "stated", "found", "used")
        for finding in findings.noise
    ]


def _small(row: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return a row with its angles in arcsec."""
    if row["unit"] != "rad":
        return row
    sizes = {name: row[name] / ARCSEC for name in names if row[name] is not None}
    return row | sizes | {"unit": "arcsec"}


def _name(finding: NoiseFinding) -> str:
    return finding.name.removesuffix("_noise").replace("_", " ")
