"""One running record of the virtual rig: its condition, step size and settling."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.studies.virtual_rig.integrator import (
    N_STATES,
    Course,
    Mechanics,
    integrate,
    quasi_static_torsion,
)
from experiments.studies.virtual_rig.laws import friction, static_error
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

SETTLING = 18.0
"""Time constants of the slowest mode before the first sample; leaves 2e-8 of the start."""
SETTLING_TURNS = 2.0
"""Input turns before the first sample, at least."""
STABLE_STEP = 1.0
"""Largest product of a step and the fastest eigenvalue; the method is stable up to 2.7."""
ACCURATE_STEP = 2.5e-4
"""Longest step where the order lines are fast, s."""
HIGHEST_ORDER = 14.0
"""Order up to which a line counts when a record is called slow."""
SLOW = 0.25
"""A record is slow if its highest line moves less than this angle (rad) between raw samples."""


@dataclass(frozen=True)
class Condition:
    """The condition of one running record.

    Attributes
    ----------
    speed_rpm : float
        Of the input, r/min; negative in the reverse direction.
    load_torque : float
        N.m.
    sample_rate : float
        Of the rows, Hz.
    samples_averaged : int
        Raw samples in one row.
    role : str
        "train" or "held_out".
    """

    speed_rpm: float
    load_torque: float
    sample_rate: float
    samples_averaged: int
    role: str

    @property
    def input_speed(self) -> float:
        """Set speed, rad/s."""
        return self.speed_rpm * REVOLUTION_PER_MINUTE

    @property
    def raw_interval(self) -> float:
        """Time between raw samples, s."""
        return 1.0 / (self.sample_rate * self.samples_averaged)

    @property
    def name(self) -> str:
        """Name of the record, as in the shared rigs."""
        name = f"run_{abs(self.speed_rpm):04g}rpm_{self.load_torque:02g}Nm"
        return name if self.speed_rpm > 0.0 else name + "_reverse"

    def duration(self, ratio: float) -> float:
        """Return the time of one output turn, s."""
        return 2.0 * math.pi * ratio / abs(self.input_speed)


def simulate_run(
    rig: Mechanics, condition: Condition, load_torque: float, start_angle: float
) -> NDArray[np.float64]:
    """Return the raw samples of one output turn in steady state, before any sensor.

    Where the lines are slow the torsional modes need only be stable.

    Parameters
    ----------
    rig : Mechanics
    condition : Condition
    load_torque : float
        True load, N.m.
    start_angle : float
        Input angle at the first sample, rad.

    Returns
    -------
    ndarray, shape (4, n)
        Input angle, output angle, motor torque and torque before the load; rad and N.m.
    """
    speed, interval = condition.input_speed, condition.raw_interval
    slow = HIGHEST_ORDER * abs(speed) * interval < SLOW
    modes = linear_modes(rig)
    fastest = float(np.abs(modes).max())
    limit = STABLE_STEP / fastest if slow else min(STABLE_STEP / fastest, ACCURATE_STEP)
    settling = max(
        SETTLING / float(np.abs(modes.real).min()), SETTLING_TURNS * 2.0 * math.pi / abs(speed)
    )
    n_settle = math.ceil(settling / interval)
    rows = math.floor(condition.duration(rig.ratio) * condition.sample_rate + 1e-6)
    motor = load_torque / rig.ratio + friction(rig.input, speed)
    course = Course(speed, start_angle, load_torque, motor)
    state = _start(rig, course, start_angle - speed * interval * n_settle)
    return integrate(
        rig,
        course,
        state,
        interval,
        math.ceil(interval / limit - 1e-9),
        n_settle,
        rows * condition.samples_averaged,
    )


def _start(rig: Mechanics, course: Course, angle: float) -> NDArray[np.float64]:
    """Return the state of the drive slowly loaded at ``angle``, then set going."""
    load = np.array([course.load_torque])
    torsion = quasi_static_torsion(rig.mesh, angle, load, 0.0)[0]
    value, slope = static_error(rig.mesh, angle)
    state = np.zeros(N_STATES)
    state[2], state[3] = value + torsion, slope * course.speed
    return state


def linear_modes(rig: Mechanics) -> NDArray[np.complex128]:
    """Return the eigenvalues of the linear rig about its steady state, 1/s."""
    mesh, ratio = rig.mesh, rig.ratio
    torque = np.array([0.0, 0.0, mesh.stiffness, mesh.damping])
    motor = np.array([rig.integral, rig.proportional + rig.input.damping, 0.0, 0.0])
    acceleration = -(motor + torque / ratio) / rig.input.inertia
    friction_torque = rig.output.damping * np.array([0.0, 1.0 / ratio, 0.0, -1.0])
    inertia = rig.output.inertia + rig.load_inertia
    system = np.zeros((N_STATES, N_STATES))
    system[0, 1] = system[2, 3] = 1.0
    system[1] = acceleration
    system[3] = acceleration / ratio - (torque - friction_torque) / inertia
    return np.linalg.eigvals(system).astype(np.complex128)
