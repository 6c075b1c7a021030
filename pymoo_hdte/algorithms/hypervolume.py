"""Truncation that keeps as much dominated hypervolume as it can, for two and three objectives.

The point that adds least to the hypervolume leaves, one at a time (N. Beume, B. Naujoks, M.
Emmerich, "SMS-EMOA: multiobjective selection based on dominated hypervolume", European Journal of
Operational Research 181 (2007) 1653-1669).
"""

from __future__ import annotations

import numpy as np
from moocore import hv_contributions
from numpy.typing import NDArray

from pymoo_hdte._compilation import COMPILES, compiled
from pymoo_hdte.algorithms.spread import chain_of, most_spread, unlinked

_REFERENCE = 1.1
"""Reference point with three objectives, in every range of the set, counted from its least value.

A larger one favours the rim of the front (H. Ishibuchi, R. Imada, Y. Setoguchi, Y. Nojima, "How to
specify a reference point in hypervolume calculation for fair performance comparison", Evolutionary
Computation 26 (2018) 411-440).
"""


def most_hypervolume(
    F: NDArray[np.float64], size: int, *, keep_ends: bool = True
) -> NDArray[np.int_]:
    """Return the rows, ascending, of ``F`` (n, m) that stay when ``size`` of them may.

    Objectives count in the ranges of the whole ``F``, whose rows must not dominate each other. With
    two objectives the ends stay as long as two rows may; with three the reference point lies a
    tenth of the range beyond the largest values, and the row with the largest value of each
    objective stays as long as so many may, unless ``keep_ends`` is false. Without that, a swarm
    whose points nearly all have the least value of an objective loses the few others, which add
    little in the present ranges, and never finds what lies beyond. Of equal contributions the
    first row leaves. With four or more objectives contributions take too long, and `most_spread`
    decides.
    """
    n, n_obj = F.shape
    if n <= size:
        return np.arange(n)
    if n_obj > 3:
        return most_spread(F, size)
    span = np.ptp(F, axis=0)
    scaled = (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)
    if n_obj == 2:
        order = np.lexsort(scaled.T[::-1])
        select = _selected_of_two if COMPILES else _selected_of_two_in_numpy
        return np.sort(order[select(scaled[order], order, size)])
    safe = np.zeros(n, dtype=bool)
    # An objective that is the same everywhere has no end.
    ends = np.unique(scaled[:, span > 0].argmax(axis=0))
    if keep_ends and len(ends) <= size:
        safe[ends] = True
    return _selected_of_three(scaled, size, safe)


@compiled
def _selected_of_two(
    scaled: NDArray[np.float64], number: NDArray[np.int_], size: int
) -> NDArray[np.bool_]:
    """Say which of the rows stay, which ascend in the first objective and are called ``number``."""
    n = len(scaled)
    stays, before, after = chain_of(n)
    added = np.empty(n)
    for row in range(n):
        inside = 0 < row < n - 1
        added[row] = _rectangle(scaled, row - 1, row, row + 1) if inside else np.inf
    for _ in range(n - size):
        leaving = -1
        for row in range(n):
            if stays[row] and (
                leaving < 0
                or added[row] < added[leaving]
                or (added[row] == added[leaving] and number[row] < number[leaving])
            ):
                leaving = row
        stays[leaving] = False
        lower, upper = unlinked(before, after, leaving)
        for row in (lower, upper):
            if 0 <= row < n and before[row] >= 0 and after[row] < n:
                added[row] = _rectangle(scaled, before[row], row, after[row])
    return stays


@compiled
def _rectangle(scaled: NDArray[np.float64], lower: int, row: int, upper: int) -> float:
    width = scaled[upper, 0] - scaled[row, 0]
    return float(width * (scaled[lower, 1] - scaled[row, 1]))


def _selected_of_two_in_numpy(
    scaled: NDArray[np.float64], number: NDArray[np.int_], size: int
) -> NDArray[np.bool_]:
    """Say the same as `_selected_of_two`, to the last bit, where there is no machine code."""
    n = len(scaled)
    rows, called = np.arange(n), number.copy()
    stays = np.ones(n, dtype=np.bool_)
    before, after = (rows - 1).tolist(), (rows + 1).tolist()
    first, second = scaled.T.tolist()
    added = np.full(n, np.inf)
    added[1:-1] = np.diff(scaled[1:, 0]) * -np.diff(scaled[:-1, 1])
    for _ in range(n - size):
        least = np.flatnonzero(added == added.min())
        leaving = int(least[called[least].argmin()])
        stays[leaving] = False
        # Of what is left, all may be without limit.
        added[leaving], called[leaving] = np.inf, n
        lower, upper = before[leaving], after[leaving]
        if lower >= 0:
            after[lower] = upper
        if upper < n:
            before[upper] = lower
        for row in (lower, upper):
            if 0 <= row < n and before[row] >= 0 and after[row] < n:
                width = first[after[row]] - first[row]
                added[row] = width * (second[before[row]] - second[row])
    return stays


def _selected_of_three(
    scaled: NDArray[np.float64], size: int, safe: NDArray[np.bool_]
) -> NDArray[np.int_]:
    """Return which rows stay, the ``safe`` ones among them."""
    added = hv_contributions(scaled, ref=np.full(3, _REFERENCE))
    added[safe] = np.inf
    if COMPILES:
        order = np.argsort(scaled[:, 2], kind="stable")
        return np.flatnonzero(_selected_of_three_compiled(scaled, order, added, size))
    rows = np.arange(len(scaled))
    while len(rows) > size:
        rows = np.delete(rows, added.argmin())
        added = hv_contributions(scaled[rows], ref=np.full(3, _REFERENCE))
        added[safe[rows]] = np.inf
    return rows


@compiled
def _selected_of_three_compiled(
    scaled: NDArray[np.float64],
    order: NDArray[np.int_],
    added: NDArray[np.float64],
    size: int,
) -> NDArray[np.bool_]:
    """Say which of the rows stay, which ascend in the last objective by ``order``.

    What a row adds only grows as others leave, so that ``added``, once counted, is a lower bound,
    and only the row of the lowest one is counted again until it keeps that place.
    """
    n = len(scaled)
    stays, fresh = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    for row in range(n):
        stays[row] = fresh[row] = True
    stairs = np.empty((n + 1, 2))
    for _ in range(n - size):
        leaving = _least(added)
        while not fresh[leaving]:
            added[leaving] = _added_to_three(scaled, order, stays, leaving, stairs)
            fresh[leaving] = True
            leaving = _least(added)
        stays[leaving] = False
        added[leaving] = np.inf
        for row in range(n):
            fresh[row] = added[row] == np.inf
    return stays


@compiled
def _least(added: NDArray[np.float64]) -> int:
    least = 0
    for row in range(1, len(added)):
        if added[row] < added[least]:
            least = row
    return least


@compiled
def _added_to_three(
    scaled: NDArray[np.float64],
    order: NDArray[np.int_],
    stays: NDArray[np.bool_],
    row: int,
    stairs: NDArray[np.float64],
) -> float:
    """Return what a row adds to the hypervolume of those that stay; ``stairs`` is a buffer.

    The box of the row is cut into slices at the last objectives of the others; in a slice, what
    those below it leave of the row's rectangle lies under a descending flight of stairs.
    """
    first, second, level = scaled[row, 0], scaled[row, 1], scaled[row, 2]
    # The first step, which no row makes, bounds the rectangle.
    stairs[0, 0], stairs[0, 1] = first, _REFERENCE
    steps, area, volume = 1, (_REFERENCE - first) * (_REFERENCE - second), 0.0
    for other in order:
        if other == row or not stays[other]:
            continue
        x, y = max(scaled[other, 0], first), max(scaled[other, 1], second)
        begin = steps
        while begin > 1 and stairs[begin - 1, 0] > x:
            begin -= 1
        if stairs[begin - 1, 1] <= y:
            continue
        if scaled[other, 2] > level:
            volume += area * (scaled[other, 2] - level)
            level = scaled[other, 2]
        end = begin
        while end < steps and stairs[end, 1] >= y:
            end += 1
        # Steps from begin to end lie behind the new one.
        shift = begin + 1 - end
        if shift > 0:
            for step in range(steps - 1, end - 1, -1):
                stairs[step + 1, 0], stairs[step + 1, 1] = stairs[step, 0], stairs[step, 1]
        elif shift < 0:
            for step in range(end, steps):
                stairs[step + shift, 0], stairs[step + shift, 1] = stairs[step, 0], stairs[step, 1]
        steps += shift
        stairs[begin, 0], stairs[begin, 1] = x, y
        area = 0.0
        for step in range(steps):
            right = stairs[step + 1, 0] if step + 1 < steps else _REFERENCE
            area += (right - stairs[step, 0]) * (stairs[step, 1] - second)
        if area == 0.0:
            return volume
    return volume + area * (_REFERENCE - level)
