"""Motion of the machine: its linear part by matrix exponentials, the rest as a forcing (ETDRK4).

Cox, Matthews, J. Comput. Phys. 176 (2002), of fourth order where the forcing is smooth. Elements
with memory are carried over each step exactly for a motion without reversal in it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import expm

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import LinearPart, Matrix
from experiments.studies.blind.rig.torques import LOAD, Plant, copy_into, torques


class Step(NamedTuple):
    """Matrices of one step of length h, n states: exponentials (n, n), weights (n, 3) of torques.

    ``half`` is h phi1(A h / 2) B / 2; ``first``, ``middle`` and ``last`` weigh the torques at the
    beginning, at both middles and at the end.
    """

    length: float
    whole: Matrix
    halfway: Matrix
    half: Matrix
    first: Matrix
    middle: Matrix
    last: Matrix


class Readout(NamedTuple):
    """Linear forms of states (n,) and torques (3,) that give what sensors see; see `LinearPart`.

    ``shows_load`` is whether the load's own torque is part of what the output's sensor shows.
    """

    motor: Values
    sensor: Values
    acceleration: Values
    acceleration_entry: Values
    shows_load: bool


def step_of(linear: LinearPart, length: float) -> Step:
    """Return the matrices of a step of ``length`` seconds."""
    half = _phi(linear, 0.5 * length, 1)
    order_1, two, three = (_phi(linear, length, order) for order in (1, 2, 3))
    return Step(
        length,
        expm(linear.system * length),
        expm(linear.system * 0.5 * length),
        half,
        order_1 - 3.0 * two + 4.0 * three,
        2.0 * two - 4.0 * three,
        4.0 * three - two,
    )


def _phi(linear: LinearPart, length: float, order: int) -> Matrix:
    """Return h phi_order(A h) B from one exponential of an augmented matrix (n + 3 order)."""
    size, width = linear.entry.shape
    whole = np.zeros((size + width * order, size + width * order))
    whole[:size, :size] = linear.system * length
    whole[:size, size : size + width] = linear.entry * length
    for k in range(order - 1):
        rows = size + width * k + np.arange(width)
        whole[rows, rows + width] = 1.0
    return np.ascontiguousarray(expm(whole)[:size, size + width * (order - 1) :])


def readout_of(linear: LinearPart) -> Readout:
    """Return what the sensors see of states and torques."""
    inertia = linear.sensor_inertia
    return Readout(
        linear.motor,
        linear.sensor,
        inertia * linear.system[3],
        inertia * linear.entry[3],
        linear.shows_load,
    )


@njit(cache=True)
def follow(
    plant: Plant,
    step: Step,
    readout: Readout,
    y: Values,
    memory: Values,
    before: Values,
    begin: float,
    n_settle: int,
    n_samples: int,
    substeps: int,
) -> Matrix:
    """Return what sensors could see at n_samples moments, from t = 0 on.

    Parameters
    ----------
    plant, step, readout : Plant, Step, Readout
    y : ndarray, shape (n,)
        State at ``begin``; overwritten.
    kept, before : ndarray, shape (elements,)
        States of memory there, and the positions that they belong to; overwritten.
    begin : float
        Time, -n_settle x substeps x step, s.
    n_settle, n_samples : int
        Samples left out, and kept.
    substeps : int
        Steps between samples.

    Returns
    -------
    ndarray, shape (4, n_samples)
        Deviations a and b (rad), motor torque, torque of the sensor (N.m).
    """
    size = len(y)
    seen = np.empty((4, n_samples))
    moved, now = memory.copy(), before.copy()
    f = np.zeros((4, LOAD + 1))
    at, state = y.copy(), np.empty(size)
    since, h = begin, step.length
    for number in range((n_settle + n_samples) * substeps):
        time = begin + number * h
        for stage in range(4):
            when = time + 0.5 * h * ((stage + 1) // 2)
            motor = torques(plant, when, at, memory, before, since, moved, now, f[stage])
            if stage == 0:
                copy_into(memory, moved)
                copy_into(before, now)
                since = time
                sample = number // substeps - n_settle
                if sample >= 0 and number % substeps == 0:
                    seen[0, sample], seen[1, sample] = y[0], y[1]
                    seen[2, sample], seen[3, sample] = read_torques(plant, readout, y, f[0], motor)
                moving(step.halfway, y, step.half, f[0], state)
                copy_into(at, state)
            elif stage == 1:
                moving(step.halfway, y, step.half, f[1], at)
            elif stage == 2:
                for j in range(3):
                    f[3, j] = 2.0 * f[2, j] - f[0, j]
                moving(step.halfway, state, step.half, f[3], at)
        moving(step.whole, y, step.first, f[0], state)
        for j in range(3):
            f[0, j] = f[1, j] + f[2, j]
        for i in range(size):
            total = state[i]
            for j in range(3):
                total += step.middle[i, j] * f[0, j] + step.last[i, j] * f[3, j]
            y[i] = total
        copy_into(at, y)
    return seen


@njit(cache=True)
def moving(states: Matrix, y: Values, entry: Matrix, f: Values, result: Values) -> None:
    """Write states y + entry f to ``result``, shapes (n, n), (n,), (n, 3) and (3,) or more."""
    for i in range(len(y)):
        total = 0.0
        for j in range(len(y)):
            total += states[i, j] * y[j]
        for j in range(3):
            total += entry[i, j] * f[j]
        result[i] = total


@njit(cache=True)
def read_torques(
    plant: Plant, readout: Readout, y: Values, f: Values, motor: float
) -> tuple[float, float]:
    """Return the torques of motor and sensor, N.m."""
    # A rigid sensor carries the load and what accelerates it, one that gives way only its twist.
    sensed = f[LOAD] if readout.shows_load else 0.0
    for i in range(len(y)):
        motor += readout.motor[i] * y[i]
        sensed += (readout.sensor[i] + readout.acceleration[i]) * y[i]
    for j in range(3):
        sensed += readout.acceleration_entry[j] * f[j]
    return motor, sensed
