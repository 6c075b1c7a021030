"""Laws of friction over speed: dry friction, also one that varies over a turn, and drag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import (
    Aperiodic,
    Law,
    Periodic,
    PortState,
    Response,
    Values,
    closest_line,
)
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.shear_thinning import shear_thinning
from pymoo_hdte.effects.unknowns import Family, starts_along_each, unknown

FRICTION_PORTS = ("input", "output")

SMOOTHING_SPEED = 1e-4
"""rad/s. Dry friction follows tanh(speed / this): exact to rounding wherever a drive turns, and its
sign is undecided only below 1 % of the slowest output speed of interest (10 r/min at the input)."""

SIGN = f"tanh(speed / {SMOOTHING_SPEED})"
"""`smoothed_sign` in a formula."""
_WHOLE = 20.0
"""Argument beyond which a hyperbolic tangent is 1 to the last digit; it takes long to compute."""
_NEGLIGIBLE_SPEED = 1e-150
"""Speed that keeps a quotient finite at rest, rad/s."""


def smoothed_sign(speed: Values) -> tuple[Values, Values]:
    """Return the smoothed sign of a speed and its derivative."""
    share = np.asarray(speed / SMOOTHING_SPEED)
    if np.abs(share).min(initial=np.inf) > _WHOLE:
        return np.copysign(1.0, share), np.zeros_like(share)
    value = np.tanh(share)
    return value, (1.0 - value**2) / SMOOTHING_SPEED


@dataclass(frozen=True)
class CoulombFriction(Aperiodic):
    """T = level sign(speed); level in N.m."""

    level: float

    def __post_init__(self) -> None:
        real_number("coulomb_friction.level", self.level)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        sign, slope = smoothed_sign(state.speed)
        return Response(self.level * sign, damping=self.level * slope)

    @property
    def breakaway(self) -> float:
        """The level, N.m."""
        return max(self.level, 0.0)

    @property
    def constant(self) -> float:
        """The level, N.m."""
        return abs(self.level)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(f"level * {SIGN}")

    @property
    def lumped(self) -> Lumped:
        """The level."""
        return Lumped(level=self.level)


def _constant(sizes: Sizes) -> list[Guess]:
    """Guess dry friction, of three sizes where a sweep shows it.

    There the loop of a small friction has another shape than that of a large one: after each
    turning point the port is held until twice the level is overcome.
    """
    level = unknown("level", 0.0, sizes.largest, sizes.force)
    shares = (1.0, 0.3, 0.1) if sizes.swept else (1.0,)
    return [Guess((level,), [(share * sizes.force,) for share in shares])]


register(
    Effect(
        "coulomb_friction",
        CoulombFriction,
        FRICTION_PORTS,
        {"level": "torque"},
        "Dry friction at the {port}: a {force} that does not depend on speed.",
        _constant,
        special_case_of=(
            "stribeck_friction",
            "hysteresis",
            "position_dependent_friction",
            "nonlinear_drag/sublinear",
        ),
        forms="curve_of_speed",
        constant_one_way=True,
        lags=True,
    )
)


@dataclass(frozen=True)
class StribeckFriction(CoulombFriction):
    """T = (level + excess exp(-(speed / fading)^2)) sign(speed).

    Level and excess in N.m; fading in rad/s. Armstrong-Helouvry, Dupont, Canudas de Wit,
    Automatica 30 (1994), with the Gaussian form of the curve.
    """

    excess: float
    fading: float

    def __post_init__(self) -> None:
        real_number("stribeck_friction.level", self.level)
        real_number("stribeck_friction.excess", self.excess)
        real_number("stribeck_friction.fading", self.fading, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        sign, slope = smoothed_sign(state.speed)
        ratio = state.speed / self.fading
        extra = self.excess * np.exp(-(ratio**2))
        falling = -2.0 * ratio / self.fading * extra * sign
        return Response((self.level + extra) * sign, damping=falling + (self.level + extra) * slope)

    @property
    def breakaway(self) -> float:
        """Level and excess, N.m."""
        return max(self.level + self.excess, 0.0)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(f"(level + excess * exp(-((speed / fading) ** 2))) * {SIGN}")

    @property
    def lumped(self) -> Lumped:
        """The level."""
        return Lumped(
            level=self.level,
            missing=f"the level alone; {self.excess:.4g} more at rest, falling over a speed of "
            f"{self.fading:.4g}, is left out",
        )


def _falling(sizes: Sizes) -> list[Guess]:
    """Guess friction that falls with the speed, slowly or before the port moves fast."""
    speed, force = sizes.speed, sizes.force
    unknowns = (
        unknown("level", 0.0, sizes.largest, force, may_vanish=True),
        unknown("excess", 0.0, sizes.largest, 0.3 * force),
        unknown("fading", 0.005 * speed, speed, 0.1 * speed),
    )
    return [Guess(unknowns, [(force, 0.3 * force, share * speed) for share in (0.02, 0.06, 0.2)])]


register(
    Effect(
        "stribeck_friction",
        StribeckFriction,
        FRICTION_PORTS,
        {"level": "torque", "excess": "torque", "fading": "speed"},
        "Dry friction at the {port} that falls with speed.",
        _falling,
        # At the output only the friction itself shows, over a range of speeds N times as narrow.
        sought=("input",),
        forms="curve_of_speed",
        lags=True,
    )
)


@dataclass(frozen=True)
class NonlinearDrag(Aperiodic):
    """T = coefficient ``speed |speed|`` (``|speed|`` / reference)^(exponent - 2).

    Exponent 2 is quadratic drag, whatever the reference. Grease that thins as it is sheared, and
    rolling bearings, whose torque grows with the power 2/3 (Palmgren, Ball and Roller Bearing
    Engineering, 1959), have exponents below 1. Exponent 1 is a machine's own damping.

    Attributes
    ----------
    coefficient : float
        Coefficient of the quadratic drag with the same torque at the reference speed, N.m.s2/rad2.
    exponent : float
        Power of the speed with which the torque grows.
    reference : float
        rad/s.
    """

    coefficient: float
    exponent: float = 2.0
    reference: float = 1.0

    def __post_init__(self) -> None:
        real_number("nonlinear_drag.coefficient", self.coefficient)
        real_number("nonlinear_drag.exponent", self.exponent, above=0.0)
        real_number("nonlinear_drag.reference", self.reference, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        # Below exponent 1 the slope at rest would be infinite: it is that at the smoothing speed.
        smoothing = SMOOTHING_SPEED if self.exponent < 1.0 else _NEGLIGIBLE_SPEED
        size = np.hypot(state.speed, smoothing)
        damping = self.coefficient * self.reference * (size / self.reference) ** (self.exponent - 1)
        share = state.speed / size
        slope = damping * (1.0 + (self.exponent - 1.0) * share**2)
        return Response(damping * state.speed, damping=slope)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(
            f"coefficient * speed * reference * (sqrt(speed ** 2 + ({SMOOTHING_SPEED} "
            f"if exponent < 1 else {_NEGLIGIBLE_SPEED}) ** 2) / reference) ** (exponent - 1)"
        )

    @property
    def lumped(self) -> Lumped:
        """A straight line up to the reference."""
        return closest_line(self, self.reference)


def _drag(sizes: Sizes) -> list[Guess]:
    """Guess drags by their torque at the largest speed, with exponents above and below 1.

    Exponents near 1 are left out, where a drag is the damping of the port, and those below a
    quarter, where it is dry friction: it takes sixteen times the speed to double.
    """
    speed = sizes.speed

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        level, exponent = values
        return (NonlinearDrag(level / speed**2, exponent, speed),)

    level = unknown("level", 0.0, sizes.largest, sizes.force)
    faster, slower = unknown("exponent", 1.2, 4.0, 2.0), unknown("exponent", 0.25, 0.85, 0.6)
    starts = [(level.start, power) for power in (0.6, 0.35)]
    sentence = "A friction at the {port} that grows, but slower than the speed."
    return [
        Guess((level, faster), [(level.start, power) for power in (2.0, 3.0, 1.5)], build),
        Guess((level, slower), starts, build, form="sublinear", sentence=sentence),
        shear_thinning(level, speed),
    ]


register(
    Effect(
        "nonlinear_drag",
        NonlinearDrag,
        FRICTION_PORTS,
        {"coefficient": "quadratic drag", "exponent": "", "reference": "speed"},
        "A drag at the {port} that grows faster than the speed.",
        _drag,
        # At the output it would have to be N times as large, as Stribeck friction.
        sought=("input",),
        of_fit={"level": "torque", "thinning": "speed"},
        forms="curve_of_speed",
        slows=True,
    )
)


@dataclass(frozen=True)
class PeriodicFriction(Periodic):
    """T = level cos(order angle + phase) sign(speed); level in N.m."""

    level: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("position_dependent_friction.level", self.level)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        sign, slope = smoothed_sign(state.speed)
        level = self.level * self.cosine(state)
        return Response(level * sign, damping=level * slope)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(f"level * cos(order * angle + phase) * {SIGN}")


def _varying(sizes: Sizes) -> list[Guess]:
    """Guess friction that varies about a mean, which is Coulomb's.

    It has to have one: a friction that is negative for half of a turn is a torque ripple.
    """
    guesses = []
    for family in sizes.varying:
        mean = unknown("mean", 0.0, sizes.largest, sizes.force, linear=True)
        unknowns = (*family.waves("level", sizes.largest, sizes.residual), mean)

        def build(values: Sequence[float], family: Family = family) -> tuple[Law, ...]:
            lines = family.lines(values[:-1])
            varying = [PeriodicFriction(order, phase, level) for order, level, phase in lines]
            return (*varying, CoulombFriction(values[-1]))

        guesses.append(Guess(unknowns, starts_along_each(unknowns), build, family, family.form))
    return guesses


register(
    Effect(
        "position_dependent_friction",
        PeriodicFriction,
        FRICTION_PORTS,
        {"order": "", "phase": "angle", "level": "torque"},
        "Friction that varies with the position of the {port}, order {order}.",
        _varying,
        of_fit={"mean": "torque"},
        forms="curve_of_speed_and_angle",
    )
)
