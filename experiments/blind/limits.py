"""Detection limits: how the rate of right verdicts grows with the size of an effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import isotonic_regression

from experiments.blind.data import Outcome
from experiments.blind.targets import Estimate, rate, select

LIMITS = (0.5, 0.95)
"""Rates whose sizes are looked for."""


def curve(outcomes: Sequence[Outcome], name: str) -> list[tuple[float, Estimate]]:
    """Return sizes and rates of right verdicts of an effect, by rising size."""
    kept = [*select(outcomes, "detection", name), *select(outcomes, "single", name)]
    sizes = sorted({one.case.size for one in kept})
    return [(size, rate([one.right for one in kept if one.case.size == size])) for size in sizes]


def size_at(outcomes: Sequence[Outcome], name: str, limit: float) -> float | None:
    """Return the size at which a rate is reached; None if it is not, or is at all sizes tried.

    Rates are made monotone, each with the weight of its cases, and taken as linear in the logarithm
    of the size between two sizes tried.
    """
    points = curve(outcomes, name)
    if not points:
        return None
    values = [estimate.value for _, estimate in points]
    monotone = isotonic_regression(values, weights=[estimate.n for _, estimate in points]).x
    reached = np.flatnonzero(monotone >= limit)
    if not reached.size or reached[0] == 0:
        return None
    place = reached[0]
    logs = np.log([points[place - 1][0], points[place][0]])
    return float(np.exp(np.interp(limit, monotone[place - 1 : place + 1], logs)))
