"""A torque ripple of the motor: a force at an order of its position that acts on the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Law, Periodic, PortState, Response
from pymoo_hdte.effects.unknowns import Family, starts_along_each


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
        """Its phasor, N.m: the torque is the motor's."""
        return complex(self.amplitude * np.exp(1j * self.phase))


def _ripple(sizes: Sizes) -> list[Guess]:
    found = []
    for family in sizes.lines:
        unknowns = family.waves("amplitude", sizes.largest, sizes.residual)

        def build(values: Sequence[float], family: Family = family) -> tuple[Law, ...]:
            lines = family.lines(values)
            return tuple(PeriodicTorque(order, phase, size) for order, size, phase in lines)

        found.append(Guess(unknowns, starts_along_each(unknowns), build, family, family.form))
    return found


register(
    Effect(
        "torque_ripple",
        PeriodicTorque,
        ("input",),
        {"order": "", "phase": "angle", "amplitude": "torque"},
        "A ripple at the {port}, order {order} of its position, that acts on the motion.",
        _ripple,
        exact=True,
    )
)
