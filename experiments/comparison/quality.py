"""How good a front is against the true one: IGD, Spacing, hypervolume and lost pieces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.comparison.indicators import IndicatorsAgainst
from pymoo_hdte.checks import finite_array

GAP = 0.02
"""Neighbours on the reference front further apart than this belong to two pieces."""

REACH = 0.05
"""A piece with no solution within this distance is lost."""


class Quality(NamedTuple):
    """Quality of one front; all but the count are in objectives normalised by the true front."""

    igd: float
    spacing: float
    hypervolume: float
    lost_pieces: int


class TrueFront:
    """The true Pareto front of a problem, against which the fronts of algorithms are measured.

    That of a robust DTE problem is the front of its surrogate, not of the drive model.

    Its ideal and nadir point normalise every front, so that a front cannot be measured by its own
    extent.

    Parameters
    ----------
    F
        Non-dominated objectives, shape (n, 2), dense enough that neighbours on one piece are
        closer than `GAP` after normalisation.

    Raises
    ------
    InvalidInput
        A value is not finite, or an objective does not vary: such a front cannot normalise.
    """

    def __init__(self, F: ArrayLike) -> None:
        front = finite_array("true front", F, (None, 2))
        front = front[np.argsort(front[:, 0], kind="stable")]
        self.F = front
        self._indicators = IndicatorsAgainst(front)

    def normalise(self, F: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map the ideal point to 0 and the nadir point to 1."""
        return self._indicators.normalise(F)

    @property
    def pieces(self) -> list[NDArray[np.float64]]:
        """The connected pieces of the front, each of shape (n, 2), by rising first objective."""
        steps = np.linalg.norm(np.diff(self.normalise(self.F), axis=0), axis=1)
        return np.split(self.F, np.flatnonzero(steps > GAP) + 1)

    def quality(self, F: ArrayLike) -> Quality:
        """Measure the front ``F``, shape (n, 2).

        As `IndicatorsAgainst`; an empty front loses every piece.

        Raises
        ------
        InvalidInput
            An objective is not finite.
        """
        front = finite_array("F", F, (None, 2))
        measured = self._indicators(front)
        lost = self._lost(front) if len(front) else len(self.pieces)
        return Quality(measured.igd, measured.spacing, measured.hypervolume, lost)

    def _lost(self, F: NDArray[np.float64]) -> int:
        found = self.normalise(F)
        nearest = [
            np.linalg.norm(self.normalise(piece)[:, None] - found[None], axis=2).min()
            for piece in self.pieces
        ]
        return sum(bool(distance > REACH) for distance in nearest)
