"""Orders at which the residual varies with the position of a port."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gamma

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.order_search import (
    over_noise,
    phasors,
)
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]

# Grid and smoothing of the search; `Rules` decide which order counts as seen.
_MOST_TRIED = 2000
_WHOLE = 2.0
"""Coarsest resolution of the travel at which orders are taken as whole numbers."""
_BESIDE = 5.0
"""Distance, in steps, up to which an order is a side line of one with a changing amplitude."""


def position_orders(data: MeasuredData, base: Fit) -> dict[str, tuple[float, ...]]:
    """Return orders by port, the strongest first.

    They are whole cycles per turn of an angle in rad, or radians per m of a length. Variations that
    are slower than the trend of the residual in time are attributed to friction.

    Parameters
    ----------
    data : MeasuredData
    base : Fit
        Fit of the model without effects.
    """
    coefficients = data.coefficients(base.residuals)
    orders = {}
    for port in data.mechanism.ports:
        shares = {port.name: 1.0} if port.read else port.motion
        signals = []
        for residual_by_row, balance in zip(coefficients, data.spectra, strict=True):
            # A force at the port would enter all rows with these shares.
            rows = [data.names.index(name) for name in shares]
            residual = np.array(list(shares.values())) @ residual_by_row[rows]
            signals.append((balance.ports[port.name].shaft, _detrended(balance.in_time(residual))))
        orders[port.name] = _strongest(signals, data.rules)
    return orders


def periods_within(band: float, position: Values, step: float, orders: Values) -> Values:
    """Return how many periods of orders pass while their frequency is within a band, (n_orders,).

    Parameters
    ----------
    band : float
        Hz.
    position : ndarray, shape (n,)
        rad or m.
    step : float
        s.
    orders : ndarray, shape (n_orders,)
        Cycles per turn, or rad/m.
    """
    ways = np.sort(np.abs(np.diff(position)))
    travelled = np.r_[0.0, np.cumsum(ways)]
    slow = np.searchsorted(ways, 2.0 * np.pi * band * step / orders, side="right")
    return np.asarray(travelled[slow] * orders / (2.0 * np.pi))


def _detrended(signal: Values) -> Values:
    """Return a signal without a polynomial of third degree in time."""
    time = np.linspace(-1.0, 1.0, len(signal))
    return signal - np.polynomial.Polynomial.fit(time, signal, 3)(time)


def _strongest(signals: list[tuple[Values, Values]], rules: Rules) -> tuple[float, ...]:
    """Return orders with more power in (position, signal) pairs than neighbouring orders.

    Each order found is removed before the next search, so that none is found twice.
    """
    orders, step = _order_grid([position for position, _ in signals], rules)
    strongest: list[float] = []
    while len(strongest) < rules.most_position_orders and orders.size:
        ratio = _significance(signals, orders, rules)
        place = int(np.argmax(ratio))
        if ratio[place] <= 1.0:
            break
        order = _refined(signals, float(orders[place]), step)
        if not any(abs(order - stronger) <= _BESIDE * step for stronger in strongest):
            strongest.append(order)
        signals = [
            (position, _without_wave(signal, order * position)) for position, signal in signals
        ]
    return tuple(strongest)


def _order_grid(positions: Sequence[Values], rules: Rules) -> tuple[Values, float]:
    """Return the orders that are searched, and their step.

    Orders are whole numbers where the travel resolves them, as for a shaft; otherwise they step by
    half the resolution.
    """
    widest = max(float(np.ptp(position)) for position in positions)
    if widest == 0.0:
        return np.empty(0), 1.0
    step = 1.0 if np.pi / widest < _WHOLE else np.pi / widest
    lowest = step * np.ceil(max(1.0, 2.0 * np.pi * rules.fewest_periods / widest) / step)
    highest = min(max(map(_finest_order, positions)), lowest + _MOST_TRIED * step)
    return np.arange(lowest, highest, step), step


def _finest_order(position: Values) -> float:
    """Return the order at which a record has eight samples per period on average."""
    return len(position) * np.pi / (4.0 * max(float(np.sum(np.abs(np.diff(position)))), 1e-300))


def _refined(signals: Sequence[tuple[Values, Values]], order: float, step: float) -> float:
    """Return the order of largest power near one of a coarse grid."""
    if step == 1.0:
        return order
    fine_grid = order + step * np.linspace(-1.0, 1.0, 41)
    power = sum(
        np.abs(np.exp(-1j * np.outer(fine_grid, position)) @ signal) ** 2
        for position, signal in signals
    )
    return float(fine_grid[np.argmax(power)])


def _significance(signals: Sequence[tuple[Values, Values]], orders: Values, rules: Rules) -> Values:
    """Return the ratio of power to noise at each order, shape (n_orders,)."""
    total, counted = np.zeros((2, len(orders)))
    for position, signal in signals:
        seen = orders * np.ptp(position) >= 2.0 * np.pi * rules.fewest_periods
        seen &= orders <= _finest_order(position)
        if not seen.any():
            continue
        power = np.abs(phasors(position, signal, orders[seen])) ** 2
        total[seen] += over_noise(power)
        counted += seen
    limit = gamma.isf(rules.position_order_chance / max(len(orders), 1), np.maximum(counted, 1))
    return np.asarray(total / limit)


def _without_wave(signal: Values, angle: Values) -> Values:
    """Return a signal without its cosine and sine parts of an angle, both of shape (n,)."""
    lines = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(signal - lines @ np.linalg.lstsq(lines, signal, rcond=None)[0])
