"""At which orders of a port's position something is left that varies with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.stats import gamma

from pymoo_hdte.discrepancy.fit import Fit
from pymoo_hdte.measured.data import MeasuredData

Values = NDArray[np.float64]

_FEWEST_PERIODS = 5.0
"""Periods within a record that make an order of what varies with its position: fewer may be a
wander."""
_FALSE_ORDER = 1e-4
"""Chance that noise alone shows any order."""
_MOST_ORDERS = 6
_MOST_TRIED = 2000
_SURROUNDINGS = 101
"""Orders whose median power is what noise shows at the one in their middle."""
_BESIDE = 5.0
"""Distance up to which an order is what another one leaves, whose size changes along the way."""


def position_orders(data: MeasuredData, base: Fit) -> dict[str, tuple[float, ...]]:
    """Return orders by port, the strongest first.

    Whole numbers per unit of the position: of an angle in rad, cycles per turn. What is slower in
    time than the residual's own trend is left to the friction.

    Parameters
    ----------
    data : MeasuredData
    base : Fit
        Of the model without effects.
    """
    coefficients = data.coefficients(base.residuals)
    found = {}
    for port in data.mechanism.ports:
        rows = [data.names.index(port.name)] if port.read else _touched(data, port.motion)
        signals = []
        for left_by_row, balance in zip(coefficients, data.spectra, strict=True):
            left = left_by_row[rows].sum(axis=0)
            signals.append((balance.ports[port.name].position, _detrended(balance.in_time(left))))
        found[port.name] = _strongest(signals)
    return found


def _touched(data: MeasuredData, motion: Mapping[str, float]) -> list[int]:
    return [data.names.index(name) for name in motion]


def _detrended(signal: Values) -> Values:
    """Return a signal without a polynomial of third degree in time."""
    time = np.linspace(-1.0, 1.0, len(signal))
    return signal - np.polynomial.Polynomial.fit(time, signal, 3)(time)


def _strongest(signals: list[tuple[Values, Values]]) -> tuple[float, ...]:
    """Return orders of which (position, signal) pairs show more than their own surroundings.

    One after the other, what is found being taken out, so that none is found again beside itself.
    """
    orders = _tried([position for position, _ in signals])
    kept: list[float] = []
    while len(kept) < _MOST_ORDERS and orders.size:
        ratio = _significance(signals, orders)
        place = int(np.argmax(ratio))
        if ratio[place] <= 1.0:
            break
        if not any(abs(orders[place] - other) <= _BESIDE for other in kept):
            kept.append(float(orders[place]))
        signals = [
            (position, _without(signal, orders[place] * position)) for position, signal in signals
        ]
    return tuple(kept)


def _tried(positions: Sequence[Values]) -> Values:
    """Return the orders that are looked at: with several periods, and samples to each of them."""
    widest = max(float(np.ptp(position)) for position in positions)
    finest = max(
        len(position) * np.pi / (4.0 * np.sum(np.abs(np.diff(position)))) for position in positions
    )
    lowest = max(1.0, np.ceil(2.0 * np.pi * _FEWEST_PERIODS / widest))
    return np.arange(lowest, min(finest, lowest + _MOST_TRIED))


def _significance(signals: Sequence[tuple[Values, Values]], orders: Values) -> Values:
    """Return the power at each order over what noise shows there by chance, shape (n_orders,)."""
    total, counted = np.zeros((2, len(orders)))
    for position, signal in signals:
        seen = orders * np.ptp(position) >= 2.0 * np.pi * _FEWEST_PERIODS
        if not seen.any():
            continue
        power = np.abs(np.exp(-1j * np.outer(orders[seen], position)) @ signal) ** 2
        around = median_filter(power, min(_SURROUNDINGS, len(power)), mode="nearest")
        total[seen] += power / np.maximum(around, 1e-300) * np.log(2.0)
        counted += seen
    limit = gamma.isf(_FALSE_ORDER / max(len(orders), 1), np.maximum(counted, 1))
    return np.asarray(total / limit)


def _without(signal: Values, angle: Values) -> Values:
    """Return a signal without what varies as cosine and sine of an angle, both of shape (n,)."""
    lines = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(signal - lines @ np.linalg.lstsq(lines, signal, rcond=None)[0])
