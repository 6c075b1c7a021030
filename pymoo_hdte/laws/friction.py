"""Laws of torque over speed: dry friction, drag, and a torque ripple of the motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.laws.law import Aperiodic, Periodic, PortState, Response, Values

SMOOTHING_SPEED = 1e-4
"""rad/s. Dry friction follows tanh(speed / this): exact to rounding wherever a drive turns, and its
sign is undecided only below 1 % of the slowest output speed of interest (10 r/min at the input)."""


def _sign(speed: Values) -> tuple[Values, Values]:
    """Return the smoothed sign of a speed and its derivative."""
    value = np.tanh(speed / SMOOTHING_SPEED)
    return value, (1.0 - value**2) / SMOOTHING_SPEED


@dataclass(frozen=True)
class CoulombFriction(Aperiodic):
    """T = level sign(speed); level in N.m."""

    level: float

    def __post_init__(self) -> None:
        real_number("coulomb_friction.level", self.level)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        sign, slope = _sign(state.speed)
        return Response(self.level * sign, damping=self.level * slope)


@dataclass(frozen=True)
class StribeckFriction(Aperiodic):
    """T = (level + excess exp(-(speed / fading)^2)) sign(speed).

    Level and excess in N.m; fading in rad/s. Armstrong-Helouvry, Dupont, Canudas de Wit,
    Automatica 30 (1994), with the Gaussian form of the curve.
    """

    level: float
    excess: float
    fading: float

    def __post_init__(self) -> None:
        real_number("stribeck_friction.level", self.level)
        real_number("stribeck_friction.excess", self.excess)
        real_number("stribeck_friction.fading", self.fading, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        sign, slope = _sign(state.speed)
        ratio = state.speed / self.fading
        extra = self.excess * np.exp(-(ratio**2))
        falling = -2.0 * ratio / self.fading * extra * sign
        return Response((self.level + extra) * sign, damping=falling + (self.level + extra) * slope)


@dataclass(frozen=True)
class NonlinearDrag(Aperiodic):
    """T = coefficient ``speed |speed|``; N.m.s2/rad2."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("nonlinear_drag.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        size = np.abs(state.speed)
        return Response(
            self.coefficient * state.speed * size, damping=2.0 * self.coefficient * size
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
        sign, slope = _sign(state.speed)
        level = self.level * self.cosine(state)
        return Response(level * sign, damping=level * slope)


@dataclass(frozen=True)
class PeriodicTorque(Periodic):
    """A driving torque amplitude cos(order angle + phase), N.m: it acts with the motion."""

    amplitude: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("torque_ripple.amplitude", self.amplitude)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents; negative, as the driving torque does not oppose."""
        return Response(-self.amplitude * self.cosine(state))
