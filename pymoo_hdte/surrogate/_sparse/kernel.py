"""A prior of polynomials in many variables: sizes and decays of their coefficients, axis by axis.

The response is a polynomial with independent normal coefficients. The variance of a coefficient is
a product over the axes: 1 for degree 0, and s e_k q^(k - 1) for degree k, with a size s, a decay q
and a share e_k of even degrees of every axis. The covariance of two points then is a product over
the axes as well, whatever the number of terms (Wahba, Spline Models for Observational Data, 1990,
chapter 10). Axes of little effect, smooth ones and even or odd ones are learnt from the runs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.measures import Measure, OrthonormalPolynomials
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes

Array = NDArray[np.float64]

DEGREES = (6, 40)
"""Least and largest degree in one variable; between them a third of the runs."""
PARAMETERS = 3
"""Number of parameters of an axis: the logarithm of s, and the logits of q and of the share of
even degrees."""
START = (np.log(0.1), 0.0, 0.0)
"""Where parameters start, and the middle of what they are expected to be."""
EXPECTED = (4.0, 2.0, 2.0)
"""How far they are expected from it, one standard deviation; set by hand, wide."""
ENDS = ((-16.0, 4.0), (-6.0, 6.0), (-8.0, 8.0))
_LEAST = 1e-10
"""Size below which a factor of the covariance is not divided by."""


class EvenPolynomials:
    """Polynomials that are orthonormal when spread evenly over -1..1, the same for every axis.

    Parameters
    ----------
    degree : int
        Highest degree k.
    values : sequence of int or None, optional
        Number of values that an axis takes, None for any. As many polynomials are independent
        there; those of higher degrees are 0, and with them their coefficients.
    """

    def __init__(self, degree: int, values: Sequence[int | None] = ()) -> None:
        self.degree, self._values = degree, tuple(values)
        nodes, weights = leggauss(degree + 4)
        self._family = OrthonormalPolynomials(Measure(nodes, 0.5 * weights), degree)

    @classmethod
    def for_runs(cls, count: int, values: Sequence[int | None] = ()) -> EvenPolynomials:
        """Return them up to the degree that so many runs may tell of."""
        return cls(int(np.clip(count // 3, *DEGREES)), values)

    def __call__(self, points: Array) -> list[Array]:
        """Return p_1 .. p_k of every axis at points of shape (n, d), each of shape (k, n)."""
        features = [self._family(z)[1:] for z in points.T]
        for feature, count in zip(features, self._values, strict=False):
            if count is not None:
                feature[count - 1 :] = 0.0
        return features

    def to_chebyshev(self) -> Array:
        """Return the triangular matrix, shape (k + 1, k + 1), of p_j in T_0 .. T_k: column j."""
        values = self._family(chebyshev_nodes(self.degree + 1))
        return np.triu(np.column_stack([coefficients_from_nodes(row) for row in values]))


def variances(parameters: Array, degree: int) -> tuple[Array, Array]:
    """Return the variances of degrees 1 .. k of every axis, and their slopes in its parameters.

    Parameters
    ----------
    parameters : ndarray, shape (d, 3)
    degree : int
        The highest degree k.

    Returns
    -------
    variance : ndarray, shape (d, k)
    slope : ndarray, shape (3, d, k)
    """
    k = np.arange(degree)
    size = np.exp(parameters[:, 0])[:, None]
    decay, share = (1.0 / (1.0 + np.exp(-parameters[:, j])) for j in (1, 2))
    sign = np.where(k % 2 == 1, 1.0, -1.0)
    of_parity = 1.0 + sign * (2.0 * share[:, None] - 1.0)
    plain = size * decay[:, None] ** k
    variance = plain * of_parity
    of_decay = variance * k * (1.0 - decay[:, None])
    of_share = plain * sign * 2.0 * (share * (1.0 - share))[:, None]
    return variance, np.array([variance, of_decay, of_share])


def factors(features: list[Array], others: list[Array], variance: Array) -> list[Array]:
    """Return the covariance's factor of every axis between two sets of points, (n, m) each."""
    per_axis = []
    for rows, columns, of_axis in zip(features, others, variance, strict=True):
        factor = (rows * of_axis[:, None]).T @ columns
        factor += 1.0
        factor[np.abs(factor) < _LEAST] = _LEAST
        per_axis.append(factor)
    return per_axis


def covariance(features: list[Array], others: list[Array], variance: Array) -> Array:
    """Return the covariance between two sets of points, shape (n, m)."""
    product, *remaining = factors(features, others, variance)
    for factor in remaining:
        product *= factor
    return product


def slope_by_axes(
    features: list[Array], of_axes: list[Array], slopes: Array, outer: Array
) -> Array:
    """Return the slope in the parameters of every axis, shape (d, 3), of a sum over the covariance.

    ``outer`` is its slope in every covariance times the covariance, (n, n); ``slopes`` those of the
    variances, and ``of_axes`` the `factors`.
    """
    gradient = np.empty((len(features), PARAMETERS))
    for j, (feature, factor) in enumerate(zip(features, of_axes, strict=True)):
        by_degree = np.einsum("kn,kn->k", feature @ (outer / factor), feature)
        gradient[j] = slopes[:, j] @ by_degree
    return gradient
