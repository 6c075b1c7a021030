"""Laws that a drive has no name for but other mechanisms need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.laws.friction import SMOOTHING_SPEED
from pymoo_hdte.laws.law import Aperiodic, PortState, Response


@dataclass(frozen=True)
class ConstantForce(Aperiodic):
    """T = force: gravity, a bias of the amplifier, the zero of a sensor; N or N.m."""

    force: float

    def __post_init__(self) -> None:
        real_number("force_offset.force", self.force)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(np.full_like(state.position, self.force))


@dataclass(frozen=True)
class DirectionalFriction(Aperiodic):
    """T = level + viscous ``|speed|`` while it moves: half the difference of the two directions.

    ``level`` in N or N.m, ``viscous`` in force per speed. What the directions have in common is
    Coulomb's friction and the port's damping.
    """

    level: float
    viscous: float

    def __post_init__(self) -> None:
        real_number("direction_dependent_friction.level", self.level)
        real_number("direction_dependent_friction.viscous", self.viscous)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        size, sign = np.abs(state.speed), np.tanh(state.speed / SMOOTHING_SPEED)
        moving = sign**2
        slope = 2.0 * sign * (1.0 - moving) / SMOOTHING_SPEED
        force = self.level + self.viscous * size
        return Response(force * moving, damping=force * slope + self.viscous * sign * moving)


@dataclass(frozen=True)
class LinearSpring(Aperiodic):
    """T = coefficient d: a spring from position zero; N/m or N.m/rad."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("linear_stiffness.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(self.coefficient * state.position, self.coefficient)


@dataclass(frozen=True)
class LinearDamper(Aperiodic):
    """T = coefficient speed; N.s/m or N.m.s/rad."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("viscous_friction.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(self.coefficient * state.speed, damping=self.coefficient)
