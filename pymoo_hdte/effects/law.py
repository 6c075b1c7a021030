"""A law at a port: the motion on which it depends and the torque that it returns.

A port is a place where two parts move relative to each other: ``input`` (wave generator against the
housing), ``output`` (circular spline against the housing), ``mesh`` (the torsion d) and ``load``
(what turns with the output beyond the output torque sensor). A law returns the torque that opposes
the motion; its effect depends on its port. The laws themselves are in
`friction`, `stiffness`, `hysteresis` and `linear`, each beside the `Effect` that defines everything
else about it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.effects.portable import Formula, Lumped

Values = NDArray[np.float64]

PORTS = ("input", "output", "mesh", "load")
OUTPUT_SHAFT = ("output", "load")
"""Ports that turn with the output, so that orders there are cycles per output turn."""


def _whole(values: Values) -> Values:
    return np.atleast_2d(values)


@dataclass(frozen=True)
class PortState:
    """Motion at a port, arrays of one shape (or numbers).

    Attributes
    ----------
    position, speed : ndarray
        Position and speed of the port, rad and rad/s.
    phase : callable
        Gives ``order`` times the angle on which periodic laws depend, rad: of the input at the
        input and at the mesh, of the output at the output.
    stiffness : ndarray
        Mean mesh stiffness K, N.m/rad, which a clearance removes.
    path, back : callable
        ``path`` arranges values of the shape of ``position`` in the order in which the port passes
        them, shape (n, steps), including a running-in; ``back`` undoes that.
    load : ndarray or None
        Torque that the machine passes on through the port, N.m; None where a solver does not know
        it. At the input of a drive it is what the output delivers to its load, bearings and laws,
        over the ratio, without what accelerates inertias; at its mesh and at its load T_L; at a
        port of another mechanism, what its ``load`` says.
    temperature : ndarray or float
        Temperature of the machine in kelvin; NaN where it is not known.
    elapsed : ndarray or float
        Time of the session, s; infinite where it is not known.
    recurs : bool
        Whether the second half of a ``path`` is the first again, and so on for ever: a law that
        forgets gradually has then come to repeat itself, too.
    """

    position: Values
    speed: Values
    phase: Callable[[float], Values]
    stiffness: Values
    path: Callable[[Values], Values] = _whole
    back: Callable[[Values], Values] = _whole
    load: Values | None = None
    temperature: Values | float = np.nan
    recurs: bool = False
    elapsed: Values | float = np.inf

    def known_load(self, effect: str, place: str) -> Values:
        """Return the load, N.m, for an effect that depends on it and may be at a place of a drive.

        Raises
        ------
        InvalidInput
            Where the solver does not know the load.
        """
        if self.load is None:
            allowed = f"the {place} of a drive, or a port whose load is stated"
            raise InvalidInput(f"port of {effect}", "of a mechanism", allowed)
        return self.load


@dataclass(frozen=True)
class Response:
    """Torque against the motion, N.m, and its derivatives by position and speed of the port."""

    torque: Values
    slope: Values | float = 0.0
    damping: Values | float = 0.0


class Law(Protocol):
    """A law at a port."""

    @property
    def orders(self) -> tuple[float, ...]:
        """Orders, in cycles per turn of the port's angle, that the law excites by itself."""
        ...

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents for the motion at the port."""
        ...

    @property
    def states(self) -> int:
        """See `Behaviour`, which provides this and the following properties."""
        ...

    @property
    def breakaway(self) -> float:
        """See `Behaviour`."""
        ...

    @property
    def constant(self) -> float:
        """See `Behaviour`."""
        ...

    def line(self, load: Values) -> NDArray[np.complex128] | None:
        """See `Behaviour`."""
        ...

    @property
    def rattles(self) -> bool:
        """See `Behaviour`."""
        ...

    @property
    def loaded(self) -> bool:
        """See `Behaviour`."""
        ...

    @property
    def warmed(self) -> bool:
        """See `Behaviour`."""
        ...

    @property
    def varies_stiffness(self) -> bool:
        """See `Behaviour`."""
        ...

    @property
    def drives(self) -> bool:
        """See `Behaviour`."""
        ...

    @property
    def creep(self) -> float:
        """See `Behaviour`."""
        ...

    @property
    def before_slip(self) -> Law | None:
        """See `Behaviour`."""
        ...

    def with_input_locked(self) -> Law | None:
        """See `Behaviour`."""
        ...

    @property
    def formula(self) -> Formula | None:
        """See `Behaviour`."""
        ...

    @property
    def lumped(self) -> Lumped | None:
        """See `Behaviour`."""
        ...


class Memory(Law, Protocol):
    """A law whose force depends on the previous motion, by inner states that solvers keep.

    Their number is above 0; all are 0 at rest and have the unit of the motion.

    Attributes
    ----------
    shortest : float
        The shortest distance over which a state changes, m or rad, which integrators must resolve.
    """

    shortest: float

    def rates(self, speed: float, kept: Values) -> Values:
        """Return how fast the states (states,) change at a speed of the port."""
        ...

    def moved(self, kept: Values, way: float) -> Values:
        """Return the states after a way without reversal."""
        ...

    def torque(self, kept: Values) -> float:
        """Return the force or torque that the states make."""
        ...

    def tangent(self, kept: Values, direction: float) -> float:
        """Return the slope of the force by the position, moving in a direction, 1 or -1."""
        ...

    def recall(self, path: Values) -> tuple[Values, Values]:
        """Return how forces along paths (n, steps) that recur depend on earlier steps.

        The force is a sum of k parts. Two derivatives of each, both of shape (k, n, steps): by
        itself at the step before, and by the way since then.
        """
        ...


class Behaviour:
    """Properties of a law beyond its force, for solvers and sensors; a law overrides its own."""

    states: ClassVar[int] = 0
    """Number of inner states; above 0 the law is a `Memory`."""
    rattles: ClassVar[bool] = False
    """Whether the law removes the spring of its port, so that parts may lose contact."""
    drives: ClassVar[bool] = False
    """Whether the force is a driving force, whatever the direction of motion."""
    loaded: ClassVar[bool] = False
    """Whether the force depends on the torque that the port passes on, `PortState.load`, which is
    known at the input, the mesh and the load of a drive and where a mechanism states it."""
    warmed: ClassVar[bool] = False
    """Whether the force depends on `PortState.temperature`, which only records of a drive have."""
    varies_stiffness: ClassVar[bool] = False
    """Whether it is K depth cos(order angle + phase) times the position, with these three numbers:
    then Hill's method and the stability of the drive know it too."""

    @property
    def breakaway(self) -> float:
        """Force up to which the law holds a port at rest."""
        return 0.0

    @property
    def constant(self) -> float:
        """Size of the part of the force that is against the motion and the same at all speeds."""
        return 0.0

    def line(self, load: Values) -> NDArray[np.complex128] | None:
        """Return the phasors of a torque that is one line of its order, whatever else moves.

        It is Re phasor exp(i order angle), N.m, against the motion; None for any other law.

        Parameters
        ----------
        load : ndarray, shape (n,)
            Torque that the machine passes on through the port, N.m.

        Returns
        -------
        ndarray of complex, shape (n,), or None
        """
        return None

    @property
    def creep(self) -> float:
        """Force that fades away in many repetitions of a motion, after a load has wound it up."""
        return 0.0

    @property
    def before_slip(self) -> Law | None:
        """What holds the output of a drive in a sweep until its contacts slip; None if these rest.

        They then rest up to ``breakaway``. Only torsion sweeps with a locked input ask for it.
        """
        return None

    @property
    def formula(self) -> Formula | None:
        """Its equations for other tools; None if they are not stated."""
        return None

    @property
    def lumped(self) -> Lumped | None:
        """What a rigid-body engine can hold of it; None for nothing."""
        return None


@dataclass(frozen=True)
class Aperiodic(Behaviour):
    """Base of laws that do not depend on an angle."""

    @property
    def orders(self) -> tuple[float, ...]:
        """An empty tuple: the law excites no order."""
        return ()

    def with_input_locked(self) -> Law | None:
        """Return the law at the mesh while the input is locked: itself."""
        return cast(Law, self)


@dataclass(frozen=True)
class Periodic(Behaviour):
    """Base of laws that vary with an angle as cos(order angle + phase)."""

    order: float
    phase: float

    def __post_init__(self) -> None:
        real_number("order", self.order, above=0.0)
        real_number("phase", self.phase)

    @property
    def orders(self) -> tuple[float, ...]:
        """The order at which the law varies."""
        return (self.order,)

    def with_input_locked(self) -> Law | None:
        """Return the law at the mesh while the input is locked at an unknown angle.

        Its mean over all angles, which is zero for a cosine.
        """
        return None

    def cosine(self, state: PortState) -> Values:
        """Return the cosine at the port."""
        return np.cos(state.phase(self.order) + self.phase)


def closest_line(law: Law, fastest: float) -> Lumped:
    """Return damper and dry friction whose force is closest to that of a law over speed.

    Parameters
    ----------
    law : Law
        Of the speed alone.
    fastest : float
        m/s or rad/s. From rest up to it squares of differences are least; neither part is negative.
    """
    speed = np.linspace(0.0, 1.0, 201)[1:]
    zero = np.zeros_like(speed)
    state = PortState(zero, fastest * speed, periodic_phase(zero), zero)
    force = np.broadcast_to(law.respond(state).torque, speed.shape)
    (level, slope), _ = nnls(np.column_stack([np.ones_like(speed), speed]), force)
    missing = f"a straight line over speed in its place, the closest one up to {fastest:.4g} SI"
    return Lumped(damping=slope / fastest, level=level, missing=missing)


def periodic_phase(angle: Values | float) -> Callable[[float], Values]:
    """Return the ``phase`` of a `PortState` for a plain angle."""
    return lambda order: np.asarray(order * angle)
