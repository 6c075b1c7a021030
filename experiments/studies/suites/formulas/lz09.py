"""F1 to F9 with complicated Pareto sets.

Source: H. Li, Q. Zhang, Multiobjective optimization problems with complicated Pareto sets, MOEA/D
and NSGA-II, IEEE Transactions on Evolutionary Computation 13(2), 2009. Thirty variables, ten in F6
to F8. A variable is best on a curve over the first variables; what it misses is added to the
objective that its number belongs to.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray
from pymoo.util.ref_dirs import get_reference_directions

from experiments.studies.suites.formulas.plain_problem import PlainProblem
from pymoo_hdte._comparing.quality import N_POINTS, even_curve

Array = NDArray[np.float64]

SHORT = (6, 7, 8)
"""Problems with ten variables."""
UNIT_BOX = (1, 7, 8)


def make_lz09(number: int) -> PlainProblem:
    """Return F ``number``, 1 to 9."""
    n_var = 10 if number in SHORT else 30
    if number == 6:
        lower, upper = np.full(n_var, -2.0), np.full(n_var, 2.0)
        lower[:2], upper[:2] = 0.0, 1.0
    else:
        lower, upper = np.full(n_var, 0.0 if number in UNIT_BOX else -1.0), np.ones(n_var)
        lower[0] = 0.0
    return PlainProblem(partial(_objectives, number), lower, upper, 3 if number == 6 else 2)


def lz09_front(number: int) -> Array:
    """Return the true front, shape (n, m)."""
    if number == 6:
        directions = get_reference_directions("das-dennis", 3, n_partitions=60)
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)
    x = np.linspace(0.0, 1.0, 20 * N_POINTS)
    return even_curve(np.column_stack([x, 1.0 - x**2 if number == 9 else 1.0 - np.sqrt(x)]))


def _objectives(number: int, X: Array) -> Array:
    n = X.shape[1]
    start = 3 if number == 6 else 2
    j = np.arange(start, n + 1)
    missed = X[:, start - 1 :] - _best(number, X, j, n)
    x = X[:, 0]
    if number == 6:
        a, b = x * np.pi / 2.0, X[:, 1] * np.pi / 2.0
        F = np.column_stack([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])
        members = [j % 3 == 1, j % 3 == 2, j % 3 == 0]
    else:
        F = np.column_stack([x, 1.0 - x**2 if number == 9 else 1.0 - np.sqrt(x)])
        members = [j % 2 == 1, j % 2 == 0]
    for objective, mine in enumerate(members):
        F[:, objective] += 2.0 / mine.sum() * _miss(number, missed[:, mine], j[mine])
    return F


def _best(number: int, X: Array, j: NDArray[np.int_], n: int) -> Array:
    """Return the best values of the variables from number ``j`` on, shape (designs, len(j))."""
    x = X[:, :1]
    phase = 6.0 * np.pi * x + j * np.pi / n
    odd = j % 2 == 1
    match number:
        case 1 | 7 | 8:
            return x ** (0.5 * (1.0 + 3.0 * (j - 2.0) / (n - 2.0)))
        case 2 | 9:
            return np.sin(phase)
        case 3:
            return 0.8 * x * np.where(odd, np.cos(phase), np.sin(phase))
        case 4:
            return 0.8 * x * np.where(odd, np.cos(phase / 3.0), np.sin(phase))
        case 5:
            radius = 0.3 * x**2 * np.cos(24.0 * np.pi * x + 4.0 * j * np.pi / n) + 0.6 * x
            return radius * np.where(odd, np.cos(phase), np.sin(phase))
    return 2.0 * X[:, 1:2] * np.sin(2.0 * np.pi * x + j * np.pi / n)


def _miss(number: int, y: Array, j: NDArray[np.int_]) -> Array:
    if number == 7:
        return np.sum(4.0 * y**2 - np.cos(8.0 * np.pi * y) + 1.0, axis=1)
    if number == 8:
        waves = np.prod(np.cos(20.0 * np.pi * y / np.sqrt(j)), axis=1)
        return 4.0 * np.sum(y**2, axis=1) - 2.0 * waves + 2.0
    return np.sum(y**2, axis=1)
