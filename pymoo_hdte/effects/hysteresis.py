"""Rate-independent hysteresis of the torsion: springs that slip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from pymoo_hdte._compilation import compiled
from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.bouc_wen import bouc_wen
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, PortState, Response, Values
from pymoo_hdte.effects.portable import PRESLIDING, Formula, Lumped
from pymoo_hdte.effects.unknowns import Parameter, unknown

SPRINGS = 4


@dataclass(frozen=True)
class MaxwellSlip(Aperiodic):
    """Hysteresis of four springs in parallel, each of which has its own slip force.

    Their slip torsions are ``torsion`` (rad) times 1, 2, 3 and 4 quarters to the power ``spread``,
    their slip forces equal and in sum ``force`` (N.m): from rest the torque rises ever more slowly
    and stays at ``force`` beyond ``torsion``; after a reversal it follows the same curve at twice
    the scale (Masing).
    Al-Bender, Lampaert, Swevers, IEEE Trans. Automatic Control 50 (2005).

    It stands for the friction before breakaway of Dahl (Aerospace Corporation TOR-158, 1968) and of
    Canudas de Wit et al. (LuGre, IEEE Trans. Automatic Control 40, 1995) too: a loop of theirs well
    beyond slip is one of these springs to a few per cent of the force. They forget all but the last
    reversal, so that small loops tell.
    """

    states: ClassVar[int] = SPRINGS
    force: float
    torsion: float
    spread: float = 1.0

    def __post_init__(self) -> None:
        real_number("hysteresis.force", self.force)
        real_number("hysteresis.torsion", self.torsion, above=0.0)
        real_number("hysteresis.spread", self.spread, above=0.0)

    # Kept, as integrators ask for them in every step.
    @cached_property
    def _slips(self) -> Values:
        return np.asarray(self.torsion * (np.arange(1, SPRINGS + 1) / SPRINGS) ** self.spread)

    @cached_property
    def _stiffnesses(self) -> Values:
        return self.force / (SPRINGS * self._slips)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents along the whole path of the port, from rest."""
        path = np.ascontiguousarray(state.path(state.position))
        torque, slope = np.zeros(path.shape), np.zeros(path.shape)
        _pull(path, self._slips, self._stiffnesses, torque, slope)
        return Response(state.back(torque), state.back(slope))

    def recall(self, path: Values) -> tuple[Values, Values]:
        """Return how each spring's torque depends on the step before and on the way since then.

        A sticking spring keeps its torque and is stretched by the way, a slipping one has forgotten
        both. Both have shape (springs, n, steps).
        """
        _, sticking = slip_along(path, self._slips)
        return sticking, self._stiffnesses[:, None, None] * sticking

    def rates(self, speed: float, kept: Values) -> Values:
        """Return how fast the springs stretch, (4,), for an integrator that keeps their state."""
        slipping = (np.abs(kept) >= self._slips) & (kept * speed > 0.0)
        return np.where(slipping, 0.0, speed)

    def torque(self, kept: Values) -> float:
        """Return the torque of stretched springs (4,), N.m."""
        return float(self._stiffnesses @ np.clip(kept, -self._slips, self._slips))

    def moved(self, kept: Values, way: float) -> Values:
        """Return the stretch of springs (4,) after a way (rad) without reversal."""
        return np.clip(kept + way, -self._slips, self._slips)

    def tangent(self, kept: Values, direction: float) -> float:
        """Return the slope of the torque in a direction, which matters at the limit of slip."""
        return float(self._stiffnesses @ np.abs(self.rates(direction, kept)))

    @property
    def shortest(self) -> float:
        """The torsion of full slip, rad."""
        return self.torsion

    @property
    def formula(self) -> Formula:
        """Its equations, with a stretch for each spring."""
        slips = {
            f"stretch_{place}": f"(torsion * {place / SPRINGS} ** spread)"
            for place in range(1, SPRINGS + 1)
        }
        pulls = [f"max(min({one} / {slip}, 1), -1)" for one, slip in slips.items()]
        return Formula(
            f"force / {SPRINGS} * ({' + '.join(pulls)})",
            {
                one: f"0 if abs({one}) >= {slip} and {one} * speed > 0 else speed"
                for one, slip in slips.items()
            },
        )

    @property
    def lumped(self) -> Lumped:
        """Dry friction of the force at which all springs slip."""
        return Lumped(level=self.force, missing=PRESLIDING.format(self.torsion))


def _slipping(sizes: Sizes) -> list[Guess]:
    """Guess springs that slip, and a smooth loop in their place.

    In a motion without reversal both would act as dry friction.
    """
    if not sizes.both_ways:
        return []
    unknowns, starts = springs("force", sizes)
    force, torsion, _ = unknowns
    return [Guess(unknowns, starts), bouc_wen(force, torsion, [start[:2] for start in starts])]


def springs(strength: str, sizes: Sizes) -> tuple[tuple[Parameter, ...], list[tuple[float, ...]]]:
    """Return unknowns and starts of springs that slip, the sum of their forces by its name."""
    travel, force = sizes.travel, sizes.force
    unknowns = (
        unknown(strength, 0.0, sizes.largest, force),
        unknown("torsion", 0.003 * travel, 2.0 * travel, 0.1 * travel),
        unknown("spread", 0.3, 4.0, 1.5),
    )
    return unknowns, [(force, share * travel, 1.5) for share in (0.03, 0.1, 0.4)]


register(
    Effect(
        "hysteresis",
        MaxwellSlip,
        ("mesh",),
        {"force": "torque", "torsion": "angle", "spread": ""},
        "The {force} at the {port} lags behind the motion: springs that slip, or friction of "
        "Dahl's or LuGre's form, which full loops hardly tell apart. Small slow reversals under a "
        "load do: springs that slip close every small loop, the other two creep from one to the "
        "next, and LuGre's changes with the speed.",
        _slipping,
        of_fit={"exponent": "", "share": ""},
        forms="slipping_springs",
        lags=True,
    )
)


def slip_along(path: Values, slips: Values) -> tuple[Values, Values]:
    """Return stretch and state of sticking of springs that slip at ``slips`` along paths.

    ``path`` has shape (n, steps) and starts from rest; results have shape (springs, n, steps).
    """
    stretch = np.empty((len(slips), *path.shape))
    sticking = np.empty_like(stretch)
    _slip(np.ascontiguousarray(path), slips, stretch, sticking)
    return stretch, sticking


@compiled
def _followed(stretch: float, before: float, position: float, bound: float) -> tuple[float, bool]:
    """Return the stretch of a spring that has followed the path a step, and whether it sticks."""
    moved = stretch + position - before
    now = min(max(moved, -bound), bound)
    return now, now == moved


@compiled
def _slip(path: Values, slips: Values, stretch: Values, sticking: Values) -> None:
    springs, rows, steps = stretch.shape
    for row in range(rows):
        for spring in range(springs):
            now, before, bound = 0.0, 0.0, slips[spring]
            for step in range(steps):
                now, sticks = _followed(now, before, path[row, step], bound)
                stretch[spring, row, step] = now
                sticking[spring, row, step] = 1.0 if sticks else 0.0
                before = path[row, step]


@compiled
def _pull(path: Values, slips: Values, stiffnesses: Values, torque: Values, slope: Values) -> None:
    """Add torque and slope, (n, steps), of all springs; that is faster than one after the other."""
    rows, steps = path.shape
    stretch = np.zeros(len(slips))
    for row in range(rows):
        stretch[:] = 0.0
        before = 0.0
        for step in range(steps):
            for spring in range(len(slips)):
                now, sticks = _followed(stretch[spring], before, path[row, step], slips[spring])
                stretch[spring] = now
                torque[row, step] += stiffnesses[spring] * now
                if sticks:
                    slope[row, step] += stiffnesses[spring]
            before = path[row, step]
