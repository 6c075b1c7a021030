"""Friction that grows with the load that a port passes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.friction import SIGN, smoothed_sign
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class LoadFriction(Aperiodic):
    """T = share ``|load|`` (``|load|`` / reference)^(exponent - 1) sign(speed).

    The load is that of `PortState`. Exponent 1 is friction in proportion, whatever the reference;
    one elastic contact has 2/3 (Archard, Proceedings of the Royal Society A 243, 1957).

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
    exponent : float
        Power of the load with which the friction grows.
    reference : float
        Load at which the shares hold, N.m; in a verdict the largest of the records.
    """

    loaded: ClassVar[bool] = True
    share: float
    driven_share: float
    exponent: float = 1.0
    reference: float = 1.0

    def __post_init__(self) -> None:
        real_number("load_dependent_friction.share", self.share)
        real_number("load_dependent_friction.driven_share", self.driven_share)
        real_number("load_dependent_friction.exponent", self.exponent, above=0.0)
        real_number("load_dependent_friction.reference", self.reference, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents.

        Raises
        ------
        InvalidInput
            Where the solver does not know the load.
        """
        load = state.known_load("load_dependent_friction", "input")
        sign, slope = smoothed_sign(state.speed)
        if self.exponent != 1.0:
            size = np.abs(load) / self.reference
            load = self.reference * np.copysign(size**self.exponent, load)
        mean = (self.share + self.driven_share) / 2.0 * np.abs(load)
        # The product of load and sign is positive while the load opposes the motion.
        uneven = (self.share - self.driven_share) / 2.0 * load
        torque = mean * sign + uneven * sign**2
        return Response(torque, damping=(mean + 2.0 * uneven * sign) * slope)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        size = "reference * (abs(load) / reference) ** exponent"
        mean, uneven = "(share + driven_share) / 2", "(share - driven_share) / 2"
        return Formula(f"{size} * ({mean} * {SIGN} + {uneven} * sign(load) * {SIGN} ** 2)")


def _shares(sizes: Sizes) -> list[Guess]:
    """Guess one share, and another for loads that drive where records hold both kinds.

    In place of a friction in proportion, also one by another power of the load.
    """
    if sizes.load == 0.0:
        return []
    names = ("share", "driven_share") if sizes.driven else ("share",)
    shares = tuple(unknown(name, 0.0, 1.0, 0.1) for name in names)

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (LoadFriction(values[0], values[-1]),)

    def power(values: Sequence[float]) -> tuple[Law, ...]:
        *of_load, exponent = values
        return (LoadFriction(of_load[0], of_load[-1], exponent, sizes.load),)

    starts = [(0.1, 0.1), (0.1, 0.0)] if sizes.driven else [(0.1,)]
    return [
        Guess(shares, starts, build),
        Guess(
            (*shares, unknown("exponent", 0.5, 2.0, 1.0)),
            [(*start, 1.0) for start in starts],
            power,
            form="power",
            sentence="Friction at the {port} that grows with a power of the load.",
            instead_of=("load_dependent_friction",),
        ),
    ]


register(
    Effect(
        "load_dependent_friction",
        LoadFriction,
        ("input",),
        {"share": "", "driven_share": "", "exponent": "", "reference": "torque"},
        "Friction at the {port} that grows with the load.",
        _shares,
        forms="power_of_load",
        with_load=True,
    )
)
