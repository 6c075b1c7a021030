"""At which orders of a port's position something is left that varies with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.stats import gamma

from pymoo_hdte.discrepancy.engine.fitting import Fit
from pymoo_hdte.discrepancy.engine.rules import Rules
from pymoo_hdte.discrepancy.mechanism.evidence import MeasuredData

Values = NDArray[np.float64]

# Grid and smoothing of the search. When an order counts as seen stands in `Rules`.
_MOST_TRIED = 2000
_WHOLE = 2.0
"""Resolution up to which orders are taken for whole numbers."""
_SURROUNDINGS = 101
"""Orders whose median power is what noise shows at the one in their middle."""
_BESIDE = 5.0
"""Steps up to which an order is what another one leaves, whose size changes along the way."""


def position_orders(data: MeasuredData, base: Fit) -> dict[str, tuple[float, ...]]:
    """Return orders by port, the strongest first.

    Cycles per turn of an angle in rad, whole numbers; of a length, radians per m. What is slower in
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
        shares = {port.name: 1.0} if port.read else port.motion
        signals = []
        for left_by_row, balance in zip(coefficients, data.spectra, strict=True):
            # As a force at the port would stand in all of them.
            rows = [data.names.index(name) for name in shares]
            residual = np.array(list(shares.values())) @ left_by_row[rows]
            signals.append(
                (balance.ports[port.name].position, _detrended(balance.in_time(residual)))
            )
        found[port.name] = _strongest(signals, data.rules)
    return found


def _detrended(signal: Values) -> Values:
    """Return a signal without a polynomial of third degree in time."""
    time = np.linspace(-1.0, 1.0, len(signal))
    return signal - np.polynomial.Polynomial.fit(time, signal, 3)(time)


def _strongest(signals: list[tuple[Values, Values]], rules: Rules) -> tuple[float, ...]:
    """Return orders of which (position, signal) pairs show more than their own surroundings.

    One after the other, what is found being taken out, so that none is found again beside itself.
    """
    orders, step = _tried([position for position, _ in signals], rules)
    kept: list[float] = []
    while len(kept) < rules.most_position_orders and orders.size:
        ratio = _significance(signals, orders, rules)
        place = int(np.argmax(ratio))
        if ratio[place] <= 1.0:
            break
        order = _refined(signals, float(orders[place]), step)
        if not any(abs(order - other) <= _BESIDE * step for other in kept):
            kept.append(order)
        signals = [(position, _without(signal, order * position)) for position, signal in signals]
    return tuple(kept)


def _tried(positions: Sequence[Values], rules: Rules) -> tuple[Values, float]:
    """Return the orders that are looked at, and their step.

    Whole numbers where the travel, as of a shaft, resolves them; otherwise half of what it does.
    """
    widest = max(float(np.ptp(position)) for position in positions)
    if widest == 0.0:
        return np.empty(0), 1.0
    step = 1.0 if np.pi / widest < _WHOLE else np.pi / widest
    lowest = step * np.ceil(max(1.0, 2.0 * np.pi * rules.fewest_periods / widest) / step)
    highest = min(max(map(_finest, positions)), lowest + _MOST_TRIED * step)
    return np.arange(lowest, highest, step), step


def _finest(position: Values) -> float:
    """Return the order of which a record has, in the mean, eight samples to a period."""
    return len(position) * np.pi / (4.0 * max(float(np.sum(np.abs(np.diff(position)))), 1e-300))


def _refined(signals: Sequence[tuple[Values, Values]], order: float, step: float) -> float:
    """Return the order beside one of a coarse grid at which there is most."""
    if step == 1.0:
        return order
    near = order + step * np.linspace(-1.0, 1.0, 41)
    power = sum(
        np.abs(np.exp(-1j * np.outer(near, position)) @ signal) ** 2 for position, signal in signals
    )
    return float(near[np.argmax(power)])


def _significance(signals: Sequence[tuple[Values, Values]], orders: Values, rules: Rules) -> Values:
    """Return the power at each order over what noise shows there by chance, shape (n_orders,)."""
    total, counted = np.zeros((2, len(orders)))
    for position, signal in signals:
        seen = orders * np.ptp(position) >= 2.0 * np.pi * rules.fewest_periods
        seen &= orders <= _finest(position)
        if not seen.any():
            continue
        power = np.abs(np.exp(-1j * np.outer(orders[seen], position)) @ signal) ** 2
        around = median_filter(power, min(_SURROUNDINGS, len(power)), mode="reflect")
        total[seen] += power / np.maximum(around, 1e-300) * np.log(2.0)
        counted += seen
    limit = gamma.isf(rules.position_order_chance / max(len(orders), 1), np.maximum(counted, 1))
    return np.asarray(total / limit)


def _without(signal: Values, angle: Values) -> Values:
    """Return a signal without what varies as cosine and sine of an angle, both of shape (n,)."""
    lines = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(signal - lines @ np.linalg.lstsq(lines, signal, rcond=None)[0])
