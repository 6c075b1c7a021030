"""A session on the bench: thirteen records to fit, six to check, and a torsion sweep.

All that chance decides of a session, but the noise of samples, is drawn first, so that the same
session can be run with a hidden effect and without.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Machine, Matrix
from experiments.studies.blind.rig.runs import Condition, locked_torsion, run
from experiments.studies.blind.rig.sensors import Sensors, rows_of

ARCSEC = math.pi / 648000.0
RATIO = 101.0
PAUSE = 25.0
"""Time between two records, s."""
LOAD_SETTING = 0.3
"""Standard deviation of the brake from a set load other than zero, N.m."""
SWEEP = (0.0, 40.0, -40.0, 40.0, 0.0)
"""Corners of the torsion sweep, N.m, `SWEEP_LEG` seconds apart, at `SWEEP_RATE` Hz."""
SWEEP_LEG, SWEEP_RATE = 40.0, 10.0
_RATES = {30: (400.0, 10), 200: (1000.0, 4), 600: (1000.0, 2)}


@dataclass(frozen=True)
class Sheet:
    """What is believed of the drive and stated of the bench, SI.

    Parameters are true within ``tolerance``, amplitudes of the static error within
    ``error_tolerance``, gains and zeros of torque sensors within theirs. The transmission error
    repeats to ``repeatability``.
    """

    stiffness: float = 2.583e4
    damping: float = 4.5
    input_inertia: float = 1.97e-4
    input_damping: float = 1.7e-4
    output_damping: float = 5.022e-4
    output_inertia: float = 8.505e-4
    load_inertia: float = 0.08
    orders: tuple[float, ...] = (1.0, 2.0, 2.02)
    amplitudes: tuple[float, ...] = (4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC)
    tolerance: float = 0.1
    error_tolerance: float = 0.3
    proportional: float = 0.02
    integral: float = 0.5
    angle_noise: float = 0.7 * ARCSEC
    torsion_noise: float = 0.204 * ARCSEC
    angle_step: float = 0.3 * ARCSEC
    input_noise: float = 0.003
    output_noise: float = 0.2
    gain: float = 0.005
    input_zero: float = 0.003
    output_zero: float = 0.1
    repeatability: float = 0.3 * ARCSEC

    @property
    def windup(self) -> float:
        """Torsion at rated torque, rad."""
        return 40.0 / self.stiffness


SHEET = Sheet()
UNCERTAIN = (
    "stiffness",
    "damping",
    "input_inertia",
    "input_damping",
    "output_damping",
    "output_inertia",
    "load_inertia",
)


def _conditions() -> tuple[Condition, ...]:
    train = {30: (0, 40), 200: (10, 40), 600: (0, 20), 1000: (10, 40), 1500: (0, 20),
             2000: (0, 20, 40)}  # fmt: skip
    held_out = {30: (20,), 200: (20,), 600: (40,), 1000: (0,), 1500: (40,), 2000: (10,)}
    return tuple(
        Condition(float(rpm), float(load), *_RATES.get(rpm, (1000.0, 1)), role)
        for role, plan in (("train", train), ("held_out", held_out))
        for rpm, loads in plan.items()
        for load in loads
    )


CONDITIONS = _conditions()


@dataclass(frozen=True)
class Warming:
    """Viscous friction that falls by a ``share`` in the end, with a time constant ``time``, s."""

    share: float
    time: float

    def left(self, clock: float) -> float:
        """Return what is left of the friction at a time of the session, s."""
        return 1.0 + self.share * math.expm1(-clock / self.time)


@dataclass(frozen=True, eq=False)
class Circumstances:
    """What chance decides of a session.

    Attributes
    ----------
    machine : Machine
        Without any hidden effect.
    sensors : Sensors
    conditions : tuple of Condition
    loads, starts, clocks : ndarray, shape (r,)
        True load (N.m), input angle (rad) and time of the session (s) where a record begins.
    unrepeated : complex ndarray, shape (r, m)
        What the phasor of each line of the static error has more in this record, rad.
    offsets : ndarray, shape (r,)
        The same of its constant, rad.
    warming : Warming or None
        Of the bench.
    """

    machine: Machine
    sensors: Sensors
    conditions: tuple[Condition, ...]
    loads: Values
    starts: Values
    clocks: Values
    unrepeated: Matrix
    offsets: Values
    warming: Warming | None = None

    def machine_in(self, record: int, machine: Machine) -> Machine:
        """Return a machine with the static error and the warmth that it has in a record."""
        if self.warming is not None:
            middle = 0.5 * self.conditions[record].duration(machine.ratio)
            left = self.warming.left(float(self.clocks[record]) + middle)
            machine = replace(
                machine,
                input_damping=left * machine.input_damping,
                output_damping=left * machine.output_damping,
            )
        phasors = np.array(machine.amplitudes) * np.exp(1j * np.array(machine.phases))
        phasors += self.unrepeated[record]
        return replace(
            machine,
            amplitudes=tuple(np.abs(phasors).tolist()),
            phases=tuple(np.angle(phasors).tolist()),
            error_offset=float(self.offsets[record]),
        )


def draw_circumstances(
    rng: np.random.Generator, sheet: Sheet = SHEET, conditions: tuple[Condition, ...] = CONDITIONS
) -> Circumstances:
    """Draw a bench whose parameters lie uniformly within the tolerances, and a session on it."""
    off = 1.0 + sheet.tolerance * rng.uniform(-1.0, 1.0, len(UNCERTAIN))
    true: dict[str, Any] = {
        name: float(k * getattr(sheet, name)) for name, k in zip(UNCERTAIN, off, strict=True)
    }
    lines, records = len(sheet.orders), len(conditions)
    amplitudes = np.array(sheet.amplitudes)
    amplitudes *= 1.0 + sheet.error_tolerance * rng.uniform(-1.0, 1.0, lines)
    machine = Machine(
        ratio=RATIO,
        orders=sheet.orders,
        amplitudes=tuple(amplitudes.tolist()),
        phases=tuple(rng.uniform(0.0, 2.0 * np.pi, lines).tolist()),
        proportional=sheet.proportional,
        integral=sheet.integral,
        **true,
    )
    share = rng.uniform(-1.0, 1.0, 4)
    sensors = Sensors(
        sheet.angle_noise,
        sheet.torsion_noise,
        sheet.angle_step,
        sheet.input_noise,
        sheet.output_noise,
        gains=(float(share[0] * sheet.gain), float(share[1] * sheet.gain)),
        zeros=(float(share[2] * sheet.input_zero), float(share[3] * sheet.output_zero)),
    )
    set_loads = np.array([condition.load for condition in conditions])
    loads = set_loads + LOAD_SETTING * rng.standard_normal(records) * (set_loads != 0.0)
    order = rng.permutation(records)
    lasting = np.array([condition.duration(RATIO) + PAUSE for condition in conditions])
    clocks = np.empty(records)
    clocks[order] = np.concatenate([[0.0], np.cumsum(lasting[order])[:-1]])
    spread = sheet.repeatability / lines**0.5
    parts = spread * rng.standard_normal((2, records, lines))
    return Circumstances(
        machine,
        sensors,
        conditions,
        loads,
        rng.uniform(0.0, 2.0 * np.pi * RATIO, records),
        clocks,
        parts[0] + 1j * parts[1],
        spread * rng.standard_normal(records),
    )


def running(about: Circumstances, record: int, machine: Machine, sensors: Sensors) -> Matrix:
    """Return the raw samples (4, n) of a record as sensors without noise show them."""
    condition, clock = about.conditions[record], float(about.clocks[record])
    machine = about.machine_in(record, machine)
    seen = run(machine, condition, float(about.loads[record]), float(about.starts[record]), clock)
    return sensors.shown(seen, clock + np.arange(seen.shape[1]) / condition.rate, condition.rate)


def sweep_torque() -> Values:
    """Return the torque of the load during the torsion sweep, N.m, shape (n,)."""
    corners = SWEEP_LEG * np.arange(len(SWEEP))
    clock = np.arange(round(corners[-1] * SWEEP_RATE)) / SWEEP_RATE
    torque: Values = np.interp(clock, corners, SWEEP).astype(np.float64)
    return torque


def sweep(machine: Machine, sensors: Sensors) -> Matrix:
    """Return output angle (rad) and torque (N.m) of the torsion sweep, without noise, (2, n).

    The encoder is zeroed just before, so that neither its drift nor its error there shows.
    """
    torque = sweep_torque()
    angle = -locked_torsion(machine, torque, 1.0 / SWEEP_RATE)
    shown = angle.copy()
    if sensors.mount is not None:
        shown -= sensors.mount.compliance * torque
    for error in sensors.scale:
        shown += error.at(angle) - error.at(np.zeros(1))
    return np.array([shown, sensors.load_shown(torque)])


def row_times(condition: Condition, rows: int) -> Values:
    """Return the middle times of rows, s, shape (rows,)."""
    weight = 0.5 * (1.0 - 1.0 / condition.averaged)
    return (np.arange(float(rows)) + weight) * (condition.averaged / condition.rate)


def averaged_rows(condition: Condition, shown: Matrix) -> Matrix:
    """Return rows (4, n) of raw samples (4, n averaged)."""
    return rows_of(shown, condition.averaged)
