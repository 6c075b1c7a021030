"""Bands around a chosen design, and how far built drives are from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number


def tolerance_band(
    design: ArrayLike, tolerance: float = 0.05
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper limits around a design (paper, Eq. (41) and Table 9).

    Parameters
    ----------
    design : array_like, shape (m,)
        Nominal values, above 0, in any units.
    tolerance : float
        Relative half-width, 0 <= tolerance < 1.

    Returns
    -------
    lower, upper : ndarray, shape (m,)
        In the units of the design.

    Raises
    ------
    InvalidInput
        If the design or the tolerance is not allowed.

    Examples
    --------
    >>> lower, upper = tolerance_band([10.0], 0.05)
    >>> lower, upper
    (array([9.5]), array([10.5]))
    """
    nominal = _positive("design", design)
    tolerance = real_number("tolerance", tolerance, at_least=0.0, below=1.0)
    return (1.0 - tolerance) * nominal, (1.0 + tolerance) * nominal


def deviation_degree(prototypes: ArrayLike, optimum: ArrayLike) -> NDArray[np.float64]:
    """Return the relative distance D_i of each prototype from the optimum (paper, Eq. 42).

    Parameters
    ----------
    prototypes : array_like, shape (n, m)
        Parameters of n prototypes, in the units of ``optimum``.
    optimum : array_like, shape (m,)
        Parameters of the optimal design, above 0, in any units.

    Returns
    -------
    ndarray, shape (n,)
        Dimensionless.

    Raises
    ------
    InvalidInput
        If the shapes do not fit or a value is not finite, or not positive in the optimum.

    Examples
    --------
    >>> deviation_degree([[1.0, 2.2]], [1.0, 2.0]).round(3)
    array([0.1])
    """
    target = _positive("optimum", optimum)
    actual = finite_array("prototypes", prototypes, (None, len(target)))
    return np.linalg.norm(actual / target - 1.0, axis=1)


def _positive(field: str, value: ArrayLike) -> NDArray[np.float64]:
    array = finite_array(field, value, (None,))
    if np.any(array <= 0):
        raise InvalidInput(field, array, "all above 0")
    return array
