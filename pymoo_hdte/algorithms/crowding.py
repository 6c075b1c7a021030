"""Crowding distance, and the removal of the most crowded points one by one.

Reference: K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, "A fast and elitist multiobjective genetic
algorithm: NSGA-II", IEEE Transactions on Evolutionary Computation 6 (2002) 182-197, section III-B.
"""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray


def crowding_distance(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the crowding distance of each row of objectives ``F`` (n, m); shape (n,).

    Sum over the objectives, scaled by their ranges, of the distance between a point's two
    neighbours; infinite for the two extremes of every objective. Of equal values the first row
    counts as the lower one.
    """
    scaled = _scaled(F)
    order = scaled.argsort(axis=0, kind="stable")
    columns = np.arange(F.shape[1])
    values = scaled[order, columns]
    gaps = np.full_like(scaled, np.inf)
    gaps[order[1:-1], columns] = values[2:] - values[:-2]
    return gaps.sum(axis=1)


def crowding_tournaments(
    F: NDArray[np.float64], n: int, random_state: np.random.Generator
) -> NDArray[np.int_]:
    """Return ``n`` rows of ``F`` (k, m), each the less crowded of two drawn at random."""
    pairs = random_state.integers(len(F), size=(n, 2))
    distance = crowding_distance(F)[pairs]
    return np.where(distance[:, 0] >= distance[:, 1], pairs[:, 0], pairs[:, 1])


def least_crowded(F: NDArray[np.float64], size: int) -> NDArray[np.int_]:
    """Return the rows, ascending, that stay when the most crowded leave one by one until ``size``.

    Distances are counted anew after each removal, on the ranges of the whole ``F`` (n, m); of equal
    distances the first row leaves. As only the neighbours of a removed point change, they alone are
    recounted; their former entries stay in the heap and are passed over.
    """
    n = len(F)
    if n <= size:
        return np.arange(n)
    neighbours = _Neighbours(_scaled(F))
    distance = [neighbours.distance(row) for row in range(n)]
    heap = list(zip(distance, range(n), strict=True))
    heapify(heap)
    present = set(range(n))
    while len(present) > size:
        shortest, row = heappop(heap)
        if row not in present or shortest != distance[row]:
            continue
        present.remove(row)
        for neighbour in neighbours.remove(row):
            distance[neighbour] = neighbours.distance(neighbour)
            heappush(heap, (distance[neighbour], neighbour))
    return np.array(sorted(present))


def _scaled(F: NDArray[np.float64]) -> NDArray[np.float64]:
    span = np.ptp(F, axis=0)
    return (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)


class _Neighbours:
    """Linked lists: for each objective, the rows next below and next above every row."""

    def __init__(self, scaled: NDArray[np.float64]) -> None:
        self.n = len(scaled)
        # Two rows that do not exist bound every list: -inf below all others, +inf above them.
        lowest, highest = self.n, self.n + 1
        self.lists = []
        for column in scaled.T:
            order = np.concatenate([[lowest], column.argsort(kind="stable"), [highest]])
            below, above = np.zeros((2, self.n + 2), dtype=int)
            below[order[1:]], above[order[:-1]] = order[:-1], order[1:]
            value = [*column.tolist(), -np.inf, np.inf]
            self.lists.append((value, below.tolist(), above.tolist()))

    def distance(self, row: int) -> float:
        """Return the crowding distance of ``row`` among those that are left."""
        total = 0.0
        for value, below, above in self.lists:
            total += value[above[row]] - value[below[row]]
        return total

    def remove(self, row: int) -> set[int]:
        """Take ``row`` out and return the rows whose neighbours changed."""
        changed: set[int] = set()
        for _, below, above in self.lists:
            lower, upper = below[row], above[row]
            above[lower], below[upper] = upper, lower
            changed.update((lower, upper))
        return changed - {self.n, self.n + 1}
