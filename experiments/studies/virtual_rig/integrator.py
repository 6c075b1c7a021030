"""Motion of the virtual rig: Runge-Kutta of fourth order, and the quasi-static torsion sweep."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.studies.virtual_rig.laws import (
    Mesh,
    Side,
    friction,
    ripple,
    static_error,
    static_mesh_torque,
)
from pymoo_hdte._compilation import compiled

N_STATES = 4
"""Deviation of the input angle from its straight line and its rate, transmission error and its
rate."""

_BISECTIONS = 60


class Course(NamedTuple):
    """One running record: set values of speed loop and load.

    Attributes
    ----------
    speed : float
        Set speed of the input, rad/s.
    start_angle : float
        Input angle at the first sample, rad.
    load_torque : float
        N.m.
    motor_torque : float
        Constant of the speed loop, N.m.
    """

    speed: float
    start_angle: float
    load_torque: float
    motor_torque: float


class Mechanics(NamedTuple):
    """The whole rig as the integrator sees it.

    Attributes
    ----------
    ratio : float
        N.
    proportional, integral : float
        Of the speed loop, N.m.s/rad and N.m/rad.
    load_inertia : float
        J_L, kg.m2.
    input, output : Side
    mesh : Mesh
    """

    ratio: float
    proportional: float
    integral: float
    load_inertia: float
    input: Side
    output: Side
    mesh: Mesh


@compiled
def derivative(
    rig: Mechanics,
    course: Course,
    time: float,
    state: NDArray[np.float64],
    rate: NDArray[np.float64],
) -> tuple[float, float]:
    """Write the rate of the state; return the motor torque and the torque sensor's, N.m.

    The integral of the speed error is minus the deviation of the angle: no state of its own.
    """
    deviation, deviation_rate, error, error_rate = state[0], state[1], state[2], state[3]
    angle = course.start_angle + course.speed * time + deviation
    speed = course.speed + deviation_rate
    output_speed = speed / rig.ratio - error_rate
    value, slope = static_error(rig.mesh, angle)
    mesh = static_mesh_torque(rig.mesh, error - value, angle)
    mesh += rig.mesh.damping * (error_rate - slope * speed)
    motor = course.motor_torque + ripple(rig.input, angle)
    motor -= rig.proportional * deviation_rate + rig.integral * deviation
    # Virtual work of the mesh torque over d = theta_in / N - theta_out - theta_s(theta_in).
    reaction = mesh * (1.0 / rig.ratio - rig.input.reaction * slope)
    resisting = friction(rig.input, speed) + reaction
    acceleration = (motor - resisting) / rig.input.inertia
    driving = mesh - friction(rig.output, output_speed)
    load, load_inertia = course.load_torque, rig.load_inertia
    output_acceleration = (driving - load) / (rig.output.inertia + load_inertia)
    rate[0], rate[1] = deviation_rate, acceleration
    rate[2], rate[3] = error_rate, acceleration / rig.ratio - output_acceleration
    return motor, load + load_inertia * output_acceleration


@compiled
def integrate(
    rig: Mechanics,
    course: Course,
    state: NDArray[np.float64],
    interval: float,
    substeps: int,
    n_settle: int,
    n_samples: int,
) -> NDArray[np.float64]:
    """Integrate from ``n_settle`` intervals before the first sample.

    Parameters
    ----------
    rig, course : Mechanics, Course
    state : ndarray, shape (4,)
        At the beginning; overwritten.
    interval : float
        Time between samples, s.
    substeps : int
        Steps in one interval.
    n_settle, n_samples : int

    Returns
    -------
    ndarray, shape (4, n_samples)
        Input angle, output angle, motor torque, torque between drive and load; rad and N.m.
    """
    samples = np.empty((4, n_samples))
    rates = np.empty((4, N_STATES))
    trial = np.empty(N_STATES)
    step = interval / substeps
    for number in range(-n_settle, n_samples):
        for part in range(substeps):
            time = interval * number + step * part
            motor, sensor = derivative(rig, course, time, state, rates[0])
            if part == 0 and number >= 0:
                angle = course.start_angle + course.speed * time + state[0]
                samples[0, number] = angle
                samples[1, number] = angle / rig.ratio - state[2]
                samples[2, number] = motor
                samples[3, number] = sensor
            for stage in range(1, 4):
                reach = step if stage == 3 else 0.5 * step
                for i in range(N_STATES):
                    trial[i] = state[i] + reach * rates[stage - 1, i]
                derivative(rig, course, time + reach, trial, rates[stage])
            for i in range(N_STATES):
                middle = 2.0 * (rates[1, i] + rates[2, i])
                state[i] += step / 6.0 * (rates[0, i] + middle + rates[3, i])
    return samples


@compiled
def quasi_static_torsion(
    mesh: Mesh,
    angle: float,
    torques: NDArray[np.float64],
    breakaway: float,
) -> NDArray[np.float64]:
    """Return the torsion of a drive with locked input under slowly changing load, rad.

    Dry friction ``breakaway`` of the output holds the mesh torque until the load differs from it by
    that much, in either direction.

    Parameters
    ----------
    mesh : Mesh
    angle : float
        Of the locked input, rad.
    torques : ndarray, shape (n,)
        Load, N.m; the path starts unloaded.
    breakaway : float
        N.m.

    Returns
    -------
    ndarray, shape (n,)
    """
    torsions = np.empty(len(torques))
    held = 0.0
    for row, torque in enumerate(torques):
        held = min(max(held, torque - breakaway), torque + breakaway)
        reach = 8.0 * abs(held) / mesh.stiffness + 4.0 * mesh.clearance
        low, high = -reach, reach
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if static_mesh_torque(mesh, middle, angle) < held:
                low = middle
            else:
                high = middle
        torsions[row] = 0.5 * (low + high)
    return torsions
