"""Robust problems with noise beside the designs: standard deviation, quantile, CVaR, failure.

The responses are linear in the noise, so that any statistic of them is known.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number, whole_number
from pymoo_hdte.problems._closed_form.pieces import falling_points
from pymoo_hdte.problems._closed_form.problem import (
    FRONT_POINTS,
    ClosedFormProblem,
    unconstrained,
)
from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.sampled_statistics import CVaR, FailureProbability, Quantile
from pymoo_hdte.problems._simulator.statistics import Mean, Std

Array = NDArray[np.float64]


class Disconnected(ClosedFormProblem):
    """Mean and standard deviation of a response whose scatter is wavy: a front of several pieces.

    y = x1 + q + a (1 + q) s(x1) with q = sum (x_j - 0.3)^2 over j > 1,
    s = 1 - 0.7 x1 - 0.12 sin(6 pi x1), all x in 0..1, and a standard normal variable a.

    Parameters
    ----------
    n_var : int
        2 or more.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    """

    def __init__(self, n_var: int = 10) -> None:
        designs = {f"x{j + 1}": Design(0.0, 1.0) for j in range(whole_number("n_var", n_var, 2))}
        super().__init__(designs, [Mean(), Std()])

    def noise(self) -> dict[Any, Any]:
        """Return the distribution of a."""
        return {"a": scipy.stats.norm(0.0, 1.0)}

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return y, shape (n,), at x1, x2, .. and a, shape (n,) each."""
        *x, a = inputs.values()
        (mean, std), _ = (part.T for part in self.closed_form(np.column_stack(x)))
        return {"y": mean + a * std}

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation, shape (n, 2), and no constraints."""
        q = np.sum((designs[:, 1:] - 0.3) ** 2, axis=1)
        objectives = np.column_stack([designs[:, 0] + q, (1.0 + q) * _wave(designs[:, 0])])
        return objectives, unconstrained(len(designs))

    def _calc_pareto_set(self) -> Array:
        """Return the designs of the front: both objectives grow with q, which is 0 there."""
        places = falling_points(_wave, 0.0, 1.0, FRONT_POINTS)
        return np.column_stack([places, np.full((len(places), self.n_var - 1), 0.3)])


def _wave(x: Array) -> Array:
    return 1.0 - 0.7 * x - 0.12 * np.sin(6.0 * np.pi * x)


class ExponentialNoise(ClosedFormProblem):
    """Mean and 99 % quantile of a response with exponential noise; a limit on its CVaR of 90 %.

    ``y = |x - a|^2 + (0.2 + |x - b|^2) e`` with e exponential of mean 1, a = (0.2, .., 0.2) and
    b = (0.8, .., 0.8), all x in 0..1: what lowers the mean is not what lowers the tail. Level
    lines of all three statistics are spheres with centres on the line from a to b.

    Parameters
    ----------
    n_var : int
        1 or more.
    limit : float
        Limit of the CVaR; None cuts off a quarter of the front, at the side of the mean.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, or a limit that no design meets.
    """

    def __init__(self, n_var: int = 4, limit: float | None = None) -> None:
        count = whole_number("n_var", n_var, 1)
        self._a, self._b = np.full(count, 0.2), np.full(count, 0.8)
        if limit is None:
            quarter = 0.25 * _centre(_QUANTILE) + 0.75 * _centre(1.0)
            limit = float(self._statistic(_CVAR, self._on_line(np.array([quarter])))[0])
        least = float(self._statistic(_CVAR, self._on_line(np.array([_centre(_CVAR)])))[0])
        self.limit = real_number("limit", limit, above=least)
        designs = {f"x{j + 1}": Design(0.0, 1.0) for j in range(count)}
        super().__init__(designs, [Mean(), Quantile(0.99)], [CVaR(0.9) <= self.limit])

    def noise(self) -> dict[Any, Any]:
        """Return the distribution of e."""
        return {"e": scipy.stats.expon()}

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return y, shape (n,), at x1, x2, .. and e, shape (n,) each."""
        *x, e = inputs.values()
        return {"y": self._statistic(e, np.column_stack(x))}

    def _statistic(self, factor: Array | float, x: Array) -> Array:
        """Return y for a value of the noise, or its statistic for that of the noise."""
        from_a, from_b = (np.sum((x - place) ** 2, axis=1) for place in (self._a, self._b))
        return from_a + (0.2 + from_b) * factor

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return mean and quantile, shape (n, 2), and CVaR less its limit, shape (n, 1)."""
        objectives = [self._statistic(factor, designs) for factor in (1.0, _QUANTILE)]
        excess = self._statistic(_CVAR, designs) - self.limit
        return np.column_stack(objectives), excess[:, None]

    def _on_line(self, share: Array) -> Array:
        return self._a + share[:, None] * (self._b - self._a)

    def _calc_pareto_set(self) -> Array:
        """Return the line between the centres of both objectives, as far as the limit is met."""
        # On the line the CVaR is its least value plus a square.
        centre = _centre(_CVAR)
        least = self._statistic(_CVAR, self._on_line(np.array([centre])))[0]
        length = np.sum((self._b - self._a) ** 2)
        reach = np.sqrt((self.limit - least) / (length * (1.0 + _CVAR)))
        low, high = max(_centre(1.0), centre - reach), min(_centre(_QUANTILE), centre + reach)
        return self._on_line(np.linspace(low, high, FRONT_POINTS))


_QUANTILE, _CVAR = float(np.log(100.0)), float(1.0 + np.log(10.0))
"""The 99 % quantile and the CVaR of 90 % of an exponential variable of mean 1."""


def _centre(factor: float) -> float:
    """Return where |x - a|^2 + factor |x - b|^2 is least, as a share of the way from a to b."""
    return factor / (1.0 + factor)


class BeamReliability(ClosedFormProblem):
    """Mass of a steel cantilever of 1 m and the probability that it yields, in SI units.

    Designed are width b and height h of the rectangular section, h at most 4 b. Force and yield
    strength are normal: F is 5000 N with a deviation of 500 N, R 250 MPa with 15 MPa. It yields
    where R b h^2 / 6 < F; this may happen to one in five.
    """

    _density, _limit = 7850.0, 0.2
    _force, _strength = (5000.0, 500.0), (250e6, 15e6)

    def __init__(self) -> None:
        designs = {"b": Design(0.015, 0.026), "h": Design(0.06, 0.085)}
        yields = FailureProbability(below=0.0, response="margin")
        limits = [yields <= self._limit, Mean(response="slenderness") <= 0.0]
        super().__init__(designs, [Mean(response="mass"), yields], limits)

    def noise(self) -> dict[Any, Any]:
        """Return the distributions of force in N and strength in Pa."""
        return {"F": scipy.stats.norm(*self._force), "R": scipy.stats.norm(*self._strength)}

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return mass in kg, margin in N.m and slenderness, shape (n,) each."""
        b, h = inputs["b"], inputs["h"]
        return {
            "mass": self._density * b * h,
            "margin": inputs["R"] * b * h**2 / 6.0 - inputs["F"],
            "slenderness": h / b - 4.0,
        }

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return mass and probability, shape (n, 2), and both constraints, shape (n, 2)."""
        b, h = designs.T
        section = b * h**2 / 6.0
        mean = self._strength[0] * section - self._force[0]
        probability = scipy.special.ndtr(
            -mean / np.hypot(self._strength[1] * section, self._force[1])
        )
        objectives = np.column_stack([self._density * b * h, probability])
        return objectives, np.column_stack([probability - self._limit, h / b - 4.0])

    def _calc_pareto_set(self) -> Array:
        """Return h = 4 b from the largest probability on, then the largest h.

        Of all sections of one mass the highest is the strongest.
        """

        def excess(h: float) -> float:
            return float(self.closed_form(np.array([[h / 4.0, h]]))[1][0, 0])

        top = float(self.xu[1])
        shortest = float(
            scipy.optimize.brentq(excess, float(self.xl[1]), top, xtol=1e-16, rtol=1e-15)
        )
        heights = np.linspace(shortest, top, FRONT_POINTS // 2)
        widths = np.linspace(top / 4.0, float(self.xu[0]), FRONT_POINTS // 2)
        slender = np.column_stack([heights / 4.0, heights])
        return np.vstack([slender, np.column_stack([widths, np.full(len(widths), top)])[1:]])


class Portfolio(ClosedFormProblem):
    """Mean loss and CVaR of 95 % of a portfolio of four assets whose returns are dependent normal.

    Designed are the shares w1, w2 and w3; the fourth gets the rest, which must not be negative.
    Means of the yearly returns are 3, 6, 9 and 12 %, deviations 4, 10, 15 and 25 %, all
    correlations 0.3. After Rockafellar and Uryasev, Journal of Risk 2, 2000.
    """

    _returns = np.array([0.03, 0.06, 0.09, 0.12])
    _deviations = np.array([0.04, 0.10, 0.15, 0.25])
    _correlation, _level = 0.3, 0.95

    def __init__(self) -> None:
        designs = {f"w{j}": Design(0.0, 1.0) for j in (1, 2, 3)}
        objectives = [Mean(response="loss"), CVaR(self._level, response="loss")]
        super().__init__(designs, objectives, [Mean(response="invested") <= 1.0])
        correlation = np.full((4, 4), self._correlation) + (1.0 - self._correlation) * np.eye(4)
        self.covariance = correlation * np.outer(self._deviations, self._deviations)
        z = scipy.special.ndtri(self._level)
        self._tail = float(np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) / (1.0 - self._level))

    def noise(self) -> dict[Any, Any]:
        """Return the joint distribution of the four returns."""
        import chaospy  # Takes longer to load than a study on the closed form.

        return {("r1", "r2", "r3", "r4"): chaospy.MvNormal(self._returns, self.covariance)}

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return loss and invested share, shape (n,) each, at shares and returns."""
        parts = np.column_stack(list(inputs.values()))
        shares = self._shares(parts[:, :3])
        invested = parts[:, :3].sum(axis=1)
        return {"loss": -np.sum(shares * parts[:, 3:], axis=1), "invested": invested}

    def _shares(self, designs: Array) -> Array:
        return np.column_stack([designs, 1.0 - designs.sum(axis=1)])

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return mean loss and CVaR, shape (n, 2), and the excess of investment, shape (n, 1)."""
        shares = self._shares(designs)
        loss = -shares @ self._returns
        std = np.sqrt(np.einsum("ni,ij,nj->n", shares, self.covariance, shares))
        excess = designs.sum(axis=1) - 1.0
        return np.column_stack([loss, loss + self._tail * std]), excess[:, None]

    def _calc_pareto_set(self) -> Array:
        """Return the portfolios of least variance w' C w / 2 - t r' w, for all prices t of return.

        From the one with the least CVaR, where the deviation is t times `_tail`, to the asset with
        the largest return.
        """

        def slope(t: float) -> float:
            shares = self._efficient(t)
            return float(np.sqrt(shares @ self.covariance @ shares) - self._tail * t)

        start_price = float(scipy.optimize.brentq(slope, 0.0, 1.0, xtol=1e-16, rtol=1e-15))
        richest = np.eye(4)[np.argmax(self._returns)]
        gaps = self.covariance @ richest
        others = np.flatnonzero(richest == 0.0)
        # Optimality of the one asset: r_4 t - C_44 >= r_j t - C_4j for all j.
        end_price = float(
            np.max((gaps[3] - gaps[others]) / (self._returns[3] - self._returns[others]))
        )
        places = np.linspace(end_price, start_price, FRONT_POINTS)
        return np.array([self._efficient(float(t)) for t in places])[:, :3]

    def _efficient(self, t: float) -> Array:
        """Return the shares for one price, shape (4,), by the one set of assets that is optimal."""
        for chosen in range(15, 0, -1):
            held = np.array([bool(chosen >> j & 1) for j in range(4)])
            count = int(held.sum())
            system = np.zeros((count + 1, count + 1))
            system[:count, :count] = self.covariance[np.ix_(held, held)]
            system[count, :count] = system[:count, count] = 1.0
            solved = np.linalg.solve(system, np.append(t * self._returns[held], 1.0))
            shares = np.zeros(4)
            shares[held] = solved[:count]
            pressure = self.covariance @ shares - t * self._returns + solved[count]
            if shares.min() >= -_ROUNDING and pressure[~held].min(initial=0.0) >= -_ROUNDING:
                return np.maximum(shares, 0.0) / np.maximum(shares, 0.0).sum()
        raise AssertionError("a convex problem has a solution")


_ROUNDING = 1e-12
"""Shares and pressures of about 1 that are 0 but for rounding."""
