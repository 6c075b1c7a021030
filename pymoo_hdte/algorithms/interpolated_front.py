"""The front of two expensive objectives: interpolated, evaluated where it seems to lie, repeated.

The logarithms of both objectives are interpolated by radial basis functions over the designs that
were evaluated and are not far worse. A swarm finds the front of the interpolation, designs along it
are evaluated, and that is repeated until interpolation and evaluation agree along the front. Every
design that is returned was evaluated: a wrong interpolation costs rounds, never truth. Some designs
of each round lie anywhere, so that a better region elsewhere has its chance. Interpolation as a
guide of expensive searches: Gutmann, Journal of Global Optimization 19, 2001; Regis and Shoemaker,
INFORMS Journal on Computing 19, 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from pymoo_hdte.algorithms.elitist import ElitistSwarm

Values = NDArray[np.float64]
Evaluate = Callable[[Values], Values]

POINTS = 20
"""Designs along the front that are evaluated in a round, by default."""
EXPLORERS = 16
"""Designs anywhere that are evaluated in a round."""
_FIRST_DESIGNS = 64
"""Designs all over the box in the first round, or a quarter of the most there may be."""
_CORNERS_UP_TO = 6
"""Variables up to which all corners of the box are evaluated."""
_POPULATION, _GENERATIONS = 100, 60
_AT_ONCE = 16
"""Designs evaluated between two notifications."""
_SAME = 1e-4
"""Distance in the unit cube below which a design counts as evaluated already."""
_OUTLYING = 2.0
"""Designs worse than the front by this factor, as in a resonance, would bend the interpolation."""
_BEYOND = 1.0
"""Distance above the largest interpolated logarithm at which the interpolation is cut off."""


@dataclass(frozen=True, eq=False)
class FoundFront:
    """The result of a search.

    Attributes
    ----------
    designs : ndarray, shape (n, n_var)
        In their own units; no evaluated design is better in both objectives than one of these. By
        rising first objective.
    front : ndarray, shape (n, 2)
        Their objectives as evaluated, in their own units.
    width : ndarray, shape (2,)
        Width of the front in their units, or ``least_width`` of its least value if that is
        more.
    difference : float
        Dimensionless, in widths: largest difference of interpolation and evaluation along the last
        front, and by which a design anywhere undercut it or lay beyond an end; inf if one along it
        had no objectives.
    evaluated : int
        Number of designs evaluated.
    lost : ndarray, shape (k, n_var)
        Evaluated designs without objectives, in their own units.

    Examples
    --------
    >>> FoundFront(np.eye(2), np.eye(2), np.ones(2), 0.01, 60, np.zeros((0, 2))).evaluated
    60
    """

    designs: Values
    front: Values
    width: Values
    difference: float
    evaluated: int
    lost: Values


def interpolated_front(
    evaluate: Evaluate,
    lower: Values,
    upper: Values,
    rng: np.random.Generator,
    *,
    accuracy: float,
    least_width: float,
    start: Values | None = None,
    most: int = 600,
    points: int = POINTS,
    notify: Callable[[int, float], None] | None = None,
) -> FoundFront:
    """Return the front of two positive objectives over a box, in some hundred evaluations.

    Parameters
    ----------
    evaluate : callable
        Takes designs in their own units, shape (n, n_var), and returns objectives in theirs, shape
        (n, 2), above 0, or NaN for a design that has none.
    lower, upper : ndarray, shape (n_var,)
        The box, in the designs' own units.
    rng : numpy.random.Generator
    accuracy : float
        Dimensionless, in widths: the search ends when interpolation and evaluation differ by less
        along the front, and no design anywhere undercuts it or extends it by more.
    least_width : float
        Dimensionless share of an objective's least value below which its width counts as that.
    start : ndarray, shape (m, n_var), optional
        Designs in their own units to evaluate first, beside some all over the box.
    most : int
        Evaluations after which no further round begins.
    points : int
        Designs along the front that are evaluated in a round.
    notify : callable, optional
        Called often with the number of evaluations and the difference of the last round in widths,
        both dimensionless; inf in the first.

    Returns
    -------
    FoundFront

    Raises
    ------
    ArithmeticError
        If no design of the first round has objectives.

    Examples
    --------
    >>> found = interpolated_front(
    ...     lambda X: np.column_stack([X[:, 0] ** 2, (X[:, 0] - 1) ** 2]) + 1.0,
    ...     np.zeros(1), np.ones(1), np.random.default_rng(1), accuracy=0.05, least_width=0.02,
    ... )
    >>> found.difference <= 0.05
    True
    """
    known = _Known(evaluate, lower, upper, least_width, notify)
    start_cubes = _first_cubes(len(lower), min(_FIRST_DESIGNS, most // 4), rng)
    if start is not None:
        cubes = known.cube_of(start)
        start_cubes = np.vstack([start_cubes, cubes[_not_known(start_cubes, cubes)]])
    known.add(start_cubes)
    if not known.good.any():
        raise ArithmeticError(f"none of {len(known.cubes)} designs over the whole box has values")
    while known.difference > accuracy and len(known.cubes) < most:
        known.difference = _round(known, points, rng)
        known.tell()
    return known.result()


class _Known:
    """The designs that were evaluated, in the unit cube, and their objectives."""

    def __init__(
        self,
        evaluate: Evaluate,
        lower: Values,
        upper: Values,
        least_width: float,
        notify: Callable[[int, float], None] | None,
    ) -> None:
        self._evaluate, self._lower, self._span = evaluate, lower, upper - lower
        self._upper, self._least_width, self._notify = upper, least_width, notify
        self.difference = np.inf
        self.cubes, self.values = np.empty((0, len(lower))), np.empty((0, 2))

    def cube_of(self, designs: Values) -> Values:
        return np.clip((designs - self._lower) / self._span, 0.0, 1.0)

    def designs_of(self, cubes: Values) -> Values:
        # Rounding must not lead out of the box.
        return np.clip(self._lower + self._span * cubes, self._lower, self._upper)

    def add(self, cubes: Values) -> Values:
        """Evaluate designs, some at once, and return their objectives."""
        before = len(self.values)
        for begin in range(0, len(cubes), _AT_ONCE):
            some = cubes[begin : begin + _AT_ONCE]
            values = self._evaluate(self.designs_of(some))
            self.cubes = np.vstack([self.cubes, some])
            self.values = np.vstack([self.values, values])
            self.tell()
        return self.values[before:]

    def tell(self) -> None:
        """Notify of the number of designs evaluated and of the last difference."""
        if self._notify is not None:
            self._notify(len(self.cubes), self.difference)

    @property
    def good(self) -> NDArray[np.bool_]:
        """Which designs have objectives, shape (n,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    @property
    def front_rows(self) -> NDArray[np.int_]:
        """Rows of the front, by rising first objective."""
        rows = np.flatnonzero(self.good)
        front = rows[NonDominatedSorting().do(self.values[rows], only_non_dominated_front=True)]
        return front[np.lexsort(self.values[front].T[::-1])]

    @property
    def width(self) -> Values:
        front = self.values[self.front_rows]
        return np.maximum(np.ptp(front, axis=0), self._least_width * front.min(axis=0))

    def result(self) -> FoundFront:
        rows = self.front_rows
        lost = self.designs_of(self.cubes[~self.good])
        designs, front = self.designs_of(self.cubes[rows]), self.values[rows]
        return FoundFront(designs, front, self.width, self.difference, len(self.cubes), lost)


class _Interpolation(Problem):
    """Both objectives between designs near the front; bad next to those that are not, or lost."""

    def __init__(self, known: _Known) -> None:
        n_var = known.cubes.shape[1]
        super().__init__(n_var=n_var, n_obj=2, xl=0.0, xu=1.0)
        self._usable, worst = known.good, known.values[known.front_rows].max(axis=0)
        usable = self._usable & (known.values <= _OUTLYING * worst).all(axis=1)
        # The polynomial of degree 2 needs as many designs as it has coefficients; more are better.
        if usable.sum() >= (n_var + 1) * (n_var + 2):
            self._usable = usable
        logarithms = np.log(known.values[self._usable])
        self._highest = logarithms.max(axis=0) + _BEYOND
        self._nearest = scipy.spatial.cKDTree(known.cubes)
        degree = 2 if len(logarithms) >= (n_var + 1) * (n_var + 2) else 0
        self._between = scipy.interpolate.RBFInterpolator(
            known.cubes[self._usable],
            logarithms,
            kernel="quintic" if degree else "linear",
            degree=degree,
        )

    def _evaluate(self, x: Values, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        is_usable = self._usable[self._nearest.query(x)[1]]
        logarithms = np.minimum(self._between(x), self._highest)
        out["F"] = np.exp(np.where(is_usable[:, None], logarithms, self._highest))


def _round(known: _Known, points: int, rng: np.random.Generator) -> float:
    """Evaluate designs along the interpolated front and anywhere; return their difference."""
    swarm = ElitistSwarm(pop_size=_POPULATION)
    seed = int(rng.integers(2**31))
    result = minimize(_Interpolation(known), swarm, ("n_gen", _GENERATIONS), seed=seed)
    along = _spread(result.F, points)
    new = _not_known(known.cubes, result.X[along])
    expected = result.F[along][new]
    explorers = rng.random((EXPLORERS, known.cubes.shape[1]))
    before = known.values[known.front_rows]
    values = known.add(np.vstack([result.X[along][new], explorers]))
    width = known.width
    elsewhere = values[len(new) :]
    elsewhere = elsewhere[np.isfinite(elsewhere).all(axis=1)]
    # By how much a design undercuts the front in both objectives at once, or lies beyond its ends.
    undercut = ((before - elsewhere[:, None]) / width).min(axis=2)
    beyond = (before.min(axis=0) - elsewhere) / width
    differences = np.abs(values[: len(new)] - expected) / width
    if np.isnan(differences).any():
        return np.inf
    return float(max(difference.max(initial=0.0) for difference in (differences, undercut, beyond)))


def _first_cubes(n_var: int, number: int, rng: np.random.Generator) -> Values:
    """Return the centre and corners of the unit cube, and a number of designs all over it."""
    sampler = scipy.stats.qmc.LatinHypercube(n_var, optimization="random-cd", rng=rng)
    parts = [np.full((1, n_var), 0.5), sampler.random(number)]
    if n_var <= _CORNERS_UP_TO:
        parts.append(np.indices((2,) * n_var).reshape(n_var, -1).T.astype(float))
    return np.vstack(parts)


def _spread(front: Values, number: int) -> NDArray[np.int_]:
    """Return rows that lie evenly along a front, both ends among them."""
    order = np.argsort(front[:, 0], kind="stable")
    if len(order) <= number:
        return order
    width = np.maximum(np.ptp(front, axis=0), 1e-300)
    steps = np.hypot(*(np.diff(front[order], axis=0) / width).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, along[-1], number)
    return order[np.unique(np.searchsorted(along, wanted).clip(0, len(order) - 1))]


def _not_known(known: Values, cubes: Values) -> NDArray[np.int_]:
    """Return the rows of designs that are neither known nor the same as an earlier one."""
    new_rows: list[int] = []
    for row, cube in enumerate(cubes):
        others = np.vstack([known, cubes[new_rows]])
        if np.abs(others - cube).max(axis=1).min() > _SAME:
            new_rows.append(row)
    return np.array(new_rows, dtype=int)
