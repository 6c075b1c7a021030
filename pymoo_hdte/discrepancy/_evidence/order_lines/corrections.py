"""Small changes of a drive that are no effect of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pymoo_hdte.drive import Coefficients, DriveEffect
from pymoo_hdte.effects.law import Law


@dataclass(frozen=True, eq=False)
class Correction(DriveEffect):
    """A law at a port beside those of effects.

    Attributes
    ----------
    port : str
    law : Law
    """

    name = "correction"
    port: str
    law: Law

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the law."""
        return replace(coefficients, laws=(*coefficients.laws, (self.port, self.law)))


@dataclass(frozen=True, eq=False)
class LoadRate(DriveEffect):
    """A load that is not rigidly coupled and answers to a derivative of the acceleration.

    Whatever couples it, springs, dampers or both, its torque is a series in these derivatives.

    Attributes
    ----------
    derivative : int
        1 or more.
    size : float
        N.m.s^(2 + derivative) per rad.
    """

    name = "load_rate"
    derivative: int
    size: float

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the torque, which the sensor at the output reads too."""
        added = (self.derivative, self.size)
        return replace(coefficients, load_rates=(*coefficients.load_rates, added))
