"""What is known of a rung's parameters: curvature, profiles, and a posterior by emcee.

The prior is uniform on the searched scale within the ranges of the ladder and of the closures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.paper.inference.likelihood import (
    BAND,
    UNLIKELY,
    box_axes,
    least_deviance,
    residuals_of,
)
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.rungs import COLUMNS, PERIODIC, Rung
from experiments.paper.inference.search import STEP, Residuals, digest, refine
from experiments.runner.registry import require
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia

DESIGNS_PER_AXIS = 17
"""Of K, J_in and B_fc: steps of 3 % of the nominal value."""
OUTCOMES = ("mean", "std", "K", "J_in", "B_fc")
OPTIMA = tuple(f"{outcome}_{name}" for name in PREFERENCES for outcome in OUTCOMES)


def optima(rung: Rung, parameters: dict[str, float], n: int = DESIGNS_PER_AXIS) -> dict[str, float]:
    """Return mean and std, arcsec, and design, as shares of the nominal one, of each preference.

    Named as `OPTIMA`; chosen from the non-dominated of n^3 designs of the paper's box, B_in being
    without influence.
    """
    surrogate = TensorSurrogate.fit(rung, parameters)
    axes = box_axes(surrogate, n)
    objectives = np.column_stack([part.ravel() for part in surrogate.on_designs(axes, BAND)])
    order = np.lexsort((objectives[:, 1], objectives[:, 0]))
    lowest = np.minimum.accumulate(objectives[order, 1])
    front = order[np.concatenate([[True], objectives[order[1:], 1] < lowest[:-1]])]
    nominal = surrogate.model.nominal[COLUMNS[1:]]
    shares = [values / value for values, value in zip(axes, nominal, strict=True)]
    grid = np.stack(np.meshgrid(*shares, indexing="ij"), axis=-1).reshape(-1, 3)
    found = []
    for weights in PREFERENCES.values():
        chosen = front[WeightedUtopia(weights).do(objectives[front])]
        found += [*objectives[chosen], *grid[chosen]]
    return dict(zip(OPTIMA, map(float, found), strict=True))


WALKERS_PER_PARAMETER = 3
BURN_IN = 0.5
"""Share of the steps that is dropped."""
DRAWS = 150
"""Places of a posterior that are kept, evenly over the rest."""
OFFSETS = (0.5, 1.0, 2.0, 3.0)
"""Of a profile on either side of the best value, in standard deviations of the curvature."""
PROFILE_STEPS = 6
UNIFORM_CURVATURE = 12.0
"""One over the variance of a uniform prior on a range of 1."""

LogProbability = Callable[[NDArray[np.float64]], float]


def scaled_jacobian(
    residuals: Residuals, place: NDArray[np.float64], width: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return central differences of residuals (m,) per range of each parameter, shape (m, k)."""
    steps = np.diag(STEP * width)
    return np.column_stack(
        [(residuals(place + step) - residuals(place - step)) / (2.0 * STEP) for step in steps]
    )


def curvature_std(jacobian: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return standard deviations of the parameters as shares of their ranges, shape (k,).

    Of the normal distribution with the curvature of the deviance and of the uniform prior.
    """
    return np.sqrt(np.diag(_covariance(jacobian)))


def _covariance(jacobian: NDArray[np.float64]) -> NDArray[np.float64]:
    curvature = jacobian.T @ jacobian + UNIFORM_CURVATURE * np.eye(jacobian.shape[1])
    return np.asarray(np.linalg.inv(curvature), dtype=np.float64)


def sample(
    log_probability: LogProbability,
    places: NDArray[np.float64],
    steps: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the chain of emcee's walkers, shape (steps, walkers, k), from places (walkers, k).

    Differential moves serve narrow curved valleys better than the stretch move.

    Raises
    ------
    ExtraMissing
        emcee is not installed.
    """
    require("emcee", "posterior")
    from emcee import EnsembleSampler
    from emcee.moves import DEMove, DESnookerMove

    moves = [(DEMove(), 0.8), (DESnookerMove(), 0.2)]
    sampler = EnsembleSampler(*places.shape, log_probability, moves=moves)
    # emcee knows the older kind of random state alone.
    sampler.random_state = np.random.RandomState(rng.integers(2**32)).get_state()
    sampler.run_mcmc(places, steps)
    return np.asarray(sampler.get_chain())


def log_posterior(rung: Rung, target: str) -> LogProbability:
    """Return the function from the searched scale to the logarithm of the posterior density.

    Angles have no ends: their density repeats every turn.
    """
    low, high = rung.limits
    ends = ~np.isin(list(rung.bounds), PERIODIC)

    def value(place: NDArray[np.float64]) -> float:
        if np.any((place < low)[ends]) or np.any((place > high)[ends]):
            return -np.inf
        residuals = residuals_of(rung, target, place)
        return -np.inf if residuals[0] == UNLIKELY else -least_deviance(residuals) / 2.0

    return value


def near(
    rung: Rung, target: str, place: NDArray[np.float64], n: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return n places around the best one, spread as the curvature has it, within the ranges."""
    low, high = rung.limits
    width = high - low
    jacobian = scaled_jacobian(lambda at: residuals_of(rung, target, at), place, width)
    spread = rng.multivariate_normal(np.zeros(len(place)), _covariance(jacobian), n)
    inside = np.clip(place + spread * width, low + 1e-6 * width, high - 1e-6 * width)
    turning = np.isin(list(rung.bounds), PERIODIC)
    return np.where(turning, place + spread * width, inside)


@dataclass(frozen=True)
class Posterior:
    """Draws of the posterior of a rung, from walkers around its best place."""

    rung: Rung
    target: str
    place: tuple[float, ...]
    seed: int
    steps: int

    @property
    def key(self) -> str:
        """All settings in one name."""
        start = f"from{digest(self.place)}_{self.steps}_seed{self.seed}"
        return f"posterior_{self.target}_{self.rung.name}_{start}"

    def execute(self) -> Run:
        """Return `DRAWS` rows: deviance, the place, and what would be chosen there (`OPTIMA`)."""
        begin = time.perf_counter()
        rng = np.random.default_rng([self.seed, 7])
        log_probability = log_posterior(self.rung, self.target)
        walkers = WALKERS_PER_PARAMETER * len(self.place)
        starts = near(self.rung, self.target, np.array(self.place), walkers, rng)
        chain = sample(log_probability, starts, self.steps, rng)
        later = chain[int(BURN_IN * self.steps) :].reshape(-1, len(self.place))
        chosen = later[np.linspace(0, len(later) - 1, DRAWS).astype(int)]
        rows = [
            [-2.0 * log_probability(place), *place,
             *optima(self.rung, self.rung.physical(place)).values()]
            for place in chosen
        ]  # fmt: skip
        columns = ("deviance", *self.rung.bounds, *OPTIMA)
        return Run(columns, np.array(rows), time.perf_counter() - begin)


@dataclass(frozen=True)
class Profile:
    """The least deviance over values of each parameter, all others being fitted."""

    rung: Rung
    target: str
    place: tuple[float, ...]

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"profile_{self.target}_{self.rung.name}_{digest(self.place)}"

    def execute(self) -> Run:
        """Return rows: number of the parameter, its value on the searched scale, deviance."""
        begin = time.perf_counter()

        def residuals(place: NDArray[np.float64]) -> NDArray[np.float64]:
            return residuals_of(self.rung, self.target, place)

        rows = profiles(residuals, self.rung, np.array(self.place))
        rows[:, 2] += least_deviance(np.zeros(1))
        columns = ("parameter", "value", "deviance")
        return Run(columns, rows, time.perf_counter() - begin)


def profiles(residuals: Residuals, rung: Rung, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows of parameter, value and least sum of squares; each from its neighbour's place."""
    low, high = rung.limits
    spread = curvature_std(scaled_jacobian(residuals, place, high - low)) * (high - low)
    rows = []
    for axis, name in enumerate(rung.bounds):
        rows.append([axis, place[axis], float(np.sum(residuals(place) ** 2))])
        for sign in (-1.0, 1.0):
            near_by = place.copy()
            for offset in OFFSETS:
                value = place[axis] + sign * offset * spread[axis]
                if name not in PERIODIC and not low[axis] < value < high[axis]:
                    break
                near_by[axis] = value
                least, near_by = refine(residuals, rung, near_by, PROFILE_STEPS, fixed=axis)
                rows.append([axis, value, least])
    return np.array(rows)
