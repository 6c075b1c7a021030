"""Where the swarms of this package cease to be the best choice: noise, many objectives, sizes.

    python -m experiments.studies.suites.limits OUT

stores what the page on suites and the choice of an algorithm quote. Finished runs lie in
``OUT/runs/ORIGIN``, from where a further call goes on. With ``--questions noise`` only that is
measured anew, and the rest stays. Rivals on ZCAT have 100 individuals everywhere else; here they
also have as many as ours, and an archive of all that they evaluate.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.util.ref_dirs import get_reference_directions

from experiments.runner.committed import (
    DATA,
    committed_file,
    read_rows,
    table_with_origin,
)
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.jobs import SuiteRun
from experiments.studies.suites.peers import OF_OUR_SIZE, ON_SUITES, OURS, RIVALS
from experiments.studies.suites.problems import SUITES
from experiments.studies.suites.suite_tables import NAMES
from pymoo_hdte._comparing.indicators import smaller_is_better
from pymoo_hdte._comparing.ranks import average_ranks
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte._runner.result import Cell, Column, Table
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm

NAME = "suites_limits"
COLUMNS = ("question", "case", "evaluations", "algorithm", "value")
SEEDS = range(1, 11)
NOISE, OBJECTIVES, SIZES = "noise", "objectives", "sizes"
ZCAT_SEEDS, ZCAT_BUDGETS = range(1, 4), (500, 2_000)
SHARE = 0.3
AGAIN = f", {SHARE:.0%} evaluated again"
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


def _noisy(deviation: float, algorithm: Algorithm, budget: int, seed: int) -> float:
    """Return IGD+ of the designs found on ZDT1 with noise, judged without it."""
    problem = NoisyZDT1(deviation, seed)
    X = minimize(problem, algorithm, ("n_eval", budget), seed=seed).X
    return float(_front_of_zdt1()(problem.exact.evaluate(np.atleast_2d(X))))


@cache
def _front_of_zdt1() -> IGDPlus:
    return IGDPlus(get_problem("zdt1").pareto_front())


def _on_sphere(count: float, algorithm: Algorithm, budget: int, seed: int) -> float:
    """Return IGD+ on DTLZ2 with many objectives."""
    problem = get_problem("dtlz2", n_obj=int(count))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # more than four objectives
        F = minimize(problem, algorithm, ("n_eval", budget), seed=seed).F
    return float(_sphere(int(count))(F))


@cache
def _sphere(n_obj: int) -> IGDPlus:
    """Return the distance from the front of DTLZ2, on none of the directions of NSGA-III."""
    points = np.abs(np.random.default_rng(1).standard_normal((5_000, n_obj)))
    return IGDPlus(points / np.linalg.norm(points, axis=1, keepdims=True))


def _with_directions(count: float) -> Algorithm:
    return NSGA3(get_reference_directions("energy", int(count), _DIRECTIONS, seed=1))


_SWARMS: dict[str, Callable[..., Algorithm]] = {
    "CompactSwarm": CompactSwarm,
    "ElitistSwarm": ElitistSwarm,
}


def _plain(make: Callable[..., Algorithm], case: float) -> Algorithm:
    return make()


def _again(make: Callable[..., Algorithm], case: float) -> Algorithm:
    return make(reevaluated=SHARE)


@dataclass(frozen=True)
class Question:
    """Cases and budgets on which algorithms, made for a case, get a value; what tables call it."""

    title: str
    case: str
    cases: tuple[float, ...]
    budgets: tuple[int, ...]
    made: dict[str, Callable[[float], Algorithm]]
    value: Callable[[float, Algorithm, int, int], float]


_PLAIN = {name: partial(_plain, make) for name, make in _SWARMS.items()}
QUESTIONS = {
    NOISE: Question(
        "ZDT1 with noise: IGD+ without it",
        "standard deviation",
        (0.05, 0.2),
        (500, 2_000, 10_000),
        {
            **_PLAIN,
            **{name + AGAIN: partial(_again, make) for name, make in _SWARMS.items()},
            "NSGA-II": partial(_plain, NSGA2),
        },
        _noisy,
    ),
    OBJECTIVES: Question(
        "DTLZ2 with many objectives: IGD+",
        "objectives",
        (2, 3, 4, 5, 6),
        (10_000,),
        {**_PLAIN, "NSGA-III": _with_directions},
        _on_sphere,
    ),
}


@dataclass(frozen=True)
class LimitRun:
    """An algorithm on one case of a question with one seed, as a job."""

    question: str
    case: float
    algorithm: str
    budget: int
    seed: int

    @property
    def key(self) -> str:
        """All settings in one name."""
        name = self.algorithm.replace("%", "percent")
        return f"limit_{self.question}_{self.case:g}_{name}_{self.budget}_seed{self.seed}"

    def execute(self) -> Run:
        """Run; the only column is the value."""
        question = QUESTIONS[self.question]
        started = time.perf_counter()
        algorithm = question.made[self.algorithm](self.case)
        value = question.value(self.case, algorithm, self.budget, self.seed)
        return Run(("value",), np.array([[value]]), time.perf_counter() - started)


def measured_rows(campaign: Campaign, name: str) -> Iterator[list[Any]]:
    """Yield the rows of a question, means over the seeds."""
    question = QUESTIONS[name]
    for case in question.cases:
        for budget in question.budgets:
            for algorithm in question.made:
                jobs = [LimitRun(name, case, algorithm, budget, seed) for seed in SEEDS]
                runs = campaign.run(jobs, f"{name} {case:g}, {algorithm}, {budget:,}")
                mean = np.mean([run.values[0, 0] for run in runs])
                yield [name, f"{case:g}", budget, algorithm, f"{mean:.4g}"]


def rows_of_sizes(campaign: Campaign) -> Iterator[list[Any]]:
    """Yield average ranks on ZCAT of the medians over the seeds."""
    names, outcome = (OURS, *RIVALS, *OF_OUR_SIZE), Outcome()
    for name in names:
        for budgets in ON_SUITES[name].budgets_of_runs(ZCAT_BUDGETS):
            jobs = [
                SuiteRun(problem.name, name, seed, budgets)
                for problem in SUITES["ZCAT"]
                for seed in ZCAT_SEEDS
            ]
            outcome.add(jobs, campaign.run(jobs, f"{name}, {budgets}"))
    for measure in NAMES:
        for budget in ZCAT_BUDGETS:
            medians = outcome.medians("ZCAT", budget, measure, names)
            ranks = average_ranks(medians, smaller_is_better=smaller_is_better(measure))
            for name, rank in zip(names, ranks, strict=True):
                yield [SIZES, measure, budget, name, f"{rank:.4g}"]


def stored() -> dict[tuple[str, str, int, str], float]:
    """Return the stored values by question, case, evaluations and algorithm."""
    return {
        (row["question"], row["case"], int(row["evaluations"]), row["algorithm"]): float(
            row["value"]
        )
        for row in read_rows(committed_file(f"{NAME}.csv", "suites"))
    }


def limits_tables() -> Iterator[Table]:
    """Show the stored values, a table a question."""
    values = stored()
    titles = {name: (question.title, question.case) for name, question in QUESTIONS.items()}
    titles[SIZES] = ("ZCAT against rivals of other sizes: average ranks of seven", "measure")
    for name, (title, case) in titles.items():
        algorithms = list(dict.fromkeys(key[3] for key in values if key[0] == name))
        places = list(dict.fromkeys(key[1:3] for key in values if key[0] == name))
        rows: list[tuple[Cell, ...]] = [
            (algorithm, *(values[name, *place, algorithm] for place in places))
            for algorithm in algorithms
        ]
        columns = (
            Column("algorithm"),
            *(
                Column(f"{budget:,}", "", 3, f"{case} {NAMES.get(which, which)}")
                for which, budget in places
            ),
        )
        note = f"After so many evaluations; means of {len(SEEDS)} seeds."
        if name == SIZES:
            note = f"After so many evaluations; medians of {len(ZCAT_SEEDS)} seeds are ranked."
        yield Table(f"limits_{name}", title, columns, tuple(rows), note=note, folded=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and store."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.suites.limits")
    parser.add_argument("out", type=Path, metavar="OUT")
    questions = (*QUESTIONS, SIZES)
    parser.add_argument("--questions", nargs="+", choices=questions, default=questions)
    options = parser.parse_args(arguments)
    campaign = Campaign(options.out)
    before = [[*key, f"{value:.4g}"] for key, value in stored().items()]
    rows: list[list[Any]] = []
    for name in questions:
        if name not in options.questions:
            rows += [row for row in before if row[0] == name]
        else:
            rows += rows_of_sizes(campaign) if name == SIZES else measured_rows(campaign, name)
    facts = {"command": "python -m experiments.studies.suites.limits OUT"}
    write_atomically(DATA / f"{NAME}.csv", table_with_origin(COLUMNS, rows, **facts).encode())


if __name__ == "__main__":
    main()
