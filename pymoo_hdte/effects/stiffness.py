"""Laws of torque over torsion without memory: curved, varying and missing stiffness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from scipy.special import expit

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, Periodic, PortState, Response, Values
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.unknowns import Family, Parameter, polar, unknown, wave


@dataclass(frozen=True)
class HardeningStiffness(Aperiodic):
    """T = coefficient d^3 + stiffening K (d - torsion g(d / torsion)): stiffer under load.

    Gradually, by the cubic (N.m/rad3), or beyond a corner: K is higher by the share ``stiffening``
    beyond the ``torsion``, rad. g is that of `SoftWindup`; a corner differs from that law by a
    multiple of K d, so that only the tolerance of K separates a drive that is stiff under load from
    one that is soft near zero.
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

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(
            f"coefficient * position ** 3 + stiffening * stiffness * (position - {_WOUND})"
        )


def _sharpness() -> Parameter:
    """Guess the corner of a curve: from no corner to one that measured points cannot resolve.

    There the curve is off from two straight pieces by 3 % of the torsion at the corner itself
    (1 - 2^(-1/20)), and by less than a thousandth a quarter away from it.
    """
    return unknown("sharpness", 1.0, 20.0, 3.0, open_above=True)


_MOST_AT_PEAK = 10.0
"""Largest force of a cubic at the largest deflection, in units of the believed spring's. Set by
hand: far beyond every spring for which one stiffness is believed."""


def _hardening(sizes: Sizes) -> list[Guess]:
    """Guess a cubic, and for a port that is wound up by a load also a corner on the way."""
    if sizes.stiffness == 0.0:
        return []
    travel, typical = sizes.travel, sizes.force / sizes.travel**3
    most = 20.0 * typical
    if not sizes.loaded:
        # Of a motion's misfit the root mean square says little about the force at peak travel.
        most = max(most, _MOST_AT_PEAK * sizes.stiffness / travel**2)
    guesses = [Guess((unknown("coefficient", 0.0, most, typical),))]
    if sizes.loaded:
        corner = (
            unknown("stiffening", 0.0, 0.9, 0.2),
            unknown("torsion", 0.05 * travel, travel, 0.4 * travel),
            _sharpness(),
        )
        starts = [(0.2, share * travel, 3.0) for share in (0.25, 0.5)]
        sentence = "The {port} grows stiffer beyond a {force}."
        guesses.append(Guess(corner, starts, form="corner", sentence=sentence))
    return guesses


register(
    Effect(
        "hardening_stiffness",
        HardeningStiffness,
        ("mesh",),
        {"coefficient": "cubic stiffness", "stiffening": "", "torsion": "angle", "sharpness": ""},
        "The {port} grows stiffer with its deflection.",
        _hardening,
        forms="curve_of_torsion",
        with_load=True,
    )
)


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

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(f"-softening * stiffness * {_WOUND}")


def _soft(sizes: Sizes) -> list[Guess]:
    if sizes.stiffness == 0.0:
        return []
    travel = sizes.travel
    unknowns = (
        unknown("softening", 0.0, 0.95, 0.2),
        unknown("torsion", 1e-3 * travel, travel, 0.2 * travel),
        _sharpness(),
    )
    return [Guess(unknowns, [(0.2, share * travel, 3.0) for share in (0.05, 0.15, 0.4)])]


register(
    Effect(
        "soft_windup",
        SoftWindup,
        ("mesh",),
        {"softening": "", "torsion": "angle", "sharpness": ""},
        "The {port} is softer near its rest position.",
        _soft,
        forms="curve_of_torsion",
        with_load=True,
    )
)


_WOUND = "position / (1 + abs(position / torsion) ** sharpness) ** (1 / sharpness)"
"""`_wound` in a formula."""


def _wound(position: Values, torsion: float, sharpness: float) -> tuple[Values, Values]:
    """Return torsion x g(position / torsion), which ends at the torsion, and its slope."""
    share = position / torsion
    # (1 + |x|^p)^(1/p) by logarithms, because the power overflows far from zero.
    root = np.logaddexp(0.0, sharpness * np.log(np.maximum(np.abs(share), 1e-30))) / sharpness
    return position * np.exp(-root), np.exp(-(1.0 + sharpness) * root)


@dataclass(frozen=True)
class PeriodicStiffness(Periodic):
    """T = depth K cos(order angle + phase) d: what a varying stiffness adds to its mean."""

    varies_stiffness: ClassVar[bool] = True
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
    """Return the reduction of K d by a clearance: everything within, a constant beyond."""
    rounding = ROUNDING * np.maximum(half_width, 1e-12)
    left, right = state.position + half_width, state.position - half_width
    met = np.logaddexp(0.0, left / rounding) - np.logaddexp(0.0, right / rounding)
    lost = rounding * met - half_width
    slope = expit(left / rounding) - expit(right / rounding)
    return Response(-state.stiffness * lost, -state.stiffness * slope)


def _lost_in(half_width: str) -> Formula:
    """Return `_dead_zone` as a formula, of a half-width that is one itself."""
    rounding = f"({ROUNDING} * max({half_width}, 1e-12))"
    # log(1 + exp(x)), which does not overflow this way.
    left, right = (
        f"max({way}, 0) + log(1 + exp(-abs({way})))"
        for way in (f"(position {sign} {half_width}) / {rounding}" for sign in "+-")
    )
    return Formula(f"-stiffness * ({rounding} * ({left} - ({right})) - {half_width})")


@dataclass(frozen=True)
class DeadZone(Aperiodic):
    """T = K (dz(d) - d): no spring torque within +-half_width (rad) of zero torsion."""

    rattles: ClassVar[bool] = True
    half_width: float

    def __post_init__(self) -> None:
        real_number("backlash.half_width", self.half_width, at_least=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return _dead_zone(state, self.half_width)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return _lost_in("half_width")


def _play(sizes: Sizes) -> list[Guess]:
    if sizes.stiffness == 0.0:
        return []
    travel = sizes.travel
    width = unknown("half_width", 0.0, 0.5 * travel, 0.05 * travel)
    return [Guess((width,), [(0.02 * travel,), (0.1 * travel,)])]


register(
    Effect(
        "backlash",
        DeadZone,
        ("mesh",),
        {"half_width": "angle"},
        "There is play at the {port}.",
        _play,
        special_case_of=("clearance_variation",),
        forms="curve_of_torsion",
        with_load=True,
    )
)


@dataclass(frozen=True)
class PeriodicClearance(Periodic):
    """A dead zone of half-width half_width + variation cos(order angle + phase), at least 0; rad.

    Attributes
    ----------
    half_width, variation : float
        rad.
    locked : float or None
        Half-width at the angle at which the input was locked for a torsion sweep, rad, where it is
        known; a property of a rig, not of a drive.
    """

    rattles: ClassVar[bool] = True
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

    def with_input_locked(self) -> Law | None:
        """Return the clearance where the input was locked, its mean where that is not known."""
        return DeadZone(self.at_rest)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        width = self.half_width + self.variation * self.cosine(state)
        return _dead_zone(state, np.maximum(width, 0.0))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return _lost_in("max(half_width + variation * cos(order * angle + phase), 0)")


def guess_of_clearance(
    sizes: Sizes, orders: Sequence[float], law: Callable[[Sequence[float]], Law]
) -> list[Guess]:
    """Guess a play that varies with the shaft, by half of its mean and more.

    There is one guess for each of the orders. ``law`` is made of order, phase, half-width,
    variation and, where a sweep shows it, half-width where the input was locked. The least width is
    an unknown of its own: a play with negative width would be clipped to zero, where a search has
    no gradient.
    """
    if sizes.stiffness == 0.0 or sizes.between:
        return []
    travel, guesses = sizes.travel, []
    size, widest = 0.02 * travel, 0.5 * travel
    for order in orders:

        def build(values: Sequence[float], order: float = order) -> tuple[Law, ...]:
            variation, phase = polar(values[0], values[1])
            return (law((order, phase, values[2] + variation, variation, *values[3:])),)

        unknowns = (
            *wave("variation", widest / 2.0, size),
            unknown("narrowest", 0.0, widest, size, linear=True, may_vanish=True),
        )
        shapes: list[tuple[int, ...]] = [(1, 0, 1), (0, 1, 1), (0, 0, 1)]
        if sizes.swept:
            locked = unknown("locked", 0.0, 2.0 * widest, size, linear=True, may_vanish=True)
            unknowns = (*unknowns, locked)
            shapes = [(1, 0, 1, 1), (0, 1, 1, 1), (0, 0, 1, 1), (0, 0, 1, 2)]
        starts = [[size * factor for factor in shape] for shape in shapes]
        guesses.append(Guess(unknowns, starts, build, Family((order,))))
    return guesses


def _uneven(sizes: Sizes) -> list[Guess]:
    return guess_of_clearance(sizes, sizes.expected, lambda numbers: PeriodicClearance(*numbers))


register(
    Effect(
        "clearance_variation",
        PeriodicClearance,
        ("mesh",),
        {"order": "", "phase": "angle", "half_width": "angle", "variation": "angle"},
        "The play at the {port} varies, order {order} of the shaft.",
        _uneven,
        of_fit={"narrowest": "angle", "locked": "angle"},
        forms="curve_of_torsion",
    )
)
