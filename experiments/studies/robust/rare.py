"""Small probabilities of six limit states: ours beside OpenTURNS's own methods, as jobs."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.studies.robust.limit_states import STATE_BY_NAME, Failure
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.problems import Response, failure_probability

Array = NDArray[np.float64]

OURS = "pymoo_hdte"
SUBSET = "subset sampling"
DIRECTIONAL = "directional sampling"
FIRST_ORDER = "FORM and importance sampling"
METHODS = (OURS, SUBSET, DIRECTIONAL, FIRST_ORDER)
ACCURACY = 0.1
"""Half-width of the 95 % band that all are asked for, as a share of the probability."""
RIVALS_ERROR = 0.1
"""Relative standard error that OpenTURNS's methods are asked for.

It is twice that of ours, which takes a quarter of the runs; what counts are runs times squared true
errors, which sampling does not change.
"""
OF_A_LEVEL = 10_000
"""Runs of each level of subset sampling, which has no such end."""
MOST_RUNS = 100_000
"""Runs after which the others end with what they have."""
COLUMNS = ("runs", "probability", "lower", "upper", "confirmed")


@dataclass(frozen=True)
class RareJob:
    """One method on one limit state at one level, with some seeds."""

    state: str
    probability: float
    method: str
    seeds: tuple[int, ...]

    @property
    def key(self) -> str:
        """All settings in one name."""
        seeds = f"{self.seeds[0]}-{self.seeds[-1]}"
        name = f"rare_{self.state}_{self.probability:g}_{self.method}_{seeds}"
        return name.replace(" ", "_")

    def execute(self) -> Run:
        """Return the columns of `COLUMNS`, one row for each seed."""
        started = time.perf_counter()
        failure = STATE_BY_NAME[self.state].failing_with(self.probability)
        estimate = by_ours if self.method == OURS else by_openturns
        rows = [estimate(failure, seed, self.method) for seed in self.seeds]
        return Run(COLUMNS, np.array(rows), time.perf_counter() - started)


Row = tuple[float, float, float, float, float]


def by_ours(failure: Failure, seed: int, method: str = OURS) -> Row:
    """Return the columns of `COLUMNS` of `failure_probability`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        result = failure_probability(
            failure.simulator,
            failure.laws,
            Response() < 0.0,
            ACCURACY,
            vectorised=True,
            seed=seed,
            progress=False,
        )
    return result.n_runs, result.probability, *result.interval, float(result.confirmed)


def by_openturns(failure: Failure, seed: int, method: str) -> Row:
    """Return the columns of `COLUMNS` of one of its methods, in standard normal space.

    The band is two of its own standard errors.
    """
    import openturns as ot

    ot.RandomGenerator.SetSeed(seed)
    ot.Log.Show(ot.Log.NONE)
    d, runs = len(failure.laws), 0

    def margin(points: Any) -> Array:
        nonlocal runs
        runs += len(points)
        return failure.in_normal_space(np.array(points))[:, None]

    function = ot.PythonFunction(d, 1, func_sample=margin)
    vector = ot.CompositeRandomVector(function, ot.RandomVector(ot.Normal(d)))
    event = ot.ThresholdEvent(vector, ot.Less(), 0.0)
    block, most = 10, MOST_RUNS
    if method == SUBSET:
        algorithm, block, most = ot.SubsetSampling(event), 1000, OF_A_LEVEL
    elif method == DIRECTIONAL:
        algorithm = ot.DirectionalSampling(event)
    else:
        solver = ot.AbdoRackwitz()
        solver.setMaximumIterationNumber(200)
        # At the origin a margin may have no slope.
        form = ot.FORM(solver, event, [0.1] * d)
        try:
            form.run()
            algorithm = ot.PostAnalyticalImportanceSampling(form.getResult())
        except Exception:  # OpenTURNS raises a class of its own where no point is found.
            return float(runs), np.nan, np.nan, np.nan, 0.0
    algorithm.setMaximumCoefficientOfVariation(RIVALS_ERROR)
    algorithm.setBlockSize(block)
    algorithm.setMaximumOuterSampling(most // block)
    algorithm.run()
    result = algorithm.getResult()
    share, error = result.getProbabilityEstimate(), result.getStandardDeviation()
    met = float(error <= 1.1 * RIVALS_ERROR * share)
    return float(runs), share, share - 1.96 * error, share + 1.96 * error, met
