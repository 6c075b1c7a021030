"""Outliers among repeated measurements: the 3-sigma rule in a form that can reject.

The plain rule, mean and standard deviation of the same ten readings, cannot: no reading of n lies
further than (n - 1) / sqrt(n) standard deviations from their mean, 2.85 for n = 10 (Samuelson, J.
Am. Stat. Assoc. 63, 1968). Here sigma is the repeatability of the instrument, pooled over all
prototypes of one error, so that it rests on 180 degrees of freedom instead of 9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array

SIGMAS = 3.0


def largest_deviation(n_repeats: int) -> float:
    """Return the greatest possible distance from the mean, in standard deviations (ddof 1).

    A pure number, (n - 1) / sqrt(n) (Samuelson, J. Am. Stat. Assoc. 63, 1968).

    Parameters
    ----------
    n_repeats : int
        Number n of readings, at least 1.

    Examples
    --------
    >>> print(f"{largest_deviation(5):.2f}")
    1.79
    """
    return (n_repeats - 1) / n_repeats**0.5


def find_outliers(measurements: ArrayLike) -> NDArray[np.bool_]:
    """Mark the readings that lie more than three pooled sigmas off their own mean (Section 2.1).

    The deviation is standardised by sqrt(1 - 1/n), since each reading pulls its mean. Only the
    worst reading of each prototype and error goes at a time, and mean and sigma are taken anew,
    until none is left: a gross outlier neither hides others nor takes good readings with it. Of
    good, normal readings 0.27 % are lost.

    Parameters
    ----------
    measurements : array_like, shape (n_prototypes, n_errors, n_repeats)
        Readings of one instrument, in any unit, whose repeatability is the same for all prototypes.

    Returns
    -------
    ndarray of bool, shape (n_prototypes, n_errors, n_repeats)

    Raises
    ------
    InvalidInput
        For fewer than three repeats, a reading that is not finite, or readings so wild that fewer
        than half of one prototype's remain.

    Examples
    --------
    >>> readings = np.random.default_rng(3).normal(10.0, 1.0, (12, 1, 5))
    >>> readings[3, 0, 2] = 30.0
    >>> bool(find_outliers(readings)[3, 0, 2])
    True
    """
    readings = finite_array("measurements", measurements, (None, None, None))
    n_repeats = readings.shape[2]
    if n_repeats < 3:
        raise InvalidInput("number of repeats", n_repeats, "at least 3")
    rejected = np.zeros(readings.shape, dtype=bool)
    while True:
        distance = _standardised(np.ma.masked_array(readings, rejected))
        worst = distance == distance.max(axis=2, keepdims=True)
        new = worst & (distance > SIGMAS)
        if not new.any():
            return rejected
        rejected |= new
        left = n_repeats - rejected.sum(axis=2)
        if left.min() < n_repeats / 2:
            prototype, error = (int(i) for i in np.unravel_index(left.argmin(), left.shape))
            raise InvalidInput(
                f"valid repeats of measurements[{prototype}, {error}]",
                int(left.min()),
                "at least half of the repeats; measure this prototype again",
            )


def mean_of_valid(measurements: ArrayLike, rejected: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the mean of the readings that are not rejected, shape (n_prototypes, n_errors)."""
    return np.ma.masked_array(measurements, rejected).mean(axis=2).filled(np.nan)


def repeatability(measurements: ArrayLike, rejected: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the standard deviation of valid repeats, pooled over prototypes, shape (n_errors,)."""
    return _pooled_sigma(np.ma.masked_array(measurements, rejected)).filled(np.nan)


def _pooled_sigma(readings: np.ma.MaskedArray) -> np.ma.MaskedArray:
    squares = ((readings - readings.mean(axis=2, keepdims=True)) ** 2).sum(axis=(0, 2))
    freedom = (readings.count(axis=2) - 1).sum(axis=0)
    return (squares / freedom) ** 0.5


def _standardised(readings: np.ma.MaskedArray) -> NDArray[np.float64]:
    """Return every reading's distance from its mean in sigmas; 0 where rejected or exact."""
    shrink = (1.0 - 1.0 / readings.count(axis=2)[:, :, None]) ** 0.5
    scale = _pooled_sigma(readings)[None, :, None] * shrink
    distance = np.abs(readings - readings.mean(axis=2, keepdims=True)).filled(0.0)
    return np.divide(distance, scale, out=np.zeros(distance.shape), where=np.asarray(scale) > 0.0)
