"""IMOP1 to IMOP8: problems with irregular fronts.

Source: Y. Tian, R. Cheng, X. Zhang, M. Li, Y. Jin, Diversity assessment of multi-objective
evolutionary algorithms: performance metric and benchmark problems, IEEE Computational Intelligence
Magazine 14(3), 2019. Ten variables in [0, 1] and the paper's exponents. The first five variables
say where on the front a design lies, by their means raised to 0.05 and to 10, so that most of
the box maps to a corner of the front; the other five say how far from it, zero at 0.5.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray

from experiments.studies.suites.formulas.plain_problem import PlainProblem
from pymoo_hdte._comparing.quality import N_POINTS, even_curve

Array = NDArray[np.float64]

N_VAR, N_PLACES = 10, 5
CROWDED, SPARSE = 0.05, 10.0
"""Exponents of the means of the variables that say where on the front."""
TWO_OBJECTIVES = (1, 2, 3)
_GRID = 300
"""Values of each of the two coordinates of a front that is a surface."""
_STACKED = 0.1
"""Half of the width of the ribbons of IMOP7."""


def make_imop(number: int) -> PlainProblem:
    """Return IMOP ``number``, 1 to 8."""
    n_obj = 2 if number in TWO_OBJECTIVES else 3
    objectives = partial(_objectives, number)
    return PlainProblem(objectives, np.zeros(N_VAR), np.ones(N_VAR), n_obj)


def imop_front(number: int) -> Array:
    """Return the true front, shape (n, m): what is non-dominated at distance zero.

    Curves are spread evenly along their length; surfaces come from a grid of coordinates.
    """
    if number <= 4:
        y = np.linspace(0.0, 1.0, 20 * N_POINTS)
        # IMOP1 and 2 are steep at both ends, where equal steps of y leave gaps.
        if number < 3:
            y = np.concatenate([y, np.geomspace(1e-9, 1e-3, 4 * N_POINTS)])
            y = np.sort(np.concatenate([y, 1.0 - y[y < 1e-3]]))
        points = FRONTS[number](0.0 * y, y, y)
        points = points[is_nondominated(points)]
        if number < 3:
            return even_curve(points)
        return points[:: max(1, len(points) // N_POINTS)]
    axis = np.linspace(0.0, 1.0, _GRID)
    if number == 5:
        return _discs(axis)
    if number == 7:
        return _ribbons(axis[::2])
    x, second = (grid.ravel() for grid in np.meshgrid(axis, axis))
    points = FRONTS[number](np.zeros_like(x), x, second)
    return points[is_nondominated(points)]


def _discs(parameter: Array) -> Array:
    """Return eight discs of radius 0.1 in the plane f1 + f2 + f3 = 0.5."""
    side = 0.2 * (parameter[:: _GRID // 25] - 0.5)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    inside = np.column_stack([x, y])[np.hypot(x, y) <= 0.1]
    turn = np.pi / 4.0 * np.arange(1, 9)
    centres = 0.4 * np.column_stack([np.cos(turn), np.sin(turn)])
    plane = (centres[:, np.newaxis] + inside).reshape(-1, 2)
    return np.column_stack([plane, 0.5 - plane.sum(axis=1)])


def _ribbons(parameter: Array) -> Array:
    """Return the parts of the unit sphere where two objectives differ by no more than 0.1."""
    x, second = (grid.ravel() for grid in np.meshgrid(parameter, parameter))
    points = FRONTS[7](np.zeros_like(x), x, second)
    return points[np.linalg.norm(points, axis=1) <= 1.0 + 1e-9]


def _objectives(number: int, X: Array) -> Array:
    distance = np.sum((X[:, N_PLACES:] - 0.5) ** 2, axis=1)
    if number <= 4:
        y = X[:, :N_PLACES].mean(axis=1) ** CROWDED
        return FRONTS[number](distance, y, y)
    position = X[:, 0:N_PLACES:2].mean(axis=1) ** CROWDED
    second = X[:, 1:N_PLACES:2].mean(axis=1) ** SPARSE
    return FRONTS[number](distance, position, second)


def _steep(exponent: float, g: Array, y: Array, _: Array) -> Array:
    angle = y * np.pi / 2.0
    return np.column_stack([g + np.cos(angle) ** exponent, g + np.sin(angle) ** exponent])


def _broken(g: Array, y: Array, _: Array) -> Array:
    return np.column_stack([g + 1.0 + np.cos(10.0 * np.pi * y) / 5.0 - y, g + y])


def _wave(g: Array, y: Array, _: Array) -> Array:
    wave = y + np.sin(10.0 * np.pi * y) / 10.0
    return (1.0 + g)[:, np.newaxis] * np.column_stack([y, wave, 1.0 - y])


def _eight(g: Array, y: Array, z: Array) -> Array:
    turn, around = np.pi * np.ceil(8.0 * y) / 4.0, 16.0 * np.pi * y
    f1 = 0.4 * np.cos(turn) + 0.1 * z * np.cos(around)
    f2 = 0.4 * np.sin(turn) + 0.1 * z * np.sin(around)
    return g[:, np.newaxis] + np.column_stack([f1, f2, 0.5 - f1 - f2])


def _grating(g: Array, y: Array, z: Array) -> Array:
    waves = np.minimum(np.sin(3.0 * np.pi * y) ** 2, np.sin(3.0 * np.pi * z) ** 2)
    plane = np.column_stack([(1.0 + g) * y, (1.0 + g) * z, (0.5 + g) * (2.0 - y - z)])
    # Where both waves are high the objectives are raised by one.
    return plane + (waves > 0.05)[:, np.newaxis]


def _sphere_ribbons(g: Array, y: Array, z: Array) -> Array:
    a, b = y * np.pi / 2.0, z * np.pi / 2.0
    sphere = np.column_stack([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])
    F = (1.0 + g)[:, np.newaxis] * sphere
    apart = np.abs(F - np.roll(F, -1, axis=1)).min(axis=1)
    return F + 10.0 * np.maximum(0.0, apart - _STACKED)[:, np.newaxis]


def _hundred_pieces(g: Array, y: Array, z: Array) -> Array:
    bumps = sum(f / (1.0 + g) * (1.0 + np.sin(19.0 * np.pi * f)) for f in (y, z))
    return np.column_stack([y, z, (1.0 + g) * (3.0 - bumps)])


FRONTS: dict[int, Callable[[Array, Array, Array], Array]] = {
    1: partial(_steep, 8.0),
    2: partial(_steep, 0.5),
    3: _broken,
    4: _wave,
    5: _eight,
    6: _grating,
    7: _sphere_ribbons,
    8: _hundred_pieces,
}
"""Objectives by number, from the distance and the two coordinates of the front."""
