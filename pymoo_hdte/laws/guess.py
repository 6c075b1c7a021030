"""What an effect could be, guessed from the sizes of a port before anything is fitted there.

An effect answers with guesses, which are what candidates of the discrepancy workflow are made of.
One guess serves every machine: it knows a machine by its `Sizes` only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from pymoo_hdte.laws.unknowns import Family, Parameter, Values, harmonics_among


@dataclass(frozen=True)
class Sizes:
    """What is known of a port before anything is fitted there; SI, N or N.m as the port has it.

    Attributes
    ----------
    force : float
        Typical size of a force that may be missing there.
    residual : float
        What the base leaves of the balance there. Of a line nothing in the base takes up a part, so
        that this is its size, while ``force`` is larger where the base takes up most of a force.
    largest : float
        The largest that may be missing.
    speed : float
        Largest speed of the port.
    travel : float
        Largest deflection from the middle of its motion.
    stiffness, damping : float
        Of the spring and the damper that are believed to stand there; 0 without.
    both_ways : bool
        Whether records move it in both directions.
    loaded : bool
        Whether records hold it under steady loads, so that corners of its spring show.
    read : bool
        Whether it is the reading of a force sensor.
    slower : float
        Turns of the machine's reference shaft per turn of the port, 1 where there is no such shaft.
    expected : tuple of float
        Orders of the port's own angle at which its parts vary by their making.
    seen : tuple of float
        Orders at which records show something; per turn of the reference shaft.
    shown : tuple of float
        All orders at which records could: further harmonics would be guesses.
    together : bool
        Whether what varies at all orders that are seen is looked for as one effect.
    """

    force: float
    residual: float
    largest: float
    speed: float
    travel: float
    stiffness: float = 0.0
    damping: float = 0.0
    both_ways: bool = True
    loaded: bool = False
    read: bool = False
    slower: float = 1.0
    expected: tuple[float, ...] = ()
    seen: tuple[float, ...] = ()
    shown: tuple[float, ...] = ()
    together: bool = False

    def family(self, order: float, most: int = 2) -> Family:
        """Return an order of the port with those of its first ``most`` harmonics that show."""
        count = harmonics_among(self.shown, order / self.slower, most)
        return Family(tuple(multiple * order for multiple in range(1, count + 1)))

    @property
    def varying(self) -> list[Family]:
        """Orders at which the making of the port may let it vary, or else all that are seen."""
        if self.together:
            return self.lines
        return [self.family(order) for order in self.expected]

    @property
    def lines(self) -> list[Family]:
        """Orders that are seen, each with its harmonics, or all in one."""
        if self.together:
            return [Family(self.seen, harmonic=False)] if self.seen else []
        return [self.family(order * self.slower) for order in self.seen]


@dataclass(frozen=True)
class Guess:
    """One form in which an effect may be there.

    Attributes
    ----------
    unknowns : tuple of Parameter
        The first is the strength, the others are shapes, unless all of them are linear.
    starts : sequence of sequence of float
        Values from which fits begin; the typical ones where there are none.
    build : callable, optional
        From values to laws (or what else the effect is in a drive), (n,) to a tuple. By default
        the one law whose numbers the unknowns are, by name.
    family : Family, optional
        Orders at which it varies.
    form : str
        In a word, where there are several forms.
    sentence : str
        Instead of that of the effect.
    name : str
        Under which it stands in place of the effect, and no verdict names it: what a campaign
        cannot tell from the machine.
    """

    unknowns: tuple[Parameter, ...]
    starts: Sequence[Sequence[float]] = ()
    build: Callable[[Values], tuple[Any, ...]] | None = None
    family: Family | None = None
    form: str = ""
    sentence: str = ""
    name: str = ""

    @property
    def begins(self) -> tuple[tuple[float, ...], ...]:
        """Where fits begin."""
        given = tuple(tuple(start) for start in self.starts)
        return given or (tuple(one.start for one in self.unknowns),)
