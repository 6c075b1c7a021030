"""A candidate: one effect that a verdict can name, with its unknowns, ranges and sentence.

A candidate turns a vector of values into effects of a model of the machine. It is made from a guess
of its effect, as `pymoo_hdte.effects.guess` describes it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.effects.effect import Effect, Place, is_contained, place_of
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.sentence_blanks import out_of_tolerance_sentence, sentence_at
from pymoo_hdte.effects.unknowns import Parameter, Values


@dataclass(frozen=True)
class Candidate:
    """One effect at one port, perhaps at one order.

    Attributes
    ----------
    name, port : str
    parameters : tuple of Parameter
        Unknowns of the effect; ``start`` is a typical strength.
    starts : tuple of tuple of float
        Values from which the joint fit starts, and the directions that the screening tries.
    build : callable
        Function from values to the effects in the model.
    sentence : str
        Description for the report.
    order : float or None
        Cycles per input turn, if the candidate has an order.
    exact : bool
        Whether its form is known exactly, so that it must explain the misfit down to the noise.
        Real curves of friction or stiffness follow those of the library only approximately.
    listed : bool
        Whether a verdict may name it. If not, it keeps the misfit that it explains from being
        attributed to another effect.
    releases : str or None
        Base parameter that it releases from its tolerance.
    released : str
        That parameter in words; empty for an effect.
    acts_at : str
        Port at which that parameter makes a torque, if it is at a port.
    covered_by, covered_at : str
        Name and port of the effect equivalent to that parameter out of tolerance, if any.
    form : str
        Name of its form, if the library holds several forms of the effect.
    remembers : bool
        Whether its force depends on the previous motion, which a model follows less exactly.
    instead_of : tuple of str
        Names of the effects that it may replace. A search does not try it otherwise.
    among : int
        Number of candidates that differ only by a number that no fit follows, itself included.
    nuisance : bool
        Whether its seat is the bench, so that it is no answer to what is missing in the machine.
    unit : callable or None
        Function from the name of an unknown, or of a line, to its SI unit.
    effect : Effect or None
        Effect from which it is made; for a base parameter out of tolerance, the equivalent effect.
    """

    name: str
    port: str
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    build: Callable[[Values], tuple[Any, ...]]
    sentence: str
    order: float | None = None
    exact: bool = False
    listed: bool = True
    releases: str | None = None
    released: str = ""
    acts_at: str = ""
    covered_by: str = ""
    covered_at: str = ""
    form: str = ""
    remembers: bool = False
    instead_of: tuple[str, ...] = ()
    among: int = 1
    nuisance: bool = False
    unit: Callable[[str], str] | None = None
    effect: Effect | None = None

    @property
    def label(self) -> str:
        """Name, form, port and order in one word."""
        order = "" if self.order is None else f"@{self.order:.4g}"
        form = f"/{self.form}" if self.form else ""
        return f"{self.name}{form}:{self.port}{order}"

    @property
    def named_effect(self) -> tuple[str, str]:
        """Name and port; for a value out of tolerance, those of the equivalent effect."""
        if self.covered_by:
            return self.covered_by, self.covered_at
        return self.name, self.port

    @property
    def is_value(self) -> bool:
        """Whether it is a value of the base, released or under the name of an effect."""
        return self.releases is not None or bool(self.effect and self.effect.covers)

    @property
    def places(self) -> frozenset[Place]:
        """Places of its effects in a drive model; each place takes one effect of a name."""
        return frozenset(place_of(effect) for effect in self.build(self.starts[0]))

    def goes_with(self, candidate: Candidate) -> bool:
        """Tell whether a drive may have both: no two effects at one place, nor forms of one."""
        forms = self.form != candidate.form and (self.name, self.port) == (
            candidate.name,
            candidate.port,
        )
        return not (forms or self.places & candidate.places)

    def shares_port_with(self, candidate: Candidate) -> bool:
        """Tell whether both act at one port, where one may stand for the form of the other."""
        return (self.acts_at or self.port) == (candidate.acts_at or candidate.port)

    def replaces(self, member: Candidate) -> bool:
        """Tell whether it may replace an effect, which is at the same port or has a memory."""
        named = member.name != self.name and member.name in self.instead_of
        return named and (member.port == self.port or member.remembers)

    @property
    def only_as_form(self) -> bool:
        """Whether it is tried only instead of another form of the same effect."""
        return self.name in self.instead_of

    def holds(self, special: Candidate) -> bool:
        """Tell whether another effect is a special case of this one, or of this form of it."""
        return is_contained(special.name, self.name) or (
            self.form != "" and is_contained(special.name, f"{self.name}/{self.form}")
        )

    def is_form_of(self, member: Candidate) -> bool:
        """Tell whether it is another form of an effect, or of the one that covers a parameter.

        The times at which a zero may change are forms too, but do not count as such here.
        """
        if self.form == member.form or self.among > 1:
            return False
        if member.covered_by:
            return self.name == member.covered_by
        return (self.name, self.port) == (member.name, member.port)

    def is_instead_of(self, member: Candidate) -> bool:
        """Tell whether it may be there in place of an effect: as another form, law or line of it.

        Lines of one effect that share an order are not there twice: once a turn and its harmonic
        may be missing where a line twice a turn was named first.
        """
        shared = self.label != member.label and self.among == 1 and self.places & member.places
        return self.is_form_of(member) or self.replaces(member) or bool(shared)

    def stands_for(self, member: Candidate, any_curve: bool) -> bool:
        """Tell whether it may replace an effect: as another form, or as a special case at its port.

        With ``any_curve`` any curve may replace another at its port, unless it is `only_as_form`.
        """
        curve = any_curve and member.is_curve and self.is_curve and not self.only_as_form
        special = self.port == member.port and (curve or member.holds(self))
        return special or self.is_form_of(member)

    @property
    def linear(self) -> bool:
        """Whether predictions are close to linear in all its unknowns: parts of lines, and levels.

        Each of `starts` then changes one unknown.
        """
        return all(parameter.linear for parameter in self.parameters)

    @property
    def lines(self) -> list[NDArray[np.int_]]:
        """Indices of the cosine and sine part of each line among its parameters, shape (2,)."""
        begins = [row for row, parameter in enumerate(self.parameters) if parameter.begins_line]
        return [np.array([row, row + 1]) for row in begins]

    @property
    def is_curve(self) -> bool:
        """Whether it is a law without memory, order or exact form: one curve of a motion."""
        return not (self.exact or self.remembers) and self.order is None

    @property
    def unknowns(self) -> int:
        """Number of parameters that it adds to a fit or releases."""
        return len(self.parameters) + (self.releases is not None)

    def outside(self, base: Sequence[Parameter], values: NDArray[np.float64]) -> bool:
        """Tell whether the base parameter that it releases lies outside its tolerance.

        ``base`` are the parameters of the base, ``values`` begins with theirs.
        """
        for parameter, value in zip(base, values, strict=False):
            if parameter.name == self.releases:
                return not parameter.lower <= value <= parameter.upper
        return False


def candidate_of(
    effect: Effect,
    guess: Guess,
    port: str,
    force: str,
    standing: Callable[[str, str, Any], Any],
    slower: float = 1.0,
) -> Candidate:
    """Return an effect at a port as a candidate.

    Parameters
    ----------
    effect : Effect
    guess : Guess
        Form that the effect may have.
    port : str
    force : str
        Word for what acts at the port.
    standing : callable
        Function from the name of an effect, its port and its law to an effect of a model.
    slower : float
        Turns of the reference shaft, to which orders refer, per turn of the port.
    """
    family = guess.family
    order = None if family is None or family.order is None else family.order / slower
    orders = family.words if family else ""
    sentence = guess.sentence or effect.sentence
    return Candidate(
        guess.name or effect.name,
        port,
        guess.unknowns,
        guess.begins,
        lambda values: tuple(
            standing(name, port, part) for name, part in effect.parts(guess, values)
        ),
        sentence_at(sentence, port, orders, force),
        order,
        effect.exact or port in effect.exact_at,
        listed=not guess.name,
        form=guess.form,
        remembers=effect.remembers,
        instead_of=guess.instead_of,
        among=guess.among,
        nuisance=port in effect.nuisance_at,
        unit=partial(effect.unit, of_guess=guess.quantities),
        effect=effect,
    )


def out_of_tolerance(
    name: str, words: str, acts_at: str = "", covering: Effect | None = None
) -> Candidate:
    """Return the candidate that releases a base parameter, called ``words``, from its tolerance.

    Parameters
    ----------
    name, words, acts_at : str
        See `Candidate`.
    covering : Effect or None
        Effect that is equivalent to this parameter out of tolerance.
    """
    return Candidate(
        "parameter",
        name,
        (),
        ((),),
        _no_effect,
        out_of_tolerance_sentence(words),
        exact=True,
        releases=name,
        released=words,
        acts_at=acts_at,
        covered_by=covering.name if covering else "",
        covered_at=covering.sought_at[0] if covering else "",
        effect=covering,
    )


def labels_apart(sets: Sequence[Sequence[Candidate]]) -> list[str]:
    """Return the label of each set without what all sets share.

    Whole labels are returned if nothing would remain of one. A set may have an effect twice.
    """
    labels = [[candidate.label for candidate in members] for members in sets]
    shared = reduce(Counter.__and__, map(Counter, labels))
    remaining = [list((Counter(members) - shared).elements()) for members in labels]
    return ["+".join(names) for names in (remaining if all(remaining) else labels)]


def _no_effect(values: Sequence[float]) -> tuple[Any, ...]:
    """Return no effects: a base parameter out of tolerance is none."""
    return ()


@dataclass(frozen=True)
class Layout:
    """Index of each parameter in a vector of values, shape (..., n_parameters)."""

    parameters: tuple[Parameter, ...]

    def __len__(self) -> int:
        return len(self.parameters)

    def index(self, name: str) -> int:
        """Return the index of a parameter."""
        return [parameter.name for parameter in self.parameters].index(name)

    def array(self, attribute: str) -> NDArray[np.float64]:
        """Return one attribute of all parameters, shape (n_parameters,)."""
        return np.array([getattr(parameter, attribute) for parameter in self.parameters])
