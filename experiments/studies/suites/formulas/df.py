"""DF1 to DF14, dynamic problems, each at two fixed times.

Source: S. Jiang, S. Yang, X. Yao, K. C. Tan, M. Kaiser, N. Krasnogor, Benchmark problems for
CEC2018 competition on dynamic multiobjective optimisation, Newcastle University 2018, as pymoo has
them, with ten variables. Of these DF12 is left out: in pymoo 0.6.2 the objectives of a design
depend on the designs that are evaluated with it. At both times sin(pi t / 2), to which most optima
are tied, is neither 0 nor 1; it is positive at the first time and negative at the second.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems.dynamic import df

from pymoo_hdte._comparing.quality import N_POINTS

Array = NDArray[np.float64]

NUMBERS = tuple(n for n in range(1, 15) if n != 12)
TIMES = (0.3, 2.7)
THREE_OBJECTIVES = (10, 11, 13, 14)
_GRID = 300
"""Values of each of the two coordinates of a front that is a surface."""


def make_df(number: int, time: float) -> Problem:
    """Return DF ``number`` as it is at a time."""
    return getattr(df, f"DF{number}")(time=time)


def df_designs(number: int, time: float) -> Array:
    """Return optimal designs, shape (n, d), in steps of the variables that say where on the front.

    All other variables are where the distance from the front is least, which every objective grows
    with.
    """
    problem = make_df(number, time)
    places = [0, 1] if number in THREE_OBJECTIVES else [0]
    if number == 2:
        places = [int((problem.n_var - 1) * abs(_wave(time)))]
    steps = _GRID if len(places) > 1 else 20 * N_POINTS
    axes = [np.linspace(problem.xl[place], problem.xu[place], steps) for place in places]
    X = np.zeros((steps ** len(places), problem.n_var))
    X[:, places] = np.stack(np.meshgrid(*axes), axis=-1).reshape(len(X), -1)
    for other in np.setdiff1d(np.arange(problem.n_var), places):
        X[:, other] = OPTIMA.get(number, _shifted)(X, other, time)
    # Off the front, some of DF4 lie beyond the box.
    return np.clip(X, problem.xl, problem.xu)


def df_front(number: int, time: float) -> Array:
    """Return the true front, shape (n, m), of `df_designs`, its ends among them."""
    F = make_df(number, time).evaluate(df_designs(number, time))
    F = F[is_nondominated(F)]
    size = min(len(F), (1 if F.shape[1] == 2 else 5) * N_POINTS)
    spread = np.linspace(0, len(F) - 1, size).astype(int)
    return F[np.unique([*spread, *F.argmin(axis=0), *F.argmax(axis=0)])]


def _wave(time: float) -> float:
    return float(np.sin(0.5 * np.pi * time))


def _shifted(X: Array, i: int, time: float) -> Array:
    return np.full(len(X), _wave(time))


def _distance_of_4(X: Array, i: int, time: float) -> Array:
    a = _wave(time)
    b = 1.0 + abs(np.cos(0.5 * np.pi * time))
    return a * (X[:, 0] / max(abs(a), a + b)) ** 2 / (i + 1)


OPTIMA: dict[int, Callable[[Array, int, float], Array]] = {
    1: lambda X, i, t: np.full(len(X), abs(_wave(t))),
    2: lambda X, i, t: np.full(len(X), abs(_wave(t))),
    3: lambda X, i, t: _wave(t) + X[:, 0] ** (_wave(t) + 1.5),
    4: _distance_of_4,
    7: lambda X, i, t: 1.0 / (1.0 + np.exp(5.0 * np.cos(0.5 * np.pi * t) * (X[:, 0] - 2.5))),
    8: lambda X, i, t: _wave(t) * np.sin(4.0 * np.pi * X[:, 0]) / (1.0 + abs(_wave(t))),
    9: lambda X, i, t: np.cos(4.0 * t + X[:, 0] + X[:, i - 1]),
    10: lambda X, i, t: np.sin(4.0 * np.pi * (X[:, 0] + X[:, 1])) / (1.0 + abs(_wave(t))),
    11: lambda X, i, t: 0.5 * abs(_wave(t)) * X[:, 0],
}
"""The best value of variable ``i`` of designs, by number of the problem; else sin(pi t / 2)."""
