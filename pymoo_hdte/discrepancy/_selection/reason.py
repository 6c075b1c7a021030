"""Reasons why a verdict is not unqualified, as data; their sentences are in `_report.words`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

AT_BOUND = "at_bound"
"""Unknowns of an effect ended at a bound; the numbers are their values, SI."""
ZERO_IN_INTERVAL = "zero_in_interval"
"""The strength of an effect may be nothing."""
FREED_AT_BOUND = "freed_at_bound"
"""A base value out of tolerance ended at ten times or a tenth of what is believed."""
SENSOR_AT_BOUND = "sensor_at_bound"
"""The gain or zero that ``effect`` names ended far beyond what is stated of it."""
STANDS_FOR_FORM = "stands_for_form"
"""Values out of tolerance may stand for what the listed form of an effect leaves."""
HARMONIC_OF_ANOTHER = "harmonic_of_another"
"""An effect may be a harmonic of another; the number is of which multiple of its order."""
NOT_VALIDATED = "not_validated"
"""The error on the records kept out of the fit does not shrink as it should."""
HELD_OUT_ERROR_GROWS = "held_out_error_grows"
"""Errors on the records kept out of the fit grow; the numbers are after over before."""
ABOVE_NOISE = "above_noise"
"""More than noise is left: ``times_noise``."""
NEEDS_ANOTHER_FORM = "needs_another_form"
"""Effects have to have another form than the listed one to explain what is left."""
EXPLAINS_TOO_LITTLE = "explains_too_little"
"""The effects explain a smaller ``share`` of the misfit than a name takes."""
RICHER_AT_BOUND = "richer_at_bound"
"""Another set leaves less, but unknowns of it ended at a bound; the numbers are their values."""
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
        Label of the effects that it is about, or name of the value; empty for the whole verdict.
    numbers : tuple of (str, float)
        By the name of what they are of, as the code tells.
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
        """What the numbers are of."""
        return [name for name, _ in self.numbers]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"code": self.code, "effect": self.effect, "numbers": dict(self.numbers)}
