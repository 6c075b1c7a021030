"""Objectives and constraints of a problem as statistics of its responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.statistics import RobustConstraint, Statistic
from pymoo_hdte.problems._simulator.tails import tail_of
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate.threads import ENOUGH_TO_COMPILE

Requested = tuple[Statistic, float, float, int]
"""Statistic, factor, bound and place of the response."""


def place_of(statistic: Statistic, responses: tuple[str, ...]) -> int:
    """Return the position of the statistic's response, of several the first, of none 0.

    Raises
    ------
    InvalidInput
        As `places_of`.
    """
    return (places_of(statistic, responses) or [0])[0]


def places_of(statistic: Statistic, responses: tuple[str, ...]) -> list[int]:
    """Return the positions of the statistic's responses.

    Raises
    ------
    InvalidInput
        If there is none of that name, or none is named and there are several.
    """
    places = []
    for name in statistic.responses:
        if name is None and len(responses) == 1:
            places.append(0)
        elif name in responses:
            places.append(responses.index(name))
        else:
            raise InvalidInput("response of a statistic", name, f"one of {responses}")
    return places


def least_tail(objectives: Sequence[Statistic], constraints: Sequence[RobustConstraint]) -> float:
    """Return the tail of the inputs that statistics need, as in `Axis`."""
    rarest = [statistic.rarest() for statistic in objectives]
    rarest += [constraint.rarest for constraint in constraints]
    return tail_of(min(rarest, default=0.5))


def requested_of(
    objectives: Sequence[Statistic],
    constraints: Sequence[RobustConstraint],
    responses: tuple[str, ...],
) -> list[Requested]:
    """Return objectives and constraints as statistic, factor, bound and place of the response.

    What is to be small is the factor times the statistic's value, less the bound.

    Raises
    ------
    InvalidInput
        As `place_of`.
    """
    requested = [(statistic, statistic.sign, 0.0) for statistic in objectives]
    for limit in constraints:
        statistic, side = limit.statistic, limit.side
        requested.append((statistic, side * statistic.sign, side * limit.bound))
    return [(*request, place_of(request[0], responses)) for request in requested]


def by_moments(
    requested: Sequence[Requested], moments: SparseMoments, x: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return the requested values at many designs, shape (n, n_requested).

    None if there are few designs, or if mean and deviation do not suffice.
    """
    weights = [weight for statistic, *_ in requested if (weight := statistic.weights) is not None]
    if len(x) < ENOUGH_TO_COMPILE or len(weights) < len(requested):
        return None
    mean, std = moments(x)
    values = np.empty((len(x), len(requested)))
    columns = zip(values.T, weights, requested, strict=True)
    for column, (of_mean, of_std), (_, sign, bound, place) in columns:
        value = of_mean * mean[:, place] + of_std * std[:, place]
        np.subtract(sign * value, bound, out=column)
    return values
