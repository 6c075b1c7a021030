"""A sensor whose zero changes between the records of a session.

The mean transmission error follows the load. Its residual may step once where the zero of an
encoder changes, be off in one record, or drift with the temperature. It is a change of the zero if
a step or one record, but no smooth drift, leaves hardly more than noise.

The mean input torque beyond that of the load is friction: a level at each speed, and a share of the
load. A single record that departs from this by more than the stated zero has another zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from pymoo_hdte.discrepancy._records.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.cleaning.findings import RowFault
from pymoo_hdte.discrepancy._records.line_fit import OrderLines, order_lines
from pymoo_hdte.discrepancy._records.records import ReadingError, RunningRecord
from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]

_LEAST_FREEDOM = 4
"""Degrees of freedom that loads and a step leave; with fewer, every step fits."""

_FEWEST = 2
"""Least number of records before and after a change that stays."""

_LEAST_OWN_SQUARE = 0.1
"""Least squared residual of one record's departure from the levels: 0.5 where two share one."""

_LEAST_SINGULAR_VALUE = 1e-9
"""Least singular value of the levels, as a share of the largest; a constant load adds none."""

_WARMING = (0.03, 0.1, 0.3, 1.0)
"""Time constants of drifts that are compared, in lengths of the session."""


class _Means(NamedTuple):
    """Mean transmission errors in the order of the session, with their loads and weights."""

    lines: list[OrderLines]
    values: Values
    loads: Values
    weights: Values
    elapsed: Values


class _Change(NamedTuple):
    """A zero that differs in some successive records, and by how much, rad or N.m."""

    records: slice
    channel: str
    size: float


def with_one_zero(
    records: Sequence[RunningRecord], believed: BelievedDrive, rig: Rig, rules: Rules
) -> tuple[tuple[RunningRecord, ...], tuple[RowFault, ...]]:
    """Return records without the differences between their zeros, and where these are.

    Parameters
    ----------
    records : sequence of RunningRecord
        Records of one session, in any order.
    believed : BelievedDrive
    rig : Rig
    rules : Rules

    Returns
    -------
    records : tuple of RunningRecord
        The same objects if there is no change.
    faults : tuple of RowFault
        At most one of a torque, in one record, and one of an encoder, in one or from it on.
    """
    ordered = sorted(records, key=lambda record: record.elapsed)
    if len(ordered) < _LEAST_FREEDOM:
        return tuple(records), ()
    faults = []
    for change_of in (_torque_change, _encoder_change):
        means = _means(ordered, believed, rig)
        change = change_of(ordered, means, believed, rig, rules)
        if change is not None:
            changed = ordered[change.records]
            n_rows = sum(len(record.time) for record in changed)
            size = (change.channel, 0, n_rows, change.size)
            faults.append(RowFault(changed[0].name, "new zero", *size, "modelled"))
            ordered[change.records] = [_shifted(record, change, len(changed)) for record in changed]
    by_name = {record.name: record for record in ordered}
    return tuple(by_name[record.name] for record in records), tuple(faults)


def _shifted(record: RunningRecord, change: _Change, number: int) -> RunningRecord:
    """Return a record without a change; the mean of one record alone remains uncertain by it."""
    values = getattr(record, change.channel) - change.size
    error = ReadingError(change.channel, abs(change.size))
    errors = (*record.reading_errors, error) if number == 1 else record.reading_errors
    return replace(record, **{change.channel: values}, reading_errors=errors)


def _means(records: Sequence[RunningRecord], believed: BelievedDrive, rig: Rig) -> _Means:
    orders = [1.0 / believed.ratio, *believed.error_orders]
    lines = [order_lines(record, rig, believed.ratio, orders) for record in records]
    torque = np.array([fit.mean[2] for fit in lines])
    shared = rig.repeatability**2 / max(len(believed.error_orders), 1)
    variance = shared + np.array([fit.covariance[0, 0, 0] for fit in lines])
    # Every load has a level of its own, since the torsion curve is unknown here; one stiffness
    # covers the small deviations of the load from its set value.
    states = _states(records)
    levels = np.array(
        [[state == distinct for distinct in dict.fromkeys(states)] for state in states]
    )
    beside = torque - np.array([record.load_torque for record in records])
    return _Means(
        lines,
        np.array([fit.mean[0] for fit in lines]) - torque / believed.stiffness,
        np.column_stack([levels, beside / believed.stiffness]),
        1.0 / np.sqrt(variance),
        np.array([record.elapsed for record in records]),
    )


def _outlier(
    records: Sequence[RunningRecord], values: Values, design: Values, weights: Values, rules: Rules
) -> tuple[int, float] | None:
    """Return the one record whose value departs from the others, and by how much, or None.

    The others have a level at each speed, and the columns of a design (n, p). There is none where
    another record fits nearly as well, or a session that warms up.
    """
    number = len(records)
    speeds = np.array([record.input_speed for record in records])
    levels = np.column_stack([speeds[:, None] == np.unique(speeds), design])
    axes, sizes, _ = np.linalg.svd(levels * weights[:, None], full_matrices=False)
    axes = axes[:, sizes > _LEAST_SINGULAR_VALUE * sizes[0]]
    freedom = number - axes.shape[1] - 1
    if freedom < _LEAST_FREEDOM:
        return None
    residual = values * weights
    residual = residual - axes @ (axes.T @ residual)
    elapsed = np.array([record.elapsed for record in records])
    constants = (float(np.ptp(elapsed)) or 1.0) * np.array(_WARMING)
    warming = np.exp(-np.divide.outer(elapsed - elapsed[0], constants))
    courses = np.column_stack([np.eye(number), warming * weights[:, None]])
    courses -= axes @ (axes.T @ courses)
    own = np.sum(courses**2, axis=0)
    known = own > _LEAST_OWN_SQUARE
    gains = np.where(known, (residual @ courses) ** 2 / np.where(known, own, 1.0), 0.0)
    place = int(np.argmax(gains[:number]))
    least = float(student.isf(rules.row_fault_chance / number / 2.0, freedom)) ** 2
    # The residual may be more than noise, as an effect may move the mean.
    excess = max(float(residual @ residual - gains[place]) / freedom, 1.0)
    if not gains[place] - np.delete(gains, place).max() > least * excess:
        return None
    return place, float(residual[place] / own[place] / weights[place])


def _torque_change(
    records: Sequence[RunningRecord],
    means: _Means,
    believed: BelievedDrive,
    rig: Rig,
    rules: Rules,
) -> _Change | None:
    """Return the change of a torque's zero, in one record."""
    ratio = believed.ratio
    of_input, of_output = np.array([fit.mean[1:3] for fit in means.lines]).T
    variance = np.array([fit.covariance[1:3, 0, 0] @ [1.0, ratio**-2] for fit in means.lines])
    forward = np.sign([record.input_speed for record in records])
    loads = np.column_stack([of_output, forward * np.abs(of_output)])
    friction = of_input - of_output / ratio
    outlier = _outlier(records, friction, loads, 1.0 / np.sqrt(variance), rules)
    if outlier is None:
        return None
    place, size = outlier
    channel = "input_torque"
    turned = size * ratio / believed.stiffness
    others = np.delete(means.values, place)[_of_same_state(records, place)]
    # A load that is read wrong also moves the transmission error away from that of the others.
    if others.size and abs(departs := means.values[place] - np.mean(others)) > abs(
        departs - turned
    ):
        channel, size = "output_torque", -size * ratio
    stated = getattr(rig, f"{channel}_zero")
    return _Change(slice(place, place + 1), channel, size) if abs(size) > stated else None


def _states(records: Sequence[RunningRecord]) -> list[tuple[float, bool]]:
    """Return the load of each record, and whether it turns forward."""
    return [(record.load_torque, record.input_speed > 0.0) for record in records]


def _of_same_state(records: Sequence[RunningRecord], place: int) -> list[bool]:
    """Return which other records have the load and direction of one, shape (n - 1,)."""
    states = _states(records)
    return [state == states[place] for state in (*states[:place], *states[place + 1 :])]


def places_of_change(elapsed: Values) -> NDArray[np.int_]:
    """Return the first records after a possible change, for rising times of records (n,), s.

    There are none between records taken at once, nor near the ends of the session.
    """
    places = np.flatnonzero(np.diff(elapsed) > 0.0) + 1
    return places[(places >= _FEWEST) & (places <= len(elapsed) - _FEWEST)]


def _chi_square(means: _Means, *courses: Values) -> tuple[float, float]:
    """Return the chi-square of a fit of loads and courses (n,), and the size of the last course."""
    design = np.column_stack([means.loads, *courses]) * means.weights[:, None]
    values = means.values * means.weights
    sizes = np.linalg.lstsq(design, values)[0]
    residual = values - design @ sizes
    return float(residual @ residual), float(sizes[-1])


def _step(means: _Means, rules: Rules) -> tuple[int, float] | None:
    """Return the first record after a change of the zero, and its size in rad."""
    number, n_loads = means.loads.shape
    freedom = number - n_loads - 1
    if freedom < _LEAST_FREEDOM:
        return None
    places = places_of_change(means.elapsed)
    if not places.size:
        return None
    steps = [_chi_square(means, (np.arange(number) >= place).astype(float)) for place in places]
    best = int(np.argmin([chi_square for chi_square, _ in steps]))
    chi_square, size = steps[best]
    least = float(norm.isf(rules.row_fault_chance / number / 2.0)) ** 2
    length = float(np.ptp(means.elapsed))
    times = means.elapsed / length
    smooth = [_chi_square(means, times, times**2)[0]]
    smooth += [_chi_square(means, np.exp(-times / constant))[0] for constant in _WARMING]
    # The residual may be more than noise, as an effect may move the mean with the speed.
    excess = max(chi_square / freedom, 1.0)
    clear = excess < rules.contradicting_chi_square and min(smooth) - chi_square > least * excess
    return (int(places[best]), size) if clear else None


def _encoder_change(
    records: Sequence[RunningRecord],
    means: _Means,
    believed: BelievedDrive,
    rig: Rig,
    rules: Rules,
) -> _Change | None:
    """Return the change of an encoder's zero, in one record or from it on."""
    change = _step(means, rules)
    if change is not None:
        place, size = change
        where = slice(place, len(records))
    else:
        change = _outlier(records, means.values, means.loads, means.weights, rules)
        # Without load the torsion stays where a hysteresis left it: no sensor has moved.
        if change is None or not records[change[0]].load_torque:
            return None
        place, size = change
        where = slice(place, place + 1)
    speeds = np.array([record.input_speed for record in records])
    if _is_of_input(means, believed, speeds, where, size):
        return _Change(where, "input_angle", size * believed.ratio)
    return _Change(where, "output_angle", -size)


def _is_of_input(
    means: _Means, believed: BelievedDrive, speeds: Values, where: slice, size: float
) -> bool:
    """Tell whether the zero of the input changed, which turns all phases."""
    phasors = np.array([fit.phasors[0, 1:] for fit in means.lines])
    turns = np.exp(1j * np.array(believed.error_orders) * size * believed.ratio)
    late, others = phasors[where], np.ones(len(speeds), dtype=bool)
    others[where] = False
    alike = others & np.isin(speeds, speeds[where])
    usual = phasors[alike if alike.any() else others]

    def apart(some: NDArray[np.complex128]) -> float:
        middle, before = (
            np.median(group.real, axis=0) + 1j * np.median(group.imag, axis=0)
            for group in (some, usual)
        )
        return float(np.sum(np.abs(middle - before) ** 2))

    return apart(late * turns) < 0.5 * apart(late)
