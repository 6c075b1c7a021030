"""Orders at which a whitened force varies with the position, as against fixed frequencies.

The power of an order is compared with that of its neighbours, so that noise of no colour makes one.
An order also has to explain more than any frequency, in windows with a phase of their own: mains
and the switching of a motor's power stage have one frequency at all speeds, and look like an order
while the speed is constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.stats import gamma

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.high_band import (
    FEWEST_ROWS,
    HighBand,
    Values,
)
from pymoo_hdte.discrepancy._selection.rules import Rules

Phasors = NDArray[np.complex128]

SURROUNDINGS = 101
"""Number of orders whose median power estimates the noise at the middle one."""


def over_noise(power: Values) -> Values:
    """Return the power of orders, (n,), over that of noise, the median of those around each."""
    around = median_filter(power, min(SURROUNDINGS, len(power)), mode="reflect")
    # Powers of noise are exponential, with a median of log 2.
    return np.asarray(power / np.maximum(around, 1e-300) * np.log(2.0))


def phasors(position: Values, signal: Values, orders: Values) -> Phasors:
    """Return the sum of a signal times exp(-i order position) at evenly spaced orders, (n_orders,).

    Every order is one of a coarse grid and one of a fine grid within its steps, so that the
    exponentials of about two square roots of n_orders are enough.
    """
    fine = int(np.ceil(np.sqrt(len(orders))))
    coarse = np.exp(-1j * np.outer(orders[::fine], position)) * signal
    within = np.exp(-1j * np.outer(orders[:fine] - orders[0], position))
    return np.asarray((coarse @ within.T).ravel()[: len(orders)])


_BLOCK = 1.1
"""Ratio of the last to the first order of a block, which shares its rows."""
NEIGHBOURS = np.concatenate([np.arange(-14.0, -3.5, 0.5), np.arange(4.0, 14.5, 0.5)])
"""Distances, in resolutions, of the orders whose power is the noise of the one between them."""
_SEGMENTS = 12
"""Windows of a record with phases of their own."""
_TRIES = 3
"""Searches per order that a search may return, since some find a frequency."""


@dataclass(frozen=True)
class SeenOrder:
    """An order with a significant line.

    Attributes
    ----------
    order : float
        Cycles per turn of an angle in rad; of a length, radians per m.
    resolution : float
        Change of the order by which the longest travel gets one more cycle.
    power : float
        Power over the least significant one.
    """

    order: float
    resolution: float
    power: float


@dataclass(frozen=True)
class SeenOrders:
    """The orders of a port, and the lines that are none.

    Attributes
    ----------
    orders : tuple of SeenOrder
        Significant orders, the strongest first.
    undecided : tuple of float
        Orders that may be frequencies instead.
    fixed : tuple of float
        Frequencies that are no orders, Hz.
    highest : float
        Highest order of the search.
    cut : bool
        Whether the records could show higher orders.
    """

    orders: tuple[SeenOrder, ...]
    undecided: tuple[float, ...]
    fixed: tuple[float, ...]
    highest: float
    cut: bool


def seen_orders(
    bands: Sequence[HighBand],
    expected: Sequence[float],
    known: Sequence[float],
    rules: Rules,
) -> SeenOrders:
    """Return the orders at which the force of bands varies, as against frequencies.

    Parameters
    ----------
    bands : sequence of HighBand
        Bands of one port.
    expected : sequence of float
        Orders that a gear is known to have; they share a probability of false alarms of their own.
    known : sequence of float
        Orders that are known already and not searched for.
    rules : Rules
    """
    for order in known:
        bands = [band.without_order(order) for band in bands]
    grids, resolution, cut = _order_grids(bands, expected, rules)
    orders = np.concatenate(grids)
    seen: list[SeenOrder] = []
    fixed: list[float] = []
    undecided: list[float] = []
    for _ in range(_TRIES * rules.most_position_orders):
        if not orders.size or len(seen) == rules.most_position_orders:
            break
        power = _significance(bands, grids, expected, resolution, rules)
        for taken in (*known, *undecided, *(line.order for line in seen)):
            power[np.abs(orders - taken) <= rules.side_lines * resolution] = 0.0
        place = int(np.argmax(power))
        if power[place] <= 1.0:
            break
        order = _refined(bands, float(orders[place]), 0.5 * resolution)
        line = SeenOrder(order, resolution, float(power[place]))
        no_frequency, frequency = differs_from_frequencies(bands, order, rules)
        if no_frequency and _at_two_speeds(bands, line, rules):
            seen.append(line)
            bands = [band.without_order(order) for band in bands]
        elif frequency is None:
            undecided.append(order)
        else:
            fixed.append(frequency)
            bands = [band.without_frequency(frequency) for band in bands]
    highest = float(grids[0][-1]) if grids[0].size else 0.0
    return SeenOrders(tuple(seen), tuple(undecided), tuple(sorted(set(fixed))), highest, cut)


def _order_grids(
    bands: Sequence[HighBand], expected: Sequence[float], rules: Rules
) -> tuple[list[Values], float, bool]:
    """Return grids of orders that are searched, their resolution, and whether the range was cut.

    The first grid begins at orders with enough periods in the travel, and ends where most rows are
    beyond the force's band. Expected orders between its steps or above it have grids of their own.
    """
    widest = max((float(np.ptp(band.position)) for band in bands), default=0.0)
    if widest == 0.0:
        return [np.empty(0)], 1.0, False
    resolution = 2.0 * np.pi / widest
    speed = np.concatenate([np.abs(band.speed) for band in bands])
    # The slowest rows would require orders that the others cannot show.
    slow = np.quantile(speed[speed > 0.01 * speed.max()], rules.slow_rows_share)
    highest = max(band.highest for band in bands) * 2.0 * np.pi / slow
    lowest = max(
        resolution * rules.fewest_periods,
        min(band.lowest for band in bands) * 2.0 * np.pi / float(speed.max()),
    )
    step = 0.5 * resolution
    if (highest - lowest) / step > rules.most_tried_orders:
        # Whole numbers, as for a shaft with whole numbers of teeth, poles or rollers.
        step = max(step, 1.0)
        lowest = step * np.ceil(lowest / step)
    end = min(highest, lowest + rules.most_tried_orders * step)
    grids = [np.arange(lowest, end, step)]
    around = 0.5 * resolution * np.arange(-(SURROUNDINGS // 2), SURROUNDINGS // 2 + 1)
    for order in expected:
        missed = order >= end or step > 0.5 * resolution
        if missed and lowest <= order <= highest:
            grid = order + around
            grids.append(grid[grid >= resolution * rules.fewest_periods])
    return grids, resolution, bool(end < highest)


def _significance(
    bands: Sequence[HighBand],
    grids: Sequence[Values],
    expected: Sequence[float],
    resolution: float,
    rules: Rules,
) -> Values:
    """Return the ratio of the power of each order to the least that is significant, (n_orders,).

    Each of the ``grids`` has evenly spaced orders; n_orders counts those of all.
    """
    powers = [_over_noise(bands, orders) for orders in grids]
    total, counted = (np.concatenate(parts) for parts in zip(*powers, strict=True))
    orders = np.concatenate(grids)
    is_expected = np.zeros(len(orders), dtype=bool)
    for order in expected:
        is_expected |= np.abs(orders - order) <= resolution
    chance = np.where(
        is_expected, 1.0 / max(int(is_expected.sum()), 1), 1.0 / max(int((~is_expected).sum()), 1)
    )
    limit = gamma.isf(rules.position_order_chance * chance, np.maximum(counted, 1))
    return np.asarray(total / limit)


def _over_noise(bands: Sequence[HighBand], orders: Values) -> tuple[Values, Values]:
    """Return the power of orders over that of their surroundings, and its number of addends."""
    total, counted = np.zeros((2, len(orders)))
    for band in bands:
        for way in band.ways():
            power = _powers(band, way, orders)
            seen = power > 0.0
            if not seen.any():
                continue
            total[seen] += over_noise(power[seen])
            counted += seen
    return total, counted


def _powers(band: HighBand, way: NDArray[np.bool_], orders: Values) -> Values:
    """Return the power of each order per unit of its noise, (n_orders,); 0 where nothing shows."""
    power = np.zeros(len(orders))
    start = 0
    while start < len(orders):
        end = int(np.searchsorted(orders, max(_BLOCK * orders[start], orders[start] + 1e-9)))
        end = max(end, start + 1)
        gain = band.gain(float(orders[(start + end) // 2])) * way
        power[start:end] = _power(band, gain, orders[start:end])
        start = end
    return power


def _power(band: HighBand, gain: Values, orders: Values) -> Values:
    """Return the power of orders with one gain, (n,), per unit of noise; 0 with too few rows."""
    rows = np.flatnonzero(gain)
    if len(rows) < FEWEST_ROWS:
        return np.zeros(len(orders))
    sums = phasors(band.position[rows], (gain * band.force)[rows], orders)
    return np.asarray(np.abs(sums) ** 2 / np.sum(gain[rows] ** 2))


def _refined(bands: Sequence[HighBand], order: float, step: float) -> float:
    """Return the order of largest power near one of a grid with a step."""
    fine_grid = order + step * np.linspace(-1.0, 1.0, 41)
    power = np.zeros(len(fine_grid))
    for band in bands:
        for way in band.ways():
            power += _power(band, band.gain(order) * way, fine_grid)
    top = int(np.argmax(power))
    if not 0 < top < len(fine_grid) - 1:
        return float(fine_grid[top])
    # The top of the power is a parabola, so that an order may lie between the steps.
    before, middle, after = power[top - 1 : top + 2]
    bend = max(2.0 * middle - before - after, 1e-300)
    return float(fine_grid[top] + 0.5 * (fine_grid[1] - fine_grid[0]) * (after - before) / bend)


def differs_from_frequencies(
    bands: Sequence[HighBand], order: float, rules: Rules
) -> tuple[bool, float | None]:
    """Return whether an order explains more than any frequency, or else a significant one in Hz.

    They are compared over whole records, because mains are coherent for hours, and with a phase of
    its own in every window, because a switching frequency drifts. Where the speed changes, one of
    them explains clearly more.
    """
    lowest, highest = min(band.lowest for band in bands), max(band.highest for band in bands)
    for windows in (1, _SEGMENTS):
        longest = max(len(band.time) // windows * band.step for band in bands)
        frequencies = np.arange(lowest, highest, 0.25 / longest)
        of_frequency, n_windows = np.zeros(len(frequencies)), 0
        of_order, n_order = 0.0, 0
        for band in bands:
            turned = band.gain(order) * np.exp(-1j * order * band.position)
            for rows in np.array_split(np.arange(len(band.time)), windows):
                of_frequency += band.line_power(rows, frequencies)
                n_windows += 1
                for way in band.ways():
                    wave = (turned * way)[rows]
                    size = float(np.sum(np.abs(wave) ** 2))
                    if size > 0.0:
                        of_order += abs(band.force[rows] @ wave) ** 2 / size
                        n_order += 1
        noise = float(np.median(of_frequency)) / gamma.median(n_windows)
        place = int(np.argmax(of_frequency))
        gain_of_order = of_order / noise - n_order
        gain_of_frequency = float(of_frequency[place]) / noise - n_windows
        limit = gamma.isf(rules.position_order_chance / len(frequencies), n_windows) - n_windows
        margin = gamma.isf(rules.second_speed_chance, n_windows) - n_windows
        significant = gain_of_frequency > limit
        if gain_of_order <= gain_of_frequency + margin and (windows == 1 or significant):
            return False, float(frequencies[place]) if significant else None
    return True, None


def _at_two_speeds(bands: Sequence[HighBand], seen: SeenOrder, rules: Rules) -> bool:
    """Tell whether an order is significant even without the rows of its commonest speed.

    A ringing of one frequency that starts at the same places again and again follows the position
    as an order does, but at one speed only.
    """
    speed = np.sort(np.concatenate([np.abs(band.speed)[band.inside(seen.order)] for band in bands]))
    width = rules.fixed_frequency_range * float(speed[-1])
    commonest = int(np.argmax(np.searchsorted(speed, speed + width) - np.arange(len(speed))))
    slowest = float(speed[commonest])
    orders = seen.order + seen.resolution * np.concatenate([np.zeros(1), NEIGHBOURS])
    total, counted = 0.0, 0
    for band in bands:
        size = np.abs(band.speed)
        gain = band.gain(seen.order) * ((size < slowest) | (size > slowest + width))
        for way in band.ways():
            rows = np.flatnonzero(gain * way)
            if len(rows) < FEWEST_ROWS:
                continue
            turned = np.exp(-1j * np.outer(orders, band.position[rows]))
            power = np.abs(turned @ (gain * band.force)[rows]) ** 2
            total += float(power[0] / np.median(power[1:])) * np.log(2.0)
            counted += 1
    return bool(counted) and total > gamma.isf(rules.second_speed_chance, counted)
