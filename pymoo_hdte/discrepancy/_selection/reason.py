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
EXPLAINS_TOO_LITTLE = "explains_too_little"
"""The effects explain a smaller ``share`` of the misfit than a name requires."""
RICHER_AT_BOUND = "richer_at_bound"
"""Another set leaves less, but its unknowns ended at a bound; the numbers are their values."""
RICHER_LEAVES_LESS = "richer_leaves_less"
"""The set that ``effect`` names leaves a small ``share`` of what the named effects leave."""
MORE_MISSING = "more_missing"
"""The effects leave something; ``outside`` is the probability that no effect of the library can."""
AT_TOLERANCE = "at_tolerance"
"""The base value that ``effect`` names ended at the bound of its tolerance."""


SAME_READING = "same_reading"
"""Both angles begin at one reading in every record."""
STANDS_OUT = "stands_out"
"""One record, that ``numbers`` names, has a share of the misfit above one half."""
NO_HELD_OUT = "no_held_out"
"""No record was held out."""
NOT_SHOWN = "not_shown"
"""The held-out records do not show what is named."""
HELD_OUT_RATTLES = "held_out_rattles"
"""All held-out records rattle."""
FLANKS_PART = "flanks_part"
"""The load of the records that ``numbers`` names does not hold the flanks together, N.m."""
CLEARANCE_EVIDENT = "clearance_evident"
"""Without load the motion does not repeat with the input."""
ONE_SPEED = "one_speed"
"""All fitted records run at one speed."""
ONE_LOAD = "one_load"
"""All fitted records carry one load."""
ONE_WAY = "one_way"
"""All fitted records turn one way; the number is the stated zero of the input torque, N.m."""
ONE_TIME = "one_time"
"""All fitted records have one time in the session."""
NO_SWEEP = "no_sweep"
"""No torsion sweep was fitted."""
LIKE_A_GAIN = "like_a_gain"
"""Power flows one way, so that friction by load looks like a gain; the number is the stated one."""
SENSOR_OFF = "sensor_off"
"""The gain or zero that ``effect`` names is ``fitted`` and contradicts what is ``stated``, SI."""
UNRESOLVED_LINES = "unresolved_lines"
"""Lines of the nominal static error that records do not resolve; the numbers are their orders."""
LINES_ABOVE = "lines_above"
"""Lines of the nominal static error above the ``highest`` order that is compared."""
HARMONIC_ABOVE = "harmonic_above"
"""The second harmonic of ``order`` lies above the ``highest``; ``effect`` is what is named."""


@dataclass(frozen=True)
class Reason:
    """Why the effects of a verdict are not named without qualification, or what stays open.

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
