"""How busy workers are: measured on a simulator that sleeps, and on 64 of them in virtual time."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize

from experiments.studies.timing import Ratio
from pymoo_hdte._runner.result import Column, Table
from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.parallel import ExecutorParallelization, VirtualWorkers, minimize_asynchronously

MEASURED = (2, 4)
EVALUATIONS, SECONDS, SWARM = 96, 0.1, 16
"""Of the simulator that sleeps; the swarm is a multiple of every number of workers."""
MANY, LONG = 64, 20
"""Workers in virtual time, and evaluations that each of them makes."""
SEEDS = range(2)
LIMIT = 10.0
"""Time limit in virtual time, in units of an evaluation's shortest time."""

Optimise = Callable[..., Any]
MODES: dict[str, Optimise] = {"generations": minimize, "asynchronous": minimize_asynchronously}


class Sleeping(ElementwiseProblem):
    """ZDT1 in six variables, by a simulator that takes its time on no core."""

    def __init__(self, seconds: float = 0.0, **kwargs: Any) -> None:
        super().__init__(n_var=6, n_obj=2, xl=0.0, xu=1.0, **kwargs)
        self.seconds = seconds

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        if self.seconds:
            time.sleep(self.seconds)
        g = 1.0 + 9.0 * x[1:].mean()
        out["F"] = [x[0], g * (1.0 - np.sqrt(x[0] / g))]


def ratios_of_workers() -> Iterator[Ratio]:
    """Measure two and four workers against one, in both modes."""
    for mode, optimise in MODES.items():
        alone = _seconds(1, optimise)
        for number in MEASURED:
            together = _seconds(number, optimise)
            yield Ratio(
                f"{EVALUATIONS} evaluations of {SECONDS:g} s, {mode}",
                "1 worker",
                alone,
                f"{number} workers",
                together,
                f"at least {0.9 * number:g}: 90 % efficiency",
                alone >= 0.9 * number * together,
            )


def _seconds(number: int, optimise: Optimise) -> float:
    with ExecutorParallelization(number) as runner:
        problem = Sleeping(SECONDS, elementwise_runner=runner)
        # Processes are started, and have imported what they need, before the clock runs; so has
        # the swarm, whose first run in a process would count for one worker alone.
        problem.evaluate(np.random.default_rng(1).random((4 * number, 6)))
        awake = Sleeping(elementwise_runner=runner)
        optimise(awake, ElitistSwarm(SWARM), ("n_eval", 2 * SWARM), seed=1)
        begin = time.perf_counter()
        optimise(problem, ElitistSwarm(SWARM), ("n_eval", EVALUATIONS), seed=1)
        return time.perf_counter() - begin


def virtual_table() -> Table:
    """Return how busy 64 workers are in virtual time, and what the front is worth."""
    rows: list[tuple[float | str, ...]] = []
    for title, times, limit in _times():
        per_mode = [
            np.mean([_virtual(optimise, times, limit, seed) for seed in SEEDS], axis=0)
            for optimise in MODES.values()
        ]
        (waited, of_generations, with_generations), (ended, asynchronous, without) = per_mode
        row = (of_generations, asynchronous, waited / ended, with_generations, without)
        rows.append((title, *map(float, row)))
    columns = (
        Column("times of the evaluations"),
        Column("busy share", "", 2, "generations"),
        Column("busy share", "", 2, "asynchronous"),
        Column("time, generations over asynchronous", "", 3),
        Column("hypervolume", "", 4, "generations"),
        Column("hypervolume", "", 4, "asynchronous"),
    )
    note = (
        f"A queue on a clock of its own: a swarm of {MANY}, {MANY * LONG} evaluations, mean of"
        f" {len(SEEDS)} seeds. The share counts all the time until the last evaluation has ended."
        " Hypervolume of the front after all evaluations, up to (1.1, 1.1)."
    )
    return Table("virtual_workers", f"{MANY} workers in virtual time", columns, tuple(rows), note)


def _times() -> Iterator[tuple[str, Callable[[np.random.Generator], float], float | None]]:
    yield "all equal", lambda rng: 1.0, None
    yield "lognormal, sigma 0.5", lambda rng: rng.lognormal(0.0, 0.5), None
    yield "lognormal, sigma 1", lambda rng: rng.lognormal(0.0, 1.0), None
    yield "Pareto, exponent 1.5", lambda rng: 1.0 + rng.pareto(1.5), None
    yield f"the same, ended and lost after {LIMIT:g}", lambda rng: 1.0 + rng.pareto(1.5), LIMIT


def _virtual(
    optimise: Optimise,
    times: Callable[[np.random.Generator], float],
    limit: float | None,
    seed: int,
) -> tuple[float, float, float]:
    """Return virtual seconds, share of busy workers and hypervolume of a run."""
    rng = np.random.default_rng(seed)
    queue = VirtualWorkers(MANY, lambda: times(rng), limit)
    problem = Sleeping(elementwise_runner=ExecutorParallelization(queue))
    # Designs that are lost are what the last row is about.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        result = optimise(problem, ElitistSwarm(MANY), ("n_eval", MANY * LONG), seed=seed)
    return queue.now, queue.efficiency, float(HV(ref_point=[1.1, 1.1])(result.F))
