"""How far a model is off, before and after a correction, beside what noise alone would leave.

A gap is the root mean square, over one period, of the difference between two signals of which only
order lines are known: ``sqrt(mean^2 + sum |line|^2 / 2)``. The noise floor is the same of the noise
of the sensors and the repeatability of the rig: what a perfect model would still leave.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pymoo_hdte.units import ARCSEC

UNITS = {
    "transmission_error": ("arcsec", ARCSEC),
    "input_torque": ("mN.m", 1e-3),
    "output_torque": ("mN.m", 1e-3),
}
"""Channels whose gap is shown, with their unit and its size in SI."""

DEVIATIONS = "standard deviations of the noise"

_NO_GAP = 0.1
"""A gap that exceeds the noise floor by less than this share of it cannot be said to shrink."""


@dataclass(frozen=True)
class Gap:
    """Root mean squares of measured minus predicted, in ``unit``.

    Attributes
    ----------
    before, after : float
        Of the fitted base, and of the model with what was named.
    noise_floor : float
    unit : str
    """

    before: float
    after: float
    noise_floor: float
    unit: str

    @property
    def reduction(self) -> float:
        """1 - after / before."""
        return 1.0 - self.after / self.before if self.before > 0.0 else 0.0

    @property
    def shrinkage(self) -> float | None:
        """1 - (after - floor) / (before - floor), or None where there was no gap to shrink."""
        excess = self.before - self.noise_floor
        if excess <= _NO_GAP * self.noise_floor:
            return None
        return 1.0 - (self.after - self.noise_floor) / excess

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain values."""
        return asdict(self) | {"shrinkage": self.shrinkage, "reduction": self.reduction}
