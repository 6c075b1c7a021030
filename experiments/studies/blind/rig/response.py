"""Closed form of the linear machine: its answer to the static error, and its means.

It is the check of the integrator, and the measure of what a fit of the believed model can absorb.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Machine, linear_part

Lines = NDArray[np.complex128]

CHANNELS = ("transmission_error", "input_torque", "output_torque")


def response(machine: Machine, order: float, speed: float) -> Lines:
    """Return phasors of `CHANNELS` (3,), per radian of a line of the static error.

    The line is cos(order theta_in), the input turns with ``speed`` (rad/s).
    """
    linear, s = linear_part(machine), 1j * order * speed
    pull = machine.stiffness + s * machine.damping
    f = np.array([pull / machine.ratio, -pull, 0.0])
    entered = linear.entry @ f
    y = np.linalg.solve(s * np.eye(len(entered)) - linear.system, entered)
    acceleration = s * y[3]
    return np.array(
        [
            y[0] / machine.ratio - y[1],
            linear.motor @ y,
            linear.sensor @ y + linear.sensor_inertia * acceleration,
        ]
    )


def means(machine: Machine, load: float, speed: float) -> Values:
    """Return the means of `CHANNELS` (3,) under a load (N.m) without any element."""
    dragging = machine.output_damping * speed / machine.ratio
    torsion = (load + dragging) / machine.stiffness + machine.error_offset
    motor = (load + dragging) / machine.ratio + machine.input_damping * speed
    return np.array([torsion, motor, load])


def lines(machine: Machine, speed: float) -> Lines:
    """Return the phasors (orders, 3) of `CHANNELS` at the orders of the static error.

    A phasor p stands for Re p exp(i order theta_in).
    """
    phasors = np.array(machine.amplitudes) * np.exp(1j * (np.array(machine.phases) - np.pi / 2.0))
    found = [
        phasor * response(machine, order, speed)
        for phasor, order in zip(phasors, machine.orders, strict=True)
    ]
    return np.array(found)
