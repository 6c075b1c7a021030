"""Objectives and constraints of a problem as statistics of its responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.statistics import RobustConstraint, Statistic
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate.threads import MANY

Asked = tuple[Statistic, float, float, int]
"""Statistic, factor, bound and place of the response."""


def place_of(statistic: Statistic, responses: tuple[str, ...]) -> int:
    """Return the position of the statistic's response.

    Raises
    ------
    InvalidInput
        If there is none of that name, or none is named and there are several.
    """
    if statistic.response is None and len(responses) == 1:
        return 0
    if statistic.response not in responses:
        raise InvalidInput("response of a statistic", statistic.response, f"one of {responses}")
    return responses.index(statistic.response)


def asked_of(
    objectives: Sequence[Statistic],
    constraints: Sequence[RobustConstraint],
    responses: tuple[str, ...],
) -> list[Asked]:
    """Return objectives and constraints as statistic, factor, bound and place of the response.

    What is to be small is the factor times the statistic's value, less the bound.

    Raises
    ------
    InvalidInput
        As `place_of`.
    """
    asked = [(one, one.sign, 0.0) for one in objectives]
    for limit in constraints:
        one, side = limit.statistic, limit.side
        asked.append((one, side * one.sign, side * limit.bound))
    return [(*one, place_of(one[0], responses)) for one in asked]


def by_moments(
    asked: Sequence[Asked], moments: SparseMoments, x: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return what is asked for at very many designs, shape (n, n_asked).

    None if there are few designs, or if mean and deviation do not suffice.
    """
    weights = [found for one, *_ in asked if (found := one.weights) is not None]
    if len(x) < MANY or len(weights) < len(asked):
        return None
    mean, std = moments(x)
    values = np.empty((len(x), len(asked)))
    each = zip(values.T, weights, asked, strict=True)
    for column, (of_mean, of_std), (_, sign, bound, place) in each:
        value = of_mean * mean[:, place] + of_std * std[:, place]
        np.subtract(sign * value, bound, out=column)
    return values
