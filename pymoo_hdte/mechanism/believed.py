"""A value of a model as it is believed, with its limits."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.checks import InvalidInput, real_number

LARGEST_FACTOR = 1e6
"""Largest factor of a nominal value: nobody who knows its unit is further off."""
SMALLEST_SHARE = 1.0 / LARGEST_FACTOR
"""Least fitted value as a share of the nominal one: a mass of zero cannot be simulated, and a
value of zero has no tolerance."""


@dataclass(frozen=True)
class BelievedValue:
    """A value that is believed within limits, which a fit must not leave.

    Attributes
    ----------
    value : float
        SI; only gains of inputs may be negative.
    tolerance : float
        Relative, 0 for a value that is known; 1 allows everything from zero to twice the value.
    factor : float
        Instead of a tolerance: the value is right within this factor, 3 allowing everything from a
        third of the value to three times as much.

    Raises
    ------
    InvalidInput
        For a number that is not finite or out of range, or a factor beside a tolerance.

    Examples
    --------
    >>> BelievedValue(0.06, tolerance=0.5).limits
    (0.03, 0.09)
    """

    value: float
    tolerance: float = 0.0
    factor: float = 1.0

    def __post_init__(self) -> None:
        real_number("believed.value", self.value)
        real_number("believed.tolerance", self.tolerance, at_least=0.0, at_most=1.0)
        real_number("believed.factor", self.factor, at_least=1.0, at_most=LARGEST_FACTOR)
        if self.tolerance > 0.0 and self.factor > 1.0:
            raise InvalidInput("believed.factor", self.factor, "absent beside a tolerance")

    @property
    def known(self) -> bool:
        """Whether the value is known exactly."""
        return self.tolerance == 0.0 and self.factor == 1.0

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the largest value, SI."""
        ends = (1.0 - self.tolerance) / self.factor, (1.0 + self.tolerance) * self.factor
        least, most = sorted(self.value * end for end in ends)
        return least, most

    @property
    def fit_limits(self) -> tuple[float, float]:
        """The least and the largest value of a fit, SI: `limits` without zero.

        Examples
        --------
        >>> BelievedValue(2.0, tolerance=1.0).fit_limits
        (2e-06, 4.0)
        """
        least, most = self.limits
        nothing = SMALLEST_SHARE * self.value
        return (max(least, nothing), most) if self.value > 0.0 else (least, min(most, nothing))


NOTHING = BelievedValue(0.0)
