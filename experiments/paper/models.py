"""What a report says of the drive models behind its numbers."""

from __future__ import annotations

from experiments.comparison.runs import robust_problem

FITTED = ("calibrated", "resonant")
"""Presets whose values were fitted to the moments of Table 8, every band of it read as ±5 %."""


def model_sentences(*names: str) -> tuple[str, ...]:
    """Return one paragraph for each drive model: what it is and where its values come from."""
    models = [robust_problem(name).model for name in names]
    return tuple(f"{m.name}: {m.description} {m.provenance}" for m in models)
