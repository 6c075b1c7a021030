"""Orders at which a whitened force varies with the position, told from lines of one frequency.

The power of an order is compared with that of its neighbours, so that no noise of whatever colour
makes one; and an order has to explain more than any frequency does, in windows with a phase of
their own: mains and the switching of a motor's power stage have one frequency at all speeds, and
look like an order while the speed is constant.
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
    """Return the power of orders, (n,), over that of noise: the median of those around each."""
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
"""Ratio of the last to the first order of a block, for all of which the same rows are taken."""
NEIGHBOURS = np.concatenate([np.arange(-14.0, -3.5, 0.5), np.arange(4.0, 14.5, 0.5)])
"""Distances, in resolutions, of the orders the power of which is the noise of one between them."""
_SEGMENTS = 12
"""Windows of a record with phases of their own."""
_TRIES = 3
"""Searches per order that may be kept: some find what has one frequency."""


@dataclass(frozen=True)
class SeenOrder:
    """An order that was seen.

    Attributes
    ----------
    order : float
        Cycles per turn of an angle in rad; of a length, radians per m.
    resolution : float
        Change of the order by which the longest travel gets one more cycle.
    power : float
        Over the least that is significant.
    """

    order: float
    resolution: float
    power: float


@dataclass(frozen=True)
class SeenOrders:
    """What a search found.

    Attributes
    ----------
    kept : tuple of SeenOrder
        The strongest first.
    undecided : tuple of float
        Orders that may be frequencies.
    fixed : tuple of float
        Frequencies that are no orders, Hz.
    highest : float
        Order up to which all were tried.
    cut : bool
        Whether the records could show higher ones.
    """

    kept: tuple[SeenOrder, ...]
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
    """Return the orders at which the force of bands varies, told from frequencies.

    Parameters
    ----------
    bands : sequence of HighBand
        Of one port.
    expected : sequence of float
        Orders that a gear is known to have, which share a chance of a false alarm of their own.
    known : sequence of float
        Orders that are known already, and not looked for.
    rules : Rules
    """
    for order in known:
        bands = [one.without_order(order) for one in bands]
    grids, resolution, cut = _tried(bands, expected, rules)
    orders = np.concatenate(grids)
    kept: list[SeenOrder] = []
    fixed: list[float] = []
    undecided: list[float] = []
    for _ in range(_TRIES * rules.most_position_orders):
        if not orders.size or len(kept) == rules.most_position_orders:
            break
        power = _significance(bands, grids, expected, resolution, rules)
        for taken in (*known, *undecided, *(one.order for one in kept)):
            power[np.abs(orders - taken) <= rules.side_lines * resolution] = 0.0
        place = int(np.argmax(power))
        if power[place] <= 1.0:
            break
        order = _refined(bands, float(orders[place]), 0.5 * resolution)
        one = SeenOrder(order, resolution, float(power[place]))
        alone, frequency = told_from_frequencies(bands, order, rules)
        if alone and _at_two_speeds(bands, one, rules):
            kept.append(one)
            bands = [one.without_order(order) for one in bands]
        elif frequency is None:
            undecided.append(order)
        else:
            fixed.append(frequency)
            bands = [one.without_frequency(frequency) for one in bands]
    highest = float(grids[0][-1]) if grids[0].size else 0.0
    return SeenOrders(tuple(kept), tuple(undecided), tuple(sorted(set(fixed))), highest, cut)


def _tried(
    bands: Sequence[HighBand], expected: Sequence[float], rules: Rules
) -> tuple[list[Values], float, bool]:
    """Return grids of orders that are searched, their resolution, and whether the range was cut.

    The first is from orders with enough periods in the travel to those beyond the force's band in
    most rows. Expected orders that it steps over, or ends below, have grids of their own.
    """
    widest = max((float(np.ptp(one.position)) for one in bands), default=0.0)
    if widest == 0.0:
        return [np.empty(0)], 1.0, False
    resolution = 2.0 * np.pi / widest
    speed = np.concatenate([np.abs(one.speed) for one in bands])
    # The slow tail of the rows would ask for orders that the others cannot show.
    slow = np.quantile(speed[speed > 0.01 * speed.max()], rules.slow_rows_share)
    highest = max(one.highest for one in bands) * 2.0 * np.pi / slow
    lowest = max(
        resolution * rules.fewest_periods,
        min(one.lowest for one in bands) * 2.0 * np.pi / float(speed.max()),
    )
    step = 0.5 * resolution
    if (highest - lowest) / step > rules.most_tried_orders:
        # As for a shaft with parts of which there are whole numbers.
        step = max(step, 1.0)
        lowest = step * np.ceil(lowest / step)
    last = min(highest, lowest + rules.most_tried_orders * step)
    grids = [np.arange(lowest, last, step)]
    around = 0.5 * resolution * np.arange(-(SURROUNDINGS // 2), SURROUNDINGS // 2 + 1)
    for order in expected:
        missed = order >= last or step > 0.5 * resolution
        if missed and lowest <= order <= highest:
            near = order + around
            grids.append(near[near >= resolution * rules.fewest_periods])
    return grids, resolution, bool(last < highest)


def _significance(
    bands: Sequence[HighBand],
    grids: Sequence[Values],
    expected: Sequence[float],
    resolution: float,
    rules: Rules,
) -> Values:
    """Return the ratio of the power of each order to the least that is significant, (n_orders,).

    ``grids`` have evenly spaced orders each; n_orders is that of all.
    """
    found = [_over_noise(bands, orders) for orders in grids]
    total, counted = (np.concatenate(parts) for parts in zip(*found, strict=True))
    orders = np.concatenate(grids)
    near = np.zeros(len(orders), dtype=bool)
    for one in expected:
        near |= np.abs(orders - one) <= resolution
    chance = np.where(near, 1.0 / max(int(near.sum()), 1), 1.0 / max(int((~near).sum()), 1))
    limit = gamma.isf(rules.position_order_chance * chance, np.maximum(counted, 1))
    return np.asarray(total / limit)


def _over_noise(bands: Sequence[HighBand], orders: Values) -> tuple[Values, Values]:
    """Return the power of orders over that of their surroundings, and in how many sums it is."""
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
    found = np.zeros(len(orders))
    first = 0
    while first < len(orders):
        last = int(np.searchsorted(orders, max(_BLOCK * orders[first], orders[first] + 1e-9)))
        last = max(last, first + 1)
        gain = band.gain(float(orders[(first + last) // 2])) * way
        found[first:last] = _power(band, gain, orders[first:last])
        first = last
    return found


def _power(band: HighBand, gain: Values, orders: Values) -> Values:
    """Return the power of orders with one gain, (n,), per unit of noise; 0 with too few rows."""
    rows = np.flatnonzero(gain)
    if len(rows) < FEWEST_ROWS:
        return np.zeros(len(orders))
    sums = phasors(band.position[rows], (gain * band.force)[rows], orders)
    return np.asarray(np.abs(sums) ** 2 / np.sum(gain[rows] ** 2))


def _refined(bands: Sequence[HighBand], order: float, step: float) -> float:
    """Return the order of largest power near one of a grid with a step."""
    near = order + step * np.linspace(-1.0, 1.0, 41)
    power = np.zeros(len(near))
    for band in bands:
        for way in band.ways():
            power += _power(band, band.gain(order) * way, near)
    top = int(np.argmax(power))
    if not 0 < top < len(near) - 1:
        return float(near[top])
    # Powers are a parabola at their top: the steps are no limit of an order.
    before, middle, after = power[top - 1 : top + 2]
    bend = max(2.0 * middle - before - after, 1e-300)
    return float(near[top] + 0.5 * (near[1] - near[0]) * (after - before) / bend)


def told_from_frequencies(
    bands: Sequence[HighBand], order: float, rules: Rules
) -> tuple[bool, float | None]:
    """Return whether an order explains more than any frequency, and one in Hz that is significant.

    Once over whole records, as mains are coherent for hours, and once with a phase of its own in
    every window, as a switching frequency drifts. Where the speed changes, one of them explains
    clearly more.
    """
    lowest, highest = min(one.lowest for one in bands), max(one.highest for one in bands)
    for windows in (1, _SEGMENTS):
        longest = max(len(one.time) // windows * one.step for one in bands)
        frequencies = np.arange(lowest, highest, 0.25 / longest)
        of_frequency, n_windows = np.zeros(len(frequencies)), 0
        of_order, n_order = 0.0, 0
        for band in bands:
            turned = band.gain(order) * np.exp(-1j * order * band.position)
            for rows in np.array_split(np.arange(len(band.time)), windows):
                of_frequency += band.line_power(rows, frequencies)
                n_windows += 1
                for way in band.ways():
                    here = (turned * way)[rows]
                    size = float(np.sum(np.abs(here) ** 2))
                    if size > 0.0:
                        of_order += abs(band.force[rows] @ here) ** 2 / size
                        n_order += 1
        noise = float(np.median(of_frequency)) / gamma.median(n_windows)
        place = int(np.argmax(of_frequency))
        gain_of_order = of_order / noise - n_order
        gain_of_frequency = float(of_frequency[place]) / noise - n_windows
        limit = gamma.isf(rules.position_order_chance / len(frequencies), n_windows) - n_windows
        doubt = gamma.isf(rules.second_speed_chance, n_windows) - n_windows
        significant = gain_of_frequency > limit
        if gain_of_order <= gain_of_frequency + doubt and (windows == 1 or significant):
            return False, float(frequencies[place]) if significant else None
    return True, None


def _at_two_speeds(bands: Sequence[HighBand], seen: SeenOrder, rules: Rules) -> bool:
    """Tell whether an order is seen without the rows of its commonest speed, too.

    What rings at a frequency after a start, and starts at the same places again and again, follows
    the position as well as an order does, but at one speed only.
    """
    speed = np.sort(np.concatenate([np.abs(one.speed)[one.inside(seen.order)] for one in bands]))
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
