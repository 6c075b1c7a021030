"""Running one record, and the torsion of a locked drive: what happens before any sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import Values, table
from experiments.studies.blind.rig.integrator import follow, readout_of, step_of
from experiments.studies.blind.rig.machine import LinearPart, Machine, Matrix, linear_part
from experiments.studies.blind.rig.torques import (
    LOAD,
    Plant,
    copy_into,
    elastic_torque,
    friction_torque,
    static_error,
    torques,
)

SETTLED = 20.0
"""Time constants of the slowest mode before the first sample."""
SETTLED_TURNS = 2.0
"""Input turns before it, in which elements with memory settle."""
LONGEST_STEP = 1.25e-3
"""s; and no line of the highest order turns by more than `FINEST` rad in a step."""
FINEST = 0.8
HIGHEST_ORDER = 14.0
STABLE = 2.0
"""Largest step times the rate at which further damping slows the output: it is a part of the
forcing, for which the method is the classical one of Runge and Kutta, stable up to 2.78."""
LOADING = 60
"""Steps in which the brake applies its load."""
_HALVINGS = 48


@dataclass(frozen=True)
class Condition:
    """How one record is run.

    Attributes
    ----------
    rpm : float
        Set speed of the input, r/min.
    load : float
        Set torque of the load, N.m.
    rate : float
        Raw samples per second.
    averaged : int
        Raw samples that make one row.
    role : str
        "train" or "held_out".
    """

    rpm: float
    load: float
    rate: float
    averaged: int
    role: str

    @property
    def speed(self) -> float:
        """Set speed, rad/s."""
        return self.rpm * math.pi / 30.0

    def duration(self, ratio: float) -> float:
        """Return the time of one output turn, s."""
        return 2.0 * math.pi * ratio / abs(self.speed)

    @property
    def substeps(self) -> int:
        """Steps of the integrator between raw samples."""
        return self.substeps_for(HIGHEST_ORDER)

    def substeps_for(self, order: float) -> int:
        """Return the steps between raw samples where lines have orders up to this one."""
        longest = min(LONGEST_STEP, FINEST / (order * abs(self.speed)))
        return max(1, math.ceil(1.0 / (self.rate * longest) - 1e-9))


def plant_of(
    machine: Machine,
    linear: LinearPart,
    condition: Condition,
    load: float,
    start: float,
    clock: float,
) -> Plant:
    """Return the machine in one record, with a motor that carries load and friction from the start.

    Parameters
    ----------
    machine, linear : Machine, LinearPart
    condition : Condition
    load, start, clock : float
        True load (N.m), input angle (rad) and time of the session (s) at the first sample.
    """
    rows, speed = table(machine.elements), condition.speed
    # Beyond half the sampling rate inertia swallows a ripple, and sensors filter what is left.
    heard = (rows[:, 0] != el.RIPPLE) | (rows[:, 2] * abs(speed) < math.pi * condition.rate)
    rows = rows[heard]
    held = load / machine.ratio + machine.input_damping * speed
    held += machine.output_damping * speed / machine.ratio**2
    plant = Plant(
        machine.ratio,
        machine.stiffness,
        machine.damping,
        machine.input_damping,
        machine.output_damping,
        np.array(machine.orders),
        np.array(machine.amplitudes),
        np.array(machine.phases),
        machine.error_offset,
        rows,
        speed,
        start,
        clock,
        load,
        held,
        linear.load_row,
    )
    rubbing = sum(
        friction_torque(plant, row, speed, start, clock, load)
        for row in rows
        if row[0] >= el.DRY and row[7] == el.INPUT
    )
    return plant._replace(motor=held + rubbing)


def run(
    machine: Machine,
    condition: Condition,
    load: float,
    start: float,
    clock: float,
    refined: int = 1,
) -> Matrix:
    """Return one output turn in steady state, before any sensor.

    Parameters
    ----------
    machine : Machine
    condition : Condition
    load, start, clock : float
        As in `plant_of`.
    refined : int
        Shorter steps by this factor, for a check of convergence.

    Returns
    -------
    ndarray, shape (4, n)
        Input angle, output angle (rad), torques of motor and sensor (N.m), of raw samples.
    """
    linear = linear_part(machine)
    plant = plant_of(machine, linear, condition, load, start, clock)
    ripples = plant.rows[plant.rows[:, 0] == el.RIPPLE, 2]
    finest = float(ripples.max(initial=0.0))
    substeps = condition.substeps * refined
    if finest > HIGHEST_ORDER:
        substeps = condition.substeps_for(finest) * refined
    damped = plant.rows[plant.rows[:, 0] == el.DAMPING]
    further = float(np.sum(damped[:, 1] * (1.0 + damped[:, 2] * abs(condition.speed))))
    # Ahead of a shaft that twists the output alone is light.
    fastest = further * linear.entry[3, 1]
    substeps = max(substeps, math.ceil(refined * fastest / (STABLE * condition.rate)))
    modes = np.abs(np.linalg.eigvals(linear.system).real)
    settling = max(
        SETTLED / modes[modes > 1e-6].min(), SETTLED_TURNS * 2.0 * math.pi / abs(condition.speed)
    )
    n_settle = math.ceil(settling * condition.rate)
    rows = math.floor(
        condition.duration(machine.ratio) * condition.rate / condition.averaged + 1e-6
    )
    n_samples = rows * condition.averaged
    begin = -n_settle / condition.rate
    y, memory = np.zeros(len(linear.system)), np.zeros(len(plant.rows))
    # The brake loads the drive before the motor starts: elements with memory know the way.
    loading = load * np.linspace(0.0, 1.0, LOADING)
    y[1] = -_locked(plant, loading, 0.0, 0.0, memory)[-1]
    y[1] -= static_error(plant, start + condition.speed * begin)[0]
    if linear.load_row == 2 and machine.third is not None:
        y[4] = y[1] - load / machine.third.stiffness
    elif machine.third is not None:
        y[4] = y[1]
    before, moved = np.zeros(len(memory)), np.zeros(len(memory))
    torques(plant, begin, y, memory, before, begin, moved, before, np.zeros(LOAD + 1))
    step = step_of(linear, 1.0 / (condition.rate * substeps))
    seen = follow(
        plant, step, readout_of(linear), y, memory, before, begin, n_settle, n_samples, substeps
    )
    turned = start + condition.speed * np.arange(n_samples) / condition.rate
    seen[0] += turned
    seen[1] += turned / machine.ratio
    return seen


def locked_torsion(machine: Machine, torque: Values, interval: float) -> Values:
    """Return the torsion while the output is loaded slowly and the input is locked at angle zero.

    Dry friction of the output holds the mesh until the load exceeds its torque by that much.

    Parameters
    ----------
    machine : Machine
    torque : ndarray, shape (n,)
        Load, N.m, from an unloaded drive on.
    interval : float
        Time between two of them, s.

    Returns
    -------
    ndarray, shape (n,)
        rad.
    """
    condition = Condition(60.0, 0.0, 1.0, 1, "train")
    plant = plant_of(machine, linear_part(machine), condition, 0.0, 0.0, 0.0)
    creeping = 1e9
    holding = sum(
        friction_torque(plant, row, creeping, 0.0, 0.0, 0.0)
        for row in plant.rows
        if row[0] in (el.DRY, el.UNEVEN) and row[7] == el.OUTPUT
    )
    memory = np.zeros(len(plant.rows))
    return _locked(plant, torque, interval, max(float(holding), 0.0), memory)


@njit(cache=True)
def _locked(
    plant: Plant, torque: Values, interval: float, holding: float, memory: Values
) -> Values:
    """Return the torsion under torques (n,), and leave the states of memory in ``kept``."""
    rows = len(plant.rows)
    moved, trial, before = np.zeros(rows), np.zeros(rows), np.zeros(rows)
    torsion = np.empty(len(torque))
    carried = d = 0.0
    for place in range(len(torque)):
        carried = min(max(carried, torque[place] - holding), torque[place] + holding)
        reach = 8.0 * (abs(carried) + 10.0) / plant.stiffness
        low, high = -reach, reach
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _static(plant, middle, memory, before, moved, trial) < carried:
                low = middle
            else:
                high = middle
        d = 0.5 * (low + high)
        _static(plant, d, memory, before, moved, trial)
        copy_into(memory, trial)
        for e in range(rows):
            before[e] = d
            row = plant.rows[e]
            if row[0] == el.CREEP:
                memory[e] += (row[1] * d - memory[e]) * (1.0 - math.exp(-interval / row[2]))
        torsion[place] = d
    return torsion


@njit(cache=True)
def _static(
    plant: Plant, d: float, memory: Values, before: Values, moved: Values, trial: Values
) -> float:
    """Return the torque that holds a torsion, N.m, and write states of memory to ``trial``."""
    copy_into(moved, memory)
    total = elastic_torque(plant, d, 0.0, 0.0, 0.0, memory, before, moved)
    copy_into(trial, moved)
    for e in range(len(plant.rows)):
        row = plant.rows[e]
        if row[0] == el.BRISTLES and row[7] == el.OUTPUT:
            # The output turns back as the torsion grows: its friction opposes both.
            way = d - before[e]
            aim = math.copysign(1.0, way)
            trial[e] = aim + (memory[e] - aim) * math.exp(-abs(way) / row[4])
            total += (row[1] + row[2]) * trial[e]
    return total
