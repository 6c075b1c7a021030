"""The machine on the bench: inertias, spring, dampers, speed loop, and its linear equations.

Coordinates are small deviations from a steady turn, so that no digits are lost: of the input angle
``a`` (theta_in = start + speed t + a), of the output angle ``b`` (theta_out = (start + speed t) / N
+ b), of a third body ``s`` beside the output, and a lag of the motor's torque::

    J_in  a'' = T_motor - B_in theta_in' - M / N - friction
    J_out b'' = M - B_out theta_out' - T_sensor - friction
    J_load b'' = T_sensor - T_load                        (rigid torque sensor)
    M = K d + c d' + elements,   d = theta_in / N - theta_out - theta_s(theta_in)
    T_motor = constant - P a' - I a

The loop integrates the error of the speed, which is minus a.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from experiments.studies.blind.rig.elements import Values

Matrix = NDArray[np.float64]

SENSOR, EXTRA = "compliant sensor", "coupled inertia"


@dataclass(frozen=True)
class ThirdBody:
    """A third inertia.

    Attributes
    ----------
    kind : str
        `SENSOR`: the load behind a torque sensor that gives way; `EXTRA`: an inertia coupled to it.
    inertia : float
        kg.m2; of the `EXTRA` body only.
    stiffness, damping : float
        N.m/rad and N.m.s/rad.
    """

    kind: str
    inertia: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Machine:
    """What turns, SI.

    Attributes
    ----------
    ratio : float
        N, input turns per output turn.
    stiffness, damping : float
        K and c of the torsion, at the output, N.m/rad and N.m.s/rad.
    input_inertia, output_inertia, load_inertia : float
        kg.m2; the torque sensor stands between the last two.
    input_damping, output_damping : float
        N.m.s/rad.
    orders, amplitudes, phases : tuple of float
        theta_s = sum amplitude sin(order theta_in + phase), rad.
    proportional, integral : float
        Of the speed loop, N.m.s/rad and N.m/rad.
    elements : tuple of tuple of float
        Of `elements`.
    third : ThirdBody or None
    lag : float
        Time constant of the motor's torque, s.
    error_offset : float
        Constant of the static error, rad.
    sensor_at_brake : bool
        Whether the load's inertia turns before the torque sensor, and not behind it.
    """

    ratio: float
    stiffness: float
    damping: float
    input_inertia: float
    output_inertia: float
    load_inertia: float
    input_damping: float
    output_damping: float
    orders: tuple[float, ...]
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    proportional: float
    integral: float
    elements: tuple[tuple[float, ...], ...] = ()
    third: ThirdBody | None = None
    lag: float = 0.0
    error_offset: float = field(default=0.0)
    sensor_at_brake: bool = False


@dataclass(frozen=True, eq=False)
class LinearPart:
    """Linear part y' = A y + B f of the equations, y = (a, b, a', b', s, s', lagged torque).

    Attributes
    ----------
    system : ndarray, shape (n, n)
        A.
    entry : ndarray, shape (n, 3)
        B: where torques f at input, output and load (N.m) enter.
    motor, sensor : ndarray, shape (n,)
        Motor torque and load's part of the torque sensor, as linear forms of y, N.m.
    sensor_inertia : float
        Inertia whose acceleration b'' adds to what the sensor shows, kg.m2.
    load_row : int
        Row of the load's torque in f.
    shows_load : bool
        Whether the sensor shows the load's torque itself.
    """

    system: Matrix
    entry: Matrix
    motor: Values
    sensor: Values
    sensor_inertia: float
    load_row: int
    shows_load: bool


def linear_part(machine: Machine) -> LinearPart:
    """Return the linear part of the equations of a machine."""
    third, lagged = machine.third, machine.lag > 0.0
    size = 4 + 2 * (third is not None) + lagged
    last = size - 1
    twist = np.zeros(size)
    twist[[0, 1]] = machine.stiffness / machine.ratio, -machine.stiffness
    twist[[2, 3]] = machine.damping / machine.ratio, -machine.damping
    command = np.zeros(size)
    command[[0, 2]] = -machine.integral, -machine.proportional
    motor = np.eye(size)[last] if lagged else command
    on_input = motor - twist / machine.ratio
    on_input[2] -= machine.input_damping
    on_output = twist.copy()
    on_output[3] -= machine.output_damping
    inner, sensor_inertia = machine.output_inertia + machine.load_inertia, machine.load_inertia
    coupling = np.zeros(size)
    system, entry = np.zeros((size, size)), np.zeros((size, 3))
    system[0, 2] = system[1, 3] = 1.0
    if third is not None:
        coupling[[1, 4]] = third.stiffness, -third.stiffness
        coupling[[3, 5]] = third.damping, -third.damping
        outer = third.inertia
        if third.kind == SENSOR:
            inner, outer, sensor_inertia = machine.output_inertia, machine.load_inertia, 0.0
        system[4, 5] = 1.0
        system[5] = coupling / outer
        entry[5, 2] = 1.0 / outer
    system[2] = on_input / machine.input_inertia
    system[3] = (on_output - coupling) / inner
    entry[2, 0], entry[3, 1] = 1.0 / machine.input_inertia, 1.0 / inner
    if lagged:
        system[last] = command / machine.lag
        system[last, last] -= 1.0 / machine.lag
    load_row = 2 if third is not None and third.kind == SENSOR else 1
    if machine.sensor_at_brake:
        # Nothing that accelerates stands behind the sensor.
        coupling, sensor_inertia = np.zeros(size), 0.0
    shows_load = load_row == 1 or machine.sensor_at_brake
    return LinearPart(system, entry, motor, coupling, sensor_inertia, load_row, shows_load)
