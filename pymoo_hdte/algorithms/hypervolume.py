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
from pymoo_hdte.algorithms.spread import most_spread, unlinked

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
    stays = np.ones(n, dtype=np.bool_)
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    added = np.full(n, np.inf)
    for row in range(1, n - 1):
        added[row] = _rectangle(scaled, row - 1, row, row + 1)
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
    reference = np.full(3, _REFERENCE)
    rows = np.arange(len(scaled))
    while len(rows) > size:
        # All anew in O(n log n): in Python, recounting only what changed takes longer.
        added = hv_contributions(scaled[rows], ref=reference)
        added[safe[rows]] = np.inf
        rows = np.delete(rows, added.argmin())
    return rows
