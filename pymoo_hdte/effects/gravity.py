"""Gravity at a shaft: a torque of one sine per turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Behaviour, Law, PortState, Response, Values
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import is_among, polar, starts_along_each, wave


@dataclass(frozen=True)
class Gravity(Behaviour):
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

    @property
    def orders(self) -> tuple[float, ...]:
        """Once per turn."""
        return (1.0,)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return Response(self.torque * np.cos(state.phase(1.0) + self.phase))

    def line(self, load: Values) -> NDArray[np.complex128]:
        """Return its phasors, N.m."""
        return np.full(np.shape(load), self.torque * np.exp(1j * self.phase))

    def with_input_locked(self) -> Law | None:
        """Return None: the weight of what does not turn is a constant."""
        return None

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("torque * cos(position + phase)")

    @property
    def lumped(self) -> Lumped:
        """The weight."""
        return Lumped(weight=self.torque * complex(np.exp(1j * self.phase)))


def _weight(sizes: Sizes) -> list[Guess]:
    """Guess a weight at the angle of a shaft, whose level position is not known.

    Behind a gear that is where a line is seen once in its turn.
    """
    if not sizes.turns or (sizes.slower != 1.0 and not is_among(sizes.seen, 1.0 / sizes.slower)):
        return []

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (Gravity(*polar(*values)),)

    unknowns = wave("torque", sizes.largest, sizes.force)
    return [Guess(unknowns, starts_along_each(unknowns), build)]


register(
    Effect(
        "gravity",
        Gravity,
        ("load",),
        {"torque": "torque", "phase": "angle"},
        "Gravity at the {port}: a {force} of one sine per turn.",
        _weight,
        forms="harmonics_of_torque",
        behind_gear=True,
        exact_at=("load",),
        nuisance_at=("load",),
    )
)
