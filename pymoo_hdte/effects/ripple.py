"""A torque ripple of motor or brake: a force at an order of the position, with the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes, guess_of_lines
from pymoo_hdte.effects.law import Periodic, PortState, Response
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.unknowns import is_whole


@dataclass(frozen=True)
class PeriodicTorque(Periodic):
    """A driving torque amplitude cos(order angle + phase), N.m: it acts with the motion."""

    drives: ClassVar[bool] = True
    amplitude: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("torque_ripple.amplitude", self.amplitude)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents; negative, as the driving torque does not oppose."""
        return Response(-self.amplitude * self.cosine(state))

    @property
    def driving(self) -> complex:
        """Its phasor, N.m: the torque is that of motor or brake."""
        return complex(self.amplitude * np.exp(1j * self.phase))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("-amplitude * cos(order * angle + phase)")


def torque_line(order: float, amplitude: float, phase: float) -> PeriodicTorque:
    """Return one line of a ripple, as `guess_of_lines` asks for it."""
    return PeriodicTorque(order, phase, amplitude)


def _ripple(sizes: Sizes) -> list[Guess]:
    """Guess ripples at seen orders, behind a gear at those of two and more whole cycles in a turn.

    There nothing of a shaft has other orders, and a ripple once a turn is the same as `Gravity`.
    """
    turns = [family.orders[0] for family in sizes.lines]
    return [
        guess_of_lines(
            family, "amplitude", sizes.largest, sizes.residual, torque_line, form=family.form
        )
        for family, order in zip(sizes.lines, turns, strict=True)
        if sizes.slower == 1.0 or (order > 1.5 and is_whole(order))
    ]


register(
    Effect(
        "torque_ripple",
        PeriodicTorque,
        ("input", "output", "load"),
        {"order": "", "phase": "angle", "amplitude": "torque"},
        "A ripple at the {port}, order {order} of its position, that acts on the motion.",
        _ripple,
        sought=("input", "load"),
        exact=True,
        forms="harmonics_of_torque",
    )
)
