"""Truncation that keeps a set evenly spread, for any number of objectives.

The point whose nearest neighbour is closest leaves, one at a time; of a closest pair the one whose
next neighbour is closer (E. Zitzler, M. Laumanns, L. Thiele, "SPEA2: improving the strength Pareto
evolutionary algorithm", TIK report 103, ETH Zurich 2001, section 3.2, there with all neighbours).
Crowding distance, which adds up objective by objective, spreads evenly with two objectives only.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


def most_spread(F: NDArray[np.float64], size: int) -> NDArray[np.int_]:
    """Return the rows, ascending, of ``F`` (n, m) that stay when ``size`` of them may.

    Distances are Euclidean, in objectives scaled by the ranges of the whole ``F``; of a pair that
    only differs in further neighbours than the second, the first row leaves.
    """
    n = len(F)
    if n <= size:
        return np.arange(n)
    return np.flatnonzero(_kept(squared_distances(F), size))


def squared_distances(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared distances (n, n) of rows scaled by their ranges, inf on the diagonal."""
    span = np.ptp(F, axis=0)
    scaled = (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)
    distance = np.zeros((len(F), len(F)))
    for column in scaled.T:
        distance += (column[:, np.newaxis] - column) ** 2
    np.fill_diagonal(distance, np.inf)
    return distance


@njit(cache=True)
def _kept(distance: NDArray[np.float64], size: int) -> NDArray[np.bool_]:
    n = len(distance)
    stays = np.ones(n, dtype=np.bool_)
    nearest = np.empty(n, dtype=np.int64)
    second = np.empty(n, dtype=np.int64)
    for row in range(n):
        _find_neighbours(distance, stays, nearest, second, row)
    for _ in range(n - size):
        leaving = -1
        for row in range(n):
            if stays[row] and (leaving < 0 or _closer(distance, nearest, second, row, leaving)):
                leaving = row
        stays[leaving] = False
        for row in range(n):
            if stays[row] and (nearest[row] == leaving or second[row] == leaving):
                _find_neighbours(distance, stays, nearest, second, row)
    return stays


@njit(cache=True)
def _closer(
    distance: NDArray[np.float64],
    nearest: NDArray[np.int_],
    second: NDArray[np.int_],
    row: int,
    other: int,
) -> bool:
    first_gap = distance[row, nearest[row]] - distance[other, nearest[other]]
    if first_gap != 0.0:
        return first_gap < 0.0
    return distance[row, second[row]] < distance[other, second[other]]


@njit(cache=True)
def _find_neighbours(
    distance: NDArray[np.float64],
    stays: NDArray[np.bool_],
    nearest: NDArray[np.int_],
    second: NDArray[np.int_],
    row: int,
) -> None:
    first, then = row, row
    for other in range(len(distance)):
        if not stays[other] or other == row:
            continue
        if distance[row, other] < distance[row, first]:
            first, then = other, first
        elif distance[row, other] < distance[row, then]:
            then = other
    nearest[row], second[row] = first, then
