"""The error of a model on held-out records, before and after its correction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymoo_hdte.discrepancy.engine.rules import RULES

DEVIATIONS = "standard deviations of the noise"


@dataclass(frozen=True)
class Gap:
    """Root mean squares of measured minus predicted, in ``unit``.

    Attributes
    ----------
    before, after : float
        Of the fitted base, and of the model with the named effects.
    noise_floor : float
    unit : str
    least_share : float
        Least excess of a gap over the noise floor, as a share of it, for a shrinkage to be stated.
    worse_share : float
        Least growth of a gap, as a share of the noise floor, for it to be called worse.
    """

    before: float
    after: float
    noise_floor: float
    unit: str
    least_share: float = RULES.least_gap_share
    worse_share: float = RULES.worse_share

    @property
    def worse(self) -> bool:
        """Whether the correction made it larger by more than rounds to the same.

        A gap within the noise is not called worse, as it cannot be said to shrink.
        """
        beyond = self.after > (1.0 + self.least_share) * self.noise_floor
        return beyond and self.after - self.before > self.worse_share * self.noise_floor

    @property
    def reduction(self) -> float:
        """1 - after / before."""
        return 1.0 - self.after / self.before if self.before > 0.0 else 0.0

    @property
    def shrinkage(self) -> float | None:
        """1 - (after - floor) / (before - floor), or None where there was no gap to shrink."""
        excess = self.before - self.noise_floor
        if excess <= self.least_share * self.noise_floor:
            return None
        return 1.0 - (self.after - self.noise_floor) / excess

    def as_dict(self) -> dict[str, Any]:
        """Return the gap as plain values."""
        sizes = {name: getattr(self, name) for name in ("before", "after", "noise_floor", "unit")}
        return sizes | {"shrinkage": self.shrinkage, "reduction": self.reduction}
