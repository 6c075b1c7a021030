"""Inertia weights: how much of its velocity a particle keeps in the next move."""

from __future__ import annotations

import math
from collections import Counter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number, whole_number


class InertiaWeight(Protocol):
    """A rule for the inertia weight of the next move."""

    def __call__(self, progress: float, front: NDArray[np.float64]) -> float:
        """Return the weight.

        Parameters
        ----------
        progress : float
            Elapsed share t / G_max of the generations, in [0, 1].
        front : ndarray, shape (n, m)
            Objectives of the archive, in any units.
        """
        ...


class LinearDecrease:
    """Weight falling linearly with the generations, ``w_max`` - (``w_max`` - ``w_min``) t / G_max.

    Reference: Y. Shi, R. C. Eberhart, "Empirical study of particle swarm optimization", CEC 1999,
    pp. 1945-1950, with the same 0.9 and 0.4.

    Parameters
    ----------
    w_min, w_max : float
        Weight at the end and at the start, dimensionless, 0 <= w_min <= w_max.

    Raises
    ------
    InvalidInput
        If the weights are not finite numbers in that order.

    Examples
    --------
    >>> LinearDecrease(0.4, 0.9).w_max
    0.9
    """

    def __init__(self, w_min: float = 0.4, w_max: float = 0.9) -> None:
        self.w_max = real_number("w_max", w_max, at_least=0.0)
        self.w_min = real_number("w_min", w_min, at_least=0.0, at_most=self.w_max)

    def __call__(self, progress: float, front: NDArray[np.float64]) -> float:
        """Return the inertia weight.

        Parameters
        ----------
        progress : float
            Elapsed share t / G_max of the generations, in [0, 1].
        front : ndarray, shape (n, m)
            Objectives of the archive, in any units; not used.

        Returns
        -------
        float
            Dimensionless.
        """
        return self.w_max - (self.w_max - self.w_min) * progress


class EntropyWeight:
    """Weight that grows when the archive loses diversity (paper, Section 5.1, step 3).

    w = w_min + (w_max - w_min) (1 - S), with the normalised diversity entropy S of the archive. The
    grid spans the archive's own objectives: the paper does not say what its "current objective
    space" is, and this is the usual adaptive grid of a swarm's repository (Coello Coello, Pulido,
    Lechuga 2004).

    Parameters
    ----------
    w_min, w_max : float
        Smallest and largest weight, dimensionless, 0 <= w_min <= w_max.
    divisions : int
        Grid cells along each objective, at least 2.

    Raises
    ------
    InvalidInput
        If a parameter is not allowed.

    Examples
    --------
    >>> swarm = ParticleSwarm(EntropyWeight(w_min=0.3), Pyramid())
    >>> swarm.pop_size
    100
    """

    def __init__(self, w_min: float = 0.4, w_max: float = 0.9, divisions: int = 32) -> None:
        self.w_max = real_number("w_max", w_max, at_least=0.0)
        self.w_min = real_number("w_min", w_min, at_least=0.0, at_most=self.w_max)
        self.divisions = whole_number("divisions", divisions, at_least=2)

    def __call__(self, progress: float, front: NDArray[np.float64]) -> float:
        """Return the inertia weight.

        Parameters
        ----------
        progress : float
            Elapsed share t / G_max of the generations, in [0, 1]; not used.
        front : ndarray, shape (n, m)
            Objectives of the archive, in any units.

        Returns
        -------
        float
            Dimensionless.
        """
        diversity = normalised_entropy(front, self.divisions)
        return self.w_min + (self.w_max - self.w_min) * (1.0 - diversity)


def normalised_entropy(front: NDArray[np.float64], divisions: int) -> float:
    """Return the diversity entropy of a front (n, m) as a share of the largest possible, in [0, 1].

    S = -sum p ln p over the cells of a grid on the front's own box, p being the share of points in
    a cell, divided by ln min(M, n) with M = ``divisions`` ** m cells (paper, Section 5.1, step 3).
    Fewer than two points have no diversity, 0, where the formula would divide by ln 1.
    """
    n, m = front.shape
    if n < 2:
        return 0.0
    lowest, span = front.min(axis=0), np.ptp(front, axis=0)
    place = (front - lowest) / np.where(span > 0, span, 1.0) * divisions
    cells = np.minimum(place.astype(int), divisions - 1)
    share = np.array(list(Counter(map(tuple, cells.tolist())).values())) / n
    entropy = -np.sum(share * np.log(share)) / math.log(min(divisions**m, n))
    return float(np.clip(entropy, 0.0, 1.0))
