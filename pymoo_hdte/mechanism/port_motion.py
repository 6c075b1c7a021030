"""The motion at a port in time, and the force of a law for it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.effects.law import Law, PortState, periodic_phase
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.motion import SmoothedMotion, noise_of
from pymoo_hdte.mechanism.parts import Input, Port
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PortMotion:
    """Position and speed at a port, and the load it passes on where known, shape (n,); SI.

    ``angle`` is that on which periodic laws depend, where it is not the position.
    """

    position: Values
    speed: Values
    load: Values | None = None
    angle: Values | None = None

    @property
    def shaft(self) -> Values:
        """The angle on which periodic laws depend."""
        return self.position if self.angle is None else self.angle


def motion_at_port(
    port: Port,
    position: dict[str, Values],
    speed: dict[str, Values],
    load: Values | None = None,
) -> PortMotion:
    """Return the motion at a port, with its kinematic error, for coordinates of shape (n,)."""
    shares = {**port.motion, **port.followed}
    here = np.sum([share * position[name] for name, share in shares.items()], axis=0)
    rate = np.sum([share * speed[name] for name, share in shares.items()], axis=0)
    for line in port.error:
        angle = line.order * position[line.coordinate] + line.phase
        here = here + line.amplitude * np.sin(angle)
        rate = rate + line.amplitude * line.order * np.cos(angle) * speed[line.coordinate]
    turning = position[next(iter(port.motion))] if port.followed else None
    return PortMotion(here, rate, load, turning)


def load_at_port(
    port: Port, inputs: Sequence[Input], signals: Mapping[str, Values]
) -> Values | None:
    """Return the load that a port passes on, shape (n,), for believed gains; None if unknown.

    ``signals`` are those of the inputs, by name.
    """
    if not port.load:
        return None
    gains = {actuation.name: actuation.gain.value for actuation in inputs}
    parts = [share * gains[name] * signals[name] for name, share in port.load.items()]
    return np.asarray(np.sum(parts, axis=0))


def law_force(law: Law, motion: PortMotion | SmoothedMotion, stiffness: float) -> Values:
    """Return the force of a law against a motion in time, shape (n,).

    ``stiffness`` is that of its port, N/m or N.m/rad.
    """
    # Laws with memory start from rest, whatever the zero of the position.
    rests = law.states > 0
    state = PortState(
        motion.position - rests * motion.position[0],
        motion.speed,
        periodic_phase(motion.shaft if isinstance(motion, PortMotion) else motion.position),
        np.full(1, stiffness),
        path=lambda values: values[None, :],
        back=lambda values: values[0],
        load=getattr(motion, "load", None),
    )
    return np.broadcast_to(law.respond(state).torque, motion.position.shape)


def followed_angles(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of measured angles that move ports and are no coordinates."""
    return tuple(dict.fromkeys(name for port in mechanism.ports for name in port.followed))


def torsion_noise(port: Port, record: Record) -> float:
    """Return the standard deviation of the noise of a motion that follows a measured angle, SI.

    The noise is that of the difference of the angles, in which jitter of the samples cancels.
    """
    shares = {**port.motion, **port.followed}
    if all(name in record.noise for name in shares):
        return math.hypot(*(share * record.noise[name] for name, share in shares.items()))
    parts = [share * record.channel(name) for name, share in shares.items()]
    return noise_of(np.sum(parts, axis=0))
