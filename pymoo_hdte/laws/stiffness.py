"""Laws of torque over torsion without memory: curved, varying and missing stiffness."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from pymoo_hdte.checks import real_number
from pymoo_hdte.laws.law import Aperiodic, Periodic, PortState, Response, Values


@dataclass(frozen=True)
class HardeningStiffness(Aperiodic):
    """T = coefficient d^3 + stiffening K (d - torsion g(d / torsion)): stiffer under load.

    Gradually, by the cubic (N.m/rad3), or beyond a corner: K is higher by the share ``stiffening``
    beyond the ``torsion``, rad. g is that of `SoftWindup`; a corner differs from that law by a
    multiple of K d, so that only the tolerance of K tells a drive that is stiff under load from one
    that is soft near zero.
    """

    coefficient: float = 0.0
    stiffening: float = 0.0
    torsion: float = 1.0
    sharpness: float = 2.0

    def __post_init__(self) -> None:
        real_number("hardening_stiffness.coefficient", self.coefficient)
        real_number("hardening_stiffness.stiffening", self.stiffening, above=-1.0)
        real_number("hardening_stiffness.torsion", self.torsion, above=0.0)
        real_number("hardening_stiffness.sharpness", self.sharpness, at_least=1.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        square = state.position**2
        torque = self.coefficient * square * state.position
        slope = 3.0 * self.coefficient * square
        if self.stiffening != 0.0:
            added = self.stiffening * state.stiffness
            wound, share = _wound(state.position, self.torsion, self.sharpness)
            torque = torque + added * (state.position - wound)
            slope = slope + added * (1.0 - share)
        return Response(torque, slope)


@dataclass(frozen=True)
class SoftWindup(Aperiodic):
    """T = -softening K torsion g(d / torsion): K is lower by this share near zero torsion.

    ``g(x) = x / (1 + |x|^p)^(1/p)`` with p the ``sharpness``: from a gradual winding up to the
    straight pieces of catalogues (K1 below K2 below K3). ``torsion``, rad, is where the drive has
    wound up.
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
        lost = self.softening * state.stiffness
        wound, slope = _wound(state.position, self.torsion, self.sharpness)
        return Response(-lost * wound, -lost * slope)


def _wound(position: Values, torsion: float, sharpness: float) -> tuple[Values, Values]:
    """Return torsion x g(position / torsion), which ends at the torsion, and its slope."""
    share = position / torsion
    # (1 + |x|^p)^(1/p) by logarithms: the power itself overflows far from zero.
    root = np.logaddexp(0.0, sharpness * np.log(np.maximum(np.abs(share), 1e-30))) / sharpness
    return position * np.exp(-root), np.exp(-(1.0 + sharpness) * root)


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
