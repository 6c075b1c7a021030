"""The four robust problems of Deb and Gupta, Evolutionary Computation 14, 2006.

The objectives are *mean effective* ones: averages over a box around the design. Here the designs
keep so far from the bounds that the box stays inside.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number, whole_number
from pymoo_hdte.problems._closed_form.pieces import falling_points, least_between
from pymoo_hdte.problems._closed_form.problem import (
    FRONT_POINTS,
    ClosedFormProblem,
    unconstrained,
)
from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.statistics import Mean

Array = NDArray[np.float64]

_WIDE, _NARROW = 0.25, 0.03
_CENTRE = 0.85
"""Widths of the two valleys of problems 3 and 4, and the centre of the narrow valley."""
_NODES, _WEIGHTS = leggauss(32)
_LEVELS = 401
_COARSE, _FINE = 33, 13
"""Places of x1; of x2, at which the deepest valley is looked for: all over, and around it."""


class DebGupta(ClosedFormProblem):
    """Base of the four problems of Deb and Gupta.

    Parameters
    ----------
    lower : tuple of float
        Lower bounds of the first two variables in the paper; upper ones are 1, and all others
        are within -1..1.
    deltas : ndarray, shape (n_var,)
        Half-widths of the box around a design.
    """

    def __init__(self, lower: tuple[float, float], deltas: Array) -> None:
        lows = [*lower, *[-1.0] * (len(deltas) - 2)]
        designs = {
            f"x{j + 1}": Design(low + delta, 1.0 - delta, deviation=delta)
            for j, (low, delta) in enumerate(zip(lows, deltas.tolist(), strict=True))
        }
        self.deltas = deltas
        super().__init__(designs, [Mean(response="f1"), Mean(response="f2")])

    def _on_curve(self, x1: Array, x2: Array | float = 0.0) -> Array:
        """Return designs with these x1 and x2, and 0 in all others."""
        designs = np.zeros((len(x1), self.n_var))
        designs[:, 0], designs[:, 1] = x1, x2
        return designs


class DebGupta12(DebGupta):
    """Their first problem (``beta`` 1) and second one (``beta`` 10).

    f1 = x1, f2 = 1 - x1^2 + g(x2, ..) S(x1) with S = 1 / (0.2 + x1) + beta x1^2 and a multimodal
    g >= 0, minimal at 0. Averaging adds to f2 what g has around its minimum, times S: in the first
    problem the front moves, in the second only a part of it stays.

    Parameters
    ----------
    beta : float
        Dimensionless, at least 0.
    delta : float
        Half-width of the box in x1; in the others it is twice that. Dimensionless, above 0 and at
        most 0.05.
    n_var : int
        2 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    def __init__(self, beta: float = 1.0, delta: float = 0.01, n_var: int = 5) -> None:
        self.beta = real_number("beta", beta, at_least=0.0)
        delta = real_number("delta", delta, above=0.0, at_most=0.05)
        deltas = np.full(whole_number("n_var", n_var, 2), 2.0 * delta)
        deltas[0] = delta
        super().__init__((0.0, -1.0), deltas)

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return f1 and f2, shape (n,) each, at x1, x2, .., shape (n,) each."""
        x1, *others = inputs.values()
        g = sum(10.0 + x**2 - 10.0 * np.cos(4.0 * np.pi * x) for x in others)
        slope = 1.0 / (0.2 + x1) + self.beta * x1**2
        return {"f1": x1, "f2": 1.0 - x1**2 + g * slope}

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return the mean effective objectives, shape (n, 2), and no constraints."""
        x1, others = designs[:, 0], designs[:, 1:]
        delta, delta2 = self.deltas[0], self.deltas[1]
        faded = np.sinc(4.0 * delta2)
        g = np.sum(10.0 + _square(others, delta2) - 10.0 * faded * np.cos(4.0 * np.pi * others), 1)
        inverse = np.log((0.2 + x1 + delta) / (0.2 + x1 - delta)) / (2.0 * delta)
        square = _square(x1, delta)
        f2 = 1.0 - square + g * (inverse + self.beta * square)
        return np.column_stack([x1, f2]), unconstrained(len(designs))

    def _calc_pareto_set(self) -> Array:
        """Return the designs of the front: all others are 0, as g has its minimum there."""

        def f2(x1: Array) -> Array:
            return self.closed_form(self._on_curve(x1))[0][:, 1]

        places = falling_points(f2, float(self.xl[0]), float(self.xu[0]), FRONT_POINTS)
        return self._on_curve(places)


class DebGupta3(DebGupta):
    """Their third problem: which of two valleys is the best depends on the size of the box.

    f1 = x1, f2 = h(x2) (50 sum x_i^2 + 1 - sqrt(x1)), h having a wide valley at 0.35 and a narrow,
    deeper one at 0.85. With a ``delta`` above 0.0272 the wide one has the better mean.

    Parameters
    ----------
    delta : float
        Half-width of the box in x1 and x2; in the others it is twice that. Dimensionless, above 0
        and at most 0.1.
    n_var : int
        2 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    lowest = 0.0
    """Smallest x2 in the paper."""

    def __init__(self, delta: float = 0.03, n_var: int = 5) -> None:
        delta = real_number("delta", delta, above=0.0, at_most=0.1)
        deltas = np.full(whole_number("n_var", n_var, 2), 2.0 * delta)
        deltas[:2] = delta
        super().__init__((0.0, self.lowest), deltas)

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return f1 and f2, shape (n,) each, at x1, x2, .., shape (n,) each."""
        x1, x2, *others = inputs.values()
        g = 50.0 * sum((x**2 for x in others), np.zeros_like(x1))
        return {"f1": x1, "f2": self._height(x1, x2) * (g + 1.0 - np.sqrt(x1))}

    def _height(self, x1: Array, x2: Array) -> Array:
        return 2.0 - _valleys(x2)

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return the mean effective objectives, shape (n, 2), and no constraints."""
        g = 50.0 * np.sum(_square(designs[:, 2:], self.deltas[-1]), axis=1)
        f2 = self._second(designs[:, 0], designs[:, 1], g)
        return np.column_stack([designs[:, 0], f2]), unconstrained(len(designs))

    def _second(self, x1: Array, x2: Array, g: Array | float) -> Array:
        delta = self.deltas[0]
        roots = (x1 + delta) ** 1.5 - np.maximum(x1 - delta, 0.0) ** 1.5
        return (2.0 - _mean_valleys(x2, delta)) * (g + 1.0 - roots / (3.0 * delta))

    def _calc_pareto_set(self) -> Array:
        """Return the designs of the front: x2 is the deepest point of the averaged valleys."""
        places = falling_points(
            lambda x1: self._second(x1, self._best(x1), self._least_g()),
            float(self.xl[0]),
            float(self.xu[0]),
            FRONT_POINTS,
            grid=_LEVELS,
        )
        return self._on_curve(places, self._best(places))

    def _least_g(self) -> float:
        return float(50.0 * (self.n_var - 2) * _square(np.zeros(1), self.deltas[-1])[0])

    def _best(self, x1: Array) -> Array:
        """Return the best x2 for each x1, shape (n,)."""
        low, high = float(self.xl[1]), float(self.xu[1])
        coarse = np.linspace(low, high, _COARSE)
        valley = np.linspace(-2.0, 2.0, _FINE)[:, None] * _NARROW + self._narrow_valley(x1)
        tried = np.vstack([np.tile(coarse[:, None], len(x1)), np.clip(valley, low, high)])
        g = self._least_g()
        lowest = np.array([self._second(x1, x, g) for x in tried]).argmin(axis=0)
        reach = np.where(lowest < _COARSE, coarse[1] - coarse[0], 4.0 * _NARROW / (_FINE - 1))
        best = tried[lowest, np.arange(len(x1))]
        ends = np.clip([best - reach, best + reach], low, high)
        return least_between(lambda x2: self._second(x1, x2, g), *ends)

    def _narrow_valley(self, x1: Array) -> Array:
        """Return the x2 at the centre of the narrow valley, shape (n,)."""
        return np.full_like(x1, _CENTRE)


class DebGupta4(DebGupta3):
    """Their fourth problem: as the third, with valleys along x1 + x2 and a height that falls in x1.

    h = 2 - x1 less two valleys at x1 + x2 = 0.35 and 0.85. Its mean over x2 is a closed form, that
    over x1 a Gauss rule of 32 nodes, exact to rounding. From place to place another valley is best.

    Parameters
    ----------
    delta : float
        Half-width of the box in x1 and x2; in the others it is twice that. Dimensionless, 0.004 to
        0.1: in a smaller box the mean height falls below 0 near x1 = 1, so that f2 has its least
        value at the bounds of the others.
    n_var : int
        2 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    lowest = -0.15
    smallest = 0.004
    """Smallest ``delta``; the mean height is above 0 from 0.0039 on."""

    def __init__(self, delta: float = 0.03, n_var: int = 5) -> None:
        super().__init__(real_number("delta", delta, at_least=self.smallest, at_most=0.1), n_var)

    def _height(self, x1: Array, x2: Array) -> Array:
        return 2.0 - x1 - _valleys(x1 + x2)

    def _narrow_valley(self, x1: Array) -> Array:
        return _CENTRE - x1

    def _second(self, x1: Array, x2: Array, g: Array | float) -> Array:
        delta = self.deltas[0]
        # With the root as the variable the integrand is smooth down to x1 = 0.
        ends = np.sqrt(np.maximum(x1 + np.array([[-delta], [delta]]), 0.0))
        half = 0.5 * (ends[1] - ends[0])
        root = 0.5 * (ends[0] + ends[1]) + half * _NODES[:, None]
        height = 2.0 - root**2 - _mean_valleys(root**2 + x2, delta)
        inner = height * (g + 1.0 - root) * 2.0 * root
        return half * (_WEIGHTS @ inner) / (2.0 * delta)


def _square(x: Array, delta: float) -> Array:
    """Return the mean of x^2 over x +- delta, same shape."""
    return x**2 + delta**2 / 3.0


def _valleys(x: Array) -> Array:
    return 0.8 * np.exp(-(((x - 0.35) / _WIDE) ** 2)) + np.exp(-(((x - _CENTRE) / _NARROW) ** 2))


def _mean_valleys(x: Array, delta: float) -> Array:
    """Return the mean of the valleys' depth over x +- delta, same shape."""
    total = np.zeros_like(x)
    for depth, centre, width in ((0.8, 0.35, _WIDE), (1.0, _CENTRE, _NARROW)):
        upper, lower = (
            scipy.special.erf((x + side * delta - centre) / width) for side in (1.0, -1.0)
        )
        total += depth * width * np.sqrt(np.pi) / 2.0 * (upper - lower) / (2.0 * delta)
    return total
