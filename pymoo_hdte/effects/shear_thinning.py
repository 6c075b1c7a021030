"""Drag of a fluid that thins as it is sheared: it grows with the logarithm of the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response, closest_line
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import Parameter, unknown


@dataclass(frozen=True)
class ShearThinningDrag(Aperiodic):
    """T = level asinh(speed / thinning) / asinh(reference / thinning): a fluid of Eyring.

    Viscous damping up to the speed of ``thinning``, beyond which the torque grows by its logarithm.
    Eyring, J. Chemical Physics 4 (1936); of oil films Johnson and Tevaarwerk, Proceedings of the
    Royal Society A 356 (1977).

    Attributes
    ----------
    level : float
        Torque at the reference speed, N.m.
    thinning, reference : float
        rad/s.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or a speed that is not above 0.
    """

    level: float
    thinning: float
    reference: float

    def __post_init__(self) -> None:
        real_number("shear_thinning_drag.level", self.level)
        real_number("shear_thinning_drag.thinning", self.thinning, above=0.0)
        real_number("shear_thinning_drag.reference", self.reference, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        share = state.speed / self.thinning
        size = self.level / np.arcsinh(self.reference / self.thinning)
        slope = size / self.thinning / np.hypot(1.0, share)
        return Response(size * np.arcsinh(share), damping=slope)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("level * asinh(speed / thinning) / asinh(reference / thinning)")

    @property
    def lumped(self) -> Lumped:
        """A straight line up to the reference."""
        return closest_line(self, self.reference)


register(
    Effect(
        "shear_thinning_drag",
        ShearThinningDrag,
        ("input", "output"),
        {"level": "torque", "thinning": "speed", "reference": "speed"},
        "A drag at the {port} of a fluid that thins: it grows with the logarithm of the speed.",
        # A verdict tells it as a form of that.
        special_case_of=("nonlinear_drag",),
        form_of="nonlinear_drag",
        slows=True,
    )
)


def shear_thinning(level: Parameter, speed: float) -> Guess:
    """Guess a fluid that thins, in place of a drag by a power of the speed.

    Parameters
    ----------
    level : Parameter
        Torque of the drag at the largest speed.
    speed : float
        Largest speed, rad/s. Thinning beyond half of it would be the damping of the port, to three
        tenths of the torque; within a five-hundredth, the torque at a tenth of the speed is two
        thirds of the whole, as of dry friction beside a drag.
    """

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (ShearThinningDrag(values[0], values[1], speed),)

    thinning = unknown("thinning", 0.002 * speed, 0.5 * speed, 0.05 * speed)
    sentence = "A friction at the {port} that grows with the logarithm of the speed."
    return Guess(
        (level, thinning),
        build=build,
        form="shear_thinning",
        sentence=sentence,
        instead_of=("nonlinear_drag",),
    )
