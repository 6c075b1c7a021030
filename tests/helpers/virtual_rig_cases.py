"""The rig that the tests of the virtual rig share."""

from dataclasses import replace

from experiments.studies.blind.cases import BELIEVED, RIG
from experiments.studies.virtual_rig.rig import HiddenEffect, TrueRig
from experiments.studies.virtual_rig.runs import Condition

__all__ = ["BELIEVED", "FAST", "PHASES", "RIG", "SHORT", "effect", "true_rig"]

PHASES = (0.3, 1.9, 4.0)
FAST = Condition(2000.0, 40.0, 1000.0, 1, "train")
SHORT = (FAST, Condition(2000.0, 0.0, 1000.0, 1, "held_out"))


def true_rig(*effects: HiddenEffect, **changes: float | tuple[float, ...]) -> TrueRig:
    """Return a rig that is as believed but for the changes."""
    return TrueRig(replace(BELIEVED, **changes), PHASES, effects)


def effect(port: str, **parameters: float) -> HiddenEffect:
    """Return a planted effect."""
    return HiddenEffect(port, parameters)
