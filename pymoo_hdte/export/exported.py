"""What every export has: its text, what it leaves out, and its first lines."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pymoo_hdte import __version__
from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.law import Law
from pymoo_hdte.mechanism import LawAt, Mechanism

MARK = "Exported by pymoo_hdte"
"""In the first lines of every export."""


@dataclass(frozen=True)
class Exported:
    """A model as a file of another tool.

    Attributes
    ----------
    text : str
        The file.
    notes : tuple of str
        What it leaves out, approximates or adds, as in its first comment; empty if nothing.

    Examples
    --------
    >>> from pymoo_hdte.discrepancy import MechanismModel
    >>> from pymoo_hdte.mechanism import BelievedValue, Mechanism
    >>> arm = Mechanism({"q": BelievedValue(0.5)}, angles=["q"])
    >>> to_urdf(MechanismModel("An arm", arm)).notes
    ('the mass of q is not known: 1 kg on its axis stands for it',)
    """

    text: str
    notes: tuple[str, ...]


def head_lines(model: MechanismModel, notes: tuple[str, ...]) -> list[str]:
    """Return the lines of the first comment: title, origin and notes."""
    lines = [" ".join(model.title.split()), f"{MARK} {__version__}; SI units."]
    for note in notes:
        lines += textwrap.wrap(f"- {' '.join(note.split())}", 92, subsequent_indent="  ")
    return lines


def stated(law: Law, name: str) -> Any:
    """Return ``formula`` or ``lumped`` of a law; None if it has another force than stated there.

    A law that takes over the force of another one and changes it must state both again.
    """
    for kind in type(law).__mro__:
        if name in vars(kind):
            return getattr(law, name)
        if "respond" in vars(kind):
            return None
    return None


def acting(model: MechanismModel) -> list[LawAt]:
    """Return the effects that act on coordinates: those at force sensors show in readings only."""
    return [one for one in model.effects if not model.mechanism.port(one.port).read]


def left_out(effect: LawAt) -> str:
    """Return the note on an effect of which a target holds nothing, with its size."""
    numbers = [
        f"{name} {getattr(effect.law, name):.4g}" for name in effect_named(effect.name).quantities
    ]
    return f"{effect.name} at {effect.port}: left out ({', '.join(numbers)} SI)"


def common_notes(model: MechanismModel) -> Iterator[str]:
    """Yield what no target holds."""
    mechanism = model.mechanism
    for port in mechanism.ports:
        if port.read:
            yield f"{port.name} is a force sensor: left out, as it does not act on the motion"
    for loop in mechanism.loops:
        yield f"the loop that commands {loop.input} is left out: the input is open"
    for one in mechanism.inputs:
        if not one.scaled:
            yield f"the gain of {one.name} is not known: forces and inertias are in its unit"


def turns(mechanism: Mechanism, coordinate: str) -> bool:
    """Tell whether a coordinate is taken as an angle: it is, unless it is known as a length."""
    return coordinate not in (mechanism.lengths or ())
