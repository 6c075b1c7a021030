"""How good a set is against a problem's true front, of any number of objectives, normalised."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from moocore import is_nondominated
from numpy.typing import ArrayLike, NDArray
from pymoo.indicators.hv import Hypervolume
from pymoo.indicators.igd import IGD
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.indicators.spacing import SpacingIndicator

from pymoo_hdte.checks import InvalidInput, finite_array

CORNER = 1.1
"""Reference point of the hypervolume in every normalised objective."""


class Indicators(NamedTuple):
    """Distance from the true front, hypervolume and evenness of one set."""

    igd: float
    igd_plus: float
    hypervolume: float
    spacing: float


NAMES = {"igd": "IGD", "igd_plus": "IGD+", "hypervolume": "hypervolume", "spacing": "Spacing"}
"""Indicators as tables call them."""


def smaller_is_better(measure: str) -> bool:
    """Return whether a smaller value of a measure, named after its indicator, is better."""
    return not measure.startswith("hypervolume")


class IndicatorsAgainst:
    """pymoo's indicators against one true front.

    Its ideal and nadir point normalise every set, so that a set cannot be measured by its own
    extent.

    Parameters
    ----------
    front
        Non-dominated objectives, shape (n, m).
    normalised
        False to measure in the units of the objectives; the hypervolume then counts up to the
        same point, and is in their product.

    Raises
    ------
    InvalidInput
        A value is not finite, or an objective does not vary: such a front cannot normalise.
    """

    def __init__(self, front: ArrayLike, *, normalised: bool = True) -> None:
        front = finite_array("true front", front, (None, None))
        self.ideal = front.min(axis=0)
        self.nadir = front.max(axis=0)
        if not np.all(self.nadir > self.ideal):
            raise InvalidInput("extent of the true front", self.nadir - self.ideal, "above 0")
        scale = {"zero_to_one": True, "ideal": self.ideal, "nadir": self.nadir}
        corner = np.full(front.shape[1], CORNER)
        if not normalised:
            scale, corner = {}, self.ideal + CORNER * (self.nadir - self.ideal)
        self._igd = IGD(front, **scale)
        self._igd_plus = IGDPlus(front, **scale)
        self._hypervolume = Hypervolume(ref_point=corner, norm_ref_point=False, **scale)
        self._spacing = SpacingIndicator(**scale)

    def __call__(self, F: ArrayLike) -> Indicators:
        """Measure the set ``F``, shape (n, m).

        pymoo gives an empty set an IGD of 0 and one of two points a Spacing of 0, each the best
        there is. Here an empty set has infinite distances, duplicates count once, and a set of
        fewer than three different points has no Spacing (NaN).

        Raises
        ------
        InvalidInput
            An objective is not finite.
        """
        points = np.unique(finite_array("F", F, (None, len(self.ideal))), axis=0)
        if len(points) == 0:
            return Indicators(np.inf, np.inf, 0.0, np.nan)
        return Indicators(
            float(self._igd(points)),
            float(self._igd_plus(points)),
            float(self._hypervolume(points)),
            float(self._spacing(points)) if len(points) > 2 else np.nan,
        )

    def normalise(self, F: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map the ideal point to 0 and the nadir point to 1."""
        return (F - self.ideal) / (self.nadir - self.ideal)


def front_among(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the different, finite, non-dominated rows of ``F`` (n, m), in rising order."""
    F = F[np.isfinite(F).all(axis=1)]
    if not len(F):
        return F
    front = F[is_nondominated(F)]
    return front[np.lexsort(front.T[::-1])]
