"""Nested points of one variable: a weighted Leja sequence, and polynomials that vanish on it.

Each point is where the weighted product of distances from all points before is largest, so that the
first k + 1 points determine a polynomial of degree k well, for every k (Narayan and Jakeman, SIAM
Journal on Scientific Computing 36, 2014). One more degree costs one more point.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

HIGHEST_DEGREE = 60
_GRID = 4001


def leja_points(
    weight: NDArray[np.float64], start: float, size: int = HIGHEST_DEGREE + 1
) -> NDArray[np.float64]:
    """Return the first points of the sequence on -1..1, shape (size,).

    Parameters
    ----------
    weight : ndarray, shape (4001,)
        Root of the probability density on an even grid, not all zero.
    start : float
        The first point.
    size : int
        Number of points.
    """
    places = grid()
    with np.errstate(divide="ignore"):
        merit = np.log(weight)
        points = [start]
        for _ in range(size - 1):
            merit = merit + np.log(np.abs(places - points[-1]))
            points.append(float(places[np.argmax(merit)]))
    return np.array(points)


def grid() -> NDArray[np.float64]:
    """Return where `leja_points` wants the weight, shape (4001,)."""
    return np.linspace(-1.0, 1.0, _GRID)


def hierarchical_basis(points: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return h_0 .. h_k at ``x``, shape (k + 1, *x.shape), for k + 1 points.

    h_k is the polynomial of degree k that is 1 at its own point and 0 at those before.
    """
    table = np.ones((len(points), *x.shape))
    for k, point in enumerate(points[:-1]):
        table[k + 1] = table[k] * (x - point)
    for k in range(1, len(points)):
        table[k] /= np.prod(points[k] - points[:k])
    return table


def hierarchical_to_chebyshev(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the triangular matrix of shape (k + 1, k + 1): column j holds h_j in T_0 .. T_k."""
    size = len(points)
    nodes = np.cos((2 * np.arange(size) + 1) * np.pi / (2 * size))
    matrix = np.linalg.solve(chebvander(nodes, size - 1), hierarchical_basis(points, nodes).T)
    return np.triu(matrix)
