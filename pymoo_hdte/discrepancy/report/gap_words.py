"""What a correction did to the gap on held-out records, in words: better and worse alike."""

from __future__ import annotations

from pymoo_hdte.discrepancy.drive.finding import DriveFinding
from pymoo_hdte.discrepancy.drive.proof import Proof
from pymoo_hdte.reports.html import number, percent

_SHOWN = 3
"""Most records that a sentence names."""


def gap_sentence(finding: DriveFinding, proof: Proof | None) -> str:
    """Return how much the gap shrank on held-out records, in words."""
    if proof is None:
        return "No record was held out, so nothing can be said about conditions not fitted."
    gap = proof.channels[proof.leading]
    records = f"{len(proof.records)} held-out record{'s' if len(proof.records) > 1 else ''}"
    where = f"{records}, {proof.leading.replace('_', ' ')}"
    noise = f"noise alone {number(gap.noise_floor)} {gap.unit}"
    if not finding.verdict.accepted.candidates:
        return f"Nothing was added. On {where}: off by {number(gap.before)} {gap.unit}, {noise}."
    words = f"On {where}: off by {number(gap.before)} before, {number(gap.after)} after, {noise}"
    if proof.condemns:
        where = "there" if gap.worse else "in all channels together"
        return f"{words}. The revised model is worse {where}: do not use it.{_worse(proof)}"
    if gap.shrinkage is not None:
        words += f"; {percent(min(gap.shrinkage, 1.0))} of what the noise does not explain is gone"
    error = proof.channels["transmission_error"]
    if error is not gap:
        words += (
            f". Transmission error: {number(error.before)} before, {number(error.after)} after, "
        )
        words += f"noise alone {number(error.noise_floor)} {error.unit}"
    return f"{words}.{_worse(proof)}"


def _worse(proof: Proof) -> str:
    """Return what the correction made worse, with its numbers; nothing where nothing is worse."""
    gaps = {name.replace("_", " "): gap for name, gap in proof.channels.items()}
    gaps["all channels together"] = proof.overall
    parts = [
        f"{name} {number(gap.before)} before, {number(gap.after)} after, in {gap.unit}"
        for name, gap in gaps.items()
        if gap.worse
    ]
    records = [name for name, gap in zip(proof.records, proof.by_record, strict=True) if gap.worse]
    if len(records) > _SHOWN:
        parts.append(f"transmission error of {len(records)} of {len(proof.records)} records")
    elif records:
        parts.append(f"transmission error of {', '.join(records)}")
    return f" Worse than before: {'; '.join(parts)}." if parts else ""
