"""ZCAT1 to ZCAT20 with two or three objectives and complicated Pareto sets.

Source: S. Zapotecas-Martinez, C. A. Coello Coello, H. E. Aguirre, K. Tanaka, Challenging test
problems for multi- and many-objective optimization, Swarm and Evolutionary Computation 81, 2023,
101350; the same values as pymoo's ZCAT, for whole arrays. Thirty variables, x_i within i / 2 of
zero. A point of the front follows from the first ones; what the others miss on a curve over these
is added to the objectives, by one of four levels: squares, the largest, waves on squares, waves on
the largest. Neither bias nor imbalance.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray

from experiments.studies.suites.formulas.plain_problem import PlainProblem

Array = NDArray[np.float64]

N_VAR = 30
ON_CURVES = (14, 15, 16)
"""Problems whose Pareto set is a curve whatever the number of objectives."""
FLAT = {19: ((0.0, 0.2), (0.4, 0.6)), 20: ((0.1, 0.4), (0.6, 0.9))}
"""Ranges of the first variable in which the Pareto set of a problem is a curve."""
MISSED_BY = (0, 4, 5, 2, 7, 9, 4, 5, 2, 7, 9, 3, 10, 1, 6, 8, 10, 1, 8, 6, 3)
"""Number of the curve, by the number of the problem."""
_GRID = 2001, 101
_EPSILON = np.finfo(float).eps


def make_zcat(number: int, n_obj: int, level: int) -> PlainProblem:
    """Return ZCAT ``number``, 1 to 20, with two or three objectives, at a level of 1 to 4."""
    half = np.arange(1.0, 1.0 + N_VAR) / 2.0
    return PlainProblem(partial(_objectives, number, n_obj, level), -half, half, n_obj)


def zcat_front(number: int, n_obj: int) -> Array:
    """Return points of the true front, shape (n, m), at even steps of its variables."""
    if n_obj == 2 or number in ON_CURVES:
        y = np.linspace(0.0, 1.0, _GRID[0])[:, np.newaxis]
    else:
        axis = np.linspace(0.0, 1.0, _GRID[1])
        y = np.column_stack([grid.ravel() for grid in np.meshgrid(axis, axis)])
    F = _weighted(_shape(number, y, n_obj))
    F = np.unique(F, axis=0)
    return F[is_nondominated(F)]


def _weighted(F: Array) -> Array:
    return F * np.arange(1.0, 1.0 + F.shape[1]) ** 2


def _objectives(number: int, n_obj: int, level: int, X: Array) -> Array:
    half = np.arange(1.0, 1.0 + N_VAR) / 2.0
    y = (X + half) / (2.0 * half)
    on_curve = _within(y[:, 0], FLAT.get(number, ())) | (number in ON_CURVES)
    missed = np.empty((len(X), n_obj))
    for rows, places in ((on_curve, 1), (~on_curve, n_obj - 1)):
        curve = _CURVES[MISSED_BY[number] - 1](*_angles(y[rows, :places]))
        off = y[rows, places:] - curve
        missed[rows] = np.column_stack([_LEVELS[level - 1](off[:, k::n_obj]) for k in range(n_obj)])
    return _weighted(_shape(number, y[:, : n_obj - 1], n_obj) + missed)


def _within(y: Array, ranges: tuple[tuple[float, float], ...]) -> NDArray[np.bool_]:
    inside = np.zeros(y.shape, dtype=bool)
    for low, high in ranges:
        inside |= (y > low - _EPSILON) & (y < high + _EPSILON)
    return inside


# --- the front ------------------------------------------------------------------------------------


def _shape(number: int, y: Array, n_obj: int) -> Array:
    """Return the objectives on the front, unweighted, from its variables (n, m - 1)."""
    leading = y[:, 0]
    if number in FLAT:
        y = np.where(_within(leading, FLAT[number])[:, np.newaxis], leading[:, np.newaxis], y)
    if number == 17:
        y = np.where((y <= 0.5).all(axis=1, keepdims=True), leading[:, np.newaxis], y)
    if number == 18:
        wedge = [
            np.all((y > low - _EPSILON) & (y < low + 0.4 + _EPSILON), axis=1) for low in (0.0, 0.6)
        ]
        y = np.where((wedge[0] | wedge[1])[:, np.newaxis], leading[:, np.newaxis], y)
    sine, cosine = np.sin(y * np.pi / 2.0), np.cos(y * np.pi / 2.0)
    match number:
        case 1:
            others, last = _products(sine, cosine), 1.0 - sine[:, 0]
        case 2:
            others, last = _products(1.0 - cosine, 1.0 - sine), 1.0 - sine[:, 0]
        case 3:
            others, last = _means(y, 1.0 - y), 1.0 - leading
        case 8:
            others, last = 1.0 - _products(1.0 - sine, 1.0 - cosine), cosine[:, 0]
        case 9:
            others, last = _means(sine, cosine), cosine[:, 0]
        case 11:
            others, last = _means(y, 1.0 - y), _wave(leading, 4)
        case 12:
            others, last = 1.0 - _products(1.0 - y, y), _wave(leading, 3)
        case 13:
            others, last = 1.0 - _means(sine, cosine), 1.0 - _wave(leading, 3)
        case 14:
            others, last = _turning(sine[:, 0] ** 2, leading, 3.0, n_obj), cosine[:, 0]
        case 15:
            powers = 1.0 + np.arange(n_obj - 1) / (4.0 * n_obj)
            others, last = leading[:, np.newaxis] ** powers, _wave(leading, 3)
        case 16:
            others, last = _turning(sine[:, 0], leading, 5.0, n_obj), _wave(leading, 5)
        case _:
            others, last = y, _LAST[number](y)
    return np.column_stack([others, last])


def _products(sines: Array, cosines: Array) -> Array:
    """Return all objectives but the last: products of ever fewer factors, the last one another."""
    n_obj = sines.shape[1] + 1
    columns = [np.prod(sines, axis=1)]
    for k in range(n_obj - 2, 0, -1):
        columns.append(np.prod(sines[:, :k], axis=1) * cosines[:, k])
    return np.column_stack(columns)


def _means(sines: Array, cosines: Array) -> Array:
    """Return the same of means."""
    n_obj = sines.shape[1] + 1
    columns = [sines.mean(axis=1)]
    for k in range(n_obj - 2, 0, -1):
        columns.append((sines[:, :k].sum(axis=1) + cosines[:, k]) / (k + 1.0))
    return np.column_stack(columns)


def _wave(y: Array, k: int) -> Array:
    return (np.cos((2.0 * k - 1.0) * np.pi * y) + 2.0 * y + 4.0 * k * (1.0 - y) - 1.0) / (4.0 * k)


def _turning(f: Array, y: Array, turns: float, n_obj: int) -> Array:
    between = 0.5 * (1.0 + np.sin(turns * np.pi * y - np.pi / 2.0))
    return np.column_stack([f, between][: n_obj - 1])


def _exponential(y: Array) -> Array:
    return (np.exp(8.0 * (1.0 - y).mean(axis=1)) - 1.0) / (np.exp(8.0) - 1.0)


def _logistic(y: Array) -> Array:
    steep, slope, mean = 40.0, 0.05, y.mean(axis=1)

    def step(t: Array) -> Array:
        return 1.0 / (1.0 + np.exp(t))

    ends = step(np.array([steep, -steep]))
    down = step(2.0 * steep * mean - steep) - slope * mean - ends[0] + slope
    return down / (ends[1] - ends[0] + slope)


def _quintic(y: Array) -> Array:
    return ((0.5 - y) ** 5).mean(axis=1) / (2.0 * 0.5**5) + 0.5


def _reciprocal(y: Array) -> Array:
    r = 0.02
    return (1.0 / r - 1.0 / ((1.0 - y).mean(axis=1) + r)) / (1.0 / r - 1.0 / (1.0 + r))


def _sloping_wave(y: Array) -> Array:
    mean = y.mean(axis=1)
    return 1.0 - mean - np.cos(10.0 * np.pi * mean + np.pi / 2.0) / (10.0 * np.pi)


_LAST: dict[int, Callable[[Array], Array]] = {
    **{4: lambda y: 1.0 - y.mean(axis=1), 5: _exponential, 6: _logistic, 7: _quintic},
    **{10: _reciprocal, 17: _exponential, 18: _quintic, 19: _sloping_wave, 20: _quintic},
}
"""The last objective where the others are the variables themselves, by number."""


# --- what the other variables miss ----------------------------------------------------------------


def _angles(y: Array) -> tuple[Array, Array, Array]:
    """Return variables (n, m, 1), their mean (n, 1) and the angles of the others (30 - m,)."""
    others = N_VAR - y.shape[1]
    return (
        y[:, :, np.newaxis],
        y.mean(axis=1)[:, np.newaxis],
        2.0 * np.pi * np.arange(others) / others,
    )


def _curve_6(y: Array, _: Array, t: Array) -> Array:
    size = np.sqrt((y**2).mean(axis=1))
    waves = (np.cos(11.0 * np.pi * y + t) ** 3).mean(axis=1)
    highest = 10.0 + np.e - 10.0 * np.exp(-0.4) - np.exp(-1.0)
    return (10.0 + np.e - 10.0 * np.exp(-0.4 * size) - np.exp(waves)) / highest


def _curve_7(_: Array, mean: Array, t: Array) -> Array:
    least = np.exp(-1.0)
    wave = np.exp(np.sin(7.0 * np.pi * mean - np.pi / 2.0 + t))
    return (mean + wave - least) / (1.0 + np.e - least)


_CURVES: tuple[Callable[[Array, Array, Array], Array], ...] = (
    lambda y, _, t: np.sin(1.5 * np.pi * y + t).mean(axis=1) / 2.0 + 0.5,
    lambda y, _, t: (y**2 * np.sin(4.5 * np.pi * y + t)).mean(axis=1) / 2.0 + 0.5,
    lambda y, _, t: (np.cos(np.pi * y + t) ** 2).mean(axis=1),
    lambda _, mean, t: mean / 2.0 * np.cos(4.0 * np.pi * mean + t) + 0.5,
    lambda y, _, t: (np.sin(2.0 * np.pi * y - 1.0 + t) ** 3).mean(axis=1) / 2.0 + 0.5,
    _curve_6,
    _curve_7,
    lambda y, _, t: np.abs(np.sin(2.5 * np.pi * (y - 0.5) + t)).mean(axis=1),
    lambda y, mean, t: (
        mean / 2.0 - np.abs(np.sin(2.5 * np.pi * y - np.pi / 2.0 + t)).mean(axis=1) / 2.0 + 0.5
    ),
    lambda y, _, t: np.sin((4.0 * y - 2.0) * np.pi + t).mean(axis=1) ** 3 / 2.0 + 0.5,
)
"""Where the others are best, shape (n, 30 - m), from variables, mean and angles."""


def _waves_on_squares(off: Array) -> Array:
    return 10.0 * ((off**2 - np.cos(9.0 * np.pi * off) + 1.0) / 3.0).mean(axis=1)


def _waves_on_the_largest(off: Array) -> Array:
    waves = (0.5 * (np.cos(9.0 * np.pi * off) + 1.0)).mean(axis=1)
    largest = np.sqrt(np.abs(off).max(axis=1))
    return 10.0 / (2.0 * np.e - 2.0) * (np.exp(largest) - np.exp(waves) - 1.0 + np.e)


_LEVELS: tuple[Callable[[Array], Array], ...] = (
    lambda off: 10.0 * (off**2).mean(axis=1),
    lambda off: 10.0 * np.abs(off).max(axis=1),
    _waves_on_squares,
    _waves_on_the_largest,
)
"""What is added for what the variables of an objective miss, (n, k), by level."""
