"""An encoder whose zero changes between two records of a session.

The mean transmission error follows the load; what is left of it may step once, at a change of the
zero, or drift with the temperature. It is a change of the zero if one step, and no smooth drift,
leaves hardly more than noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from pymoo_hdte.discrepancy.campaign.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy.campaign.line_fit import OrderLines, order_lines
from pymoo_hdte.discrepancy.campaign.records import RunningRecord
from pymoo_hdte.discrepancy.campaign.rows.findings import RowFault
from pymoo_hdte.discrepancy.engine.rules import Rules

Values = NDArray[np.float64]

_LEAST_FREEDOM = 4
"""Degrees of freedom that loads and a step leave; with fewer, every step fits."""

_FEWEST = 2
"""Least number of records before and after a change: one may be off for any reason."""

_WARMING = (0.03, 0.1, 0.3, 1.0)
"""Time constants of drifts that are compared, in lengths of the session."""


class _Means(NamedTuple):
    """Mean transmission errors by rising time in the session, whitened with what explains them."""

    lines: list[OrderLines]
    values: Values
    loads: Values
    weights: Values
    elapsed: Values


def with_one_zero(
    records: Sequence[RunningRecord], believed: BelievedDrive, rig: Rig, rules: Rules
) -> tuple[tuple[RunningRecord, ...], tuple[RowFault, ...]]:
    """Return records without a change of an encoder's zero between two of them, and the change.

    Parameters
    ----------
    records : sequence of RunningRecord
        Of one session, in any order.
    believed : BelievedDrive
    rig : Rig
    rules : Rules

    Returns
    -------
    records : tuple of RunningRecord
        The same objects if there is no change.
    faults : tuple of RowFault
        None or one.
    """
    ordered = sorted(records, key=lambda one: one.elapsed)
    if len(ordered) < _LEAST_FREEDOM:
        return tuple(records), ()
    means = _means(ordered, believed, rig)
    found = _step(means, rules)
    if found is None:
        return tuple(records), ()
    first, size = found
    channel = _encoder(means, believed, first, size)
    moved = -size if channel == "output_angle" else size * believed.ratio
    late = {one.name for one in ordered[first:]}
    corrected = tuple(
        replace(one, **{channel: getattr(one, channel) - moved}) if one.name in late else one
        for one in records
    )
    n_rows = sum(len(one.time) for one in ordered[first:])
    fault = RowFault(ordered[first].name, "new zero", channel, 0, n_rows, moved, "modelled")
    return corrected, (fault,)


def _means(records: Sequence[RunningRecord], believed: BelievedDrive, rig: Rig) -> _Means:
    orders = [1.0 / believed.ratio, *believed.error_orders]
    lines = [order_lines(one, rig, believed.ratio, orders) for one in records]
    torque = np.array([one.mean[2] for one in lines])
    shared = rig.repeatability**2 / max(len(believed.error_orders), 1)
    variance = shared + np.array([one.covariance[0, 0, 0] for one in lines])
    # Every load has a level of its own, since how the torsion grows with it is not known here; but
    # small deviations of the load from what was set turn the drive by one stiffness.
    states = [(one.load_torque, one.input_speed > 0.0) for one in records]
    levels = np.array([[one == other for other in dict.fromkeys(states)] for one in states])
    beside = torque - np.array([one.load_torque for one in records])
    return _Means(
        lines,
        np.array([one.mean[0] for one in lines]) - torque / believed.stiffness,
        np.column_stack([levels, beside / believed.stiffness]),
        1.0 / np.sqrt(variance),
        np.array([one.elapsed for one in records]),
    )


def places_of_change(elapsed: Values) -> NDArray[np.int_]:
    """Return the first records after a possible change, for rising times of records (n,), s.

    Not between records taken at once, nor near the ends of the session.
    """
    places = np.flatnonzero(np.diff(elapsed) > 0.0) + 1
    return places[(places >= _FEWEST) & (places <= len(elapsed) - _FEWEST)]


def _left(means: _Means, *courses: Values) -> tuple[float, float]:
    """Return the chi-square beside loads and further courses, and the size of the last one."""
    design = np.column_stack([means.loads, *courses]) * means.weights[:, None]
    values = means.values * means.weights
    sizes = np.linalg.lstsq(design, values)[0]
    left = values - design @ sizes
    return float(left @ left), float(sizes[-1])


def _step(means: _Means, rules: Rules) -> tuple[int, float] | None:
    """Return the first record after a change of the zero, and its size in rad."""
    number, n_loads = means.loads.shape
    freedom = number - n_loads - 1
    if freedom < _LEAST_FREEDOM:
        return None
    places = places_of_change(means.elapsed)
    if not places.size:
        return None
    steps = [_left(means, (np.arange(number) >= place).astype(float)) for place in places]
    best = int(np.argmin([chi_square for chi_square, _ in steps]))
    chi_square, size = steps[best]
    least = float(norm.isf(rules.row_fault_chance / number / 2.0)) ** 2
    length = float(np.ptp(means.elapsed))
    times = means.elapsed / length
    smooth = [_left(means, times, times**2)[0]]
    smooth += [_left(means, np.exp(-times / constant))[0] for constant in _WARMING]
    # What is left may be more than noise, as an effect may move the mean with the speed.
    left = max(chi_square / freedom, 1.0)
    clear = left < rules.contradicting_chi_square and min(smooth) - chi_square > least * left
    return (int(places[best]), size) if clear else None


def _encoder(means: _Means, believed: BelievedDrive, first: int, size: float) -> str:
    """Return the encoder whose zero changed: with that of the input all phases turn."""
    phasors = np.array([one.phasors[0, 1:] for one in means.lines])
    turns = np.exp(1j * np.array(believed.error_orders) * size * believed.ratio)

    def apart(late: NDArray[np.complex128]) -> float:
        both = np.median(late.real, axis=0) + 1j * np.median(late.imag, axis=0)
        early = phasors[:first]
        before = np.median(early.real, axis=0) + 1j * np.median(early.imag, axis=0)
        return float(np.sum(np.abs(both - before) ** 2))

    of_input = apart(phasors[first:] * turns) < 0.5 * apart(phasors[first:])
    return "input_angle" if of_input else "output_angle"
