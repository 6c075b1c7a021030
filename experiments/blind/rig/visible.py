"""How visible a hidden effect is: what it changes beyond noise and what a base fit can absorb.

Means and order lines of all fitted records change by D. Noise of the sensors is S; the parameters
within their tolerances, gains and zeros, and the error that does not repeat move them by B and R
per standard deviation, by the closed form of the linear machine. The visibility is the length of D
in standard deviations of what these explain, sqrt(D' (S + B B' + R R')^-1 D), and of the torsion
sweep beside it what no straight line explains. An effect drawn less visible than `LEAST` is made
larger, up to its largest plausible size: one to two times `LEAST` visible. Of an effect that has a
simpler one in it (a gap whose width varies is a gap), the difference from that must be visible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from experiments.blind.rig.elements import Values
from experiments.blind.rig.machine import Machine, Matrix
from experiments.blind.rig.response import lines, means, response
from experiments.blind.rig.session import (
    SHEET,
    UNCERTAIN,
    Circumstances,
    averaged_rows,
    row_times,
    sweep_torque,
)

LEAST = 10.0
"""Standard deviations. 100 of chi-square: several times what the evidence for an effect of three
unknowns costs among a thousand features and fifty candidates, and its fit differs from the truth by
a tenth of the effect."""
_EVER = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 2.02)
_UNIFORM = 3.0**-0.5
"""Standard deviation of a number uniform between -1 and 1."""


def orders_seen(ratio: float, further: Sequence[float] = ()) -> Values:
    """Return the orders whose lines count, cycles per input turn."""
    wanted = [1.0 / ratio, 2.0 / ratio, *_EVER]
    wanted += [one for one in further if min(abs(one - other) for other in wanted) > 0.005]
    return np.array(sorted(wanted))


def features(about: Circumstances, record: int, shown: Matrix, orders: Values) -> Matrix:
    """Return mean, cosine and sine parts (3, 1 + 2 m) of transmission error and torques."""
    condition = about.conditions[record]
    rows = averaged_rows(condition, shown)
    angle = about.starts[record] + condition.speed * row_times(condition, rows.shape[1])
    waves = np.outer(angle, orders)
    basis = np.column_stack([np.ones(len(angle)), np.cos(waves), np.sin(waves)])
    channels = np.array([rows[0] / about.machine.ratio - rows[1], rows[2], rows[3]])
    return np.asarray(np.linalg.solve(basis.T @ basis, basis.T @ channels.T).T)


def visibility(
    about: Circumstances, changes: Sequence[Matrix], orders: Values, sweep: Values
) -> float:
    """Return the visibility of changes of features, one (3, 1 + 2 m) for each fitted record.

    ``sweep`` (k,) is the change of the angle in the torsion sweep, rad.
    """
    kept = [place for place, one in enumerate(about.conditions) if one.role == "train"]
    change = np.concatenate([one.ravel() for one in changes])
    noise = np.concatenate([_noise(about, place, orders).ravel() for place in kept])
    nuisance = np.column_stack([_of_base(about, kept, orders), _unrepeated(about, kept, orders)])
    white, moved = change / noise, nuisance / noise[:, None]
    # Woodbury: (1 + B B')^-1 = 1 - B (1 + B' B)^-1 B'.
    inner = np.eye(moved.shape[1]) + moved.T @ moved
    absorbed = moved.T @ white
    total = white @ white - absorbed @ np.linalg.solve(inner, absorbed)
    return float(np.sqrt(max(total, 0.0) + _bend(about, sweep)))


def _bend(about: Circumstances, sweep: Values) -> float:
    """Return the square of what of a sweep no straight line over the torque explains."""
    torque = sweep_torque()
    basis = np.column_stack([np.ones(len(torque)), torque])
    left = sweep - basis @ np.linalg.lstsq(basis, sweep, rcond=None)[0]
    return float(left @ left) / about.sensors.torsion_noise**2


def _noise(about: Circumstances, record: int, orders: Values) -> Matrix:
    """Return the standard deviation of the features of a record, shape (3, 1 + 2 m)."""
    condition, sensors = about.conditions[record], about.sensors
    raw = condition.duration(about.machine.ratio) * condition.rate
    sizes = np.array([2.0**0.5 * sensors.angle_noise, sensors.input_noise, sensors.output_noise])
    of_lines = np.full(2 * len(orders), (2.0 / raw) ** 0.5)
    return np.outer(sizes, np.concatenate([[raw**-0.5], of_lines]))


def _placed(mean: Values, phasors: NDArray[np.complex128], at: Values, orders: Values) -> Values:
    """Return features (3 (1 + 2 m),) with means (3,) and phasors (k, 3) at some orders (k,)."""
    found = np.zeros((3, 1 + 2 * len(orders)))
    found[:, 0] = mean
    for phasor, order in zip(phasors, at, strict=True):
        line = int(np.argmin(np.abs(orders - order)))
        found[:, 1 + line] = phasor.real
        found[:, 1 + len(orders) + line] = -phasor.imag
    return found.ravel()


def _predicted(
    about: Circumstances, machine: Machine, kept: Sequence[int], orders: Values
) -> Values:
    parts = []
    for record in kept:
        speed = about.conditions[record].speed
        mean = means(machine, float(about.loads[record]), speed)
        parts.append(_placed(mean, lines(machine, speed), np.array(machine.orders), orders))
    return np.concatenate(parts)


def _of_base(about: Circumstances, kept: Sequence[int], orders: Values) -> Matrix:
    """Return what a standard deviation of each base parameter changes, shape (features, p)."""
    machine, columns = about.machine, []
    stands = _predicted(about, machine, kept, orders)
    share = 1e-4
    for name in UNCERTAIN:
        other = replace(machine, **{name: getattr(machine, name) * (1.0 + share)})
        step = (_predicted(about, other, kept, orders) - stands) / share
        columns.append(step * SHEET.tolerance * _UNIFORM)
    for line, amplitude in enumerate(machine.amplitudes):
        for turn in (0.0, np.pi / 2.0):
            lone = [0.0] * len(machine.amplitudes)
            lone[line] = 1.0
            phases = [one + turn for one in machine.phases]
            other = replace(machine, amplitudes=tuple(lone), phases=tuple(phases))
            empty = replace(machine, amplitudes=(0.0,) * len(lone))
            step = _predicted(about, other, kept, orders) - _predicted(about, empty, kept, orders)
            size = SHEET.error_tolerance * _UNIFORM if turn == 0.0 else 10.0
            columns.append(step * size * amplitude)
    shape = (len(kept), 3, 1 + 2 * len(orders))
    for channel, gain, zero in (
        (0, 0.0, 1e-3),
        (1, SHEET.gain, SHEET.input_zero),
        (2, SHEET.gain, SHEET.output_zero),
    ):
        level = np.zeros(shape)
        level[:, channel, 0] = zero * (1.0 if channel == 0 else _UNIFORM)
        grown = np.zeros(shape)
        grown[:, channel] = stands.reshape(shape)[:, channel] * gain * _UNIFORM
        columns += [level.ravel(), grown.ravel()]
    return np.column_stack(columns)


def _unrepeated(about: Circumstances, kept: Sequence[int], orders: Values) -> Matrix:
    """Return what a standard deviation of each line's error in each record changes."""
    machine, columns = about.machine, []
    spread = SHEET.repeatability / len(machine.orders) ** 0.5
    width = 3 * (1 + 2 * len(orders))
    for row, record in enumerate(kept):
        speed = about.conditions[record].speed
        none = np.zeros((0, 3), dtype=complex)
        parts = [_placed(np.array([spread, 0.0, 0.0]), none, np.zeros(0), orders)]
        for order in machine.orders:
            answer = spread * response(machine, order, speed)
            parts += [
                _placed(np.zeros(3), turn * answer[None], np.array([order]), orders)
                for turn in (1.0, 1j)
            ]
        for part in parts:
            column = np.zeros(width * len(kept))
            column[row * width : (row + 1) * width] = part
            columns.append(column)
    return np.column_stack(columns)
