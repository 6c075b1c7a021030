"""A joint with encoders on both sides of its gear, made with a known truth."""

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.mechanism import BelievedValue, Gear, Input, Mechanism, Port, Record

RATIO = 101
STIFFNESS = 3e4
ARCSECOND = np.pi / 648000.0
MOTOR, LOAD, DAMPING, DELIVERED = 0.8, 1.5, 12.0, 60.0
"""Inertias of input and load at the output, kg.m2; damping of the load, N.m.s/rad; gravity, N.m."""
STEP = 0.004


def believed(**options):
    """Return the joint as it is believed: gravity is missing."""
    stiffness = BelievedValue(STIFFNESS * 1.1, factor=2.0)
    return Mechanism(
        {"motor": BelievedValue(1.0, factor=3.0), "load": BelievedValue(1.2, factor=3.0)},
        [
            Port(
                "gear",
                {"motor": 1.0, "load": -1.0},
                stiffness,
                gear=Gear(RATIO, "harmonic drive"),
                **options,
            ),
            Port("bearing", {"load": 1.0}, damping=BelievedValue(10.0, factor=3.0)),
        ],
        [Input("torque", {"motor": 1.0})],
        angles=("motor", "load"),
    )


@dataclass(frozen=True)
class Hidden:
    """What the made joint has beside what is believed.

    Attributes
    ----------
    of_torsion : Law or None
        Of the torsion, beside the spring.
    dry : float
        Friction of the motor, ahead of the gear, N.m at the output.
    order, amplitude : float
        Of the kinematic error, per turn of the output and rad.
    late : float
        By which the load's encoder is read after the motor's, s.
    """

    of_torsion: object = None
    dry: float = 0.0
    order: float = 0.0
    amplitude: float = 0.0
    late: float = 0.0


def motion(seconds, seed):
    """Return time, position, speed and acceleration of a load that swings slowly to and fro."""
    time = np.arange(0.0, seconds, STEP)
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 4)
    rates = 2.0 * np.pi * np.array([0.07, 0.13, 0.31, 0.53])
    sizes = np.array([1.8, 0.9, 0.25, 0.1])
    angles = np.outer(time, rates) + phases
    return (
        time,
        np.sin(angles) @ sizes,
        np.cos(angles) @ (sizes * rates),
        -np.sin(angles) @ (sizes * rates**2),
    )


def record(hidden, role, seconds=20.0, seed=1, noise=(0.3 * ARCSECOND, 0.05)):
    """Return a record of the joint; ``noise`` of the encoders, rad, and of the torque, N.m."""
    time, q, v, a = motion(seconds, seed)
    wanted = LOAD * a + DAMPING * v + DELIVERED * np.cos(q + 0.4)
    torsion = wanted / STIFFNESS
    for _ in range(200):
        torque = STIFFNESS * torsion
        if hidden.of_torsion is not None:
            state = PortState(
                torsion,
                np.gradient(torsion, STEP),
                periodic_phase(q),
                np.full(1, STIFFNESS),
                path=lambda values: values[None, :],
                back=lambda values: values[0],
            )
            torque = torque + hidden.of_torsion.respond(state).torque
        torsion = torsion + 0.5 * (wanted - torque) / STIFFNESS
    # The error is added to the torsion that the encoders show to get the one that winds the spring.
    motor = q + torsion
    for _ in range(20):
        motor = q + torsion - hidden.amplitude * np.cos(hidden.order * motor + 0.7)
    speed, acceleration = np.gradient(motor, STEP), np.gradient(np.gradient(motor, STEP), STEP)
    torque = wanted + MOTOR * acceleration + hidden.dry * np.tanh(speed / 1e-4)
    draw = np.random.default_rng(seed + 100).standard_normal((3, len(time)))
    inner = slice(5, -5)
    channels = {
        "motor": motor + noise[0] * draw[0] + 7.0,
        "load": np.interp(time + hidden.late, time, q) + noise[0] * draw[1],
        "torque": torque + noise[1] * draw[2],
    }
    return Record(role, role, time[inner], {name: one[inner] for name, one in channels.items()})


def records(hidden):
    """Return a record to be fitted and one held out."""
    return [record(hidden, "train"), record(hidden, "held_out", 10.0, 2)]
