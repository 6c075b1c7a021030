"""Words and table rows of the report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy.campaign import Campaign
from pymoo_hdte.discrepancy.gap import Gap
from pymoo_hdte.discrepancy.naming import ADEQUATE, BIC_GAIN, SHARE, Rival, Verdict
from pymoo_hdte.discrepancy.parameters import Parameter
from pymoo_hdte.discrepancy.prove import Proof
from pymoo_hdte.discrepancy.revise import accepted_fit
from pymoo_hdte.discrepancy.workflow import Analysis
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

UNITS = {
    "stiffness": "N m/rad",
    "damping": "N m s/rad",
    "input_inertia": "kg m²",
    "input_damping": "N m s/rad",
    "output_damping": "N m s/rad",
    "load_inertia": "kg m²",
    "offset": "arcsec",
    "input_torque_zero": "N m",
    "output_torque_zero": "N m",
}
METRICS = ("mae", "rmse", "mape_percent", "max_error", "mean_error", "r2")

_NORMAL_95 = 1.96


@dataclass(frozen=True)
class ParameterRow:
    """A fitted base parameter; ``None`` where nothing was believed or no bound is meant."""

    name: str
    unit: str
    believed: float | None
    value: float
    half_width: float
    lower: float | None
    upper: float | None
    at_bound: bool


@dataclass(frozen=True)
class RivalRow:
    """Evidence for a set of effects; ``bic`` above that of the best."""

    label: str
    role: str
    chi_square: float
    share: float
    bic: float
    at_bounds: str


def certainty(analysis: Analysis) -> str:
    """Return how sure the verdict is, in words."""
    verdict = analysis.verdict
    freedom = verdict.degrees_of_freedom
    left = verdict.base.chi_square / freedom
    if verdict.status == "adequate" or verdict.chosen is None:
        return (
            f"The fitted base leaves {left:.2f} of the noise's variance; up to {ADEQUATE:g} it is "
            "adequate. What is too small for these records may still be there."
        )
    chosen = verdict.chosen
    share = f"{_percent(chosen.share)} of the misfit beyond noise"
    if verdict.status == "unlisted":
        return (
            f"The best known effect, {chosen.label}, removes {share}; a name takes "
            f"{_percent(SHARE)}. That the model misses something is certain "
            f"({left:.3g} times the noise's variance), what it is is not."
        )
    after = chosen.fit.chi_square / freedom
    words = [
        f"It removes {share} ({left:.3g} times the noise's variance before, {after:.3g} after)."
    ]
    if after > ADEQUATE:
        words.append("That is still more than noise: something else is missing, too.")
    rivals = [
        rival
        for rival in verdict.alternatives
        if _names(rival) != _names(chosen) and len(rival.candidates) == len(chosen.candidates)
    ]
    if verdict.equivalent:
        labels = ", ".join(rival.label for rival in verdict.equivalent)
        words.append(f"These data cannot tell it from {labels}.")
    elif rivals:
        lead = rivals[0].bic - chosen.bic
        words.append(
            f"The next best, {rivals[0].label}, is worse by {lead:.3g} in BIC; "
            f"{BIC_GAIN:g} would do."
        )
    if chosen.fit.at_bounds:
        words.append(f"At a bound, so judge with care: {', '.join(chosen.fit.at_bounds)}.")
    return " ".join(words)


def gap_sentence(analysis: Analysis, proof: Proof | None) -> str:
    """Return how much the gap shrank on held-out records, in words."""
    if proof is None:
        return "No record was held out, so nothing can be said about conditions not fitted."
    gap = proof.channels[proof.leading]
    where = f"{len(proof.records)} held-out records, {proof.leading.replace('_', ' ')}"
    if not accepted_fit(analysis.verdict).candidates:
        return (
            f"Nothing was added. On {where}, the fitted base leaves {_size(gap.before, gap)}; the "
            f"noise alone is {_size(gap.noise_floor, gap)}."
        )
    words = f"On {where}: {gap.before:.3g} → {_size(gap.after, gap)}, noise {gap.noise_floor:.3g}"
    if gap.after > gap.before or proof.overall.after > proof.overall.before:
        return f"{words}. The revised model is worse there: do not use it."
    if gap.shrinkage is not None:
        words += f"; {_percent(min(gap.shrinkage, 1.0))} of what the noise does not explain is gone"
    error = proof.channels["transmission_error"]
    if error.after > max(error.before, 1.5 * error.noise_floor):
        words += ". But the transmission error is met less well than before"
    return f"{words}."


def rival_rows(verdict: Verdict) -> list[RivalRow]:
    """Return the evidence of all that was fitted, the chosen first."""
    rivals = [] if verdict.chosen is None else [verdict.chosen]
    rivals += [rival for rival in verdict.alternatives if rival is not verdict.chosen]
    if not rivals:
        return []
    best = min(rival.bic for rival in rivals)
    return [
        RivalRow(
            rival.label,
            _role(verdict, rival),
            rival.fit.chi_square,
            rival.share,
            rival.bic - best,
            ", ".join(rival.fit.at_bounds) or "none",
        )
        for rival in rivals
    ]


def parameter_rows(analysis: Analysis) -> list[ParameterRow]:
    """Return the base parameters of the accepted fit."""
    fitted = accepted_fit(analysis.verdict)
    # What no residual depends on has no interval, and variances near zero may round below it.
    known = np.any(fitted.jacobian != 0.0, axis=0)
    variances = np.where(known, np.maximum(np.diag(fitted.covariance), 0.0), np.nan)
    half_widths = _NORMAL_95 * np.sqrt(variances)
    base = fitted.parameters[: len(analysis.data.base)]
    return [
        _parameter_row(analysis.campaign, parameter, value, half_width, fitted.at_bounds)
        for parameter, value, half_width in zip(
            base, fitted.values.tolist(), half_widths.tolist(), strict=False
        )
    ]


def metric_rows(proof: Proof | None) -> list[tuple[str, float, float]]:
    """Return the paper's metrics of the peak-to-peak: name, before, after."""
    if proof is None or proof.metrics is None:
        return []
    before, after = proof.metrics
    return [(name, getattr(before, name), getattr(after, name)) for name in METRICS]


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
    name, unit, size = parameter.name, UNITS.get(parameter.name, ""), 1.0
    if name.startswith(("error_amplitude_", "error_phase_")):
        kind, line = name.rsplit("_", 1)
        unit, size = ("arcsec", ARCSEC) if kind == "error_amplitude" else ("rad", 1.0)
        name = f"{kind} of order {campaign.believed.error_orders[int(line)]:g}"
    elif name == "offset":
        size = ARCSEC
    # Phases and the constant of the encoders are found, not believed.
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


def _role(verdict: Verdict, rival: Rival) -> str:
    if rival is verdict.chosen:
        return "best known, but not enough" if verdict.status == "unlisted" else "chosen"
    return "cannot be told apart" if rival in verdict.equivalent else "rejected"


def _names(rival: Rival) -> set[str]:
    return {candidate.name for candidate in rival.candidates}


def _size(value: float, gap: Gap) -> str:
    return f"{value:.3g} {gap.unit}"


def _percent(share: float) -> str:
    """Return a share rounded down: 100 % is not said of less."""
    return f"{np.floor(1000.0 * share + 1e-9) / 10.0:g} %"
