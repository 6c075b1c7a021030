"""Phasors of a signal at orders of a position, and how far their power stands above the noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

Values = NDArray[np.float64]
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
