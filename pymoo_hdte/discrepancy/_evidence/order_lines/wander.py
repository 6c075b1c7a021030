"""What the input does beside its lines, as nobody holds a set speed exactly.

What it does between the lines, it does in them as well: the neighbours of a line tell how much. A
set speed that wanders does so at frequencies of its own, whatever the speed. One that falls into a
line, and so between the lines of no neighbour, lies elsewhere among those of another record.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.line_fit import OrderLines
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._records.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]

NEIGHBOURS = 4
"""Multiples of 1/N on either side of a line that tell what is there: a mean of sixteen squares,
which is known to a quarter."""
_WITHIN = 2.0
"""Cycles in a record within which a tone may be hidden by a line and the one beside it."""
WHOLE = 1e-6
"""Distance from a whole order by rounding; these are the motor's."""


class _Beside(NamedTuple):
    """Spectrum of the input angle beside the lines of a record.

    Attributes
    ----------
    orders : ndarray, shape (k,)
        Cycles per input turn.
    power : ndarray, shape (k,)
        Over that of the noise.
    noise : ndarray, shape (m,)
        Variances of the lines by the sensor, rad2.
    turns_per_second : float
    duration : float
        s.
    """

    orders: Values
    power: Values
    noise: Values
    turns_per_second: float
    duration: float

    def tones(self, threshold: float) -> tuple[Values, Values]:
        """Return frequencies, Hz, and variances over the mean speed of what exceeds a power."""
        orders = self.orders
        beside = np.abs(orders - orders.round()) > WHOLE
        strong = beside & (self.power > threshold)
        variances = (self.power[strong] - 1.0) * np.median(self.noise) * orders[strong] ** 2
        return orders[strong] * self.turns_per_second, variances


def wander_of_lines(
    records: Sequence[RunningRecord],
    campaign: Campaign,
    lines: Sequence[OrderLines],
    rules: Rules,
) -> list[Values]:
    """Return the variances of the lines of the input angle beside their noise, rad2.

    For each record they have the shape of its orders, and are zero where no record wanders.
    """
    beside = [
        _beside(record, campaign, line, rules) for record, line in zip(records, lines, strict=True)
    ]
    own = [
        _of_neighbours(spectrum, line.orders, rules)
        for spectrum, line in zip(beside, lines, strict=True)
    ]
    if not any(variances.any() for variances in own):
        return own
    count = sum(spectrum.power.size for spectrum in beside)
    threshold = float(np.log(count / rules.unexpected_line_chance))
    tones = [(spectrum.duration, *spectrum.tones(threshold)) for spectrum in beside]
    return [
        np.maximum(variances, _of_tones(spectrum, line.orders, tones))
        for variances, spectrum, line in zip(own, beside, lines, strict=True)
    ]


def line_variances(line: OrderLines) -> Values:
    """Return the variances of the lines of the input angle by its sensor, rad2, shape (m,)."""
    variances = np.diag(line.covariance[3])[1:]
    return np.asarray((variances[: len(line.orders)] + variances[len(line.orders) :]) / 2.0)


def _beside(record: RunningRecord, campaign: Campaign, line: OrderLines, rules: Rules) -> _Beside:
    orders, amplitudes = residual_spectrum(
        record, campaign.rig, campaign.believed.ratio, line.orders, rules.highest_order
    )
    turns_per_second = abs(float(line.slope[3])) / (2.0 * np.pi)
    duration = float(np.ptp(record.time))
    return _Beside(orders, amplitudes[3] ** 2, line_variances(line), turns_per_second, duration)


def _of_neighbours(beside: _Beside, orders: Values, rules: Rules) -> Values:
    """Return what the neighbours of each line tell of it, rad2; zeros where all are noise.

    A set point that goes in steps has a speed whose power falls as the square of the frequency, and
    an angle as its fourth power.
    """
    searched, power = beside.orders, beside.power
    excess, seen = np.zeros(len(orders)), np.zeros(len(orders), dtype=bool)
    for place, order in enumerate(orders):
        middle = int(np.searchsorted(searched, order))
        near = slice(max(middle - NEIGHBOURS, 0), middle + NEIGHBOURS)
        count = len(searched[near])
        if not count:
            continue
        # The power of each neighbour is exponential under noise, with mean 1.
        chance = rules.unexpected_line_chance / len(orders)
        seen[place] = power[near].sum() > chi2.isf(chance, 2 * count) / 2.0
        excess[place] = np.mean((power[near] - 1.0) * (searched[near] / order) ** 4)
    return np.maximum(excess, 0.0) * beside.noise if seen.any() else np.zeros(len(orders))


def _of_tones(
    beside: _Beside, orders: Values, tones: Sequence[tuple[float, Values, Values]]
) -> Values:
    """Return the most that the tones of any record have within each line, rad2.

    A tone that is d cycles from a line in the shorter of two records has at most 1/(pi d)^2 of its
    power there, that of a sine seen for so long.
    """
    most = np.zeros(len(orders))
    for duration, frequencies, variances in tones:
        distances = np.abs(np.subtract.outer(orders * beside.turns_per_second, frequencies))
        cycles = distances * min(duration, beside.duration)
        shares = np.minimum(1.0, 1.0 / np.maximum(np.pi * cycles, 1.0) ** 2)
        most = np.maximum(most, np.where(cycles < _WITHIN, shares, 0.0) @ variances)
    return most / orders**2
