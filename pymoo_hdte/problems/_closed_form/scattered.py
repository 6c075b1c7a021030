"""Known problems whose variables scatter: means, worst cases, robust constraints in closed form.

A uniform deviation in -d..d adds d^2 / 3 to the mean of a square, and multiplies that of cos(w x)
by sin(w d) / (w d).
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number, whole_number
from pymoo_hdte.problems._closed_form.problem import (
    FRONT_POINTS,
    ClosedFormProblem,
    unconstrained,
)
from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.statistics import Mean, MeanPlusStd, WorstCase

Array = NDArray[np.float64]


class WorstCaseSchaffer(ClosedFormProblem):
    """The worst case of two distances under scatter, after Schaffer's first problem.

    The responses are f1 = sum x_j^2 and f2 = sum (x_j - a_j)^2 with a = (1, 0.7, 0.4, ..), at least
    0.1. Their largest values within d of the design are ``sum (|x_j| + d)^2`` and the like: they
    have kinks where the front ends, and each variable stops there at another place.

    Parameters
    ----------
    deviation : float
        Half-width d of the box around a design, dimensionless, above 0 and at most 0.5.
    n_var : int
        1 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    def __init__(self, deviation: float = 0.1, n_var: int = 3) -> None:
        self.deviation = real_number("deviation", deviation, above=0.0, at_most=0.5)
        count = whole_number("n_var", n_var, 1)
        self.target = np.maximum(1.0 - 0.3 * np.arange(count), 0.1)
        designs = {f"x{j + 1}": Design(-1.0, 2.0, deviation=deviation) for j in range(count)}
        super().__init__(designs, [WorstCase(response="f1"), WorstCase(response="f2")])

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return f1 and f2, shape (n,) each, at x1, x2, .., shape (n,) each."""
        x = np.column_stack(list(inputs.values()))
        return {"f1": np.sum(x**2, axis=1), "f2": np.sum((x - self.target) ** 2, axis=1)}

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return the largest f1 and f2 in the box, shape (n, 2), and no constraints."""
        reach = [np.abs(designs - place) + self.deviation for place in (0.0, self.target)]
        worst = np.column_stack([np.sum(distance**2, axis=1) for distance in reach])
        return worst, unconstrained(len(designs))

    def _calc_pareto_set(self) -> Array:
        """Return the minimisers of w f1 + (1 - w) f2, which are strictly convex, for all w."""
        a, d = self.target, self.deviation
        lowest, highest = np.min(d / (a + 2.0 * d)), np.max((a + d) / (a + 2.0 * d))
        w = np.linspace(highest, lowest, FRONT_POINTS)[:, None]
        return np.clip((1.0 - w) * a + (1.0 - 2.0 * w) * d, 0.0, a)


class MeanDTLZ2(ClosedFormProblem):
    """Mean effective objectives of DTLZ2: three of them, on an eighth of an ellipsoid.

    Means over a box of half-width d as in Deb and Gupta (2006) of the functions of Deb, Thiele,
    Laumanns and Zitzler (2002). Designs keep d off the bounds.

    Parameters
    ----------
    delta : float
        Half-width d, dimensionless, above 0 and at most 0.2.
    n_var : int
        3 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    def __init__(self, delta: float = 0.05, n_var: int = 7) -> None:
        self.delta = real_number("delta", delta, above=0.0, at_most=0.2)
        count = whole_number("n_var", n_var, 3)
        designs = {f"x{j + 1}": Design(delta, 1.0 - delta, deviation=delta) for j in range(count)}
        super().__init__(designs, [Mean(response=f"f{k}") for k in (1, 2, 3)])

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return f1, f2 and f3, shape (n,) each, at x1, x2, .., shape (n,) each."""
        x = np.column_stack(list(inputs.values()))
        return self._objectives(x, 0.0, 1.0)

    def _objectives(self, x: Array, added: float, faded: float) -> dict[str, Array]:
        size = 1.0 + np.sum((x[:, 2:] - 0.5) ** 2 + added, axis=1)
        cos, sin = (faded * wave(np.pi / 2.0 * x[:, :2].T) for wave in (np.cos, np.sin))
        return {"f1": size * cos[0] * cos[1], "f2": size * cos[0] * sin[1], "f3": size * sin[0]}

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return the mean effective objectives, shape (n, 3), and no constraints."""
        means = self._objectives(designs, self.delta**2 / 3.0, float(np.sinc(self.delta / 2.0)))
        return np.column_stack(list(means.values())), unconstrained(len(designs))

    def _calc_pareto_set(self) -> Array:
        """Return designs with 0.5 from x3 on, over a grid of x1 and x2."""
        side = np.linspace(self.delta, 1.0 - self.delta, int(np.sqrt(FRONT_POINTS)) + 1)
        x1, x2 = np.meshgrid(side, side, indexing="ij")
        designs = np.full((x1.size, self.n_var), 0.5)
        designs[:, 0], designs[:, 1] = x1.ravel(), x2.ravel()
        return designs


class RobustSrinivas(ClosedFormProblem):
    """Means of the problem of Srinivas and Deb (1994), its constraints met by 3 deviations.

    f1 = 2 + (x1 - 2)^2 + (x2 - 1)^2, f2 = 9 x1 - (x2 - 1)^2, x1^2 + x2^2 <= 225 and
    x1 - 3 x2 + 10 <= 0 with x in -20..20. The front runs along one constraint, through the inside,
    and along the other. ``Robust(get_problem("srn"), deviation)`` is the same problem.

    Parameters
    ----------
    deviation : float
        Half-width of the uniform scatter of x1 and x2, dimensionless, above 0 and at most 1.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    def __init__(self, deviation: float = 0.5) -> None:
        self.deviation = real_number("deviation", deviation, above=0.0, at_most=1.0)
        designs = {name: Design(-20.0, 20.0, deviation=deviation) for name in ("x1", "x2")}
        limits = [MeanPlusStd(3.0, response=name) <= 0.0 for name in ("g1", "g2")]
        super().__init__(designs, [Mean(response="f1"), Mean(response="f2")], limits)

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return f1, f2, g1 and g2, shape (n,) each, at x1 and x2, shape (n,) each."""
        x1, x2 = inputs["x1"], inputs["x2"]
        return {
            "f1": 2.0 + (x1 - 2.0) ** 2 + (x2 - 1.0) ** 2,
            "f2": 9.0 * x1 - (x2 - 1.0) ** 2,
            "g1": x1**2 + x2**2 - 225.0,
            "g2": x1 - 3.0 * x2 + 10.0,
        }

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return means of f1 and f2, shape (n, 2), and mean + 3 std of g1 and g2, shape (n, 2)."""
        part = self.deviation**2 / 3.0
        at = self.simulator(x1=designs[:, 0], x2=designs[:, 1])
        # The fourth moment of the deviation is d^4 / 5, so the square's variance 4 d^4 / 45.
        variance = np.sum(4.0 * designs**2 * part + 0.8 * part**2, axis=1)
        circle = at["g1"] + 2.0 * part + 3.0 * np.sqrt(variance)
        line = at["g2"] + 3.0 * np.sqrt(10.0 * part)
        objectives = np.column_stack([at["f1"] + 2.0 * part, at["f2"] - part])
        return objectives, np.column_stack([circle, line])

    def _calc_pareto_set(self) -> Array:
        """Return the front's designs along g2 = 0, x1 = -2.5 and g1 = 0.

        Inside, the gradients of f1 and f2 are parallel at x1 = -2.5 only.
        """
        shift = 10.0 + 3.0 * np.sqrt(10.0 / 3.0) * self.deviation
        # The foot of the perpendicular from (2, 1), where f1 is least, on x1 = 3 x2 - shift.
        start = 1.0 + 0.3 * (shift - 1.0)
        along_line = np.linspace(start, (shift - 2.5) / 3.0, FRONT_POINTS // 3)
        end = self._least_on_circle()
        along_circle = np.linspace(-2.5, end, FRONT_POINTS // 3)
        heights = np.array([self._circle(x1) for x1 in along_circle])
        inside = np.linspace(along_line[-1], heights[0], FRONT_POINTS // 3 + 1)
        parts = [
            np.column_stack([3.0 * along_line - shift, along_line]),
            np.column_stack([np.full(len(inside), -2.5), inside])[1:-1],
            np.column_stack([along_circle, heights]),
        ]
        return np.vstack(parts)

    def _circle(self, x1: float) -> float:
        """Return the largest x2 that g1 allows at x1."""

        def excess(x2: float) -> float:
            return float(self.closed_form(np.array([[x1, x2]]))[1][0, 0])

        return float(scipy.optimize.brentq(excess, 1.0, 20.0, xtol=1e-14, rtol=1e-15))

    def _least_on_circle(self) -> float:
        """Return the x1 where f2 is least on g1 = 0: there its slope along the circle is 0."""

        def slope(x1: float) -> float:
            x2 = self._circle(x1)
            # Mean and deviation of g1 depend on x1^2 + x2^2 alone, so that it is a circle.
            return 9.0 + 2.0 * (x2 - 1.0) * x1 / x2

        return float(scipy.optimize.brentq(slope, -8.0, -2.5, xtol=1e-14, rtol=1e-15))
