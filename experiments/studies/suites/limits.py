"""Where the swarms of this package cease to be the best choice: noise, many objectives, sizes.

    python -m experiments.studies.suites.limits

stores what the page on suites and the choice of an algorithm quote. Rivals of ZCAT have 100
individuals everywhere else; here they also have as many as a `CompactSwarm` of the same budget, and
an archive of all that they evaluate.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.age2 import AGEMOEA2
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.algorithm import Algorithm
from pymoo.core.callback import Callback
from pymoo.core.problem import Problem
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.ref_dirs import get_reference_directions
from scipy.stats import rankdata

from experiments.runner.committed import (
    DATA,
    committed_file,
    read_rows,
    table_with_origin,
)
from experiments.studies.suites.jobs import measured
from experiments.studies.suites.problems import SUITES, problem_of
from pymoo_hdte._comparing.indicators import front_among
from pymoo_hdte._runner.result import Cell, Column, Table
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.compact import size_for

NAME = "suites_limits"
COLUMNS = ("question", "case", "evaluations", "algorithm", "value")
SEEDS = range(1, 11)
NOISE, OBJECTIVES, SIZES = "noise", "objectives", "sizes"
DEVIATIONS, COUNTS = (0.05, 0.2), (2, 3, 4, 5, 6)
ZCAT_SEEDS, ZCAT_BUDGETS = range(1, 4), (500, 2_000)
SIZED = ", sized to the budget, with an archive"
_DIRECTIONS = 100


class NoisyZDT1(Problem):
    """ZDT1 whose objectives scatter independently, with a generator of its own."""

    def __init__(self, deviation: float, seed: int) -> None:
        self.exact = get_problem("zdt1")
        super().__init__(n_var=30, n_obj=2, xl=0.0, xu=1.0)
        self.deviation, self.generator = deviation, np.random.default_rng(seed)

    def _evaluate(self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kw: Any) -> None:
        exact = self.exact.evaluate(x)
        out["F"] = exact + self.deviation * self.generator.standard_normal(exact.shape)


class Everything(Callback):
    """Keeps the front of all that was evaluated."""

    def __init__(self) -> None:
        super().__init__()
        self.front: NDArray[np.float64] | None = None

    def notify(self, algorithm: Algorithm) -> None:
        """Add the new points."""
        new = algorithm.off if algorithm.off is not None else algorithm.pop
        F = new.get("F")
        known = F if self.front is None else np.vstack([self.front, F])
        self.front = front_among(known)


def noisy() -> Iterator[list[Any]]:
    """Yield IGD+ of the found designs without noise, mean over the seeds."""
    distance = IGDPlus(get_problem("zdt1").pareto_front())
    makers = {"CompactSwarm": CompactSwarm, "ElitistSwarm": ElitistSwarm, "NSGA-II": NSGA2}
    for deviation in DEVIATIONS:
        for budget in (2_000, 10_000):
            for name, make in makers.items():
                values = []
                for seed in SEEDS:
                    problem = NoisyZDT1(deviation, seed)
                    X = minimize(problem, make(), ("n_eval", budget), seed=seed).X
                    values.append(distance(problem.exact.evaluate(np.atleast_2d(X))))
                yield [NOISE, deviation, budget, name, float(np.mean(values))]


def many_objectives() -> Iterator[list[Any]]:
    """Yield IGD+ on DTLZ2, mean over the seeds."""
    budget = 10_000
    for count in COUNTS:
        problem = get_problem("dtlz2", n_obj=count)
        directions = get_reference_directions("energy", count, _DIRECTIONS, seed=1)
        distance = IGDPlus(_sphere(count))
        makers: dict[str, Callable[[], Algorithm]] = {
            "CompactSwarm": CompactSwarm,
            "ElitistSwarm": ElitistSwarm,
            "NSGA-III": partial(NSGA3, directions),
        }
        for name, make in makers.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # more than four objectives
                runs = [minimize(problem, make(), ("n_eval", budget), seed=seed) for seed in SEEDS]
            values = [distance(run.F) for run in runs]
            yield [OBJECTIVES, count, budget, name, float(np.mean(values))]


def _sphere(n_obj: int) -> NDArray[np.float64]:
    """Return points all over the front of DTLZ2, on none of the directions of NSGA-III."""
    points = np.abs(np.random.default_rng(1).standard_normal((5_000, n_obj)))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def sizes() -> Iterator[list[Any]]:
    """Yield average ranks by hypervolume and by IGD+ on ZCAT, of the medians over the seeds."""
    rivals = {"NSGA-II": NSGA2, "SMS-EMOA": SMSEMOA, "AGE-MOEA-II": AGEMOEA2}
    makers: dict[str, Callable[[int], Algorithm]] = {"CompactSwarm": lambda _: CompactSwarm()}
    for rival, make in rivals.items():
        makers[rival] = partial(_of_size, make, lambda _: 100)
        makers[rival + SIZED] = partial(_of_size, make, size_for)
    for budget in ZCAT_BUDGETS:
        medians = [
            [
                np.median([_worth(problem.name, name, make, budget, s) for s in ZCAT_SEEDS], axis=0)
                for name, make in makers.items()
            ]
            for problem in SUITES["ZCAT"]
        ]
        # Problems by algorithms by measures.
        ranks = rankdata(np.array(medians), axis=1).mean(axis=0)
        for name, (volume, distance) in zip(makers, ranks, strict=True):
            yield [SIZES, "hypervolume", budget, name, float(volume)]
            yield [SIZES, "igd_plus", budget, name, float(distance)]


def _of_size(make: Callable[..., Algorithm], size: Callable[[int], int], budget: int) -> Algorithm:
    """Return a rival with as many individuals as a budget asks for."""
    return make(pop_size=size(budget))


def _worth(
    problem: str, name: str, make: Callable[[int], Algorithm], budget: int, seed: int
) -> tuple[float, float]:
    """Return minus the hypervolume, and IGD+, of what a run offers."""
    everything = Everything()
    try:
        result = minimize(
            problem_of(problem), make(budget), ("n_eval", budget), seed=seed, callback=everything
        )
        F = result.F
    except ZeroDivisionError:  # AGE-MOEA-II of pymoo 0.6.2, where its front is degenerate
        F = everything.front
    if name.endswith(SIZED):
        F = everything.front
    volume, distance, _ = measured(problem, np.atleast_2d(F))
    return -volume, distance


def stored() -> dict[tuple[str, str, int, str], float]:
    """Return the stored values by question, case, evaluations and algorithm."""
    rows = read_rows(committed_file(f"{NAME}.csv", "suites"))
    return {
        (row["question"], row["case"], int(row["evaluations"]), row["algorithm"]): float(
            row["value"]
        )
        for row in rows
    }


def limits_tables() -> Iterator[Table]:
    """Show the stored values, a table a question."""
    titles = {
        NOISE: ("ZDT1 with noise: IGD+ without it", "standard deviation"),
        OBJECTIVES: ("DTLZ2 with many objectives: IGD+", "objectives"),
        SIZES: ("ZCAT against rivals of other sizes: average ranks of seven", "measure"),
    }
    values = stored()
    for question, (title, case) in titles.items():
        algorithms = list(dict.fromkeys(key[3] for key in values if key[0] == question))
        cases = list(dict.fromkeys(key[1:3] for key in values if key[0] == question))
        rows: list[tuple[Cell, ...]] = [
            (algorithm, *(values[question, *place, algorithm] for place in cases))
            for algorithm in algorithms
        ]
        columns = (
            Column("algorithm"),
            *(
                Column(f"{budget:,}", "", 3, f"{case} {name}".replace("igd_plus", "IGD+"))
                for name, budget in cases
            ),
        )
        note = f"After so many evaluations; means of {len(SEEDS)} seeds."
        if question == SIZES:
            note = f"After so many evaluations; medians of {len(ZCAT_SEEDS)} seeds are ranked."
        yield Table(f"limits_{question}", title, columns, tuple(rows), note=note, folded=True)


def main() -> None:
    """Measure and store."""
    rows = [
        [*row[:-1], f"{row[-1]:.4g}"] for part in (noisy, many_objectives, sizes) for row in part()
    ]
    facts = {"command": "python -m experiments.studies.suites.limits"}
    write_atomically(DATA / f"{NAME}.csv", table_with_origin(COLUMNS, rows, **facts).encode())


if __name__ == "__main__":
    main()
