"""How well a surrogate predicts: independent test points and error measures (Table 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, whole_number
from pymoo_hdte.surrogate.box import Box


def latin_hypercube(
    box: Box, n: int, random_state: int | np.random.Generator
) -> NDArray[np.float64]:
    """Draw a Latin hypercube of ``n`` points in the box.

    Every variable has exactly one point in each of n equal slices of its interval (McKay,
    Beckman and Conover, Technometrics 21, 1979).

    Parameters
    ----------
    box : Box
        Where the points shall lie.
    n : int
        Number of points, at least 1.
    random_state : int or numpy.random.Generator
        Source of the randomness, or a seed of at least 0 for one.

    Returns
    -------
    ndarray, shape (n, d)
        In the box's units.

    Raises
    ------
    InvalidInput
        If ``n`` is below 1 or the seed negative.

    Examples
    --------
    >>> box = Box(("x",), np.array([0.0]), np.array([4.0]))
    >>> np.sort(latin_hypercube(box, 4, 1)[:, 0]).astype(int)
    array([0, 1, 2, 3])
    """
    if not isinstance(random_state, np.random.Generator):
        random_state = np.random.default_rng(whole_number("random_state", random_state, 0))
    sampler = scipy.stats.qmc.LatinHypercube(d=len(box), rng=random_state)
    return box.from_cube(2.0 * sampler.random(whole_number("n", n, 1)) - 1.0)


@dataclass(frozen=True)
class Accuracy:
    """Error measures of a prediction (Table 5).

    Examples
    --------
    >>> accuracy([1.0, 2.0, 3.5], [1.0, 2.0, 3.0]).max_error
    0.5
    """

    mae: float
    """Mean absolute error, in the output's unit."""
    rmse: float
    """Root mean square error, in the output's unit."""
    mape_percent: float
    """Mean of the absolute errors relative to the actual values, in percent."""
    max_error: float
    """Largest absolute error, in the output's unit."""
    r2: float
    """Coefficient of determination, dimensionless: 1 minus residual over total sum of squares."""


def accuracy(predicted: ArrayLike, actual: ArrayLike) -> Accuracy:
    """Compare predictions with actual values (the measures of Table 5).

    Parameters
    ----------
    predicted, actual : array_like, shape (n,)
        Finite, of one unit; the actual values must not be zero (relative errors) nor all equal
        (R2).

    Returns
    -------
    Accuracy

    Raises
    ------
    InvalidInput
        If shapes differ or values are not as described.

    Examples
    --------
    >>> print(f"{accuracy([1.0, 2.0, 3.0], [1.0, 2.0, 4.0]).rmse:.3f}")
    0.577
    """
    truth = finite_array("actual", actual, (None,))
    error = finite_array("predicted", predicted, truth.shape) - truth
    if len(truth) < 2 or np.all(truth == truth[0]):
        raise InvalidInput("actual", truth.tolist(), "at least two different values")
    zeros = np.flatnonzero(truth == 0.0)
    if len(zeros):
        raise InvalidInput(f"actual[{zeros[0]}]", 0.0, "not zero")
    size = np.abs(error)
    return Accuracy(
        mae=float(size.mean()),
        rmse=float(np.sqrt(np.mean(error**2))),
        mape_percent=float(100.0 * np.mean(size / np.abs(truth))),
        max_error=float(size.max()),
        r2=float(1.0 - np.sum(error**2) / np.sum((truth - truth.mean()) ** 2)),
    )
