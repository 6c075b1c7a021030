"""A force with a memory as an effect of your own: a rubber seal that grips before it slides.

The seal is stretched up to a largest stretch, beyond which it slides along; its force grows with
the cube of the stretch. So it depends on the way since the last reversal, which solvers keep for it
as an inner state.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects import Aperiodic, Effect, Guess, Response, unknown


@dataclass(frozen=True)
class GrippingSeal(Aperiodic):
    """T = force (stretch / slip)^3, where the stretch follows the motion but stays within slip.

    ``force`` in N.m and ``slip`` in rad, or N and m.
    """

    states: ClassVar[int] = 1
    force: float
    slip: float

    def __post_init__(self):
        """Refuse values that a seal cannot have."""
        real_number("gripping_seal.force", self.force)
        real_number("gripping_seal.slip", self.slip, above=0.0)

    def respond(self, state):
        """Return torque and tangent along the whole path of the port, from rest."""
        stretch, sticks = self._along(state.path(state.position))
        return Response(state.back(self._pull(stretch)), state.back(sticks * self._slope(stretch)))

    def recall(self, path):
        """Return how the torque depends on itself a step before, and on the way since then."""
        stretch, sticks = self._along(path)
        slope = self._slope(stretch)
        before = self._slope(np.concatenate([np.zeros_like(stretch[:, :1]), stretch[:, :-1]], 1))
        known = np.divide(slope, before, out=np.zeros_like(slope), where=before > 0.0)
        return (sticks * known)[None], (sticks * slope)[None]

    def rates(self, speed, kept):
        """Return how fast the stretch changes, (1,)."""
        slides = (np.abs(kept) >= self.slip) & (kept * speed > 0.0)
        return np.where(slides, 0.0, speed)

    def moved(self, kept, way):
        """Return the stretch, (1,), after a way without reversal."""
        return np.clip(kept + way, -self.slip, self.slip)

    def torque(self, kept):
        """Return the torque of a stretch, (1,)."""
        return float(self._pull(np.clip(kept[0], -self.slip, self.slip)))

    def tangent(self, kept, direction):
        """Return the slope of the torque, moving in a direction."""
        return float(np.abs(self.rates(direction, kept))[0] * self._slope(kept[0]))

    @property
    def shortest(self):
        """The stretch at which the seal slides, which integrators must resolve."""
        return self.slip

    def _pull(self, stretch):
        return self.force * (stretch / self.slip) ** 3

    def _slope(self, stretch):
        return 3.0 * self.force / self.slip * (stretch / self.slip) ** 2

    def _along(self, path):
        """Return stretch and state of sticking along paths, (n, steps), from rest."""
        stretch, sticks = np.empty_like(path), np.empty_like(path)
        for row, places in enumerate(path.tolist()):
            now = before = 0.0
            for step, place in enumerate(places):
                moved = now + place - before
                now, before = min(max(moved, -self.slip), self.slip), place
                stretch[row, step], sticks[row, step] = now, now == moved
        return stretch, sticks


def guess(sizes):
    """Guess the seal from what may be missing at a port and from how far it moves."""
    if not sizes.both_ways:
        return []
    force, travel = sizes.force, sizes.travel
    unknowns = (
        unknown("force", 0.0, sizes.largest, force),
        unknown("slip", 0.003 * travel, 2.0 * travel, 0.1 * travel),
    )
    return [Guess(unknowns, [(force, share * travel) for share in (0.03, 0.1, 0.4)])]


GRIPPING_SEAL = Effect(
    name="gripping_seal",
    law=GrippingSeal,
    ports=("mesh",),
    quantities={"force": "torque", "slip": "angle"},
    sentence="A seal at the {port} grips before it slides: its {force} grows with the stretch.",
    guess=guess,
    forms="slipping_springs",
    lags=True,
)
