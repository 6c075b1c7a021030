"""What an algorithm offers when a budget is spent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

POPULATION = 100
"""Population of every algorithm that has one."""


class Offer(NamedTuple):
    """Objectives (n, m) of the feasible set an algorithm holds, and the evaluations it has spent.

    It spends less than its budget if a generation does not divide it, or if it broke off.
    """

    F: NDArray[np.float64]
    spent: int
