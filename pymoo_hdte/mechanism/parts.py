"""What a mechanism is put together from: ports with their laws, inputs and their control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pymoo_hdte.effects.law import Law
from pymoo_hdte.mechanism.believed import NOTHING, BelievedValue
from pymoo_hdte.mechanism.error_line import ErrorLine
from pymoo_hdte.mechanism.gear import Gear


@dataclass(frozen=True)
class Port:
    """A place where parts move relative to each other.

    Attributes
    ----------
    name : str
    motion : mapping of str to float
        Share of each coordinate in the motion d of the port, by name.
    stiffness, damping : BelievedValue
        Linear spring and damper at the port, N/m and N.s/m or N.m/rad and N.m.s/rad.
    read : bool
        True for a force sensor: the force at the port is measured, as the channel of this name, and
        does not act on the coordinates.
    error : tuple of ErrorLine
        Kinematic error, added to d. It does not act back on the coordinate that makes it, as in
        Eq. (9) of the paper.
    load : mapping of str to float
        Share of the force of inputs, by name, in the load that the port passes on, on which laws
        may depend; positive where it opposes a positive motion.
    gear : Gear or None
        Whose output is the port; or, of a motion between two angles, whose torsion it is.
    followed : mapping of str to float
        Share of measured angles that are no coordinates: they move the port, and it does not move
        them. The zero of d is then unknown, and periodic laws vary with the first coordinate.

    Examples
    --------
    >>> Port("spring", {"motor": 1.0, "load": -1.0}, stiffness=BelievedValue(2e3)).stiffness.value
    2000.0
    """

    name: str
    motion: Mapping[str, float]
    stiffness: BelievedValue = NOTHING
    damping: BelievedValue = NOTHING
    read: bool = False
    error: tuple[ErrorLine, ...] = ()
    load: Mapping[str, float] = field(default_factory=dict)
    gear: Gear | None = None
    followed: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Input:
    """A measured signal that drives the mechanism.

    Attributes
    ----------
    name : str
        Name of its channel.
    acts : mapping of str to float
        Share with which it acts on each coordinate, by name.
    gain : BelievedValue
        Force, N, or torque, N.m, per unit of the signal.
    scaled : bool
        False where the gain of the only input is not known at all. It is then 1, and inertias,
        stiffnesses, dampings and forces, those of known effects as well, are in units of the
        signal: their ratios are determined, their sizes not.
    delay : float or None
        Time by which it acts later than its channel says, s; None if it is to be estimated.

    Examples
    --------
    >>> Input("torque", {"q": 101.0}).gain.value
    1.0
    """

    name: str
    acts: Mapping[str, float]
    gain: BelievedValue = field(default=BelievedValue(1.0))
    scaled: bool = True
    delay: float | None = 0.0


@dataclass(frozen=True)
class Loop:
    """A control law: input = position_gain (reference - coordinate) - speed_gain coordinate'.

    Proportional-derivative: Astrom and Murray, Feedback Systems, Princeton University Press 2008.

    Attributes
    ----------
    input, reference : str
        The input that it commands, and the channel of the reference.
    coordinate : str
        The coordinate that it controls.
    position_gain, speed_gain : float
        Units of the input per m or rad, and per m/s or rad/s.
    limit : float
        Largest size of the command, in units of the input; infinite without saturation.

    Examples
    --------
    >>> Loop("torque", "target", "q", position_gain=5.0, speed_gain=2.0).limit
    inf
    """

    input: str
    reference: str
    coordinate: str
    position_gain: float
    speed_gain: float
    limit: float = float("inf")


@dataclass(frozen=True)
class LawAt:
    """An effect: a law at a port of a mechanism.

    Attributes
    ----------
    name : str
        Name of the effect, as in verdicts.
    port : str
        Name of the port.
    law : Law
        Force or torque over the port's motion; its numbers are in SI.

    Examples
    --------
    >>> from pymoo_hdte.effects.friction import CoulombFriction
    >>> LawAt("coulomb_friction", "bearing", CoulombFriction(0.3)).port
    'bearing'
    """

    name: str
    port: str
    law: Law
