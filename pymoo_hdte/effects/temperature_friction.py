"""Viscous friction that falls as the lubricant warms up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.unknowns import unknown

STEEPEST = 0.2
"""1/K. Largest rate that is looked for: it halves the friction every 3.5 K, while the viscosity of
greases and oils halves every 10 to 20 K."""


@dataclass(frozen=True)
class TemperatureFriction(Aperiodic):
    """T = coefficient (exp(-rate (temperature - reference)) - 1) speed.

    The change of a viscous friction from that at the reference, which the machine's own damping
    holds: the exponential viscosity of Reynolds (Philosophical Transactions 177, 1886). Where no
    temperature is known, it is the reference.

    Attributes
    ----------
    coefficient : float
        The viscous friction at the reference, N.m.s/rad.
    rate : float
        Share by which it falls per kelvin, 1/K.
    reference : float
        K.
    """

    warmed: ClassVar[bool] = True
    coefficient: float
    rate: float
    reference: float

    def __post_init__(self) -> None:
        real_number("temperature_dependent_friction.coefficient", self.coefficient)
        real_number("temperature_dependent_friction.rate", self.rate)
        real_number("temperature_dependent_friction.reference", self.reference, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        warmer = np.nan_to_num(np.asarray(state.temperature) - self.reference, nan=0.0)
        damping = self.coefficient * np.expm1(-self.rate * warmer)
        return Response(damping * state.speed, damping=damping)


def _thinning(sizes: Sizes) -> list[Guess]:
    """Guess how fast the believed damping falls, where the records' temperatures show it.

    How much of the damping does and how fast are one and the same over a small range.
    """
    if not (sizes.damping and sizes.temperature):
        return []
    coefficient, reference = sizes.damping, sizes.temperature

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (TemperatureFriction(coefficient, values[0], reference),)

    return [Guess((unknown("rate", 0.0, STEEPEST, 0.03),), [(0.03,), (0.1,)], build)]


register(
    Effect(
        "temperature_dependent_friction",
        TemperatureFriction,
        ("input",),
        {"coefficient": "damping", "rate": "1/K", "reference": "K"},
        "Viscous friction at the {port} that falls as the temperature rises.",
        _thinning,
        # Records at few temperatures would follow any curve of it.
        forms="as_listed",
    )
)
