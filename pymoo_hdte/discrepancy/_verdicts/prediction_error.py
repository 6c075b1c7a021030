"""The error of a model on held-out records, before and after its correction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scipy.stats import norm

from pymoo_hdte.discrepancy._selection.rules import RULES, Rules

DEVIATIONS = "standard deviations of the noise"


def grows(
    before: float, after: float, floor: float, chance: float, among: int = 1, rules: Rules = RULES
) -> bool:
    """Tell whether a root mean square error on held-out records grew, and not by their noise.

    One within the noise is not said to grow, as it cannot be said to shrink.

    Parameters
    ----------
    before, after : float
    floor : float
        What the best model leaves of it.
    chance : float
        Standard deviation of ``after**2 - before**2`` by the noise of the records.
    among : int
        Number of errors that are asked: the chance that noise makes any of them grow is that of
        one (Bonferroni).
    rules : Rules
    """
    beyond = after > (1.0 + rules.least_gap_share) * floor
    larger = after - before > rules.worse_share * floor
    deviations = float(norm.isf(norm.sf(rules.certain_deviations) / among))
    return beyond and larger and after**2 - before**2 > deviations * chance


@dataclass(frozen=True)
class PredictionError:
    """Root mean squares of measured minus predicted, in ``unit``.

    Attributes
    ----------
    before, after : float
        Of the fitted base, and of the model with the named effects.
    noise_floor : float
    unit : str
    rules : Rules
        Thresholds by which it shrinks or grows.
    chance : float
        Standard deviation of the difference of their squares by the noise.
    among : int
        See `grows`.
    """

    before: float
    after: float
    noise_floor: float
    unit: str
    rules: Rules = RULES
    chance: float = 0.0
    among: int = 1

    @property
    def worse(self) -> bool:
        """Whether the correction made it larger: see `grows`."""
        sizes = self.before, self.after, self.noise_floor, self.chance
        return grows(*sizes, self.among, self.rules)

    @property
    def reduction(self) -> float:
        """1 - after / before."""
        return 1.0 - self.after / self.before if self.before > 0.0 else 0.0

    @property
    def shrinkage(self) -> float | None:
        """1 - (after - floor) / (before - floor), or None where there was no error to shrink."""
        excess = self.before - self.noise_floor
        if excess <= self.rules.least_gap_share * self.noise_floor:
            return None
        return 1.0 - (self.after - self.noise_floor) / excess

    def as_dict(self) -> dict[str, Any]:
        """Return the error as plain values."""
        sizes = {name: getattr(self, name) for name in ("before", "after", "noise_floor", "unit")}
        return sizes | {"shrinkage": self.shrinkage, "reduction": self.reduction}
