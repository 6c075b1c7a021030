"""Variables of a chosen design that carry no information, because they move no objective."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

LITTLE = 1e-3
"""Share of an objective that a variable must move, between its bounds, to carry information."""


def without_influence(
    objectives: Callable[[Values], Values], lower: Values, upper: Values, design: Values
) -> NDArray[np.bool_]:
    """Return which variables move no objective by `LITTLE`, the others staying at the design.

    Parameters
    ----------
    objectives : callable
        Maps designs (n, d) to objectives (n, m), above 0; NaN where a design has none.
    lower, upper : ndarray, shape (d,)
        Bounds, in the units of the design.
    design : ndarray, shape (d,)
        The chosen one.

    Returns
    -------
    ndarray, shape (d,)
        False where an objective is NaN at a bound: such a variable matters.
    """
    moved = np.repeat(design[None], 2 * len(design) + 1, axis=0)
    for row, bound in enumerate((lower, upper)):
        np.fill_diagonal(moved[row * len(design) : -1], bound)
    values = objectives(moved)
    changes = np.abs(values[:-1] / values[-1] - 1.0).max(axis=1)
    return np.nan_to_num(changes, nan=np.inf).reshape(2, -1).max(axis=0) < LITTLE
