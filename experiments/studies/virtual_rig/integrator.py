"""Motion of the virtual rig: Runge-Kutta of fourth order, and the quasi-static torsion sweep."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.studies.virtual_rig.laws import (
    Mesh,
    Side,
    damping_at,
    friction,
    ripple,
    slip_torque,
    static_error,
    static_mesh_torque,
)
from pymoo_hdte._compilation import compiled

N_STATES = 6
"""Deviation of the input angle from its straight line and its rate, transmission error and its
rate, twist of the torque sensor and its rate."""

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
    clock : float
        Time within the session at the first sample, s.
    motor_torque : float
        Constant of the speed loop, N.m.
    """

    speed: float
    start_angle: float
    load_torque: float
    clock: float
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
    slip: NDArray[np.float64],
    slip_torsion: float,
    rate: NDArray[np.float64],
) -> tuple[float, float]:
    """Write the rate of the state; return the motor torque and the torque sensor's, N.m.

    The integral of the speed error is minus the deviation of the angle: no state of its own.
    """
    deviation, deviation_rate, error, error_rate = state[0], state[1], state[2], state[3]
    angle = course.start_angle + course.speed * time + deviation
    speed = course.speed + deviation_rate
    output_angle = angle / rig.ratio - error
    output_speed = speed / rig.ratio - error_rate
    clock = course.clock + time
    value, slope = static_error(rig.mesh, angle)
    mesh = static_mesh_torque(rig.mesh, error - value, angle, speed, slip, slip_torsion)
    mesh += damping_at(rig.mesh, speed) * (error_rate - slope * speed)
    motor = course.motor_torque + ripple(rig.input, angle)
    motor -= rig.proportional * deviation_rate + rig.integral * deviation
    # Virtual work of the mesh torque over d = theta_in / N - theta_out - theta_s(theta_in).
    reaction = mesh * (1.0 / rig.ratio - rig.input.reaction * slope)
    resisting = friction(rig.input, speed, angle, clock) + reaction
    acceleration = (motor - resisting) / rig.input.inertia
    load = course.load_torque * (1.0 + ripple(rig.output, output_angle))
    if rig.output.vibration != 0.0:
        load += rig.output.vibration * math.cos(rig.output.vibration_frequency * clock)
    driving = mesh - friction(rig.output, output_speed, output_angle, clock)
    load_inertia = rig.load_inertia + rig.output.extra_inertia
    if rig.output.sensor_stiffness > 0.0:
        sensor = rig.output.sensor_stiffness * state[4] + rig.output.sensor_damping * state[5]
        output_acceleration = (driving - sensor) / rig.output.inertia
        twist_acceleration = output_acceleration - (sensor - load) / load_inertia
    else:
        output_acceleration = (driving - load) / (rig.output.inertia + load_inertia)
        sensor = load + load_inertia * output_acceleration
        twist_acceleration = 0.0
    rate[0], rate[1] = deviation_rate, acceleration
    rate[2], rate[3] = error_rate, acceleration / rig.ratio - output_acceleration
    rate[4], rate[5] = state[5], twist_acceleration
    return motor, sensor


@compiled
def integrate(
    rig: Mechanics,
    course: Course,
    state: NDArray[np.float64],
    slip: NDArray[np.float64],
    interval: float,
    substeps: int,
    n_settle: int,
    n_samples: int,
) -> NDArray[np.float64]:
    """Integrate from ``n_settle`` intervals before the first sample.

    Maxwell elements keep their memory over one step and move monotonically within it.

    Parameters
    ----------
    rig, course : Mechanics, Course
    state : ndarray, shape (6,)
        At the beginning; overwritten.
    slip : ndarray, shape (n_elements,)
        Torques of the Maxwell elements at the beginning, N.m; overwritten.
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
    torsion = (
        state[2]
        - static_error(
            rig.mesh, course.start_angle - course.speed * interval * n_settle + state[0]
        )[0]
    )
    for number in range(-n_settle, n_samples):
        for part in range(substeps):
            time = interval * number + step * part
            motor, sensor = derivative(rig, course, time, state, slip, torsion, rates[0])
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
                derivative(rig, course, time + reach, trial, slip, torsion, rates[stage])
            for i in range(N_STATES):
                middle = 2.0 * (rates[1, i] + rates[2, i])
                state[i] += step / 6.0 * (rates[0, i] + middle + rates[3, i])
            if len(slip) > 0:
                angle = course.start_angle + course.speed * (time + step) + state[0]
                moved = state[2] - static_error(rig.mesh, angle)[0]
                for element in range(len(slip)):
                    slip[element] = slip_torque(rig.mesh, slip, moved - torsion, element)
                torsion = moved
    return samples


@compiled
def quasi_static_torsion(
    mesh: Mesh,
    angle: float,
    torques: NDArray[np.float64],
    breakaway: float,
    slip: NDArray[np.float64],
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
    slip : ndarray, shape (n_elements,)
        Torques of the Maxwell elements of the unloaded drive, N.m; overwritten.

    Returns
    -------
    ndarray, shape (n,)
    """
    torsions = np.empty(len(torques))
    held = torsion = 0.0
    for row, torque in enumerate(torques):
        held = min(max(held, torque - breakaway), torque + breakaway)
        reach = 8.0 * (abs(held) + mesh.slip_limit.sum()) / mesh.stiffness + 4.0 * mesh.clearance
        low, high = -reach, reach
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if static_mesh_torque(mesh, middle, angle, 0.0, slip, torsion) < held:
                low = middle
            else:
                high = middle
        moved = 0.5 * (low + high)
        for element in range(len(slip)):
            slip[element] = slip_torque(mesh, slip, moved - torsion, element)
        torsions[row] = torsion = moved
    return torsions
