"""How well tests tell an effect from what else could explain it: what no other model imitates.

An effect changes the whitened features of tests by a vector d. Other models can imitate d by moving
their unknowns u, whose derivatives are J and about which P is known beforehand; what they cannot,

    lambda = min over u of |d - J u|^2 + u^T P u,

is the noncentrality of the chi-square that separates them. The next experiment after a campaign and
the plan before one both compute it, from Gram matrices of (d, J), which add up over tests. Since it
is the minimum of a sum of squares, a further test never makes it smaller and more noise never
larger. With P from a fit it is the criterion of Hunter and Reiner (Technometrics 1965).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

Values = NDArray[np.float64]


def unimitated(gram: Values, count: int) -> Values:
    """Return the Gram matrix of what the other columns cannot imitate of the first ones.

    Parameters
    ----------
    gram : ndarray, shape (..., n, n)
        Inner products of all columns, with what is known beforehand of the unknowns added.
    count : int
        Number of the first columns; the others may move to imitate them.

    Returns
    -------
    ndarray, shape (..., count, count)
        Its diagonal is lambda for each of the first columns.
    """
    cross, moving = gram[..., count:, :count], gram[..., count:, count:]
    imitated = np.swapaxes(cross, -1, -2) @ np.linalg.solve(moving, cross)
    return np.asarray(gram[..., :count, :count] - imitated)


def power(noncentrality: ArrayLike, threshold: float) -> Values:
    """Return the chance that a chi-square of one degree of freedom exceeds a threshold.

    It is the noncentral distribution, that of the square of a normal value with the mean
    sqrt(noncentrality), and close to one half where noncentrality and threshold are equal.

    Parameters
    ----------
    noncentrality : array_like
        0 or more.
    threshold : float
        Chi-square.
    """
    mean, least = np.sqrt(np.maximum(noncentrality, 0.0)), threshold**0.5
    return np.asarray(ndtr(mean - least) + ndtr(-mean - least))


def noncentrality_for(wanted: float, threshold: float) -> float:
    """Return the noncentrality that gives a power at a threshold.

    Parameters
    ----------
    wanted : float
        Power, above that of noise alone and below 1.
    threshold : float
        Chi-square.
    """
    # Ten standard deviations above the threshold the power is 1 to rounding.
    most = (threshold**0.5 + 10.0) ** 2
    return float(brentq(lambda size: float(power(size, threshold)) - wanted, 0.0, most))
