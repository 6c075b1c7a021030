"""A law in the words of other tools: as equations, and as the elements of a rigid-body engine.

Each law states both itself, beside its force; `export` asks, and tells what a target leaves out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

PRESLIDING = "dry friction in its place; that it yields over {:.4g} of motion is left out"
"""What `Lumped` leaves out of a hysteresis, with the motion after which it slips, m or rad."""


@dataclass(frozen=True)
class Formula:
    """Equations of a law as text, in the grammar of Python.

    Names are the numbers of the law, its states, and ``position``, ``speed``, ``angle`` (on which
    periodic laws depend), ``load`` and ``stiffness`` of its port. Functions are ``abs``,
    ``asinh``, ``cos``, ``exp``, ``log``, ``max``, ``min``, ``sign``, ``sin``, ``sqrt`` and
    ``tanh``; beside arithmetic there are ``a if condition else b``, ``and`` and ``or``.

    Attributes
    ----------
    force : str
        Against the motion, N or N.m.
    rates : mapping of str to str
        For each inner state its derivative by time; states are 0 at rest.
    """

    force: str
    rates: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Lumped:
    """What a rigid-body engine can hold of a law.

    For the motion d of a port the force against it is stiffness d + damping d' + level sign(d') +
    force + Re(weight exp(i d)), in N and m or N.m and rad.

    Attributes
    ----------
    stiffness, damping, level, force : float
    weight : complex
        Of a body that hangs at a shaft.
    missing : str
        What that leaves out or approximates, in words for a comment; empty if it is the law itself.
    """

    stiffness: float = 0.0
    damping: float = 0.0
    level: float = 0.0
    force: float = 0.0
    weight: complex = 0.0
    missing: str = ""

    def __add__(self, other: Lumped) -> Lumped:
        """Return both side by side at one port; what is missing is told of each law, not here."""
        names = [one.name for one in fields(self) if one.name != "missing"]
        return Lumped(**{name: getattr(self, name) + getattr(other, name) for name in names})
