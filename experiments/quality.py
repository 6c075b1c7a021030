"""How good a front is against the true one: IGD, Spacing, hypervolume and lost pieces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.indicators.hv import Hypervolume
from pymoo.indicators.igd import IGD
from pymoo.indicators.spacing import SpacingIndicator

from pymoo_hdte.checks import InvalidInput, finite_array

GAP = 0.02
"""Neighbours on the reference front further apart than this belong to two pieces."""

REACH = 0.05
"""A piece with no solution within this distance is lost."""

HYPERVOLUME_CORNER = np.array([1.1, 1.1])
"""Reference point of the hypervolume in normalised objectives."""


class Quality(NamedTuple):
    """Quality of one front; all but the count are in objectives normalised by the true front."""

    igd: float
    spacing: float
    hypervolume: float
    lost_pieces: int


class TrueFront:
    """The true Pareto front of a problem, against which the fronts of algorithms are measured.

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
        self.ideal = front.min(axis=0)
        self.nadir = front.max(axis=0)
        if not np.all(self.nadir > self.ideal):
            raise InvalidInput("extent of the true front", self.nadir - self.ideal, "above 0")
        scale = {"zero_to_one": True, "ideal": self.ideal, "nadir": self.nadir}
        self._igd = IGD(front, **scale)
        self._spacing = SpacingIndicator(**scale)
        self._hypervolume = Hypervolume(ref_point=HYPERVOLUME_CORNER, norm_ref_point=False, **scale)

    def normalise(self, F: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map the ideal point to 0 and the nadir point to 1."""
        return (F - self.ideal) / (self.nadir - self.ideal)

    @property
    def pieces(self) -> list[NDArray[np.float64]]:
        """The connected pieces of the front, each of shape (n, 2), by rising first objective."""
        steps = np.linalg.norm(np.diff(self.normalise(self.F), axis=0), axis=1)
        return np.split(self.F, np.flatnonzero(steps > GAP) + 1)

    def quality(self, F: ArrayLike) -> Quality:
        """Measure the front ``F``, shape (n, 2).

        pymoo gives an empty front an IGD of 0 and a duplicated one a Spacing of 0, each the best
        there is. Here an empty front has infinite IGD, duplicates count once, and a front of fewer
        than two different points has no Spacing (NaN).

        Raises
        ------
        InvalidInput
            An objective is not finite.
        """
        front = np.unique(finite_array("F", F, (None, 2)), axis=0)
        if len(front) == 0:
            return Quality(np.inf, np.nan, 0.0, len(self.pieces))
        spacing = float(self._spacing(front)) if len(front) > 1 else np.nan
        return Quality(
            float(self._igd(front)), spacing, float(self._hypervolume(front)), self._lost(front)
        )

    def _lost(self, F: NDArray[np.float64]) -> int:
        found = self.normalise(F)
        nearest = [
            np.linalg.norm(self.normalise(piece)[:, None] - found[None], axis=2).min()
            for piece in self.pieces
        ]
        return sum(bool(distance > REACH) for distance in nearest)
