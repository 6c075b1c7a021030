"""Truncation that keeps a set evenly spread, for any number of objectives.

The point whose nearest neighbour is closest leaves, one at a time; of a closest pair the one whose
next neighbour is closer (E. Zitzler, M. Laumanns, L. Thiele, "SPEA2: improving the strength Pareto
evolutionary algorithm", TIK report 103, ETH Zurich 2001, section 3.2, there with all neighbours).
Crowding distance, which adds up objective by objective, spreads evenly with two objectives only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import COMPILES, compiled


def most_spread(F: NDArray[np.float64], size: int) -> NDArray[np.int_]:
    """Return the rows, ascending, of ``F`` (n, m) that stay when ``size`` of them may.

    Distances are Euclidean, in objectives scaled by the ranges of the whole ``F``; of a pair that
    only differs in further neighbours than the second, the first row leaves.
    """
    n = len(F)
    if n <= size:
        return np.arange(n)
    span = np.ptp(F, axis=0)
    scaled = (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)
    if not COMPILES:
        return np.flatnonzero(_selected_in_numpy(scaled, size))
    if F.shape[1] == 2:
        order = np.lexsort(scaled.T[::-1])
        if np.all(np.diff(scaled[order, 1]) <= 0.0):
            return np.sort(order[_selected_of_chain(scaled[order], order, size)])
    order = np.argsort(scaled[:, 0], kind="stable")
    return np.flatnonzero(_selected(scaled, order, size))


@compiled
def _selected(scaled: NDArray[np.float64], order: NDArray[np.int_], size: int) -> NDArray[np.bool_]:
    """Say which rows stay; ``order`` is that of the first objective."""
    n = len(scaled)
    stays, places = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.int64)
    for place in range(n):
        stays[place], places[order[place]] = True, place
    # Of every row the two nearest that stay, and their squared distances.
    neighbours = np.empty((n, 2), dtype=np.int64)
    gaps = np.empty((n, 2))
    for row in range(n):
        _find_neighbours(scaled, stays, order, places, neighbours, gaps, row)
    for _ in range(n - size):
        leaving = -1
        for row in range(n):
            if stays[row] and (leaving < 0 or _closer(gaps, row, leaving)):
                leaving = row
        stays[leaving] = False
        for row in range(n):
            if stays[row] and (neighbours[row, 0] == leaving or neighbours[row, 1] == leaving):
                _find_neighbours(scaled, stays, order, places, neighbours, gaps, row)
    return stays


@compiled
def _selected_of_chain(
    scaled: NDArray[np.float64], number: NDArray[np.int_], size: int
) -> NDArray[np.bool_]:
    """Say the same of rows that ascend in one objective and descend in the other.

    There the nearest of all are the nearest along the chain. Rows are called ``number``.
    """
    n = len(scaled)
    stays, before, after = chain_of(n)
    gaps = np.empty((n, 2))
    for row in range(n):
        _measure(scaled, before, after, gaps, row)
    for _ in range(n - size):
        leaving = -1
        for row in range(n):
            if stays[row] and (
                leaving < 0
                or _closer(gaps, row, leaving)
                or (not _closer(gaps, leaving, row) and number[row] < number[leaving])
            ):
                leaving = row
        stays[leaving] = False
        lower, upper = unlinked(before, after, leaving)
        for _ in range(2):
            if lower >= 0:
                _measure(scaled, before, after, gaps, lower)
                lower = before[lower]
            if upper < n:
                _measure(scaled, before, after, gaps, upper)
                upper = after[upper]
    return stays


@compiled
def chain_of(n: int) -> tuple[NDArray[np.bool_], NDArray[np.int_], NDArray[np.int_]]:
    """Return which rows stay, all, and of each its neighbours, -1 and n beyond the ends."""
    stays = np.empty(n, dtype=np.bool_)
    before, after = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for row in range(n):
        stays[row], before[row], after[row] = True, row - 1, row + 1
    return stays, before, after


@compiled
def unlinked(before: NDArray[np.int_], after: NDArray[np.int_], row: int) -> tuple[int, int]:
    """Take a row out of a chain of n; return its neighbours, -1 and n beyond the ends."""
    lower, upper = int(before[row]), int(after[row])
    if lower >= 0:
        after[lower] = upper
    if upper < len(before):
        before[upper] = lower
    return lower, upper


@compiled
def _measure(
    scaled: NDArray[np.float64],
    before: NDArray[np.int_],
    after: NDArray[np.int_],
    gaps: NDArray[np.float64],
    row: int,
) -> None:
    """Write the two least squared distances of a row to two rows on either side."""
    least, second = np.inf, np.inf
    lower, upper = row, row
    for _ in range(2):
        lower = before[lower] if lower >= 0 else lower
        upper = after[upper] if upper < len(scaled) else upper
        for neighbour in (lower, upper):
            if 0 <= neighbour < len(scaled):
                distance = (scaled[row, 0] - scaled[neighbour, 0]) ** 2
                distance += (scaled[row, 1] - scaled[neighbour, 1]) ** 2
                if distance < least:
                    least, second = distance, least
                elif distance < second:
                    second = distance
    gaps[row, 0], gaps[row, 1] = least, second


@compiled
def _closer(gaps: NDArray[np.float64], row: int, reference: int) -> bool:
    gap, least = gaps[row, 0], gaps[reference, 0]
    return bool(gap < least or (gap == least and gaps[row, 1] < gaps[reference, 1]))


@compiled
def _find_neighbours(
    scaled: NDArray[np.float64],
    stays: NDArray[np.bool_],
    order: NDArray[np.int_],
    places: NDArray[np.int_],
    neighbours: NDArray[np.int_],
    gaps: NDArray[np.float64],
    row: int,
) -> None:
    nearest, second, gap, second_gap = row, row, np.inf, np.inf
    for direction in (-1, 1):
        place = places[row] + direction
        while 0 <= place < len(order):
            candidate = order[place]
            place += direction
            # Nobody further along the first objective is nearer.
            if (scaled[row, 0] - scaled[candidate, 0]) ** 2 > second_gap:
                break
            if not stays[candidate]:
                continue
            distance = 0.0
            for objective in range(scaled.shape[1]):
                distance += (scaled[row, objective] - scaled[candidate, objective]) ** 2
            if distance < gap:
                nearest, second, gap, second_gap = candidate, nearest, distance, gap
            elif distance < second_gap:
                second, second_gap = candidate, distance
    # One by one: assigning a tuple to a row takes three seconds more to compile.
    neighbours[row, 0], neighbours[row, 1] = nearest, second
    gaps[row, 0], gaps[row, 1] = gap, second_gap


def _selected_in_numpy(scaled: NDArray[np.float64], size: int) -> NDArray[np.bool_]:
    """Say the same as `_selected`, to the last bit, where there is no machine code."""
    n = len(scaled)
    # Added up objective by objective, as machine code does.
    squared = np.zeros((n, n))
    for values in scaled.T:
        squared += (values[:, None] - values) ** 2
    np.fill_diagonal(squared, np.inf)
    stays = np.ones(n, dtype=np.bool_)
    neighbours, gaps = np.empty((n, 2), dtype=np.int64), np.empty((n, 2))
    rows = np.arange(n)
    for _ in range(n - size + 1):
        # Of the changed rows, the two nearest that stay.
        distances = squared[rows]
        for place in range(2):
            nearest = distances.argmin(axis=1)
            here = np.arange(len(rows)), nearest
            neighbours[rows, place], gaps[rows, place] = nearest, distances[here]
            distances[here] = np.inf
        if np.count_nonzero(stays) == size:
            break
        alive = np.flatnonzero(stays)
        closest = alive[gaps[alive, 0] == gaps[alive, 0].min()]
        leaving = closest[gaps[closest, 1].argmin()]
        stays[leaving] = False
        squared[:, leaving] = np.inf
        rows = np.flatnonzero(stays & (neighbours == leaving).any(axis=1))
    return stays
