"""What stands beside the orders that a drive is expected to show: a fixed frequency, a broad band.

Both spread over other orders in every record, so that a list of orders would not describe them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.data import Data
from pymoo_hdte.discrepancy.order_lines import CHANNELS, residual_spectrum

_FALSE_LINES = 1e-3
"""Chance that noise alone shows a line beyond the expected ones in a whole campaign."""
_SAME_FREQUENCY = 0.02
_FEWEST = 3
"""Records that must share a frequency before it is called fixed."""
_BROAD = 8.0
"""Lines that share the power from which on a band is broad; one line that leaks fills two."""


@dataclass(frozen=True)
class StrayLines:
    """Lines that are no orders.

    Attributes
    ----------
    frequency : float or None
        Hz, of a line that records at several speeds share.
    broad : tuple of str
        Channels in which many neighbouring lines share the power.
    """

    frequency: float | None = None
    broad: tuple[str, ...] = ()


def stray_lines(data: Data, unexpected: Sequence[float]) -> StrayLines:
    """Return the lines of a campaign that are no orders.

    Parameters
    ----------
    data : Data
    unexpected : sequence of float
        Orders of the features that are there only because records showed something at them.
    """
    if not unexpected:
        return StrayLines()
    ratio, rig, features = data.campaign.believed.ratio, data.campaign.rig, data.features
    known = [order for order in features.orders if np.abs(order - unexpected).min() > 1e-6]
    speeds = np.abs(features.conditions.input_speed)
    peaks, widths = [], []
    for record, speed in zip(features.records, speeds, strict=True):
        orders, amplitudes = residual_spectrum(record, rig, ratio, known)
        power = amplitudes**2
        power[power < np.log(power.size * len(speeds) / _FALSE_LINES)] = 0.0
        widths.append(_lines_in_effect(power))
        if power.any():
            strongest = int(np.argmax(power.max(axis=0)))
            peaks.append((orders[strongest] * speed / (2.0 * np.pi), speed))
    broad = np.median(widths, axis=0) > _BROAD
    names = tuple(name for name, wide in zip(CHANNELS, broad, strict=True) if wide)
    return StrayLines(None if names else _shared(np.array(peaks).reshape(-1, 2)), names)


def _lines_in_effect(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how many lines share the power (4, k) of each channel: (sum p)^2 / sum p^2."""
    square = np.maximum(np.sum(power**2, axis=1), np.finfo(float).tiny)
    return np.asarray(np.sum(power, axis=1) ** 2 / square)


def _shared(peaks: NDArray[np.float64]) -> float | None:
    """Return the frequency that peaks (k, 2), in Hz at a speed, have in common at many speeds."""
    frequencies, speeds = peaks.T
    for frequency in frequencies:
        same = np.abs(frequencies / frequency - 1.0) < _SAME_FREQUENCY
        if same.sum() >= _FEWEST and np.ptp(speeds[same]) > 0.1 * speeds[same].max():
            return float(np.median(frequencies[same]))
    return None
