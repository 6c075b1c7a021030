"""What a law at a port is: the motion it sees and the torque it answers with.

A port is a place where two parts move against each other: ``input`` (wave generator against the
housing), ``output`` (circular spline against the housing), ``mesh`` (the torsion d). A law answers
with the torque that opposes the motion; which port it stands at decides which effect it is. The
laws themselves are in `friction`, `stiffness` and `hysteresis`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number

Values = NDArray[np.float64]

PORTS = ("input", "output", "mesh")


def _whole(values: Values) -> Values:
    return np.atleast_2d(values)


@dataclass(frozen=True)
class PortState:
    """Motion at a port, arrays of one shape (or numbers).

    Attributes
    ----------
    position, speed : ndarray
        Of the port, rad and rad/s.
    phase : callable
        Gives ``order`` times the angle on which periodic laws depend, rad: of the input at the
        input and at the mesh, of the output at the output.
    stiffness : ndarray
        Mean mesh stiffness K, N.m/rad, which a clearance takes away.
    path, back : callable
        ``path`` lays values of the shape of ``position`` out in the order in which the port passes
        them, shape (n, steps), running in included; ``back`` undoes that.
    """

    position: Values
    speed: Values
    phase: Callable[[float], Values]
    stiffness: Values
    path: Callable[[Values], Values] = _whole
    back: Callable[[Values], Values] = _whole


@dataclass(frozen=True)
class Response:
    """Torque against the motion, N.m, and its derivatives by position and speed of the port."""

    torque: Values
    slope: Values | float = 0.0
    damping: Values | float = 0.0


class Law(Protocol):
    """What stands at a port."""

    @property
    def orders(self) -> tuple[float, ...]:
        """Orders, in cycles per turn of the port's angle, that the law excites by itself."""
        ...

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents for the motion at the port."""
        ...


@dataclass(frozen=True)
class Aperiodic:
    """Base of laws that depend on no angle."""

    @property
    def orders(self) -> tuple[float, ...]:
        """No orders."""
        return ()


@dataclass(frozen=True)
class Periodic:
    """Base of laws that vary with an angle as cos(order angle + phase)."""

    order: float
    phase: float

    def __post_init__(self) -> None:
        real_number("order", self.order, above=0.0)
        real_number("phase", self.phase)

    @property
    def orders(self) -> tuple[float, ...]:
        """The one order."""
        return (self.order,)

    def cosine(self, state: PortState) -> Values:
        """Return the cosine at the port."""
        return np.cos(state.phase(self.order) + self.phase)


def periodic_phase(angle: Values | float) -> Callable[[float], Values]:
    """Return the ``phase`` of a `PortState` for a plain angle."""
    return lambda order: np.asarray(order * angle)
