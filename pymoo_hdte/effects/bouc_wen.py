"""Hysteresis of Bouc and Wen: a smooth loop, which forgets gradually."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Aperiodic, PortState, Response, Values
from pymoo_hdte.effects.portable import PRESLIDING, Formula, Lumped
from pymoo_hdte.effects.smooth_loop import Rise, follow, rise_of, slope_of, state_at, way_to
from pymoo_hdte.effects.unknowns import Parameter, unknown


@dataclass(frozen=True)
class BoucWen(Aperiodic):
    """T = force z with dz/dx = (1 - ``|z|`` ^ exponent (share sgn(z x') + 1 - share)) / torsion.

    From rest the torque rises with the slope force / torsion and nears ``force``, with a sharper
    corner for a larger exponent. Back from there it begins to fall with 2 share of that slope: with
    1/2 it falls along a straight line, with 1 and exponent 1 the law is Dahl's friction. Small
    loops under a load do not close: they creep until their mean is as good as zero, so that a
    motion that repeats itself long enough has forgotten how it began.
    Bouc, Proc. 4th Conference on Nonlinear Oscillation, Prague (1967); Wen, J. Engineering
    Mechanics Division 102 (1976).

    Attributes
    ----------
    force : float
        Largest torque, N.m.
    torsion : float
        Torsion of yield, rad.
    exponent, share : float
        Dimensionless; the share is beta / (beta + gamma) of the literature, which has exponents of
        1 and more and, where no loop may give more than it took, shares from 1/2 on (Erlicher and
        Point, Mathematical Models and Methods in Applied Sciences 14, 2004).

    Raises
    ------
    InvalidInput
        For a number that is not finite, a torsion that is not above 0, an exponent outside 0.5 to
        8, or a share that is not above 0 (at 0 nothing would be lost) or above 2.
    """

    states: ClassVar[int] = 1
    force: float
    torsion: float
    exponent: float = 1.0
    share: float = 0.5

    def __post_init__(self) -> None:
        real_number("bouc_wen_hysteresis.force", self.force)
        real_number("bouc_wen_hysteresis.torsion", self.torsion, above=0.0)
        real_number("bouc_wen_hysteresis.exponent", self.exponent, at_least=0.5, at_most=8.0)
        real_number("bouc_wen_hysteresis.share", self.share, above=0.0, at_most=2.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents along the whole path of the port, from rest."""
        z, slope, _ = self._along(state.path(state.position), state.recurs)
        stiffness = self.force / self.torsion
        return Response(state.back(self.force * z), state.back(stiffness * slope))

    def recall(self, path: Values) -> tuple[Values, Values]:
        """Return how the torque along paths that recur depends on the step before and its way."""
        _, slope, retained = self._along(path, True)
        return retained[None], self.force / self.torsion * slope[None]

    def _along(self, path: Values, recurs: bool) -> tuple[Values, Values, Values]:
        """Return z, its slope by the way in torsions of yield, and by z a step before."""
        path = np.ascontiguousarray(path) / self.torsion
        z, slope, retained = np.empty(path.shape), np.empty(path.shape), np.empty(path.shape)
        follow(path, recurs, self._rise, z, slope, retained)
        return z, slope, retained

    # Kept, as integrators ask for it in every step.
    @cached_property
    def _rise(self) -> Rise:
        return rise_of(self.exponent, self.share)

    # Its one state is z as a torsion: z times the torsion of yield.

    def rates(self, speed: float, kept: Values) -> Values:
        """Return how fast the state changes, (1,), for an integrator that keeps it."""
        return np.array([speed * self._slope(kept, speed)])

    def torque(self, kept: Values) -> float:
        """Return the torque of a state (1,), N.m."""
        return self.force / self.torsion * float(kept[0])

    def moved(self, kept: Values, way: float) -> Values:
        """Return the state (1,) after a way (rad) without reversal."""
        side = math.copysign(1.0, way)
        begin = way_to(side * self._z(kept), self._rise)
        return np.array(
            [side * self.torsion * state_at(begin + abs(way) / self.torsion, self._rise)[0]]
        )

    def tangent(self, kept: Values, direction: float) -> float:
        """Return the slope of the torque in a direction."""
        return self.force / self.torsion * self._slope(kept, direction)

    def _slope(self, states: Values, direction: float) -> float:
        return float(
            slope_of(math.copysign(1.0, direction) * self._z(states), self.exponent, self.share)
        )

    def _z(self, states: Values) -> float:
        # An integrator may leave the range of the state by its error.
        return min(max(float(states[0]) / self.torsion, -1.0), 1.0)

    @property
    def creep(self) -> float:
        """All of the force, N.m: a load winds it up, and small loops let it fade."""
        return abs(self.force)

    @property
    def shortest(self) -> float:
        """The torsion of yield, rad."""
        return self.torsion

    @property
    def formula(self) -> Formula:
        """Its equations, with z as a torsion."""
        size = "min(abs(wound) / torsion, 1) ** exponent"
        rate = f"speed * (1 - {size} * (share * sign(wound * speed) + 1 - share))"
        return Formula("force / torsion * wound", {"wound": rate})

    @property
    def lumped(self) -> Lumped:
        """Dry friction of the largest force."""
        return Lumped(level=self.force, missing=PRESLIDING.format(self.torsion))


def bouc_wen(force: Parameter, torsion: Parameter, starts: Sequence[tuple[float, ...]]) -> Guess:
    """Guess a smooth loop, in the place of springs that slip.

    Exponent and share may go beyond what the literature has, by what noise may make of 1 and 1/2.

    Parameters
    ----------
    force, torsion : Parameter
        Force and torsion of the springs, N.m and rad.
    starts : sequence of (float, float)
        Forces and torsions from which fits of springs start, the typical torsion among them.
    """
    exponent, share = unknown("exponent", 0.6, 4.0, 1.5), unknown("share", 0.3, 1.5, 0.6)
    # In the place of springs only the first is tried.
    typical_first = sorted(starts, key=lambda start: start[1] != torsion.start)
    sentence = (
        "The {force} at the {port} lags behind the motion in a smooth loop, of Bouc and Wen's form "
        "or Dahl's, which forgets gradually: it creeps after each change of the load, and how much "
        "of that is left when a record begins is not known."
    )
    return Guess(
        (force, torsion, exponent, share),
        [(*start, exponent.start, share.start) for start in typical_first],
        _built,
        form="bouc_wen",
        sentence=sentence,
        instead_of=("hysteresis",),
    )


def _built(values: Sequence[float]) -> tuple[BoucWen]:
    return (BoucWen(*values),)


register(
    Effect(
        "bouc_wen_hysteresis",
        BoucWen,
        ("mesh",),
        {"force": "torque", "torsion": "angle", "exponent": "", "share": ""},
        "The {force} at the {port} lags behind the motion in a smooth loop that forgets gradually.",
        # A verdict tells it as a form of that.
        special_case_of=("hysteresis",),
        form_of="hysteresis",
    )
)
