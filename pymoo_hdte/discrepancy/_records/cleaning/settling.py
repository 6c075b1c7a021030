"""A record that begins before the drive has settled: its first rows run out into the motion.

A controller that was just switched on, or a friction that builds up, leaves an exponential decay
from the first row on. It is no order line, but the slow lines take a part of it. So it is fitted
with the lines, and no rows are lost (`records.RunningRecord.settling`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from pymoo_hdte.discrepancy._records.cleaning.spikes_and_jumps import scatter
from pymoo_hdte.discrepancy._records.line_basis import LineFit, decays
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._selection.rules import Rules

Rows = NDArray[np.float64]

SETTLED = 3.0
"""Time constants after which a twentieth of a decay remains, and its rows end."""

# Shapes of the search; that a decay stands out is a matter of rules.
_SHORTEST = 16
"""Shortest time constant in rows; a shorter one may be a jump after the first rows."""
_LONGEST = 0.5
"""Longest time constant as a share of the record: far longer than settling, to see slow drifts."""
_CONSTANTS = 25
"""Time constants that are compared at once."""
_NARROWED = 3
"""Number of searches between the neighbours of the best one, which find it to 1e-4."""
_COARSE = 0.95
"""Least share of a decay's size that the nearest constant of the first comparison shows."""
_INDEPENDENT = 1e-3
"""Least share of a decay's power that the lines do not take; the fit is ill-posed below."""


class Settling(NamedTuple):
    """A decay, by the channel of the lines that shows it best.

    Attributes
    ----------
    constant : float
        Time constant, s.
    place : int
        Index of the channel.
    size : float
        Size at the first row, rad or N.m.
    deviations : float
        Size in standard deviations of the noise.
    """

    constant: float
    place: int
    size: float
    deviations: float


def unsettled_rows(record: RunningRecord) -> int:
    """Return the number of rows of a record before its decay is `SETTLED`."""
    ends = record.time[0] + SETTLED * (record.settling or 0.0)
    return int(np.count_nonzero(record.time < ends))


def settling(fit: LineFit, deviations: float, rules: Rules) -> Settling | None:
    """Return the decay with which a record begins, or None.

    Parameters
    ----------
    fit : LineFit
        Fit of the order lines.
    deviations : float
        Least size of a decay in its standard deviations.
    rules : Rules
    """
    record, residual = fit.record, fit.whole_residual
    length = float(record.time[-1] - record.time[0])
    noise = np.array([scatter(channel) for channel in residual.T])
    shortest = low = _SHORTEST / record.sample_rate
    high = _LONGEST * length
    if low >= high:
        return None
    for _ in range(1 + _NARROWED):
        constants = np.geomspace(low, high, _CONSTANTS)
        strength = _strength(fit, residual, noise, constants)
        best, place = divmod(int(np.argmax(strength)), strength.shape[1])
        if strength[best, place] < _COARSE * deviations:
            return None
        low, high = constants[max(best - 1, 0)], constants[min(best + 1, _CONSTANTS - 1)]
    constant, clear = float(constants[best]), float(strength[best, place])
    if clear < deviations or not shortest < constant <= rules.longest_settling * length:
        return None
    shape = _beyond_lines(fit, constant)
    size = float(shape @ residual[:, place] / (shape @ shape))
    later = _as_from_each_row(record, residual[:, place] - size * shape, constant)
    later[record.time < record.time[0] + SETTLED * constant] = 0.0
    initial = _as_from_each_row(record, residual[:, place], constant)[0]
    if abs(initial) < rules.fault_prominence * np.abs(later).max():
        return None
    return Settling(constant, place, size, clear)


def _strength(fit: LineFit, residual: Rows, noise: Rows, constants: Rows) -> Rows:
    """Return how strongly each channel speaks for each decay, (k, 4), in standard deviations.

    It is zero for a channel without noise, and for decays that the lines follow.
    """
    power, products = np.zeros(len(constants)), np.zeros((len(constants), residual.shape[1]))
    lines = np.zeros((len(fit.triangle), len(constants)))
    for part in fit.parts:
        some = decays(fit.record, part, constants)
        power += np.sum(some**2, axis=0)
        lines += fit.basis(part).T @ some
        products += some.T @ residual[part]
    independent = power - np.sum(lines**2, axis=0)
    known = (independent > _INDEPENDENT * power)[:, None] & (noise > 0.0)
    scale = np.sqrt(np.where(independent > 0.0, independent, 1.0))[:, None] * np.where(
        noise > 0.0, noise, 1.0
    )
    return np.where(known, np.abs(products) / scale, 0.0)


def _beyond_lines(fit: LineFit, constant: float) -> Rows:
    """Return the residual of the lines for a decay from 1 at the first row, shape (n,)."""
    shape = decays(fit.record, slice(None), np.array([constant]))[:, 0]
    share = sum(fit.basis(part).T @ shape[part] for part in fit.parts)
    for part in fit.parts:
        shape[part] -= fit.basis(part) @ share
    return shape


def _as_from_each_row(record: RunningRecord, values: Rows, constant: float) -> Rows:
    """Return the products of values (n,) with a decay from each row on, as rows in one step."""
    retained = np.exp(-1.0 / (record.sample_rate * constant))
    return np.asarray(lfilter([1.0], [1.0, -retained], values[::-1])[::-1])
