"""What the printed statistics of Section 4 say about values that the paper does not print.

Of the five prototypes the paper prints the design (Table 6), the statistics of the residuals and
which two measured the lowest and the highest DTE, but neither predictions nor measurements. Write
d = measured - predicted for the residual; predictions are all low, so d > 0.

What follows for any predictions with these statistics, with n = 5 and standard deviations over n:

1. The residuals have mean MAE and mean square RMSE^2, so std(d) = sqrt(RMSE^2 - MAE^2) = 1.80".
2. R2 = 1 - RMSE^2 / var(measured), so std(measured) = RMSE / sqrt(1 - R2) = 9.31". Of the readings
   of R2 it is the only one that a bias lowers, as the paper says that it does.
3. n values of standard deviation s have a range of n s / sqrt(floor(n/2) ceil(n/2)) at least, which
   is 19.0". No. 4 measured highest and No. 5 lowest, so this is how far No. 4 lies above No. 5.
4. One residual is the largest, 10.193". By Samuelson's inequality for the other four, none is below
   4.57", so two differ by 5.62" at most.
5. Predicted is measured less residual: No. 4 is predicted above No. 5 by 19.0" - 5.6" = 13.4" at
   least. By the triangle inequality, std(predicted) is 9.31" less or plus 1.80".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import t as student

from experiments.published_values import TABLE_6

MAE = 7.761
RMSE = 7.968
MAX_ERROR = 10.193
MAPE_PERCENT = 8.14
R2 = 0.267
MEAN_ERROR = -7.761
MEAN_ERROR_INTERVAL = (-10.265, -5.257)
"""Section 4, in arcsec but for MAPE and R2: prediction against measurement of five prototypes."""

NUMBERS = tuple(TABLE_6)
LOWEST, HIGHEST = 5, 4
"""Prototypes with the lowest and the highest measured DTE (Section 5.3)."""

HALF_DIGIT = 5e-4
"""By which each of the printed statistics but MAPE may be rounded."""

_N = len(NUMBERS)
_LOW, _HIGH = NUMBERS.index(LOWEST), NUMBERS.index(HIGHEST)

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Bounds:
    """What must hold for every set of values with the printed statistics, in arcsec.

    Attributes
    ----------
    residual_std
        Of d, with n in the denominator.
    smallest_residual
        The least that any d can be, given that one is the largest error.
    largest_difference
        The most by which two d can differ.
    measured_mean
        MAE over MAPE: exact only if relative errors do not go with the measured values.
    measured_std
        With n in the denominator, from RMSE and R2.
    least_range
        The least highest minus lowest measured DTE.
    least_lead
        The least by which the prediction for No. 4 exceeds that for No. 5.
    predicted_std
        Between which the standard deviation of the predictions (over n) lies.
    """

    residual_std: float
    smallest_residual: float
    largest_difference: float
    measured_mean: float
    measured_std: float
    least_range: float
    least_lead: float
    predicted_std: tuple[float, float]


def bounds(
    mae: float = MAE, rmse: float = RMSE, max_error: float = MAX_ERROR, r2: float = R2
) -> Bounds:
    """Return the bounds in closed form, of the printed statistics or of others near them.

    Of n values with a given mean and standard deviation s (over n) none is farther than
    s sqrt(n - 1) below the mean (Samuelson); of n = 5 values with range r, s is at most
    r sqrt(6)/5, reached with two at one end and three at the other.
    """
    std = np.sqrt(rmse**2 - mae**2)
    others_mean = (_N * mae - max_error) / (_N - 1)
    others_std = np.sqrt((_N * rmse**2 - max_error**2) / (_N - 1) - others_mean**2)
    smallest = others_mean - others_std * np.sqrt(_N - 2)
    measured_std = rmse / np.sqrt(1.0 - r2)
    least_range = measured_std * _N / np.sqrt((_N // 2) * (_N - _N // 2))
    return Bounds(
        residual_std=float(std),
        smallest_residual=float(smallest),
        largest_difference=float(max_error - smallest),
        measured_mean=100.0 * mae / MAPE_PERCENT,
        measured_std=float(measured_std),
        least_range=float(least_range),
        least_lead=float(least_range - (max_error - smallest)),
        predicted_std=(float(measured_std - std), float(measured_std + std)),
    )


def least_lead_unrounded() -> float:
    """Return the least lead of No. 4 if every statistic is rounded in the least favourable way.

    Over so small a range the lead is monotone in each of them, so that a corner has the least.
    """
    printed = (MAE, RMSE, MAX_ERROR, R2)
    ends = ((value - HALF_DIGIT, value + HALF_DIGIT) for value in printed)
    return min(bounds(*corner).least_lead for corner in product(*ends))


def mean_error_interval() -> tuple[float, float]:
    """Return the 95 % interval of the mean error that MAE and RMSE imply, by Student's t."""
    std = np.sqrt((RMSE**2 - MAE**2) * _N / (_N - 1))
    half_width = float(student.ppf(0.975, _N - 1) * std / np.sqrt(_N))
    return MEAN_ERROR - half_width, MEAN_ERROR + half_width


@dataclass(frozen=True)
class Assignment:
    """Measured values and predictions that have the printed statistics, shape (5,), in arcsec."""

    measured: Values
    predicted: Values


def nearest_assignment(predictions: Values, *, to: str, ranked: bool) -> Assignment | None:
    """Return the assignment nearest to our ``predictions``, or None if the search finds none.

    Parameters
    ----------
    predictions : ndarray, shape (5,)
        Predicted DTE of the prototypes, arcsec.
    to : {"predicted", "measured"}
        Whether the assignment's predictions or its measured values are to be near ours: how far our
        model is from the paper's, or how well ours could at best agree with its measurements.
    ranked : bool
        Whether the measured values must also have the lowest and the highest where the paper has
        them.

    Notes
    -----
    Every choice of the prototypes with the largest and the smallest error is tried, from several
    regular starts, by sequential quadratic programming.
    """
    best, shortest = None, np.inf
    for (worst, least), measured in product(permutations(range(_N), 2), _starts(predictions)):
        residual = np.full(_N, MAE)
        residual[worst], residual[least] = MAX_ERROR, bounds().smallest_residual
        solution = _solve(predictions, Assignment(measured, measured - residual), worst, to, ranked)
        if solution is not None:
            distance = float(np.linalg.norm(getattr(solution, to) - predictions))
            if distance < shortest:
                best, shortest = solution, distance
    return best


def _starts(predictions: Values) -> Iterator[Values]:
    """Yield measured values: ours shifted, ours with both ends in their places, and flat ones."""
    shifted = predictions + MAE
    yield shifted
    ends = shifted.copy()
    ends[[_LOW, _HIGH]] = shifted.min() - 5.0, shifted.max() + 5.0
    yield ends
    flat = np.full(_N, 100.0 * MAE / MAPE_PERCENT)
    flat[[_LOW, _HIGH]] += -12.0, 12.0
    yield flat


def _solve(
    predictions: Values, start: Assignment, worst: int, to: str, ranked: bool
) -> Assignment | None:
    identity = np.eye(_N)
    near = np.hstack([identity, -identity if to == "predicted" else 0.0 * identity])

    def objective(x: Values) -> tuple[float, Values]:
        distance = near @ x - predictions
        return float(distance @ distance), 2.0 * near.T @ distance

    constraints = [{"type": "eq", "fun": _misfit, "jac": _misfit_slope}]
    if ranked:
        constraints.append(
            {"type": "ineq", "fun": lambda x: _RANKING @ x, "jac": lambda x: _RANKING}
        )
    bounds_of_x = [(1.0, 1000.0)] * _N + [(0.0, MAX_ERROR)] * _N
    bounds_of_x[_N + worst] = (MAX_ERROR, MAX_ERROR)
    result = minimize(
        objective,
        np.concatenate([start.measured, start.measured - start.predicted]),
        jac=True,
        method="SLSQP",
        bounds=bounds_of_x,
        constraints=constraints,
        options={"maxiter": 300, "ftol": 1e-10},
    )
    fits = np.abs(_misfit(result.x)).max() < 1e-6
    if not fits or (ranked and (_RANKING @ result.x).min() < -1e-6):
        return None
    return Assignment(result.x[:_N], result.x[:_N] - result.x[_N:])


def _misfit(x: Values) -> Values:
    """Return by how much mean, RMSE, MAPE and R2 of an assignment miss the printed ones."""
    measured, residual = x[:_N], x[_N:]
    mean_square = np.mean(residual**2)
    return np.array(
        [
            np.mean(residual) - MAE,
            mean_square / RMSE - RMSE,
            100.0 * np.mean(residual / measured) - MAPE_PERCENT,
            (1.0 - R2) * np.var(measured) / mean_square - 1.0,
        ]
    )


def _misfit_slope(x: Values) -> Values:
    measured, residual = x[:_N], x[_N:]
    mean_square, variance = np.mean(residual**2), np.var(measured)
    of_mean_square = 2.0 * residual / _N
    unexplained = (1.0 - R2) / mean_square
    by_measured = [
        np.zeros(_N),
        np.zeros(_N),
        -100.0 * residual / measured**2 / _N,
        unexplained * 2.0 * (measured - measured.mean()) / _N,
    ]
    by_residual = [
        np.full(_N, 1.0 / _N),
        of_mean_square / RMSE,
        100.0 / measured / _N,
        -unexplained * variance / mean_square * of_mean_square,
    ]
    return np.hstack([by_measured, by_residual])


def _ranking() -> Values:
    """Return the rows whose products with (measured, residuals) a ranking as printed keeps >= 0."""
    identity = np.eye(_N, 2 * _N)
    above = np.delete(identity, _LOW, axis=0) - identity[_LOW]
    below = identity[_HIGH] - np.delete(identity, _HIGH, axis=0)
    return np.vstack([above, below])


_RANKING = _ranking()
