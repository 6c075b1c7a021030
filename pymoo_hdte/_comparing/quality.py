"""How good a front is against the true one: IGD, Spacing, hypervolume and lost pieces."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from moocore import is_nondominated
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte._comparing.indicators import IndicatorsAgainst
from pymoo_hdte.checks import finite_array

GAP = 0.02
"""Neighbours on the reference front further apart than this belong to two pieces."""

N_POINTS = 1000
"""Of a front with two objectives; those with three have thousands."""

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
        Non-dominated objectives, shape (n, m), with two objectives dense enough that neighbours on
        one piece are closer than `GAP` after normalisation.
    in_pieces
        Whether it falls into pieces at gaps. Otherwise it counts as one piece, as every front of
        more objectives does: lost only if nothing comes near any of it.

    Raises
    ------
    InvalidInput
        A value is not finite, or an objective does not vary: such a front cannot normalise.
    """

    def __init__(self, F: ArrayLike, *, in_pieces: bool = True) -> None:
        front = finite_array("true front", F, (None, None))
        front = front[np.argsort(front[:, 0], kind="stable")]
        self.F = front
        self._in_pieces = in_pieces and front.shape[1] == 2
        self._indicators = IndicatorsAgainst(front)

    @cached_property
    def hypervolume(self) -> float:
        """Its own hypervolume, as `Quality` has that of others."""
        return self._indicators(self.F).hypervolume

    def normalise(self, F: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map the ideal point to 0 and the nadir point to 1."""
        return self._indicators.normalise(F)

    @property
    def pieces(self) -> list[NDArray[np.float64]]:
        """The connected pieces of the front, each of shape (n, m), by rising first objective."""
        if not self._in_pieces:
            return [self.F]
        steps = np.linalg.norm(np.diff(self.normalise(self.F), axis=0), axis=1)
        return np.split(self.F, np.flatnonzero(steps > GAP) + 1)

    def quality(self, F: ArrayLike) -> Quality:
        """Measure the front ``F``, shape (n, m).

        As `IndicatorsAgainst`; an empty front loses every piece.

        Raises
        ------
        InvalidInput
            An objective is not finite.
        """
        front = finite_array("F", F, (None, self.F.shape[1]))
        measured = self._indicators(front)
        lost = self._lost(front) if len(front) else len(self.pieces)
        return Quality(measured.igd, measured.spacing, measured.hypervolume, lost)

    def _lost(self, F: NDArray[np.float64]) -> int:
        scaled = self.normalise(F)
        nearest = [
            np.linalg.norm(self.normalise(piece)[:, None] - scaled[None], axis=2).min()
            for piece in self.pieces
        ]
        return sum(bool(distance > REACH) for distance in nearest)


def even_curve(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return some `N_POINTS` of the non-dominated rows of a curve of more, even in arc length.

    Distances are in objectives normalised by the front, and steps of over `GAP` are gaps.
    """
    front = F[is_nondominated(F)]
    front = front[front[:, 0].argsort()]
    normal = (front - front.min(axis=0)) / np.ptp(front, axis=0)
    steps = np.linalg.norm(np.diff(normal, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(np.where(steps > GAP, 0.0, steps))])
    wanted = np.linspace(0.0, arc[-1], N_POINTS)
    ends = np.flatnonzero(steps > GAP)
    rows = np.unique(np.concatenate([np.searchsorted(arc, wanted), ends, ends + 1]))
    return front[rows.clip(max=len(front) - 1)]
