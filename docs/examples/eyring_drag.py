"""Eyring's drag as an effect of your own: everything about it in one file.

The lubricant's molecules jump over energy barriers (Eyring, Journal of Chemical Physics 4, 1936):
the drag is proportional to the speed when slow, to its logarithm when fast.
"""

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects import Aperiodic, Effect, Guess, Response, unknown


@dataclass(frozen=True)
class EyringDrag(Aperiodic):
    """T = level asinh(speed / knee); N.m and rad/s, or N and m/s."""

    level: float
    knee: float

    def __post_init__(self):
        """Refuse values that a drag cannot have."""
        real_number("eyring_drag.level", self.level)
        real_number("eyring_drag.knee", self.knee, above=0.0)

    def respond(self, state):
        """Return torque and tangents."""
        share = state.speed / self.knee
        return Response(
            self.level * np.arcsinh(share), damping=self.level / self.knee / np.hypot(1.0, share)
        )


def guess(sizes):
    """Guess the drag from what may be missing at a port and from how fast it moves."""
    force, speed = sizes.force, sizes.speed
    unknowns = (
        unknown("level", 0.0, sizes.largest, force),
        # A knee beyond all speeds would be a viscous friction.
        unknown("knee", 0.001 * speed, speed, 0.1 * speed),
    )
    return [Guess(unknowns, [(force, share * speed) for share in (0.02, 0.1, 0.4)])]


EYRING_DRAG = Effect(
    name="eyring_drag",
    law=EyringDrag,
    ports=("input", "output"),
    quantities={"level": "torque", "knee": "speed"},
    sentence="A drag at the {port} that grows with the logarithm of the speed.",
    guess=guess,
    sought=("input",),
    contains=("viscous_friction", "coulomb_friction"),
)
