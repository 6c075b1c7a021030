"""Small changes of a drive that are no effect of their own: a law of any function of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import Coefficients, DriveEffect
from pymoo_hdte.effects.law import Behaviour, Law, PortState, Response

Force = Callable[[PortState], Response]


@dataclass(frozen=True, eq=False)
class AnyForce(Behaviour):
    """A law of any function of the motion.

    Attributes
    ----------
    force : callable
    orders : tuple of float
        Cycles per turn of the port with which it varies.
    """

    force: Force
    orders: tuple[float, ...] = ()

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return self.force(state)

    def with_input_locked(self) -> Law | None:
        """Return None: what varies with an angle has a mean of zero, and nothing else moves."""
        return None


class AnyForceOfLoad(AnyForce):
    """A law of any function of the motion that depends on the load too."""

    loaded: ClassVar[bool] = True


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

    def times(self, factor: float) -> Correction | None:
        """Return the effect times a factor; None for a law of the library, which does more."""
        law = self.law
        if not isinstance(law, AnyForce):
            return None

        def force(state: PortState) -> Response:
            response = law.respond(state)
            return Response(
                factor * response.torque, factor * response.slope, factor * response.damping
            )

        return Correction(self.port, replace(law, force=force))

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the law."""
        return replace(coefficients, laws=(*coefficients.laws, (self.port, self.law)))


@dataclass(frozen=True, eq=False)
class DampingByRecord(DriveEffect):
    """A damping of the torsion that differs between r records, which divide the rows evenly.

    Attributes
    ----------
    shares : ndarray, shape (r,)
        Added damping, as a share of the believed one.
    """

    name = "damping_by_record"
    shares: NDArray[np.float64]

    def times(self, factor: float) -> DampingByRecord:
        """Return the effect times a factor."""
        return DampingByRecord(factor * self.shares)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the damping; those of a sweep, of one row, stay."""
        damping = np.asarray(coefficients.damping)
        if len(damping) % len(self.shares):
            return coefficients
        factors = 1.0 + np.tile(self.shares, len(damping) // len(self.shares))
        return replace(coefficients, damping=damping * factors)


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

    def times(self, factor: float) -> LoadRate:
        """Return the effect times a factor."""
        return LoadRate(self.derivative, factor * self.size)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the torque, which the sensor at the output reads too."""
        added = (self.derivative, self.size)
        return replace(coefficients, load_rates=(*coefficients.load_rates, added))
