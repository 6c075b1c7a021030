"""A smooth Gaussian process over -1 to 1 of deviation 1, as a sum of sines with normal factors.

Solin and Sarkka, Statistics and Computing 30 (2020): sines that vanish beyond the range, each as
large as the spectrum of the process says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

LENGTH = 0.5
"""Length over which the process changes: a quarter of its range."""
TERMS = 10
"""Sines; the next ten have a hundredth of the variance."""
_EDGE = 2.0
"""Where the sines vanish, two lengths beyond the range, so that its ends are like its middle."""


def sine_of(number: int, place: Values) -> tuple[Values, Values]:
    """Return a sine, from 1 on, at places, times the deviation of its factor, and its slope."""
    rate = np.pi * number / (2.0 * _EDGE)
    density = np.sqrt(2.0 * np.pi) * LENGTH * np.exp(-0.5 * (rate * LENGTH) ** 2)
    size = np.sqrt(density / _EDGE)
    inside = np.clip(place, -_EDGE, _EDGE)
    angle = rate * (inside + _EDGE)
    return size * np.sin(angle), size * rate * np.cos(angle) * (inside == place)


def sines_of(place: Values) -> Values:
    """Return all sines at places (n,), shape (n, TERMS)."""
    return np.column_stack([sine_of(number, place)[0] for number in range(1, TERMS + 1)])
