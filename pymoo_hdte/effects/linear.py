"""Laws for mechanisms other than a drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.friction import SIGN, smoothed_sign
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import starts_along_each, unknown

FURTHEST = 20.0
"""Largest force of a spring at position zero, in units of the largest one on its travel."""


@dataclass(frozen=True)
class ConstantForce(Aperiodic):
    """T = force: gravity, a bias of the amplifier, the zero of a sensor; N or N.m."""

    force: float

    def __post_init__(self) -> None:
        real_number("force_offset.force", self.force)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(np.full_like(state.position, self.force))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("force")

    @property
    def lumped(self) -> Lumped:
        """The force."""
        return Lumped(force=self.force)


def _offset(sizes: Sizes) -> list[Guess]:
    """Guess a constant force, which only motion in both directions separates from dry friction."""
    most = sizes.largest
    return [Guess((unknown("force", -most, most, sizes.force),))] if sizes.both_ways else []


register(
    Effect(
        "force_offset",
        ConstantForce,
        (),
        {"force": "torque"},
        "A constant {force} at the {port}: gravity, or a bias.",
        _offset,
        constant_one_way=True,
        # Ahead of a gear it is the zero of the torsion.
        behind_gear=True,
    )
)


@dataclass(frozen=True)
class DirectionalFriction(Aperiodic):
    """T = level + viscous ``|speed|`` while it moves: half the difference of the two directions.

    ``level`` in N or N.m, ``viscous`` in force per speed. The common part of the directions is
    Coulomb friction and the port's damping.
    """

    level: float
    viscous: float

    def __post_init__(self) -> None:
        real_number("direction_dependent_friction.level", self.level)
        real_number("direction_dependent_friction.viscous", self.viscous)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        size, (sign, steep) = np.abs(state.speed), smoothed_sign(state.speed)
        moving, slope = sign**2, 2.0 * sign * steep
        force = self.level + self.viscous * size
        return Response(force * moving, damping=force * slope + self.viscous * sign * moving)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula(f"(level + viscous * abs(speed)) * {SIGN} ** 2")


def _one_sided(sizes: Sizes) -> list[Guess]:
    """Guess friction that differs between the directions, if the port moves in both."""
    if not sizes.both_ways:
        return []
    force, slope = sizes.force, sizes.force / sizes.speed
    steepest = sizes.largest / sizes.speed
    unknowns = (
        unknown("level", -sizes.largest, sizes.largest, force),
        unknown("viscous", -steepest, steepest, slope),
    )
    return [Guess(unknowns, [(force, 0.0), (0.0, slope), (force, -slope)])]


register(
    Effect(
        "direction_dependent_friction",
        DirectionalFriction,
        (),
        {"level": "torque", "viscous": "damping"},
        "Friction at the {port} that is not the same in both directions.",
        _one_sided,
        constant_one_way=True,
    )
)


@dataclass(frozen=True)
class LinearSpring(Aperiodic):
    """T = coefficient d: a spring from position zero; N/m or N.m/rad."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("linear_stiffness.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(self.coefficient * state.position, self.coefficient)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("coefficient * position")

    @property
    def lumped(self) -> Lumped:
        """The spring."""
        return Lumped(stiffness=self.coefficient)


def _spring(sizes: Sizes) -> list[Guess]:
    """Guess a spring with its rest at position zero, or elsewhere where that may be gravity.

    Where a spring is believed to stand, its stiffness is a quantity of the machine.
    """
    if sizes.stiffness:
        return []
    typical, largest = sizes.force / sizes.travel, sizes.largest
    most = largest / sizes.travel
    guesses = [Guess((unknown("coefficient", 0.0, most, typical),))]
    if sizes.turns:
        # Far from zero a weak spring makes a large force there.
        unknowns = (
            unknown("coefficient", 0.0, most, typical, linear=True),
            unknown(
                *("force", -FURTHEST * largest, FURTHEST * largest, sizes.force),
                linear=True,
                may_vanish=True,
            ),
        )
        guesses.append(
            Guess(
                unknowns,
                starts_along_each(unknowns),
                _preloaded,
                form="preloaded",
                sentence="There is a spring at the {port}, its rest not at zero.",
                instead_of=("gravity",),
            )
        )
    return guesses


def _preloaded(values: Sequence[float]) -> tuple[Law, ...]:
    return (LinearSpring(values[0]), ConstantForce(values[1]))


register(
    Effect(
        "linear_stiffness",
        LinearSpring,
        (),
        {"coefficient": "stiffness"},
        "There is a spring at the {port} that the nominal model lacks.",
        _spring,
        of_fit={"force": "torque"},
        behind_gear=True,
    )
)


@dataclass(frozen=True)
class LinearDamper(Aperiodic):
    """T = coefficient speed; N.s/m or N.m.s/rad."""

    coefficient: float

    def __post_init__(self) -> None:
        real_number("viscous_friction.coefficient", self.coefficient)

    def respond(self, state: PortState) -> Response:
        """Return force and tangents."""
        return Response(self.coefficient * state.speed, damping=self.coefficient)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("coefficient * speed")

    @property
    def lumped(self) -> Lumped:
        """The damper."""
        return Lumped(damping=self.coefficient)


def _damper(sizes: Sizes) -> list[Guess]:
    typical, most = sizes.force / sizes.speed, sizes.largest / sizes.speed
    return [] if sizes.damping else [Guess((unknown("coefficient", 0.0, most, typical),))]


register(
    Effect(
        "viscous_friction",
        LinearDamper,
        (),
        {"coefficient": "damping"},
        "There is viscous friction at the {port} that the nominal model lacks.",
        _damper,
        slows=True,
    )
)
