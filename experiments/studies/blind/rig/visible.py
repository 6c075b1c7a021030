"""How visible a hidden effect is: what it changes beyond noise and what a base fit can absorb.

Means and order lines of all fitted records change by D. Base parameters may move within their
tolerances to imitate that, lines of the static error also turn as far as their amplitude allows;
gains and zeros of torque sensors, and the error that does not repeat, may move at a cost of one for
each standard deviation. The closed form of the linear machine says what all of them do. The
visibility is the root of the least sum of squares of these costs and of what is left of D, in
standard deviations of the noise: the sensors', and a hundredth of D for what the closed form leaves
out. What no straight line explains of the torsion sweep is added.

An effect drawn less visible than `LEAST` is made larger, step by step, up to its largest plausible
size. Of an effect that has a simpler one in it (a gap whose width varies is a gap), the difference
from that must be visible.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Machine, Matrix, linear_part
from experiments.studies.blind.rig.session import (
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
LINEAR = 0.01
"""Share of a change that counts as noise: in so much the closed form, which has the static error
over the mean input angle, may differ from the bench; measured are 0.004."""
_EVER = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 2.02)


def orders_seen(ratio: float, further: Sequence[float] = ()) -> Values:
    """Return the orders whose lines count, cycles per input turn."""
    wanted = [1.0 / ratio, 2.0 / ratio, *_EVER]
    wanted += [
        effect for effect in further if min(abs(effect - second) for second in wanted) > 0.005
    ]
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
    about: Circumstances, changes: Mapping[int, Matrix], orders: Values, sweep: Values
) -> float:
    """Return the visibility of changes of features (3, 1 + 2 m), by the place of their record.

    ``sweep`` (k,) is the change of the angle in the torsion sweep, rad.
    """
    names = list(changes)
    change = np.concatenate([change.ravel() for change in changes.values()])
    noise = np.concatenate([_noise(about, place, orders).ravel() for place in names])
    sizes = np.concatenate([_sizes(change).ravel() for change in changes.values()])
    noise = np.hypot(noise, LINEAR * sizes)
    within, low, high = _of_base(about, names, orders)
    costly = np.column_stack([_of_sensors(about, names, orders), _unrepeated(about, names, orders)])
    count = costly.shape[1]
    columns = np.vstack(
        [
            np.hstack([within, costly]) / noise[:, None],
            np.hstack([np.zeros((count, within.shape[1])), np.eye(count)]),
        ]
    )
    target = np.concatenate([change / noise, np.zeros(count)])
    # To the size of the unknowns' number, without which the bounded solver is slow.
    _, triangle = np.linalg.qr(np.column_stack([columns, target]))
    ends = np.full(count, np.inf)
    bounds = np.concatenate([low, -ends]), np.concatenate([high, ends])
    solution = lsq_linear(triangle[:, :-1], triangle[:, -1], bounds)
    return float(np.sqrt(2.0 * solution.cost + _bend(about, sweep)))


def _sizes(change: Matrix) -> Matrix:
    """Return the sizes of the means and lines of a change, shape (3, 1 + 2 m) as it."""
    lines_of = change[:, 1:].reshape(3, 2, -1)
    size = np.hypot(lines_of[:, 0], lines_of[:, 1])
    return np.hstack([np.abs(change[:, :1]), size, size])


def _bend(about: Circumstances, sweep: Values) -> float:
    """Return the square of what of a sweep no straight line over the torque explains."""
    torque = sweep_torque()
    basis = np.column_stack([np.ones(len(torque)), torque])
    residual = sweep - basis @ np.linalg.lstsq(basis, sweep, rcond=None)[0]
    return float(residual @ residual) / about.sensors.torsion_noise**2


def _noise(about: Circumstances, record: int, orders: Values) -> Matrix:
    """Return the standard deviation of the features of a record, shape (3, 1 + 2 m)."""
    condition, sensors = about.conditions[record], about.sensors
    raw = condition.duration(about.machine.ratio) * condition.rate
    sizes = np.array([2.0**0.5 * sensors.angle_noise, sensors.input_noise, sensors.output_noise])
    of_lines = np.full(2 * len(orders), (2.0 / raw) ** 0.5)
    return np.outer(sizes, np.concatenate([[raw**-0.5], of_lines]))


def _placed(mean: Values, phasors: NDArray[np.complex128], at: Values, orders: Values) -> Values:
    """Return features (3 (1 + 2 m),) with means (3,) and phasors (k, 3) at some orders (k,)."""
    readings = np.zeros((3, 1 + 2 * len(orders)))
    readings[:, 0] = mean
    for phasor, order in zip(phasors, at, strict=True):
        line = int(np.argmin(np.abs(orders - order)))
        readings[:, 1 + line] = phasor.real
        readings[:, 1 + len(orders) + line] = -phasor.imag
    return readings.ravel()


def _predicted(
    about: Circumstances, machine: Machine, rows: Sequence[int], orders: Values
) -> Values:
    parts = []
    for record in rows:
        speed = about.conditions[record].speed
        mean = means(machine, float(about.loads[record]), speed)
        parts.append(_placed(mean, lines(machine, speed), np.array(machine.orders), orders))
    return np.concatenate(parts)


def _of_base(
    about: Circumstances, rows: Sequence[int], orders: Values
) -> tuple[Matrix, Values, Values]:
    """Return what a tolerance of each base parameter changes, and how far each may move.

    Shapes (features, p), (p,) and (p,); in tolerances from its true value.
    """
    machine, columns, ends = about.machine, [], []
    stands = _predicted(about, machine, rows, orders)
    step = 1e-4
    for name in UNCERTAIN:
        true = getattr(machine, name) / getattr(SHEET, name)
        changed = replace(machine, **{name: getattr(SHEET, name) * (true + step)})
        moved = _predicted(about, changed, rows, orders) - stands
        columns.append(moved / step * SHEET.tolerance)
        ends.append(_ends((1.0 - true) / SHEET.tolerance))
    silent = replace(machine, amplitudes=(0.0,) * len(machine.orders))
    still = _predicted(about, silent, rows, orders)
    for line, (amplitude, believed) in enumerate(
        zip(machine.amplitudes, SHEET.amplitudes, strict=True)
    ):
        reach = SHEET.error_tolerance * believed
        for turn in (0.0, np.pi / 2.0):
            alone = np.eye(len(machine.orders))[line] * reach
            phases = [phase + turn for phase in machine.phases]
            changed = replace(machine, amplitudes=tuple(alone), phases=tuple(phases))
            columns.append(_predicted(about, changed, rows, orders) - still)
        # A line that turns by more than this is shorter than the tolerance allows, to this order.
        turned = (1.0 - (1.0 - SHEET.error_tolerance) ** 2) ** 0.5 / SHEET.error_tolerance
        ends += [_ends((believed - amplitude) / reach), (-turned, turned)]
    level = np.zeros((len(rows), 3, 1 + 2 * len(orders)))
    level[:, 0, 0] = SHEET.windup
    columns.append(level.ravel())
    ends.append((-np.inf, np.inf))
    low, high = np.array(ends).T
    return np.column_stack(columns), low, high


def _ends(middle: float) -> tuple[float, float]:
    """Return how far a parameter may move, the middle of its tolerance being there."""
    # A parameter out of tolerance, as under stress, may stay where it is.
    return min(middle - 1.0, -0.01), max(middle + 1.0, 0.01)


def _of_sensors(about: Circumstances, rows: Sequence[int], orders: Values) -> Matrix:
    """Return what gains and zeros of the torque sensors change, shape (features, 4)."""
    shape, columns = (len(rows), 3, 1 + 2 * len(orders)), []
    stands = _predicted(about, about.machine, rows, orders).reshape(shape)
    for channel, zero in ((1, SHEET.input_zero), (2, SHEET.output_zero)):
        level, grown = np.zeros(shape), np.zeros(shape)
        level[:, channel, 0] = zero
        grown[:, channel] = SHEET.gain * stands[:, channel]
        columns += [level.ravel(), grown.ravel()]
    return np.column_stack(columns)


def _unrepeated(about: Circumstances, rows: Sequence[int], orders: Values) -> Matrix:
    """Return what a standard deviation of each line's error in each record changes."""
    machine, columns = about.machine, []
    spread = SHEET.repeatability / len(machine.orders) ** 0.5
    width = 3 * (1 + 2 * len(orders))
    for row, record in enumerate(rows):
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
            column = np.zeros(width * len(rows))
            column[row * width : (row + 1) * width] = part
            columns.append(column)
    return np.column_stack(columns)


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
