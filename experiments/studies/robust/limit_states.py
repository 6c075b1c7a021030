"""Six limit states of the literature of structural reliability, whose probabilities are integrals.

Each fails where its margin is below 0, and has one parameter, its level, which is set so that it
fails with a given probability; that is a closed form or an integral over at most three variables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FINE = np.linspace(-9.0, 9.0, 20_001)
"""Standard normal values over which sharp integrands are summed."""


@dataclass(frozen=True)
class LimitState:
    """A margin of d variables at a level.

    Attributes
    ----------
    name, source : str
    margin : callable
        Maps the level and d arrays of shape (n,) to one.
    laws : callable
        Maps the level to the distributions of `scipy.stats` by name.
    chance : callable
        Maps the level to the probability that the margin is below 0.
    levels : tuple of float
        Between which levels it fails with 1e-2 to 1e-7.
    """

    name: str
    source: str
    margin: Callable[..., Array]
    laws: Callable[[float], dict[str, Any]]
    chance: Callable[[float], float]
    levels: tuple[float, float]

    def failing_with(self, probability: float) -> Failure:
        """Return it at the level at which it fails with this probability."""

        def off(level: float) -> float:
            return float(np.log(self.chance(level) / probability))

        return Failure(self, probability, float(scipy.optimize.brentq(off, *self.levels)))


@dataclass(frozen=True)
class Failure:
    """A limit state at a level."""

    state: LimitState
    probability: float
    level: float

    @cached_property
    def laws(self) -> dict[str, Any]:
        """Distributions by name."""
        return self.state.laws(self.level)

    def simulator(self, **inputs: Array) -> Array:
        """Return the margin at inputs of shape (n,) each."""
        return self.state.margin(self.level, *(inputs[name] for name in self.laws))

    def in_normal_space(self, points: Array) -> Array:
        """Return the margin, shape (n,), at points of shape (n, d) of standard normal variables."""
        columns = zip(self.laws.items(), points.T, strict=True)
        inputs = {name: _from_normal(law, column) for (name, law), column in columns}
        return self.simulator(**inputs)


def _from_normal(law: Any, u: Array) -> Array:
    """Return values of one of the distributions used here at standard normal ones."""
    kind = law.dist.name
    if kind == "norm":
        mean, std = law.args or (0.0, 1.0)
        return mean + std * u
    if kind == "lognorm":
        return law.kwds["scale"] * np.exp(law.args[0] * u)
    if kind == "expon" and not (law.args or law.kwds):
        return -scipy.special.log_ndtr(-u)
    raise ValueError(f"{kind} has no such transformation here")


def _normals(names: str) -> dict[str, Any]:
    return dict.fromkeys(names.split(), scipy.stats.norm())


def _resistance(level: float) -> dict[str, Any]:
    return {
        "resistance": scipy.stats.lognorm(0.15, scale=level),
        "load": scipy.stats.lognorm(0.25, scale=1.0),
    }


def _resistance_fails(level: float) -> float:
    return float(scipy.stats.norm.sf(np.log(level) / np.hypot(0.15, 0.25)))


def _exponentials(level: float) -> dict[str, Any]:
    return {f"x{k}": scipy.stats.expon() for k in range(1, 6)}


def _four_branches(level: float, u: Array, v: Array) -> Array:
    bowl, turn = 3.0 + 0.1 * (u - v) ** 2, (u + v) / 2.0**0.5
    lines = u - v + 7.0 / 2.0**0.5, v - u + 7.0 / 2.0**0.5
    return np.minimum.reduce([bowl - turn, bowl + turn, *lines]) + level


def _four_branches_fail(level: float) -> float:
    # In turned coordinates, of which the first is (u - v) / sqrt(2).
    end = (7.0 / 2.0**0.5 + level) / 2.0**0.5
    inside = np.linspace(-end, end, 4001)
    both = 2.0 * scipy.stats.norm.sf(3.0 + 0.2 * inside**2 + level)
    within = scipy.integrate.simpson(scipy.stats.norm.pdf(inside) * both, x=inside)
    return float(2.0 * scipy.stats.norm.sf(end) + within)


def _parabola(level: float, u: Array, v: Array) -> Array:
    return level - v - 0.5 * (u - 0.1) ** 2


def _parabola_fails(level: float) -> float:
    fails = scipy.stats.norm.sf(_parabola(level, _FINE, np.zeros(1)))
    return float(scipy.integrate.simpson(scipy.stats.norm.pdf(_FINE) * fails, x=_FINE))


def _oscillator(
    level: float, m: Array, c1: Array, c2: Array, r: Array, force: Array, time: Array
) -> Array:
    own = np.sqrt((c1 + c2) / m)
    return 3.0 * r - np.abs(2.0 * force / (m * own**2) * np.sin(0.5 * own * time))


def _oscillator_laws(level: float) -> dict[str, Any]:
    means = {"m": 1.0, "c1": 1.0, "c2": 0.1, "r": 0.5, "force": level, "time": 1.0}
    stds = 0.05, 0.1, 0.01, 0.05, level / 6.0, 0.2
    return {
        name: scipy.stats.norm(mean, std)
        for (name, mean), std in zip(means.items(), stds, strict=True)
    }


def _oscillator_fails(level: float) -> float:
    # Given mass, springs and time, the margin is linear in r and the force on either side.
    nodes, weights = hermegauss(24)
    m, c, time = np.meshgrid(
        1.0 + 0.05 * nodes, 1.1 + np.hypot(0.1, 0.01) * nodes, 1.0 + 0.2 * nodes, indexing="ij"
    )
    share = np.einsum("i,j,k->ijk", *[weights / weights.sum()] * 3)
    by_force = np.abs(2.0 / c * np.sin(0.5 * np.sqrt(c / m) * time))
    spread = np.hypot(3.0 * 0.05, by_force * level / 6.0)
    sides = sum(
        scipy.stats.norm.sf((1.5 + side * by_force * level) / spread) for side in (1.0, -1.0)
    )
    return float(np.sum(share * sides))


def _column(level: float, moment: Array, load: Array, strength: Array) -> Array:
    width, depth = 5.0, 15.0
    bending = 4.0 * moment / (width * depth**2 * strength)
    return 1.0 - bending - (load / (width * depth * strength)) ** 2


def _column_laws(level: float) -> dict[str, Any]:
    return {
        "moment": scipy.stats.norm(2000.0, 400.0),
        "load": scipy.stats.norm(500.0, 100.0),
        "strength": scipy.stats.lognorm(0.1, scale=level),
    }


def _column_fails(level: float) -> float:
    nodes, weights = hermegauss(60)
    load, strength = np.meshgrid(500.0 + 100.0 * nodes, level * np.exp(0.1 * nodes), indexing="ij")
    share = np.outer(weights, weights) / weights.sum() ** 2
    left = 1.0 - (load / (75.0 * strength)) ** 2
    most = left * 5.0 * 15.0**2 * strength / 4.0
    return float(np.sum(share * scipy.stats.norm.sf((most - 2000.0) / 400.0)))


LIMIT_STATES = (
    LimitState(
        "resistance and load",
        "the first example of textbooks, log-normal",
        lambda level, resistance, load: resistance - load,
        _resistance,
        _resistance_fails,
        (1.5, 8.0),
    ),
    LimitState(
        "sum of exponentials",
        "Madsen, Krenk and Lind, Methods of Structural Safety, 1986",
        lambda level, *x: level - sum(x),
        _exponentials,
        lambda level: float(scipy.stats.gamma.sf(level, 5)),
        (9.0, 35.0),
    ),
    LimitState(
        "four branches",
        "Waarts, Structural Reliability Using Finite Element Methods, 2000",
        _four_branches,
        lambda level: _normals("u v"),
        _four_branches_fail,
        (-1.0, 3.5),
    ),
    LimitState(
        "two design points",
        "Der Kiureghian and Dakessian, Structural Safety 20, 1998",
        _parabola,
        lambda level: _normals("u v"),
        _parabola_fails,
        (2.0, 16.0),
    ),
    LimitState(
        "oscillator",
        "Bucher and Bourgund, Structural Safety 7, 1990; force as Echard et al., Reliability Eng. "
        "System Safety 111, 2013",
        _oscillator,
        _oscillator_laws,
        _oscillator_fails,
        (0.2, 1.2),
    ),
    LimitState(
        "short column",
        "Kuschel and Rackwitz, Mathematical Methods of Operations Research 46, 1997; independent",
        _column,
        _column_laws,
        _column_fails,
        (8.0, 40.0),
    ),
)
STATE_BY_NAME = {state.name: state for state in LIMIT_STATES}
