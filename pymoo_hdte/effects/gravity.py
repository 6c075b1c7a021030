"""Gravity at a shaft: a torque of one sine per turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import polar, starts_along_each, wave


@dataclass(frozen=True)
class Gravity(Aperiodic):
    """T = torque cos(angle + phase): the weight of an eccentric body that turns with the port.

    Attributes
    ----------
    torque : float
        The largest one, N.m: with a level axis the weight times its distance from the axis.
    phase : float
        Minus the angle of the port at which the weight opposes a positive motion most, rad.
    """

    torque: float
    phase: float

    def __post_init__(self) -> None:
        real_number("gravity.torque", self.torque)
        real_number("gravity.phase", self.phase)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        angle = state.position + self.phase
        return Response(self.torque * np.cos(angle), -self.torque * np.sin(angle))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("torque * cos(position + phase)")

    @property
    def lumped(self) -> Lumped:
        """The weight."""
        return Lumped(weight=self.torque * complex(np.exp(1j * self.phase)))


def _weight(sizes: Sizes) -> list[Guess]:
    """Guess a weight at the angle of a shaft, whose level position is not known."""
    if not sizes.turns:
        return []

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (Gravity(*polar(*values)),)

    unknowns = wave("torque", sizes.largest, sizes.force)
    return [Guess(unknowns, starts_along_each(unknowns), build)]


register(
    Effect(
        "gravity",
        Gravity,
        (),
        {"torque": "torque", "phase": "angle"},
        "Gravity at the {port}: a {force} of one sine per turn.",
        _weight,
        behind_gear=True,
    )
)
