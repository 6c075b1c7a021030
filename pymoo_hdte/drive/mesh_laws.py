"""Laws of torque over torsion without memory: curved, varying and missing stiffness."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive.laws import Aperiodic, Periodic, PortState, Response, Values


@dataclass(frozen=True)
class CubicStiffness(Aperiodic):
    """T = coefficient d^3; N.m/rad3."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("hardening_stiffness.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        square = state.position**2
        return Response(self.coefficient * square * state.position, 3.0 * self.coefficient * square)


@dataclass(frozen=True)
class SoftWindup(Aperiodic):
    """T = -softening K torsion g(d / torsion): K is lower by this share near zero torsion.

    g(x) = x / (1 + |x|^p)^(1/p) with p the ``sharpness``: from a gradual winding up to the straight
    pieces of catalogues (K1 below K2 below K3). ``torsion``, rad, is where the drive has wound up.
    """

    softening: float
    torsion: float
    sharpness: float = 2.0

    def __post_init__(self) -> None:
        real_number("soft_windup.softening", self.softening, below=1.0)
        real_number("soft_windup.torsion", self.torsion, above=0.0)
        real_number("soft_windup.sharpness", self.sharpness, at_least=1.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        wound = state.position / self.torsion
        # (1 + |x|^p)^(1/p) by logarithms: the power itself overflows far from zero.
        power = self.sharpness * np.log(np.maximum(np.abs(wound), 1e-30))
        root = np.logaddexp(0.0, power) / self.sharpness
        lost = self.softening * state.stiffness
        slope = np.exp(-(1.0 + self.sharpness) * root)
        return Response(-lost * self.torsion * wound * np.exp(-root), -lost * slope)


@dataclass(frozen=True)
class PeriodicStiffness(Periodic):
    """T = depth K cos(order angle + phase) d: what a varying stiffness adds to its mean."""

    depth: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("mesh_stiffness_variation.depth", self.depth, at_least=0.0, below=1.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        added = self.depth * state.stiffness * self.cosine(state)
        return Response(added * state.position, added)


ROUNDING = 0.05
"""Share of a clearance over which contact sets in: no tooth flank is met at once. A sharp corner
differs by less than this share of the half-width, times ln 2, and only at the corner itself."""


def _dead_zone(state: PortState, half_width: Values | float) -> Response:
    """Return what a clearance takes from K d: everything within, a constant beyond."""
    rounding = ROUNDING * np.maximum(half_width, 1e-12)
    left, right = state.position + half_width, state.position - half_width
    lost = rounding * (_soft_plus(left / rounding) - _soft_plus(right / rounding)) - half_width
    slope = expit(left / rounding) - expit(right / rounding)
    return Response(-state.stiffness * lost, -state.stiffness * slope)


def _soft_plus(x: Values) -> Values:
    return np.logaddexp(0.0, x)


@dataclass(frozen=True)
class DeadZone(Aperiodic):
    """T = K (dz(d) - d): no spring torque within +-half_width (rad) of zero torsion."""

    half_width: float

    def __post_init__(self) -> None:
        real_number("backlash.half_width", self.half_width, at_least=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return _dead_zone(state, self.half_width)


@dataclass(frozen=True)
class PeriodicClearance(Periodic):
    """A dead zone of half-width half_width + variation cos(order angle + phase), at least 0; rad.

    Attributes
    ----------
    half_width, variation : float
        rad.
    locked : float or None
        Half-width at the angle at which the input was locked for a torsion sweep, rad, where it
        is known: of a rig, not of a drive.
    """

    half_width: float
    variation: float
    locked: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("clearance_variation.half_width", self.half_width, at_least=0.0)
        real_number("clearance_variation.variation", self.variation, at_least=0.0)
        if self.locked is not None:
            real_number("clearance_variation.locked", self.locked, at_least=0.0)

    @property
    def at_rest(self) -> float:
        """Half-width where the input was locked, rad."""
        return self.half_width if self.locked is None else self.locked

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        width = self.half_width + self.variation * self.cosine(state)
        return _dead_zone(state, np.maximum(width, 0.0))
