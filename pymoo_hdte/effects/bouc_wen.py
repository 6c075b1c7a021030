"""Hysteresis of Bouc and Wen: a smooth loop, which forgets gradually."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.compilation import compiled
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, PortState, Response, Values
from pymoo_hdte.effects.unknowns import unknown

_STEP = 0.04
"""Ways between the states that are integrated, in torsions of yield: errors of the state stay below
1e-6."""
_STEPS = 1000
"""Of them: after forty torsions of yield nothing is left of where it began, to the last digit."""
_FLAT = 1e-12
"""Slope below which a state is that of the end of the rise."""
_UNCHANGED = 1e-10
"""Share of the force by which a passage may still change a state that repeats itself."""
_PASSAGES = 50


@dataclass(frozen=True)
class BoucWen(Aperiodic):
    """T = force z, dz/dx = (1 - ``|z|``^exponent (share sgn(z x') + 1 - share)) / torsion.

    From rest the torque rises with the slope force / torsion and nears ``force``, the sooner the
    larger the exponent. Back from there it falls 2 share times as steeply to zero: with 1/2 along a
    straight line, with 1 and exponent 1 it is Dahl's friction. Small loops under a load do not
    close; they creep until their mean is as good as zero, so that a steady motion that repeats has
    forgotten how it began.
    Bouc, Proc. 4th Conference on Nonlinear Oscillation, Prague (1967); Wen, J. Engineering
    Mechanics Division 102 (1976).

    Attributes
    ----------
    force : float
        Largest torque, N.m.
    torsion : float
        Torsion of yield, rad.
    exponent, share : float
        Dimensionless; the share is beta / (beta + gamma) of the literature.

    Raises
    ------
    InvalidInput
        For a number that is not finite, a torsion that is not above 0, an exponent below 1, or a
        share outside 0 to 1 or of 0, with which nothing would be lost.
    """

    states: ClassVar[int] = 1
    force: float
    torsion: float
    exponent: float = 1.0
    share: float = 0.5

    def __post_init__(self) -> None:
        real_number("bouc_wen_hysteresis.force", self.force)
        real_number("bouc_wen_hysteresis.torsion", self.torsion, above=0.0)
        real_number("bouc_wen_hysteresis.exponent", self.exponent, at_least=1.0)
        real_number("bouc_wen_hysteresis.share", self.share, above=0.0, at_most=1.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents along the whole path of the port, from rest."""
        z, slope, _ = self._along(state.path(state.position), state.recurs)
        stiffness = self.force / self.torsion
        return Response(state.back(self.force * z), state.back(stiffness * slope))

    def recall(self, path: Values) -> tuple[Values, Values]:
        """Return how the torque along paths that recur depends on the step before and its way."""
        _, slope, kept = self._along(path, True)
        return kept[None], self.force / self.torsion * slope[None]

    def _along(self, path: Values, recurs: bool) -> tuple[Values, Values, Values]:
        """Return z, its slope by the way in torsions of yield, and by z a step before."""
        path = np.ascontiguousarray(path) / self.torsion
        z, slope, kept = np.empty(path.shape), np.empty(path.shape), np.empty(path.shape)
        _follow(path, recurs, self._rise, z, slope, kept)
        return z, slope, kept

    # Kept, as integrators ask for it in every step.
    @cached_property
    def _rise(self) -> tuple[Values, Values, int]:
        return _rise(self.exponent, self.share)

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
        begin = _way_to(side * self._z(kept), self._rise)
        return np.array([side * self.torsion * _at(begin + abs(way) / self.torsion, self._rise)[0]])

    def tangent(self, kept: Values, direction: float) -> float:
        """Return the slope of the torque in a direction."""
        return self.force / self.torsion * self._slope(kept, direction)

    def _slope(self, kept: Values, direction: float) -> float:
        return float(
            _slope(math.copysign(1.0, direction) * self._z(kept), self.exponent, self.share)
        )

    def _z(self, kept: Values) -> float:
        # An integrator may leave the range of the state by its error.
        return min(max(float(kept[0]) / self.torsion, -1.0), 1.0)

    @property
    def creep(self) -> float:
        """All of the force, N.m: a load winds it up, and small loops let it fade."""
        return abs(self.force)

    @property
    def shortest(self) -> float:
        """The torsion of yield, rad."""
        return self.torsion


def bouc_wen(sizes: Sizes) -> Guess:
    """Guess a smooth loop, in the place of springs that slip."""
    travel, force = sizes.travel, sizes.force
    unknowns = (
        unknown("force", 0.0, sizes.largest, force),
        unknown("torsion", 0.003 * travel, 2.0 * travel, 0.1 * travel),
        unknown("exponent", 1.0, 4.0, 1.5),
        unknown("share", 0.05, 1.0, 0.6),
    )
    starts = [(force, share * travel, 1.5, 0.6) for share in (0.1, 0.03, 0.4)]
    return Guess(unknowns, starts, _built, form="bouc_wen", instead_of=("hysteresis",))


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
    )
)


@compiled
def _slope(z: float, exponent: float, share: float) -> float:
    """Return dz over the way of a motion towards positive z, in torsions of yield."""
    return 1.0 - (1.0 if z > 0.0 else 1.0 - 2.0 * share) * abs(z) ** exponent


@compiled
def _rise(exponent: float, share: float) -> tuple[Values, Values, int]:
    """Return z and its slope at steps of a motion towards positive z, and the step of zero.

    By the classical method of Runge and Kutta, from zero to 1 and back to -1, so that its kink at
    zero lies between steps.
    """
    z, slope = np.empty(2 * _STEPS + 1), np.empty(2 * _STEPS + 1)
    z[_STEPS], slope[_STEPS] = 0.0, 1.0
    first = _STEPS
    for way in (_STEP, -_STEP):
        now, going = 0.0, 1.0
        for step in range(1, _STEPS + 1):
            second = _slope(now + 0.5 * way * going, exponent, share)
            third = _slope(now + 0.5 * way * second, exponent, share)
            fourth = _slope(min(now + way * third, 1.0), exponent, share)
            now += way * (going + 2.0 * second + 2.0 * third + fourth) / 6.0
            now = min(now, 1.0)
            going = _slope(now, exponent, share)
            place = _STEPS + (step if way > 0.0 else -step)
            z[place], slope[place] = now, going
            if now <= -1.0:
                break
        first = min(first, place)
    return z[first:], slope[first:], _STEPS - first


@compiled
def _at(way: float, rise: tuple[Values, Values, int]) -> tuple[float, float]:
    """Return z and its slope after a way from zero along a rise: cubics between its steps."""
    z, slope, zero = rise
    steps = way / _STEP + zero
    place = int(steps)
    if place >= len(z) - 1:
        return 1.0, 0.0
    if steps < 0.0:
        return z[0], slope[0]
    s = steps - place
    start, end = _STEP * slope[place], _STEP * slope[place + 1]
    rest = z[place + 1] - z[place]
    bend, twist = 3.0 * rest - 2.0 * start - end, start + end - 2.0 * rest
    value = z[place] + s * (start + s * (bend + s * twist))
    return value, (start + s * (2.0 * bend + 3.0 * s * twist)) / _STEP


@compiled
def _way_to(z: float, rise: tuple[Values, Values, int]) -> float:
    """Return the way from zero along a rise to a state."""
    values, zero = rise[0], rise[2]
    place = max(np.searchsorted(values, z) - 1, 0)
    if place >= len(values) - 1:
        return _STEP * (place - zero)
    way = _STEP * (place - zero)
    rest = values[place + 1] - values[place]
    way += _STEP * (z - values[place]) / rest if rest > 0.0 else 0.0
    for _ in range(3):
        there, slope = _at(way, rise)
        way += (z - there) / slope if slope > _FLAT else 0.0
    return way


@compiled
def _passed(
    path: Values,
    z: float,
    before: float,
    rise: tuple[Values, Values, int],
    along: Values,
    slope: Values,
    kept: Values,
) -> float:
    """Follow a path from a state and a position; return how the last state depends on the first."""
    product, side, way = 1.0, 1.0, _way_to(z, rise)
    z, going = _at(way, rise)
    for step in range(len(path)):
        change = path[step] - before
        before = path[step]
        if change * side < 0.0:
            side = -side
            way = _way_to(side * z, rise)
            going = _at(way, rise)[1]
        first = going
        way += abs(change)
        z, going = _at(way, rise)
        z *= side
        along[step], slope[step] = z, going
        # States that differ by little stay apart as long as it takes to pass their difference.
        kept[step] = going / first if first > 0.0 else 0.0
        product *= kept[step]
    return product


@compiled
def _follow(
    path: Values,
    recurs: bool,
    rise: tuple[Values, Values, int],
    along: Values,
    slope: Values,
    kept: Values,
) -> None:
    """Follow paths (n, steps) from rest; where their second half recurs, as it does for ever."""
    rows, steps = path.shape
    half = steps // 2 if recurs else 0
    for row in range(rows):
        of_row = along[row, half:], slope[row, half:], kept[row, half:]
        if recurs and np.ptp(path[row]) > 0.0:
            _settle(path[row, half:], rise, *of_row)
        else:
            _passed(path[row, half:], 0.0, 0.0, rise, *of_row)
        for one in (along, slope, kept):
            one[row, :half] = one[row, half : 2 * half]


@compiled
def _settle(
    path: Values,
    rise: tuple[Values, Values, int],
    along: Values,
    slope: Values,
    kept: Values,
) -> None:
    """Follow a path from the state to which it returns.

    A passage leads two states nearer to each other, and keeps their order: Newton's method stays
    between states that a passage raises and lowers.
    """
    z, low, high = 0.0, -1.0, 1.0
    for _ in range(_PASSAGES):
        product = _passed(path, z, path[-1], rise, along, slope, kept)
        change = along[-1] - z
        if abs(change) <= _UNCHANGED:
            break
        if change > 0.0:
            low = z
        else:
            high = z
        z += change / (1.0 - product) if product < 1.0 else change
        if not low < z < high:
            z = 0.5 * (low + high)
