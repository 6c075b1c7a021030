"""A record that begins before the drive has settled: its first rows run out into the motion.

A controller that was just switched on, or a friction that builds up, leaves an exponential decay
from the first row on. Over the angle it is no line, but the slow lines take a part of it. It is
fitted with the lines, and no rows are lost (`records.RunningRecord.settling`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.campaign.line_basis import LineFit, decay
from pymoo_hdte.discrepancy.campaign.rows.faults import scatter
from pymoo_hdte.discrepancy.engine.rules import Rules

Rows = NDArray[np.float64]

# Shapes of the search; what its result is compared with are rules.
_CONSTANTS = 25
"""Time constants that are compared, from `_SHORTEST` rows to `_LONGEST` of the record."""
_SHORTEST = 4
"""Rows; a shorter decay is a spike."""
_LONGEST = 0.5
"""Share of the record, far beyond what counts as settling: a slow drift must not pass for it."""
_NARROWED = 9
"""Time constants between the neighbours of the best one."""
_PLACES = 24
"""Places in the record where a decay could begin as well."""
_INDEPENDENT = 1e-3
"""Least share of a decay's power that the lines do not take."""


class Settling(NamedTuple):
    """A decay: time constant in s, the channel of the lines that shows it best, size there.

    And how far it stands out of the noise, in standard deviations.
    """

    time: float
    place: int
    size: float
    deviations: float


def settling(fit: LineFit, deviations: float, rules: Rules) -> Settling | None:
    """Return the decay with which a record begins, or None.

    Parameters
    ----------
    fit : LineFit
        Of the order lines.
    deviations : float
        Least size of a decay in standard deviations of its own.
    rules : Rules
    """
    time, residual = fit.record.time, fit.whole_residual
    length = float(time[-1] - time[0])
    noise = np.array([scatter(one) for one in residual.T])
    if not noise.all():
        return None
    constants = np.geomspace(_SHORTEST / fit.record.sample_rate, _LONGEST * length, _CONSTANTS)
    best = int(np.argmax(_strength(fit, residual, noise, constants).max(axis=1)))
    near = constants[max(best - 1, 0)], constants[min(best + 1, _CONSTANTS - 1)]
    constants = np.geomspace(*near, _NARROWED)
    strength = _strength(fit, residual, noise, constants)
    best, place = divmod(int(np.argmax(strength)), strength.shape[1])
    constant, clear = float(constants[best]), float(strength[best, place])
    if clear < deviations or constant > rules.longest_settling * length:
        return None
    starts = time[0] + length * np.arange(_PLACES + 1) / (_PLACES + 1)
    shared, products = _sums(fit, residual, starts, np.full(len(starts), constant))
    size = products[0, place] / shared[0, 0]
    elsewhere = (products[1:, place] - size * shared[1:, 0]) / np.sqrt(np.diag(shared)[1:])
    common = float(np.abs(elsewhere).max()) / noise[place]
    if clear < rules.fault_prominence * common:
        return None
    return Settling(constant, place, float(size), clear)


def _strength(fit: LineFit, residual: Rows, noise: Rows, constants: Rows) -> Rows:
    """Return how strongly each channel speaks for each decay, (k, 4), in standard deviations."""
    starts = np.full(len(constants), fit.record.time[0])
    shared, products = _sums(fit, residual, starts, constants)
    power = np.diag(shared)
    whole = constants * fit.record.sample_rate / 2.0
    known = power > _INDEPENDENT * whole
    found = np.abs(products) / np.sqrt(np.where(known, power, 1.0))[:, None] / noise
    return np.where(known[:, None], found, 0.0)


def _sums(fit: LineFit, residual: Rows, starts: Rows, constants: Rows) -> tuple[Rows, Rows]:
    """Return the products of k decays beyond the lines, (k, k), and with a residual, (k, 4)."""
    squares = np.zeros((len(starts), len(starts)))
    lines = np.zeros((len(fit.triangle), len(starts)))
    products = np.zeros((len(starts), residual.shape[1]))
    for part in fit.parts:
        decays = decay(fit.record.time[part], starts, constants)
        squares += decays.T @ decays
        lines += fit.basis(part).T @ decays
        products += decays.T @ residual[part]
    return squares - lines.T @ lines, products
