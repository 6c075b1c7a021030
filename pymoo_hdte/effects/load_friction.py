"""Friction in proportion to the load that a port passes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.friction import smoothed_sign
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class LoadFriction(Aperiodic):
    """T = share ``|load|`` sign(speed), with the load of `PortState`.

    As with an efficiency, the share may differ with the direction of power. If nothing else rubs,
    the motor's efficiency is 1 / (1 + share) while the load opposes the motion, and that of a load
    which drives the motor is 1 - driven_share; from 1 on the drive locks. Torques that accelerate
    the output do not count: friction that follows them at every instant would rectify them.

    Attributes
    ----------
    share : float
        While the load opposes the motion, dimensionless.
    driven_share : float
        While the load drives the motion, dimensionless.
    """

    loaded: ClassVar[bool] = True
    share: float
    driven_share: float

    def __post_init__(self) -> None:
        real_number("load_dependent_friction.share", self.share)
        real_number("load_dependent_friction.driven_share", self.driven_share)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents.

        Raises
        ------
        InvalidInput
            Where the solver does not know the load.
        """
        if state.load is None:
            allowed = "the input of a drive, or a port whose load is stated"
            raise InvalidInput("port of load_dependent_friction", "of a mechanism", allowed)
        sign, slope = smoothed_sign(state.speed)
        mean = (self.share + self.driven_share) / 2.0 * np.abs(state.load)
        # The product of load and sign is positive while the load opposes the motion.
        uneven = (self.share - self.driven_share) / 2.0 * state.load
        torque = mean * sign + uneven * sign**2
        return Response(torque, damping=(mean + 2.0 * uneven * sign) * slope)


def _shares(sizes: Sizes) -> list[Guess]:
    """Guess one share, and another for loads that drive where records hold both kinds."""
    if sizes.load == 0.0:
        return []
    share = unknown("share", 0.0, 1.0, 0.1)
    if sizes.driven:
        driven = unknown("driven_share", 0.0, 1.0, 0.1)
        return [Guess((share, driven), [(0.1, 0.1), (0.1, 0.0)])]

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (LoadFriction(values[0], values[0]),)

    return [Guess((share,), build=build)]


register(
    Effect(
        "load_dependent_friction",
        LoadFriction,
        ("input",),
        {"share": "", "driven_share": ""},
        "Friction at the {port} that grows in proportion to the load.",
        _shares,
    )
)
