"""Unknowns of an effect: their bounds and sizes, and lines, each described by two of them.

Amplitude and phase of a line are searched as its cosine and sine parts, in which a prediction is
close to linear; only lines whose amplitude has a tolerance are unknown by amplitude and phase. A
periodic effect includes its harmonics: a ripple of order 6 with a little of order 12 is one effect
and not two.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Values = Sequence[float]

HARMONIC_NAMES = ("", "second_", "third_", "fourth_", "fifth_")
"""Prefixes of the parameters of a line's harmonics; higher ones are lines of their own."""
_HARMONIC_SHARE = 0.2
"""Typical size of a further harmonic, as a share of the first."""
_COSINE, _SINE = "_cosine", "_sine"
"""Endings of the names of the two parts of a line."""


_OF_A_LINE = re.compile(rf"({'|'.join(filter(None, HARMONIC_NAMES))}|order_[\d.e+-]+_)")
"""How names of lines begin: of the harmonics of an order, and of orders that are no multiples."""


@dataclass(frozen=True)
class Parameter:
    """One unknown.

    Attributes
    ----------
    name : str
    start, lower, upper : float
        SI.
    scale : float
        Its natural size, the unit of the search.
    prior : float
        Standard deviation around ``start``; infinite for a parameter with bounds only.
    linear : bool
        Whether a prediction is close to linear in it: part of a line, or a level.
    open_above : bool
        Whether larger values predict nearly the same: ``upper`` is then no limit of the law.
    phase_of : str
        Name of the amplitude of the line whose phase it is; empty for other unknowns.
    may_vanish : bool
        Whether the effect is still itself with zero, and no other effect: a size beside that by
        which it is named, as a further line.
    """

    name: str
    start: float
    lower: float
    upper: float
    scale: float
    prior: float = np.inf
    linear: bool = False
    open_above: bool = False
    phase_of: str = ""
    may_vanish: bool = False

    @property
    def line(self) -> str:
        """Name of the line that it is a part of; empty for other unknowns."""
        line_name = self.name.removesuffix(_COSINE).removesuffix(_SINE)
        return "" if line_name == self.name else line_name

    @property
    def begins_line(self) -> bool:
        """Whether it is the cosine part of a line, which the sine part follows."""
        return self.name.endswith(_COSINE)

    def limited_at(self, side: float) -> bool:
        """Tell whether a value is limited that ended at a side: -1 lower, 1 upper, 0 neither."""
        return side < 0.0 or (side > 0.0 and not self.open_above)


def unknown(
    name: str,
    lower: float,
    upper: float,
    typical: float,
    linear: bool = False,
    open_above: bool = False,
    may_vanish: bool = False,
) -> Parameter:
    """Return a parameter that starts at its typical size; the arguments as of `Parameter`."""
    return Parameter(
        *(name, typical, lower, upper, abs(typical)),
        linear=linear,
        open_above=open_above,
        may_vanish=may_vanish,
    )


def wave(
    name: str, largest: float, typical: float, harmonics: Sequence[int] = (1,)
) -> tuple[Parameter, ...]:
    """Return the cosine and sine parts of a line and of its harmonics.

    Parameters
    ----------
    name : str
        Name of the amplitude.
    largest, typical : float
        Amplitudes.
    harmonics : sequence of int
        Multiples of its order from 1, the line alone, to 5.
    """
    parameters = []
    for multiple in harmonics:
        size = typical if multiple == 1 else _HARMONIC_SHARE * typical
        start = typical if multiple == 1 else 0.0
        name_of_line = f"{HARMONIC_NAMES[multiple - 1]}{name}"
        parameters += [
            Parameter(
                *(f"{name_of_line}{part}", begin, -largest, largest, size),
                linear=True,
                may_vanish=multiple > 1,
            )
            for part, begin in ((_COSINE, start), (_SINE, 0.0))
        ]
    return tuple(parameters)


def number_of(name: str) -> str:
    """Return the number of an effect that a line of it is, whichever harmonic or order.

    Parameters
    ----------
    name : str
        Name of a line or of another unknown.

    Examples
    --------
    >>> number_of("second_amplitude"), number_of("order_2.02_level"), number_of("order")
    ('amplitude', 'level', 'order')
    """
    return _OF_A_LINE.sub("", name, count=1) if _OF_A_LINE.match(name) else name


def starts_along_each(parameters: Sequence[Parameter]) -> tuple[tuple[float, ...], ...]:
    """Return one start along each unknown of a `wave`, or of other unknowns that add up."""
    sizes = np.diag([parameter.scale for parameter in parameters])
    return tuple(tuple(row) for row in sizes.tolist())


def lines_of(values: Values) -> list[tuple[float, float]]:
    """Return (amplitude, phase) of each line for the values of a `wave`."""
    return [polar(cosine, sine) for cosine, sine in np.reshape(values, (-1, 2))]


@dataclass(frozen=True)
class Family:
    """Orders at which something varies as one effect.

    Attributes
    ----------
    orders : tuple of float
        Cycles per turn of the angle of a port, or per unit of its position.
    harmonic : bool
        Whether all are multiples of the first, which then represents all of them.
    """

    orders: tuple[float, ...]
    harmonic: bool = True

    @property
    def order(self) -> float | None:
        """The order that represents all of them, if any."""
        return self.orders[0] if self.harmonic else None

    @property
    def form(self) -> str:
        """All orders in a word, if none represents them."""
        return "" if self.harmonic else "+".join(f"{order:g}" for order in self.orders)

    @property
    def words(self) -> str:
        """The orders in the words of a sentence."""
        return ", ".join(f"{order:g}" for order in self.orders[: 1 if self.harmonic else None])

    def waves(self, name: str, largest: float, typical: float) -> tuple[Parameter, ...]:
        """Return cosine and sine parts of a line at each order; the arguments as of `wave`."""
        if self.harmonic:
            multiples = [round(order / self.orders[0]) for order in self.orders]
            return wave(name, largest, typical, multiples)
        return tuple(
            replace(part, may_vanish=place > 0)
            for place, order in enumerate(self.orders)
            for part in wave(f"order_{order:g}_{name}", largest, typical)
        )

    def lines(self, values: Values) -> list[tuple[float, float, float]]:
        """Return (order, amplitude, phase) for the values of `waves`, or of the first of them."""
        return [
            (order, amplitude, phase)
            for order, (amplitude, phase) in zip(self.orders, lines_of(values), strict=False)
        ]


def harmonics_among(orders: Sequence[float], order: float, most: int) -> int:
    """Return how many of order, 2 order, 3 order, ... the ``orders`` hold; at least 1."""
    count = 1
    while count < most and is_among(orders, (count + 1) * order):
        count += 1
    return count


def is_among(orders: Iterable[float], order: float) -> bool:
    """Tell whether an order is among ``orders``, to within rounding."""
    return any(abs(order - known) < 1e-6 for known in orders)


def is_whole(order: float) -> bool:
    """Tell whether an order is a whole number of cycles, to within rounding."""
    return abs(order - round(order)) < 1e-6


def line_with_variance(
    cosine: float, sine: float, covariance: NDArray[np.float64]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return amplitude and phase of a line, each with its variance.

    ``covariance`` is that of its cosine and sine part, shape (2, 2). The variance of a phase is at
    most that of an unknown phase.
    """
    amplitude, phase = polar(cosine, sine)
    along = np.array([np.cos(phase), np.sin(phase)])
    across = np.array([-np.sin(phase), np.cos(phase)])
    sidewise = float(across @ covariance @ across)
    nothing_known = np.pi**2 / 3.0
    of_phase = sidewise / amplitude**2 if sidewise < nothing_known * amplitude**2 else nothing_known
    return (amplitude, float(along @ covariance @ along)), (phase, of_phase)


def polar(cosine: float, sine: float) -> tuple[float, float]:
    """Return amplitude and phase of cosine cos(x) - sine sin(x) = amplitude cos(x + phase)."""
    return float(np.hypot(cosine, sine)), float(np.arctan2(sine, cosine))
