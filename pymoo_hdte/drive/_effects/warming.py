"""Viscous friction of the input that falls as the bench warms up, where no temperature is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveSizes
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class WarmingFriction(Aperiodic):
    """T = -coefficient share (1 - exp(-elapsed / time)) speed.

    What a viscous friction loses in a session; its value at the start is the machine's own damping.
    Where the time of the session is not known, the bench has warmed up.

    Attributes
    ----------
    coefficient : float
        The viscous friction at the start, N.m.s/rad.
    share : float
        Of it, what is lost in the end; dimensionless.
    time : float
        Time constant, s.
    """

    coefficient: float
    share: float
    time: float

    def __post_init__(self) -> None:
        real_number("warming.coefficient", self.coefficient)
        real_number("warming.share", self.share)
        real_number("warming.time", self.time, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        lost = self.share * np.expm1(-np.asarray(state.elapsed) / self.time)
        damping = self.coefficient * lost
        return Response(damping * state.speed, damping=damping)

    @property
    def formula(self) -> Formula:
        """Its equations once the bench has warmed up."""
        return Formula("-coefficient * share * speed")


def _warming(sizes: Any) -> list[Guess]:
    """Guess a loss of up to all of the believed damping, early in the session or late.

    Where records have temperatures, these say more than the time.
    """
    if not isinstance(sizes, DriveSizes) or sizes.temperature:
        return []
    coefficient, duration = sizes.damping, sizes.duration
    if not (coefficient and duration):
        return []

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (WarmingFriction(coefficient, *values),)

    unknowns = (
        unknown("share", 0.0, 1.0, 0.1),
        unknown("time", duration / 20.0, 20.0 * duration, duration / 2.0),
    )
    return [Guess(unknowns, [(0.1, share * duration) for share in (0.1, 0.5, 5.0)], build)]


register(
    Effect(
        "warming",
        WarmingFriction,
        ("input",),
        {"coefficient": "damping", "share": "", "time": "time"},
        "Viscous friction at the {port} falls as the bench warms up.",
        _warming,
        forms="as_listed",
        nuisance_at=("input",),
    )
)
