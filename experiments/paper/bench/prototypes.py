"""Prototypes drawn from printed statistics, and readings of them with noise and outliers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number, whole_number


def draw_prototypes(
    means: ArrayLike,
    stds: ArrayLike,
    n_prototypes: int,
    rng: np.random.Generator,
    correlation: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Draw the true values of prototypes from a normal distribution.

    Parameters
    ----------
    means, stds : array_like, shape (n,)
    n_prototypes : int
    rng : numpy.random.Generator
    correlation : array_like, shape (n, n), optional
        Planted correlation matrix; independent by default.

    Returns
    -------
    ndarray, shape (n_prototypes, n)

    Raises
    ------
    InvalidInput
        For shapes that do not fit, a negative std, or no valid correlation matrix.
    """
    means = finite_array("means", means, (None,))
    stds = finite_array("stds", stds, (len(means),))
    real_number("least std", float(stds.min()), at_least=0.0)
    n_prototypes = whole_number("n_prototypes", n_prototypes, 1)
    wanted = np.eye(len(means)) if correlation is None else correlation
    matrix = finite_array("correlation", wanted, (len(means), len(means)))
    if not np.allclose(matrix, matrix.T) or not np.allclose(np.diag(matrix), 1.0):
        raise InvalidInput("correlation", matrix, "a symmetric matrix with ones on its diagonal")
    if np.linalg.eigvalsh(matrix).min() < -1e-12:
        raise InvalidInput("correlation", matrix, "a matrix without negative eigenvalues")
    zero = np.zeros(len(means))
    return means + stds * rng.multivariate_normal(zero, matrix, n_prototypes, method="eigh")


def repeat_measurements(
    true_values: ArrayLike, noise: float, n_repeats: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Measure every error of every prototype several times with normal noise.

    Parameters
    ----------
    true_values : array_like, shape (n_prototypes, n_errors)
    noise : float
        Standard deviation of a reading.
    n_repeats : int
    rng : numpy.random.Generator

    Returns
    -------
    ndarray, shape (n_prototypes, n_errors, n_repeats)
    """
    values = finite_array("true_values", true_values, (None, None))
    noise = real_number("noise", noise, at_least=0.0)
    n_repeats = whole_number("n_repeats", n_repeats, 1)
    return values[:, :, None] + noise * rng.standard_normal((*values.shape, n_repeats))


def plant_outliers(
    measurements: ArrayLike, count: int, size: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Shift random readings by ``size``, up or down, at most one a prototype and error.

    Parameters
    ----------
    measurements : array_like, shape (n_prototypes, n_errors, n_repeats)
    count : int
        No more than there are prototypes times errors.
    size : float
    rng : numpy.random.Generator

    Returns
    -------
    ndarray, ndarray of bool
        The measurements with outliers, a new array, and where these are.

    Raises
    ------
    InvalidInput
        For too many outliers.
    """
    readings = finite_array("measurements", measurements, (None, None, None))
    n_prototypes, n_errors, n_repeats = readings.shape
    count = whole_number("count", count, 0)
    if count > n_prototypes * n_errors:
        raise InvalidInput("count", count, f"at most {n_prototypes * n_errors}")
    cells = rng.choice(n_prototypes * n_errors, count, replace=False)
    planted = np.zeros(readings.shape, dtype=bool)
    planted.reshape(-1, n_repeats)[cells, rng.integers(n_repeats, size=count)] = True
    readings[planted] += size * rng.choice([-1.0, 1.0], count)
    return readings, planted
