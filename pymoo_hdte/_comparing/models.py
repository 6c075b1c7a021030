"""What a report says of the drive models behind its numbers."""

from __future__ import annotations

from pymoo_hdte._comparing.runs import robust_problem

FITTED = ("calibrated", "resonant")
"""Presets whose values were fitted to the moments of Table 8, every band of it read as ±5 %."""


def models_of(*names: str) -> dict[str, str]:
    """Return for each drive model, by its name, what it is and where its values come from."""
    models = [robust_problem(name).model for name in names]
    return {m.name: f"{m.description} {m.provenance}" for m in models}
