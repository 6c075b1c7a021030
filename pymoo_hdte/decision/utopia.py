"""Choice of one solution of a front by its weighted distance from the ideal point."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.decision_making import DecisionMaking

from pymoo_hdte.checks import InvalidInput, finite_array

PREFERENCES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "accuracy_first": (0.9, 0.1),
        "balanced": (0.5, 0.5),
        "robustness_first": (0.1, 0.9),
    }
)
"""Weights of (mean, standard deviation) for the paper's three preferences (Section 5.3).

Examples
--------
>>> PREFERENCES["balanced"]
(0.5, 0.5)
"""


class WeightedUtopia(DecisionMaking):
    """Weighted utopia distance, Eqs. (37)-(41) of the paper.

    Every objective is scaled to [0, 1] over the front, to 0 where its range is 0. The solution with
    the smallest d = sqrt(sum_j (w_j f_j)^2) is chosen; of equal distances, the first.

    ``do(F)`` takes objectives of shape (n, m) and returns the index of the chosen row, or None if
    there are no rows; it raises `InvalidInput` if ``F`` is not finite or m is not the number of
    weights.

    Parameters
    ----------
    weights : sequence of float, length m
        Weights of the objectives, dimensionless: at least two, none negative, with sum 1 (to 1e-9).

    Raises
    ------
    InvalidInput
        If the weights are not allowed.

    Notes
    -----
    The paper prints the ideal point as [0, 1] but calls it the origin of the scaled objectives and
    measures from there, as this class does.

    Examples
    --------
    >>> F = np.array([[0.0, 1.0], [0.4, 0.4], [1.0, 0.0]])
    >>> int(WeightedUtopia(PREFERENCES["balanced"]).do(F))
    1
    """

    def __init__(self, weights: Sequence[float]) -> None:
        super().__init__()
        array = finite_array("weights", weights, (None,))
        if len(array) < 2:
            raise InvalidInput("number of weights", len(array), "at least 2")
        if np.any(array < 0):
            raise InvalidInput("weights", weights, "none negative")
        with np.errstate(over="ignore"):
            total = float(array.sum())
        if not math.isclose(total, 1.0, rel_tol=0.0, abs_tol=1e-9):
            raise InvalidInput("sum of weights", total, "1")
        self.weights = array

    def distances(self, F: ArrayLike) -> NDArray[np.float64]:
        """Return the weighted distance of every solution from the ideal point.

        Parameters
        ----------
        F : array_like, shape (n, m)
            Objectives, in any units.

        Returns
        -------
        ndarray, shape (n,)
            Dimensionless.

        Raises
        ------
        InvalidInput
            If ``F`` is not finite or has another shape.
        """
        front = finite_array("F", F, (None, len(self.weights)))
        span = np.ptp(front, axis=0)
        scaled = (front - front.min(axis=0)) / np.where(span > 0, span, 1.0)
        return np.linalg.norm(self.weights * scaled, axis=1)

    def _do(self, F: ArrayLike) -> int:
        return int(self.distances(F).argmin())
