"""How much an index matters: the size of what it adds, in units of the scatter around designs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate.sparse.axes import Axis
from pymoo_hdte.surrogate.sparse.index_set import parents
from pymoo_hdte.surrogate.sparse.interpolation import GrowingInterpolation, Index
from pymoo_hdte.surrogate.sparse.leja import HIGHEST_DEGREE, hierarchical_basis
from pymoo_hdte.surrogate.sparse.measures import OrthonormalPolynomials

Array = NDArray[np.float64]

FIRST_DECAY = 0.5
"""Guess of the ratio of an axis's second surplus to its first, before both are known; by hand."""
BLIND_DECAY = 0.3
"""Factor for each degree of an index by which unexplained errors go to candidates; set by hand."""


class Influence:
    """Sizes of members in the L2 norm over the scatter, and guesses for candidates.

    Parameters
    ----------
    axes : list of Axis, length d
    designs : ndarray, shape (n, m)
        Designs at which sizes are judged, m of the axes having a design.
    """

    def __init__(self, axes: list[Axis], designs: Array) -> None:
        self.designs = designs
        self._squares, column = [], 0
        for axis in axes:
            own = designs[:, column] if axis.designed else None
            column += axis.designed
            rule = OrthonormalPolynomials(axis.cut, HIGHEST_DEGREE)
            offset, factor, _, _ = axis.around(own)
            z = offset[:, None] + factor[:, None] * rule.nodes
            self._squares.append(hierarchical_basis(axis.points, z) ** 2 @ rule.weights)

    def sizes(self, indices: NDArray[np.int_], surpluses: Array, scale: Array) -> Array:
        """Return the size of each member, shape (p,): the worst of the responses.

        Parameters
        ----------
        indices : ndarray of int, shape (p, d)
        surpluses : ndarray, shape (p, r)
            In the responses' units.
        scale : ndarray, shape (n, r)
            What counts as one, at each design.
        """
        square = np.ones((len(indices), 1))
        for j, table in enumerate(self._squares):
            square = square * table[indices[:, j]]
        per_response = np.mean(square[:, :, None] / scale**2, axis=1) * surpluses**2
        return np.sqrt(per_response.max(axis=1))


def expected_sizes(
    grown: GrowingInterpolation, sizes: Array, candidates: list[Index], unexplained: float
) -> Array:
    """Return a guess of the size of each candidate, shape (c,).

    From below along each axis by the decay seen on it, the smallest of these guesses. An error seen
    at points not used is ascribed to all, those of low degree first, so that an interaction whose
    parents vanish is found too.

    Parameters
    ----------
    grown : GrowingInterpolation
    sizes : ndarray, shape (p,)
        Of its members.
    candidates : list of tuple of int
    unexplained : float
        The error at points not used, in the same unit.
    """
    first, decay = _decays(grown, sizes)
    guesses = np.empty(len(candidates))
    for row, index in enumerate(candidates):
        guess = np.inf
        for j, below in parents(index):
            step = decay[j] if below[j] else min(1.0, first[j])
            guess = min(guess, step * sizes[grown.place(below)])
        guesses[row] = max(guess, unexplained * BLIND_DECAY ** sum(index))
    return guesses


def _decays(grown: GrowingInterpolation, sizes: Array) -> tuple[Array, Array]:
    """Return the size of the first index on each axis, and the ratio from degree to degree."""
    pure: list[dict[int, float]] = [{} for _ in grown.axes]
    for index, size in zip(grown.members, sizes, strict=True):
        raised = [j for j, k in enumerate(index) if k]
        if len(raised) == 1:
            pure[raised[0]][index[raised[0]]] = float(size)
    first, decay = np.ones(len(pure)), np.full(len(pure), FIRST_DECAY)
    for j, by_degree in enumerate(pure):
        first[j] = by_degree.get(1, 1.0)
        top = max(by_degree, default=1)
        # The larger of the last two: every second one vanishes if the function is even or odd.
        last = max(by_degree.get(top, 0.0), by_degree.get(top - 1, 0.0) if top > 2 else 0.0)
        largest = max(by_degree.values(), default=0.0)
        if top > 1 and largest > 0.0:
            decay[j] = np.clip((last / largest) ** (1.0 / (top - 1)), 0.05, 1.0)
    return first, decay
