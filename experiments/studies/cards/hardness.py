"""What makes a problem hard, in numbers: local optima, pieces of the front, good designs."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from pymoo_hdte._comparing.indicators import IndicatorsAgainst
from pymoo_hdte._comparing.quality import TrueFront
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.problems import RobustProblem

STARTS = 60
"""Random designs from which a gradient method minimises each weighted sum."""
DESIGNS = 2**15
"""Random designs of which the near-optimal ones are counted."""
COSTLY_DESIGNS = 500
"""The same where no surrogate makes designs cheap."""
NEAR = (0.1, 1.0)
"""A design is near-optimal within these shares of the front's width in every objective."""
POINTS = 50
"""Of the true front itself, spread evenly: the best set of the size at which all are judged."""

_STEPS = 4
_ANOTHER = 1e-3
"""Optima whose weighted sums differ by more than this, in widths of the front, are two."""
_ALLOWED = 1e-6
"""A minimum may violate a constraint, of the size of 1, by this."""
_AT_ONCE = 256

Values = NDArray[np.float64]


class Hardness(NamedTuple):
    """Numbers of one problem; None where one cannot be had.

    Attributes
    ----------
    optima : int
        Local minima of the weighted sum that has the most, of those found.
    best_reached : float
        Share of the starts that end in the best minimum, at the weights where it is least.
    pieces : int
        Of a front of two objectives.
    feasible, near, wide : float
        Shares of random designs that are allowed, and within either of `NEAR`.
    floor : float
        IGD of the `POINTS` of the true front.
    """

    optima: int | None
    best_reached: float | None
    pieces: int | None
    feasible: float
    near: float
    wide: float
    floor: float


def hardness(problem: Problem, rng: np.random.Generator, starts: int = STARTS) -> Hardness:
    """Measure a problem with a true front; a `RobustProblem` by its gradients, too."""
    front = problem.pareto_front()
    smooth = isinstance(problem, RobustProblem)
    optima, reached = modality_of(problem, front, rng, starts) if smooth else (None, None)
    shares = _shares(problem, front, rng, DESIGNS if smooth else COSTLY_DESIGNS)
    pieces = len(TrueFront(front).pieces) if problem.n_obj == 2 else None
    floor = IndicatorsAgainst(front)(front[most_spread(front, POINTS)]).igd
    return Hardness(optima, reached, pieces, *shares, floor)


def weights_of(n_obj: int) -> Values:
    """Return weights in steps of a quarter that add up to 1, shape (n, n_obj)."""
    grid = np.array(list(product(range(_STEPS + 1), repeat=n_obj)))
    return grid[grid.sum(axis=1) == _STEPS] / _STEPS


def modality_of(
    problem: Problem, front: Values, rng: np.random.Generator, starts: int
) -> tuple[int, float]:
    """Return the most local minima of any weighted sum, and the least share that ends in the best.

    Objectives are in widths of the front. Minima of one value count as one, wherever they lie, and
    starts that end where a constraint is violated count as lost.
    """
    search = _WeightedSum(problem, front)
    cubes = rng.random((starts, problem.n_var))
    counts, shares = [], []
    for weights in weights_of(problem.n_obj):
        ends = np.sort([search.minimum(weights, cube) for cube in cubes])
        optima = ends[np.isfinite(ends)]
        if not len(optima):
            continue
        counts.append(1 + int(np.sum(np.diff(optima) > _ANOTHER)))
        shares.append(float(np.mean(ends <= optima[0] + _ANOTHER)))
    return max(counts), min(shares)


class _WeightedSum:
    """Minimises weighted sums of the objectives, in widths of the front, over the unit cube."""

    def __init__(self, problem: Problem, front: Values) -> None:
        self.problem = problem
        self.span = problem.xu - problem.xl
        self.ideal, self.width = front.min(axis=0), np.ptp(front, axis=0)

    def _at(self, cube: Values, *names: str) -> Values:
        designs = self.problem.xl + np.clip(cube, 0.0, 1.0) * self.span
        return self.problem.evaluate(designs, return_values_of=list(names))

    def minimum(self, weights: Values, start: Values) -> float:
        """Return the weighted sum where SLSQP ends, infinite where that is not allowed."""

        def value(cube: Values) -> tuple[float, Values]:
            F, dF = self._at(cube, "F", "dF")
            slopes = dF * self.span / self.width[:, None]
            return float(weights @ ((F - self.ideal) / self.width)), weights @ slopes

        limits = [
            NonlinearConstraint(
                lambda cube: self._at(cube, "G"),
                -np.inf,
                0.0,
                jac=lambda cube: self._at(cube, "dG") * self.span,
            )
        ][: self.problem.n_ieq_constr]
        ended = minimize(
            value,
            start,
            jac=True,
            bounds=Bounds(np.zeros_like(start), np.ones_like(start)),
            constraints=limits,
            method="SLSQP",
            options={"ftol": 1e-9, "maxiter": 200},
        )
        cube = np.clip(ended.x, 0.0, 1.0)
        if limits and np.max(self._at(cube, "G")) > _ALLOWED:
            return np.inf
        return value(cube)[0]


def _shares(
    problem: Problem, front: Values, rng: np.random.Generator, n: int
) -> tuple[float, float, float]:
    """Return the shares of ``n`` random designs that are allowed, and near the front."""
    designs = rng.uniform(problem.xl, problem.xu, (n, problem.n_var))
    F, G = problem.evaluate(designs, return_values_of=["F", "G"])
    F = F[np.all(G <= 0.0, axis=1)]
    scaled = front / np.ptp(front, axis=0)
    behind = [
        (row / np.ptp(front, axis=0) - scaled[:, None]).max(axis=2).min(axis=0)
        for row in np.array_split(F, max(1, len(F) // _AT_ONCE))
    ]
    distance = np.concatenate(behind)
    near, wide = (float(np.sum(distance <= share) / n) for share in NEAR)
    return len(F) / n, near, wide
