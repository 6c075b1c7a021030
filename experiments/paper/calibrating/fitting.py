"""Fits a candidate of the ladder to published numbers, and refits it to perturbed ones."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, least_squares
from scipy.stats import sobol_indices, uniform

from experiments.paper.calibrating.ladder import Candidate
from experiments.paper.calibrating.predictions import FITS, PUBLISHED, UNCERTAINTY, predict
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.drive import DriveModel, UnstableDrive
from pymoo_hdte.problems import RobustDTE

_FRONT_SAMPLE = 20_000
_SHARE_SAMPLE = 1024
_VARIABLES = ("K", "J_in", "B_in", "B_fc")

WIDTHS = ("front_mean_width", "front_std_width")
SHARES = tuple(f"{objective}_share_{name}" for objective in ("mean", "std") for name in _VARIABLES)
TRAITS = (*WIDTHS, *SHARES)


def front_traits(model: DriveModel) -> dict[str, float]:
    """Return the width of the Pareto front in arcsec, and total Sobol shares over the design box.

    The width is that of the non-dominated ones among random designs; the shares are those of each
    design variable in the variance of either objective, designs being uniform in the box.
    """
    problem = RobustDTE(model)
    width = problem.xu - problem.xl
    designs = problem.xl + np.random.default_rng(1).random((_FRONT_SAMPLE, problem.n_var)) * width
    objectives = problem.evaluate(designs)
    rising = objectives[np.argsort(objectives[:, 0], kind="stable")]
    front = rising[rising[:, 1] <= np.minimum.accumulate(rising[:, 1])]
    indices = sobol_indices(
        func=lambda cube: problem.evaluate(problem.xl + cube.T * width).T,
        n=_SHARE_SAMPLE,
        dists=[uniform()] * problem.n_var,
        rng=np.random.default_rng(1),
    )
    values = [*np.ptp(front, axis=0), *indices.total_order.ravel()]
    return dict(zip(TRAITS, map(float, values), strict=True))


UNSTABLE_RESIDUAL = 1e3
"""Residual given to every number of a model that has no steady state."""

Residuals = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Budget:
    """Effort of one fit: population and generations of the global search, local starts, steps."""

    population: int
    generations: int
    starts: int
    local_evaluations: int

    @property
    def name(self) -> str:
        """All four numbers in one word."""
        return f"{self.population}x{self.generations}_{self.starts}x{self.local_evaluations}"


BUDGETS = {
    "table8": Budget(population=20, generations=30, starts=4, local_evaluations=20),
    "table5": Budget(population=16, generations=12, starts=2, local_evaluations=10),
}
"""By direction; the four numbers of the second are met by most rungs at once."""


@dataclass(frozen=True)
class Fit:
    """A candidate fitted in one direction (see `predictions.FITS`) from one seed."""

    candidate: Candidate
    direction: str
    seed: int
    budget: Budget

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"fit_{self.direction}_{self.candidate.name}_{self.budget.name}_seed{self.seed}"

    def execute(self) -> Run:
        """Search globally, then locally from the best of what that found and of known basins.

        One row a local optimum, the best first; columns as `outcome_row` has them.
        """
        begin = time.perf_counter()
        residuals = _residuals(self.candidate, self.direction, PUBLISHED)
        found = _global_search(residuals, self.candidate, self.budget, self.seed)
        starts = np.vstack([found[: self.budget.starts], self.candidate.known()])
        order = np.argsort([np.sum(residuals(start) ** 2) for start in starts], kind="stable")
        chosen = starts[order[: self.budget.starts]]
        optima = [_refine(residuals, self.candidate, start, self.budget) for start in chosen]
        optima.sort(key=lambda optimum: optimum[0])
        rows = [outcome_row(self.candidate, *optimum) for optimum in optima]
        return _as_run(rows, time.perf_counter() - begin)


@dataclass(frozen=True)
class Bootstrap:
    """A refit from known parameters to published numbers perturbed by their uncertainty.

    The spread of the refits over many seeds gives intervals for the parameters.
    """

    candidate: Candidate
    parameters: tuple[tuple[str, float], ...]
    direction: str
    seed: int
    budget: Budget

    @property
    def key(self) -> str:
        """All settings in one name."""
        name = f"{self.direction}_{self.candidate.name}_{self.budget.name}"
        start = hashlib.sha256(repr(self.parameters).encode()).hexdigest()[:8]
        return f"bootstrap_{name}_from{start}_seed{self.seed}"

    def execute(self) -> Run:
        """Refit locally; one row as `outcome_row` has it."""
        begin = time.perf_counter()
        rng = np.random.default_rng([self.seed, 2])
        targets = {
            name: value + UNCERTAINTY[name] * rng.standard_normal()
            for name, value in PUBLISHED.items()
        }
        residuals = _residuals(self.candidate, self.direction, targets)
        start = self.candidate.searched(dict(self.parameters))
        optimum = _refine(residuals, self.candidate, start, self.budget)
        rows = [outcome_row(self.candidate, *optimum)]
        return _as_run(rows, time.perf_counter() - begin)


def outcome_row(
    candidate: Candidate, chi_square: float, searched: NDArray[np.float64]
) -> dict[str, float]:
    """Return chi-square of the fitted numbers, parameters, all predictions and the trade-off."""
    parameters = candidate.physical(searched)
    model = candidate.model(parameters)
    try:
        predicted = predict(model, candidate.bands, tuple(PUBLISHED))
        traits = front_traits(model)
    except UnstableDrive:
        predicted = dict.fromkeys(PUBLISHED, np.nan)
        traits = dict.fromkeys(TRAITS, np.nan)
    return {"chi_square": chi_square, **parameters, **predicted, **traits}


def _residuals(candidate: Candidate, direction: str, targets: dict[str, float]) -> Residuals:
    """Return the function from search space to (prediction - target) / uncertainty."""
    names = FITS[direction]

    def residuals(searched: NDArray[np.float64]) -> NDArray[np.float64]:
        model = candidate.model(candidate.physical(searched))
        try:
            predictions = predict(model, candidate.bands, names)
        except UnstableDrive:
            return np.full(len(names), UNSTABLE_RESIDUAL)
        return np.array([(predictions[name] - targets[name]) / UNCERTAINTY[name] for name in names])

    return residuals


def _global_search(
    residuals: Residuals, candidate: Candidate, budget: Budget, seed: int
) -> NDArray[np.float64]:
    """Return the final population of a differential evolution, the best first."""
    low, high = np.array(list(candidate.bounds.values())).T
    rng = np.random.default_rng(seed)

    def cost(searched: NDArray[np.float64]) -> float:
        # The logarithm keeps distant members comparable, but they do not dominate the search.
        return float(np.log1p(np.sum(residuals(searched) ** 2)))

    ended = differential_evolution(
        cost,
        list(zip(low, high, strict=True)),
        init=low + rng.random((budget.population, len(low))) * (high - low),
        maxiter=budget.generations,
        tol=0.0,
        polish=False,
        rng=rng,
    )
    return ended.population[np.argsort(ended.population_energies, kind="stable")]


def _refine(
    residuals: Residuals, candidate: Candidate, start: NDArray[np.float64], budget: Budget
) -> tuple[float, NDArray[np.float64]]:
    """Return chi-square and place of the local optimum near ``start``."""
    low, high = np.array(list(candidate.bounds.values())).T
    margin = 1e-9 * (high - low)
    ended = least_squares(
        residuals,
        np.clip(start, low + margin, high - margin),
        bounds=(low, high),
        x_scale=high - low,
        diff_step=1e-4,
        max_nfev=budget.local_evaluations,
    )
    return 2.0 * float(ended.cost), ended.x


def _as_run(rows: Sequence[dict[str, float]], seconds: float) -> Run:
    columns = tuple(rows[0])
    return Run(columns, np.array([[row[name] for name in columns] for row in rows]), seconds)
