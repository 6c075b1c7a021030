"""Possible forms and values of an effect, guessed from the sizes of a port before a fit.

Candidates of a discrepancy analysis are made from the guesses of effects. A guess serves every
machine, which it knows by its `Sizes` only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.effects.unknowns import (
    HARMONIC_NAMES,
    Family,
    Parameter,
    Values,
    harmonics_among,
    is_among,
    starts_along_each,
)


@dataclass(frozen=True)
class Sizes:
    """Known sizes of a port before a fit; SI, N or N.m depending on the port.

    Attributes
    ----------
    force : float
        Typical size of a force that may be missing there.
    residual : float
        Residual of the base in the balance there. The base absorbs no part of a line, so that this
        is the size of a line, while ``force`` is larger where the base absorbs most of a force.
    largest : float
        Largest size of a force that may be missing there.
    speed : float
        Largest speed of the port.
    travel : float
        Largest deflection from the middle of its motion.
    stiffness, damping : float
        Stiffness and damping of the nominal spring and damper there; 0 without.
    both_ways : bool
        Whether records move it in both directions.
    loaded : bool
        Whether records hold it under steady loads, so that corners of its spring show.
    load : float
        Largest torque that the port passes on; 0 where solvers do not know it.
    driven : bool
        Whether the load opposes the motion in some records and drives it in others.
    swept : bool
        Whether a slow load moves it to and fro at one place, as output and mesh of a drive whose
        input is locked.
    temperature : float
        Mean of the records, K, where their temperatures spread enough to show what depends on them;
        0 elsewhere.
    turns : bool
        Whether its position is the angle of a shaft at which gravity may pull.
    read : bool
        Whether it is the reading of a force sensor.
    slower : float
        Turns of the machine's reference shaft per turn of the port, 1 where there is no such shaft.
    expected : tuple of float
        Orders of the port's own angle at which its parts vary by design or manufacture.
    seen : tuple of float
        Orders with significant lines in the records; per turn of the reference shaft.
    clear : tuple of float
        All of them, where ``seen`` holds the strongest only: the others are sought as harmonics.
    shown : tuple of float
        All orders at which records could show lines; further harmonics could not be determined.
    together : bool
        Whether the variation at all seen orders is searched for as one effect.
    coupling : bool
        Whether a coupling of a bench, which may be out of line, sits between the port and the
        sensor of its torque.
    highest : float
        Order below which records show every significant line; per turn of the reference shaft.
    motor : tuple of float
        Orders at which the motor is known to cog; empty where it is not known.
    folded : tuple of float
        Orders above those of ``shown`` that averaging folds down onto these in some record.
    braked : float
        Largest load, N.m, of a port where a brake holds it; 0 elsewhere.
    between : bool
        Whether the port lies between two measured angles: its position is the torsion of a gear,
        and what is periodic there varies with the angle of its input.
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
    load: float = 0.0
    driven: bool = False
    swept: bool = False
    temperature: float = 0.0
    turns: bool = False
    read: bool = False
    slower: float = 1.0
    expected: tuple[float, ...] = ()
    seen: tuple[float, ...] = ()
    clear: tuple[float, ...] = ()
    shown: tuple[float, ...] = ()
    together: bool = False
    coupling: bool = False
    highest: float = 0.0
    motor: tuple[float, ...] = ()
    folded: tuple[float, ...] = ()
    braked: float = 0.0
    between: bool = False

    def family(self, order: float, most: int = 2) -> Family:
        """Return an order of the port with its harmonics: what varies with an angle is no cosine.

        It has its first ``most`` in ``shown``, and further ones up to the fifth that are seen: a
        rounded trapezoid has the third and the fifth.
        """
        relative_order = order / self.slower
        count = harmonics_among(self.shown, relative_order, most)
        further = range(count + 1, len(HARMONIC_NAMES) + 1)
        clear = set(self.shown) & {*self.seen, *self.clear}
        multiples = [
            *range(1, count + 1),
            *(k for k in further if is_among(clear, k * relative_order)),
        ]
        return Family(tuple(multiple * order for multiple in multiples))

    @property
    def varying(self) -> list[Family]:
        """Orders at which the port is expected to vary, or else all that are seen."""
        if self.together:
            return self.lines
        return [self.family(order) for order in self.expected]

    @property
    def lines(self) -> list[Family]:
        """Orders that are seen, each with its harmonics, or all in one family."""
        if self.together:
            return [Family(self.seen, harmonic=False)] if self.seen else []
        return [self.family(order * self.slower) for order in self.seen]


@dataclass(frozen=True)
class Guess:
    """One form that an effect may have.

    Attributes
    ----------
    unknowns : tuple of Parameter
        The first is the strength, the others are shapes, unless all of them are linear.
    starts : sequence of sequence of float
        Values from which fits start; by default the typical ones.
    build : callable, optional
        Maps values (n,) to a tuple of laws (or other changes of a drive). By default the one law
        whose numbers are the unknowns, by name.
    family : Family, optional
        Orders at which the effect varies.
    form : str
        Word for the form, where there are several.
    sentence : str
        Replaces that of the effect.
    instead_of : tuple of str
        Names of the effects in whose place alone it is tried: what a small motion may not tell from
        them, and what several effects together would be.
    name : str
        Replaces that of the effect, and no verdict names it: for what a campaign cannot separate
        from the machine.
    among : int
        Number of guesses from which it differs by a number only that no fit follows, as the time of
        a change; itself counted.
    quantities : mapping of str to str
        Of its unknowns, where they are other ones than the effect states: an error of a reading has
        the unit of what is read.
    """

    unknowns: tuple[Parameter, ...]
    starts: Sequence[Sequence[float]] = ()
    build: Callable[[Values], tuple[Any, ...]] | None = None
    family: Family | None = None
    form: str = ""
    sentence: str = ""
    instead_of: tuple[str, ...] = ()
    name: str = ""
    among: int = 1
    quantities: Mapping[str, str] = field(default_factory=dict)

    @property
    def begins(self) -> tuple[tuple[float, ...], ...]:
        """Values from which fits start."""
        given = tuple(tuple(start) for start in self.starts)
        return given or (tuple(parameter.start for parameter in self.unknowns),)


def guess_of_lines(
    family: Family,
    strength: str,
    largest: float,
    typical: float,
    line: Callable[[float, float, float], Any],
    *,
    form: str = "",
    sentence: str = "",
    name: str = "",
    quantities: Mapping[str, str] = MappingProxyType({}),
) -> Guess:
    """Return a guess of what is no more than lines at the orders of a family.

    Parameters
    ----------
    family : Family
    strength : str
        Name of the amplitude of a line.
    largest, typical : float
        Amplitudes.
    line : callable
        Maps order, amplitude and phase to a law (or another change of a drive).
    form, sentence, name : str
    quantities : mapping of str to str
        As of `Guess`.
    """
    unknowns = family.waves(strength, largest, typical)

    def build(values: Values) -> tuple[Any, ...]:
        return tuple(line(*numbers) for numbers in family.lines(values))

    starts = starts_along_each(unknowns)
    return Guess(unknowns, starts, build, family, form, sentence, name=name, quantities=quantities)


def check_response(name: str, parts: Sequence[Any], sizes: Sizes) -> None:
    """Refuse laws that answer no motion of a port with numbers, one a point or one for all.

    A fit would count them as lost everywhere, and the effect as one that was tried.

    Parameters
    ----------
    name : str
        Name of the effect.
    parts : sequence
        Laws; other changes of a drive are passed over.
    sizes : Sizes
        Sizes of the port.
    """
    at = np.linspace(-1.0, 1.0, 6)[None]
    state = PortState(
        sizes.travel * at,
        sizes.speed * at,
        lambda order: order * at,
        np.array([[sizes.stiffness]]),
        load=sizes.load * at,
        temperature=300.0,
    )
    for law in (part for part in parts if hasattr(part, "respond")):
        with np.errstate(all="ignore"):
            response = law.respond(state)
        for what in ("torque", "slope", "damping"):
            value = np.asarray(getattr(response, what), dtype=float)
            if value.size not in (1, at.size) or not np.any(np.isfinite(value)):
                allowed = "finite numbers, one for each point of the motion"
                raise InvalidInput(f"{what} of {name}", value, allowed)
