"""Multi-start least squares: a rung fitted to a target from Latin hypercube starts alone."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats.qmc import LatinHypercube

from experiments.paper.inference.likelihood import least_deviance, residuals_of
from experiments.paper.inference.rungs import PERIODIC, Rung
from pymoo_hdte._runner.campaign import Run

TRIED = 6
"""Points of the Latin hypercube for each start; the start is the best of them."""
KEPT = 3
"""After the first steps one start in so many goes on: the others are far behind."""
REFINED = 3
"""Ends that are followed to convergence."""
BASIN = 2.0
"""Ends within this of the lowest deviance count as the same basin: less than that does no model
differ noticeably from another."""
STEP = 1e-4
"""Of derivatives, as a share of each range: the peak-to-peak is good to 1e-5."""

Residuals = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Effort:
    """Starts of a search, and steps of its three stages: all starts, those kept, those refined."""

    starts: int
    steps: tuple[int, int, int] = (8, 15, 40)

    @property
    def name(self) -> str:
        """All numbers in one word."""
        return f"{self.starts}x{'_'.join(map(str, self.steps))}"


def digest(place: tuple[float, ...]) -> str:
    """Return a short name of a place, for keys."""
    return hashlib.sha256(repr(place).encode()).hexdigest()[:8]


@dataclass(frozen=True)
class Search:
    """A rung fitted to one of the targets of `likelihood` from one seed.

    ``known`` is a place on the searched scale that is followed beside the starts: the end of a
    target that this one contains.
    """

    rung: Rung
    target: str
    seed: int
    effort: Effort
    known: tuple[float, ...] = ()

    @property
    def key(self) -> str:
        """All settings in one name."""
        start = f"_from{digest(self.known)}" if self.known else ""
        return f"search_{self.target}_{self.rung.name}_{self.effort.name}_seed{self.seed}{start}"

    def execute(self) -> Run:
        """Return one row an end, the best first: deviance, then the place on the searched scale."""
        begin = time.perf_counter()

        def residuals(place: NDArray[np.float64]) -> NDArray[np.float64]:
            return residuals_of(self.rung, self.target, place)

        def soft(place: NDArray[np.float64]) -> NDArray[np.float64]:
            return residuals_of(self.rung, "independent", place)

        rng = np.random.default_rng([self.seed, 24])
        ends = multi_start(residuals, self.rung, self.effort, rng, soft)
        if self.known:
            steps = self.effort.steps[-1]
            ends.append(refine(residuals, self.rung, np.array(self.known), steps)[1])
        rows = np.array([[least_deviance(residuals(end)), *end] for end in ends])
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        return Run(("deviance", *self.rung.bounds), rows, time.perf_counter() - begin)


def multi_start(
    residuals: Residuals,
    rung: Rung,
    effort: Effort,
    rng: np.random.Generator,
    soft: Residuals,
) -> list[NDArray[np.float64]]:
    """Return where least squares from Latin hypercube starts end, those of `KEPT`.

    The first stage follows the residuals ``soft``: those without correlation lead out of the narrow
    valleys that the correlated ones have everywhere.
    """
    low, high = rung.limits
    drawn = LatinHypercube(len(low), rng=rng).random(TRIED * effort.starts)
    tried = low + drawn * (high - low)
    costs = np.array([np.sum(soft(place) ** 2) for place in tried])
    groups = np.arange(len(tried)).reshape(effort.starts, TRIED)
    places = [tried[group[np.argmin(costs[group])]] for group in groups]
    start, second, end = effort.steps
    ends = _followed(soft, rung, places, start)[: -(-effort.starts // KEPT)]
    ends = _followed(residuals, rung, ends, second)
    return [*_followed(residuals, rung, ends[:REFINED], end), *ends[REFINED:]]


def _followed(
    residuals: Residuals, rung: Rung, places: list[NDArray[np.float64]], steps: int
) -> list[NDArray[np.float64]]:
    """Return the places after so many steps, the best first."""
    ends = [refine(residuals, rung, place, steps) for place in places]
    return [place for _, place in sorted(ends, key=lambda end: end[0])]


def refine(
    residuals: Residuals, rung: Rung, start: NDArray[np.float64], steps: int
) -> tuple[float, NDArray[np.float64]]:
    """Return the sum of squares and the place of the local optimum near ``start``.

    Angles may leave their range by a turn.
    """
    low, high = rung.limits
    width = high - low
    turning = np.isin(list(rung.bounds), PERIODIC)
    low, high = np.where(turning, low - width, low), np.where(turning, high + width, high)
    inside = np.clip(start, low + 1e-9 * width, high - 1e-9 * width)
    solution = least_squares(
        residuals,
        inside,
        bounds=(low, high),
        x_scale=width,
        diff_step=STEP * width / np.maximum(np.abs(inside), 1e-3 * width),
        max_nfev=steps,
    )
    return 2.0 * float(solution.cost), np.asarray(solution.x)
