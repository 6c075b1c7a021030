"""Reasons why a verdict is qualified, as data; their sentences are in `_report.words`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

AT_BOUND = "at_bound"
"""Unknowns of an effect ended at a bound; the numbers are their values, SI."""
ZERO_IN_INTERVAL = "zero_in_interval"
"""The strength of an effect may be zero."""
FREED_AT_BOUND = "freed_at_bound"
"""A base value out of tolerance ended at ten times or a tenth of its nominal value."""
SENSOR_AT_BOUND = "sensor_at_bound"
"""The gain or zero that ``effect`` names ended far beyond what is stated of it."""
STANDS_FOR_FORM = "stands_for_form"
"""Values out of tolerance may stand for what the listed form of an effect leaves."""
HARMONIC_OF_ANOTHER = "harmonic_of_another"
"""An effect may be a harmonic of another; the number is the multiple of its order."""
NOT_VALIDATED = "not_validated"
"""The error on held-out records does not shrink as it should."""
HELD_OUT_ERROR_GROWS = "held_out_error_grows"
"""Errors on held-out records grow; the numbers are their ratios, after to before."""
ABOVE_NOISE = "above_noise"
"""More than noise is left: ``times_noise``."""
NEEDS_ANOTHER_FORM = "needs_another_form"
"""Effects need another form than the listed one to explain the misfit."""
EXPLAINS_TOO_LITTLE = "explains_too_little"
"""The effects explain a smaller ``share`` of the misfit than a name requires."""
RICHER_AT_BOUND = "richer_at_bound"
"""Another set leaves less, but its unknowns ended at a bound; the numbers are their values."""
AT_TOLERANCE = "at_tolerance"
"""The base value that ``effect`` names ended at the bound of its tolerance."""


@dataclass(frozen=True)
class Reason:
    """Why the effects of a verdict are not named without qualification.

    Attributes
    ----------
    code : str
        One of the constants of this module.
    effect : str
        Label of the effects concerned, or name of the value; empty for the whole verdict.
    numbers : tuple of (str, float)
        Name and value of each number, as described at the code.
    """

    code: str
    effect: str = ""
    numbers: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, code: str, effect: str = "", numbers: Mapping[str, float] | None = None) -> Reason:
        """Return a reason with its numbers from a mapping."""
        items = (numbers or {}).items()
        return cls(code, effect, tuple((name, float(number)) for name, number in items))

    @property
    def names(self) -> list[str]:
        """Names of the numbers."""
        return [name for name, _ in self.numbers]

    def as_dict(self) -> dict[str, Any]:
        """Return the reason as plain values."""
        return {"code": self.code, "effect": self.effect, "numbers": dict(self.numbers)}
