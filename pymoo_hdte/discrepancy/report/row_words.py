"""What the report says about faulty rows and about noise other than stated."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.campaign.rows.findings import (
    FAILED,
    UNITS,
    NoiseFinding,
    RowFault,
    RowFindings,
)
from pymoo_hdte.effects.sentence_blanks import listed
from pymoo_hdte.units import ARCSEC

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


@dataclass(frozen=True)
class FaultRow:
    """A fault as the page shows it; angles in arcsec."""

    record: str
    kind: str
    channel: str
    row: int
    rows: int
    size: float
    unit: str
    treatment: str


@dataclass(frozen=True)
class NoiseRow:
    """A noise as the page shows it; angles in arcsec."""

    name: str
    stated: float
    found: float | None
    used: float
    unit: str
    reason: str


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
    replaced = [one for one in findings.noise if one.replaced]
    for zero in (one for one in replaced if one.name.endswith("_zero")):
        words.append(
            f"The {_name(zero)} drifts, so that it counts as known to {zero.used:.2g} {zero.unit} "
            f"instead of {zero.stated:.2g} {zero.unit}."
        )
    changed = [one for one in replaced if not one.name.endswith("_zero")]
    if changed:
        ratios = listed([f"{one.used / one.stated:.2g} times ({_name(one)})" for one in changed])
        words.append(f"The noise is not the stated one but {ratios}; what was found is used.")
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
            done[-1] += f", also in {hidden} more, where noise may hide it"
    if "new zero" in modelled:
        done.append("records with a new zero are shifted back")
    if "drift" in modelled:
        largest = max(abs(one.size) for one in findings.faults if one.kind == "drift")
        done.append(f"drifts of up to {largest:.2g} N.m are taken out")
    if findings.left_out:
        done.append(f"left out as a whole: {listed(list(findings.left_out))}")
    return "; ".join(done) or "nothing had to be left out"


def fault_rows(findings: RowFindings) -> list[FaultRow]:
    """Return the faults of the page."""
    return [_fault_row(fault) for fault in findings.faults[:_MOST_FAULTS]]


def _fault_row(fault: RowFault) -> FaultRow:
    unit, size = UNITS[fault.channel], fault.size
    if fault.kind not in FAILED:  # whose size is a reading, and no small angle
        unit, size = _shown(unit, size)
    channel = "all" if fault.channel == "rows" else fault.channel.replace("_", " ")
    kind = "repeated rows" if fault.kind == "repeated" else fault.kind
    return FaultRow(
        fault.record, kind, channel, fault.row + 1, fault.rows, size, unit, fault.treatment
    )


def noise_rows(findings: RowFindings) -> list[NoiseRow]:
    """Return stated and found noise."""
    return [_noise_row(one) for one in findings.noise]


def _noise_row(one: NoiseFinding) -> NoiseRow:
    unit, stated = _shown(one.unit, one.stated)
    found = None if one.found is None else _shown(one.unit, one.found)[1]
    return NoiseRow(_name(one), stated, found, _shown(one.unit, one.used)[1], unit, one.reason)


def _shown(unit: str, size: float) -> tuple[str, float]:
    return ("arcsec", size / ARCSEC) if unit == "rad" else (unit, size)


def _name(one: NoiseFinding) -> str:
    return one.name.removesuffix("_noise").replace("_", " ")
