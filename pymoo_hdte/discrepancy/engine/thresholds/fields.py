"""A rule of the verdict: a number with its meaning, its unit and its derivation."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields
from typing import Any

from pymoo_hdte.checks import real_number, whole_number

BY_HAND = "Set by hand on 2026-11-21"
"""Derivation of hand-set values, all of which were chosen on campaigns made for that purpose."""


@dataclass(frozen=True)
class Rule:
    """One rule in words.

    Attributes
    ----------
    name : str
        Of the field.
    value : float
    unit : str
        ``"1"`` for a ratio or a number of things.
    meaning : str
        What the rule decides.
    derivation : str
        Test level, simulation or literature that it comes from, or that it was set by hand.
    """

    name: str
    value: float
    unit: str
    meaning: str
    derivation: str


def rule(
    value: float,
    unit: str,
    meaning: str,
    derivation: str,
    *,
    at_least: float | None = None,
    at_most: float = math.inf,
) -> Any:
    """Return a field of `RuleSet`: whole for a whole default, otherwise a real number.

    Parameters
    ----------
    value : float
        Default.
    unit, meaning, derivation : str
        As in `Rule`.
    at_least, at_most : float
        Allowed values; by default anything above zero, for a whole number from one on.
    """
    words = {"unit": unit, "meaning": meaning, "derivation": derivation}
    return field(default=value, metadata=words | {"at_least": at_least, "at_most": at_most})


@dataclass(frozen=True, kw_only=True)
class RuleSet:
    """Base of classes all of whose fields are made by `rule`.

    Raises
    ------
    InvalidInput
        For a value that is no number or that its field does not allow.
    TypeError
        Where a class is made that declares a field of another one again, or inherits two of a name.
    """

    def __init_subclass__(cls) -> None:
        own = [name for name, value in vars(cls).items() if isinstance(value, Field)]
        inherited = [one.name for base in cls.__bases__ for one in fields(base)]
        declared = Counter([*own, *inherited])
        # Of two fields of a name one would win silently, with the meaning and bounds of the other.
        if twice := [name for name, count in declared.items() if count > 1]:
            raise TypeError(f"rules of {cls.__name__} declared twice: {', '.join(twice)}")

    def __post_init__(self) -> None:
        for one in fields(self):
            _check(one, getattr(self, one.name))

    def explained(self) -> tuple[Rule, ...]:
        """Return every rule with its present value, in words."""
        return tuple(_in_words(one, getattr(self, one.name)) for one in fields(self))


def _check(one: Field[Any], value: Any) -> None:
    limits: Mapping[str, Any] = one.metadata
    name, at_least = f"rules.{one.name}", limits["at_least"]
    if isinstance(one.default, int):
        whole_number(name, value, 1 if at_least is None else int(at_least))
    elif at_least is None:
        real_number(name, value, above=0.0, at_most=limits["at_most"])
    else:
        real_number(name, value, at_least=at_least, at_most=limits["at_most"])


def _in_words(one: Field[Any], value: float) -> Rule:
    words = one.metadata
    return Rule(one.name, value, words["unit"], words["meaning"], words["derivation"])
