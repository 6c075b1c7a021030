"""A torque ripple of motor or brake: a force at an order of the position, with the motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes, guess_of_lines
from pymoo_hdte.effects.law import Periodic, PortState, Response, Values
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.effects.unknowns import Family, is_among, is_whole


@dataclass(frozen=True)
class PeriodicTorque(Periodic):
    """A driving torque amplitude cos(order angle + phase), N.m: it acts with the motion."""

    drives: ClassVar[bool] = True
    amplitude: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("torque_ripple.amplitude", self.amplitude)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents; negative, as the driving torque does not oppose."""
        return Response(-self.amplitude * self.cosine(state))

    def line(self, load: Values) -> NDArray[np.complex128]:
        """Return its phasors, N.m; negative, as the driving torque does not oppose."""
        return np.full(np.shape(load), -self.amplitude * np.exp(1j * self.phase))

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("-amplitude * cos(order * angle + phase)")


@dataclass(frozen=True)
class CouplingTorque(PeriodicTorque):
    """The torque of a coupling whose shafts do not align; no torque of a motor, so none it reads.

    It acts between a shaft and the sensor of its torque.
    """

    drives: ClassVar[bool] = False


@dataclass(frozen=True)
class BrakeRipple(Periodic):
    """A torque share load cos(order angle + phase) of a brake, in proportion to the load it holds.

    With the sign of a load, it opposes the motion.

    Attributes
    ----------
    order : float
        Cycles per turn of the brake.
    phase : float
        rad.
    share : float
        Of the load, dimensionless.
    """

    drives: ClassVar[bool] = True
    loaded: ClassVar[bool] = True
    share: float

    def __post_init__(self) -> None:
        super().__post_init__()
        real_number("brake_ripple.share", self.share)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents.

        Raises
        ------
        InvalidInput
            Where the solver does not know the load.
        """
        load = state.known_load("brake_ripple", "load")
        return Response(self.share * load * self.cosine(state))

    def line(self, load: Values) -> NDArray[np.complex128]:
        """Return its phasors, N.m."""
        return np.asarray(self.share * np.exp(1j * self.phase) * load)

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("share * load * cos(order * angle + phase)")


def torque_line(order: float, amplitude: float, phase: float) -> PeriodicTorque:
    """Return one line of a ripple, as `guess_of_lines` asks for it."""
    return PeriodicTorque(order, phase, amplitude)


def _ripple(sizes: Sizes) -> list[Guess]:
    """Guess ripples at seen orders, behind a gear at those of two and more whole cycles in a turn.

    There nothing of a shaft has other orders, and a ripple once a turn is the same as `Gravity`. A
    coupling has both.
    """
    behind_gear = sizes.slower != 1.0
    lines = _of_shaft(sizes) if behind_gear else sizes.lines
    guesses = [
        guess_of_lines(
            family, "amplitude", sizes.largest, sizes.residual, torque_line, form=family.form
        )
        for family in lines
    ]
    if behind_gear and sizes.coupling:
        guesses.append(_of_coupling(sizes, torque_line))
    return guesses


def _of_shaft(sizes: Sizes) -> list[Family]:
    """Return the lines of two and more whole cycles in a turn of the load's shaft."""
    return [
        family
        for family in sizes.lines
        if sizes.turns and family.orders[0] > 1.5 and is_whole(family.orders[0])
    ]


def _of_coupling(sizes: Sizes, line: Callable[[float, float, float], PeriodicTorque]) -> Guess:
    """Guess what a misaligned coupling does once and twice in its turn."""
    # Shafts that are apart make the first, those at an angle the second: either may be stronger.
    family = Family(sizes.family(1.0).orders[:2], harmonic=False)
    sentence = "A coupling at the {port} is out of line: a torque once and twice in its turn."
    return guess_of_lines(
        family,
        "amplitude",
        sizes.largest,
        sizes.residual,
        line,
        form=family.form,
        sentence=sentence,
    )


def _brakes(sizes: Sizes) -> list[Guess]:
    """Guess ripples in proportion to the load, up to all of it."""
    brakes = [sizes.family(1.0), *_of_shaft(sizes)] if sizes.braked else []
    return [_of_brake(family, sizes) for family in brakes]


def _of_brake(family: Family, sizes: Sizes) -> Guess:
    def line(order: float, share: float, phase: float) -> BrakeRipple:
        return BrakeRipple(order, phase, share)

    return guess_of_lines(
        family,
        "share",
        1.0,
        sizes.residual / sizes.braked,
        line,
    )


def _cogging(sizes: Sizes) -> list[Guess]:
    """Guess the cogging of a motor with poles and slots that show all lines that records could.

    Of a known motor any of its lines is enough. Lines above all those that records analyse go with
    it where rows are averages that fold them down.
    """
    if sizes.slower != 1.0 or not sizes.coupling:
        return []
    seen = (*sizes.seen, *sizes.clear)
    families = list[Family]()
    # Several motors may differ in lines only that no record could show.
    for lines in [sizes.motor] if sizes.motor else _MOTORS:
        could_show = [order for order in lines if _could_show(sizes, order)]
        if sizes.motor:
            could_show = [order for order in could_show if is_among(seen, order)]
        if could_show and all(is_among(seen, order) for order in could_show):
            folded = [order for order in lines if is_among(sizes.folded, order)]
            families.append(Family(tuple(sorted({*could_show, *folded})), harmonic=False))
    return [
        guess_of_lines(
            family, "amplitude", sizes.largest, sizes.residual, torque_line, form=family.form
        )
        for family in dict.fromkeys(families)
    ]


def _could_show(sizes: Sizes, order: float) -> bool:
    return order < sizes.highest or is_among(sizes.shown, order)


def cogging_of(slots: int, poles: int) -> tuple[float, ...]:
    """Return the orders at which a motor cogs.

    It has the least common multiple of both and, as neither are quite even, the number of poles
    and that of slots as well (Hendershot and Miller, Design of Brushless Permanent-Magnet Machines,
    2010).

    Parameters
    ----------
    slots, poles : int
    """
    return tuple(sorted({float(poles), float(slots), float(math.lcm(poles, slots))}))


_MOTORS = tuple(
    dict.fromkeys(
        cogging_of(slots, poles)
        for slots in range(6, 25, 3)
        for poles in range(4, 29, 2)
        if poles != slots and 2 * slots <= 3 * poles <= 4 * slots
    )
)
"""Orders of each motor with concentrated windings of which nearly all of the flux is used."""
COGGING_ORDERS = tuple(sorted({order for lines in _MOTORS for order in lines}))
"""Orders at which any of these motors cogs."""


def orders_beside(seen: Sequence[float], motor: tuple[float, ...] = ()) -> set[float]:
    """Return the orders of all motors that have a line at one of some orders, or of the known one.

    Parameters
    ----------
    seen : sequence of float
    motor : tuple of float
        As of `Sizes`.
    """
    beside = [lines for lines in _MOTORS if any(is_among(seen, line) for line in lines)]
    return set(motor) if motor else {order for lines in beside for order in lines}


def _coupling(sizes: Sizes) -> list[Guess]:
    """Guess a coupling ahead of a gear; behind it, it is a ripple like any other."""

    def line(order: float, amplitude: float, phase: float) -> CouplingTorque:
        return CouplingTorque(order, phase, amplitude)

    return [_of_coupling(sizes, line)] if sizes.coupling and sizes.slower == 1.0 else []


register(
    Effect(
        "torque_ripple",
        PeriodicTorque,
        ("input", "output", "load"),
        {"order": "", "phase": "angle", "amplitude": "torque"},
        "A ripple at the {port}, order {order} of its position, that acts on the motion.",
        _ripple,
        exact=True,
        forms="harmonics_of_torque",
        nuisance_at=("output", "load"),
    )
)


register(
    Effect(
        "cogging",
        PeriodicTorque,
        ("input",),
        {"order": "", "phase": "angle", "amplitude": "torque"},
        "The motor cogs at its poles or slots: order {order} of its position.",
        _cogging,
        exact=True,
        nuisance_at=("input",),
    )
)


register(
    Effect(
        "coupling_ripple",
        CouplingTorque,
        ("input",),
        {"order": "", "phase": "angle", "amplitude": "torque"},
        "A coupling at the {port} is out of line, order {order}.",
        _coupling,
        exact=True,
        nuisance_at=("input",),
    )
)


register(
    Effect(
        "brake_ripple",
        BrakeRipple,
        ("load",),
        {"order": "", "phase": "angle", "share": ""},
        "The torque of the brake varies in its turn, order {order}, as the load does.",
        _brakes,
        exact=True,
        nuisance_at=("load",),
    )
)
