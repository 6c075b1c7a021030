"""Elitism: which of the parents and their offspring make up the next swarm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.algorithms.dominance import constrained_ranks
from pymoo_hdte.algorithms.hypervolume import most_hypervolume
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.checks import InvalidInput

Truncation = Callable[[NDArray[np.float64], int], NDArray[np.int_]]
"""Takes mutually non-dominated objectives (n, m) and a size, and returns which rows stay."""

Quality = Literal["spread", "hypervolume"] | Truncation

_NAMED: dict[str, Truncation] = {"spread": most_spread, "hypervolume": most_hypervolume}


def truncation_of(quality: Quality) -> Truncation:
    """Return the truncation of a quality's name, or a truncation as it is.

    Raises
    ------
    InvalidInput
        If the name is not known.
    """
    if callable(quality):
        return quality
    if not isinstance(quality, str) or quality not in _NAMED:
        raise InvalidInput("quality", quality, f"{', '.join(_NAMED)} or a callable")
    return _NAMED[quality]


def survivors(points: Points, size: int, truncation: Truncation = most_spread) -> NDArray[np.int_]:
    """Return ``size`` rows, ascending: the best fronts, the last of them thinned out.

    Feasible points come before infeasible ones, these by violation. A point whose objectives and
    violation equal an earlier one's comes after all others, so that no front fills with copies.
    """
    size = min(size, len(points))
    ranks = constrained_ranks(points)
    copies = _copies(points)
    ranks[copies] += ranks.max()
    order = np.argsort(ranks, kind="stable")
    last_rank = ranks[order[size - 1]]
    safe = np.flatnonzero(ranks < last_rank)
    front = np.flatnonzero(ranks == last_rank)
    room = size - len(safe)
    # Infeasible fronts are ordered by violation, and copies are all alike: no spread to keep.
    spread = last_rank <= ranks[~copies].max() and points.violation[front[0]] == 0.0
    chosen = truncation(points.F[front], room) if spread else np.arange(room)
    return np.sort(np.concatenate([safe, front[chosen]]))


def _copies(points: Points) -> NDArray[np.bool_]:
    """Return which rows (n,) repeat an earlier one in objectives and violation."""
    copies = np.zeros(len(points), dtype=bool)
    first = np.sort(points.F[:, 0])
    if not np.any(first[1:] == first[:-1]):
        return copies
    keys = np.column_stack([points.F, points.violation])
    order = np.lexsort(keys.T)
    # Stable sorting leaves the earliest of equal rows in front.
    same = np.all(keys[order[1:]] == keys[order[:-1]], axis=1)
    copies[order[1:][same]] = True
    return copies
