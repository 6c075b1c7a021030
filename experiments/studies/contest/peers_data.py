"""Scores of algorithms on the benchmark: measured from runs, and as the CSV that the repo keeps.

Seconds are in a separate file, because they differ from run to run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.contestants import EVALUATIONS, SPENT, ContestantRun
from experiments.comparing.stored import Stored
from experiments.runner.committed import read_rows, rounded, table_with_origin
from experiments.runner.registry import Context
from experiments.studies.contest.benchmark_fronts import front_of
from experiments.studies.contest.problems import BENCHMARKS, EVERY, problem_of
from experiments.studies.contest.reduced_swarms import EVERYONE
from pymoo_hdte._comparing.indicators import Indicators, IndicatorsAgainst, front_among
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.algorithms.spread import most_spread


@dataclass(frozen=True)
class ContestRun(ContestantRun):
    """A run on a problem of the contest, which keeps the sets that are offered."""

    def execute(self) -> Run:
        """Run, and return the front of what is offered.

        Columns are the budget, the evaluations spent and the objectives, rows by budget and rising
        objectives. A budget at which nothing feasible is offered has one row without objectives.
        """
        problem = problem_of(self.problem)
        offers, seconds = self.offers(EVERYONE[self.algorithm], problem)
        rows = []
        for budget, offer in offers:
            front = front_among(offer.F)
            if not len(front):
                front = np.full((1, problem.n_obj), np.nan)
            rows.append(np.column_stack([np.tile([budget, offer.spent], (len(front), 1)), front]))
        columns = (EVALUATIONS, SPENT, *(f"f{1 + i}" for i in range(problem.n_obj)))
        return Run(columns, np.concatenate(rows), seconds)


_KEY = ("problem", "algorithm", "evaluations", "seed")

FINAL_SIZE = 50
MEASURES = (*Indicators._fields, "igd_crowding", "hypervolume_crowding")
"""Indicators of the final set thinned out evenly, and two of that thinned out by crowding."""
DIGITS = 6
"""Digits kept of an indicator: with four, different hypervolumes near 1 would tie."""


@dataclass(frozen=True)
class Scores:
    """Indicators of every run.

    Attributes
    ----------
    problems, algorithms : tuple of str
    budgets, seeds : tuple of int
    values : ndarray, shape (6, problems, algorithms, budgets, seeds)
        In the order of `MEASURES`; a run without any feasible solution has infinite distances, and
        an algorithm that cannot take a problem has NaN throughout.
    spent : ndarray of int, shape (problems, algorithms, budgets, seeds)
        Evaluations; 0 where an algorithm cannot take a problem.
    seconds : ndarray, shape (problems, algorithms)
        Median wall time of a run of the largest budget.
    """

    problems: tuple[str, ...]
    algorithms: tuple[str, ...]
    budgets: tuple[int, ...]
    seeds: tuple[int, ...]
    values: NDArray[np.float64]
    spent: NDArray[np.int_]
    seconds: NDArray[np.float64]

    def of(
        self, indicator: str, evaluations: int, *, tuning: bool | None = None
    ) -> NDArray[np.float64]:
        """Return one indicator at one budget, shape (problems, algorithms, seeds).

        With ``tuning``, only of the problems that may, or may not, be tuned on.
        """
        place = MEASURES.index(indicator), self.budgets.index(evaluations)
        return self.values[place[0], :, :, place[1], :][self.rows(tuning)]

    def rows(self, tuning: bool | None) -> NDArray[np.int_]:
        """Return the rows of the problems that may, or may not, be tuned on; all for None."""
        kinds = [EVERY[name].tuning for name in self.problems]
        return np.array([i for i, kind in enumerate(kinds) if tuning is None or kind == tuning])


class Extent(NamedTuple):
    """Budgets of evaluations, and how many seeds, from 1."""

    budgets: tuple[int, ...]
    seeds: int


def scores_for(
    context: Context, name: str, algorithms: Sequence[str], full: Extent, quick: Extent
) -> Scores:
    """Return the committed scores of an experiment, or those of a full or quick run."""
    budgets, seeds = full if context.full else quick
    problems, numbers = list(BENCHMARKS), range(1, seeds + 1)
    return STORED.of(
        context,
        name,
        lambda: contest_scores(context.campaign, problems, algorithms, budgets, numbers),
    )


def committed_scores(name: str) -> Scores:
    """Return the scores of the last full run of an experiment; errors as `committed_file`."""
    return STORED.committed(name)


def contest_scores(
    campaign: Campaign,
    problems: Sequence[str],
    algorithms: Sequence[str],
    budgets: tuple[int, ...],
    seeds: Sequence[int],
) -> Scores:
    """Run every algorithm on every problem with every seed, and measure the final sets."""
    entries = [
        (problem, algorithm, seed)
        for seed, problem, algorithm in product(seeds, problems, algorithms)
        if takes_part(algorithm, problem)
    ]
    jobs = [
        ContestRun(*entry, budget)
        for entry in entries
        for budget in EVERYONE[entry[1]].budgets_of_runs(budgets)
    ]
    shape = (len(problems), len(algorithms), len(budgets), len(seeds))
    values = np.full((len(MEASURES), *shape), np.nan)
    spent = np.zeros(shape, dtype=int)
    seconds = np.full((len(problems), len(algorithms), len(seeds)), np.nan)
    for job, run in zip(jobs, campaign.run(jobs, "contest"), strict=True):
        place = problems.index(job.problem), algorithms.index(job.algorithm)
        for budget in job.budgets:
            where = (*place, budgets.index(budget), seeds.index(job.seed))
            values[(slice(None), *where)], spent[where] = measure(job.problem, run, budget)
        # The last run of an algorithm on a problem is that of the largest budget.
        seconds[(*place, seeds.index(job.seed))] = run.seconds
    return Scores(
        tuple(problems),
        tuple(algorithms),
        budgets,
        tuple(seeds),
        np.vectorize(rounded)(values, DIGITS),
        spent,
        np.median(seconds, axis=-1),
    )


def takes_part(algorithm: str, problem: str) -> bool:
    """Say whether an algorithm takes the problem at all."""
    unconstrained = not EVERY[problem].family.startswith("constrained")
    return unconstrained or EVERYONE[algorithm].takes_constraints


@cache
def _indicators(problem: str) -> IndicatorsAgainst:
    return IndicatorsAgainst(front_of(problem))


def measure(problem: str, run: Run, budget: int) -> tuple[list[float], int]:
    """Return the `MEASURES` of what a run offers at one budget, and the evaluations it spent."""
    rows = run.values[run.values[:, run.columns.index(EVALUATIONS)] == budget]
    front = rows[:, run.columns.index(SPENT) + 1 :]
    front = front[np.isfinite(front).all(axis=1)]
    indicators = _indicators(problem)
    even = indicators(front[most_spread(front, FINAL_SIZE)])
    crowding = indicators(front[least_crowded(front, FINAL_SIZE)])
    measured = [*even, crowding.igd, crowding.hypervolume]
    return measured, int(rows[0, run.columns.index(SPENT)])


def format_scores(scores: Scores) -> str:
    """Return the CSV text of the scores, with date and versions in a first comment line."""
    rows = []
    axes = (scores.problems, scores.algorithms, scores.budgets, scores.seeds)
    for place in np.ndindex(*scores.spent.shape):
        if scores.spent[place]:
            key = [axis[i] for axis, i in zip(axes, place, strict=True)]
            row = [f"{value:.{DIGITS}g}" for value in scores.values[(slice(None), *place)]]
            rows.append([*key, scores.spent[place], *row])
    return table_with_origin([*_KEY, SPENT, *MEASURES], rows)


def format_seconds(scores: Scores) -> str:
    """Return the CSV text of the seconds."""
    rows = (
        [problem, *(f"{value:.3g}" for value in row)]
        for problem, row in zip(scores.problems, scores.seconds, strict=True)
    )
    return csv_text(["problem", *scores.algorithms], rows)


def read_scores(path: Path, seconds_path: Path) -> Scores:
    """Read what `format_scores` and `format_seconds` wrote."""
    rows = read_rows(path)
    problems, algorithms = (_in_order(rows, name) for name in _KEY[:2])
    budgets, seeds = (tuple(sorted({int(row[name]) for row in rows})) for name in _KEY[2:])
    shape = (len(problems), len(algorithms), len(budgets), len(seeds))
    values, spent = np.full((len(MEASURES), *shape), np.nan), np.zeros(shape, dtype=int)
    for row in rows:
        place = (
            problems.index(row["problem"]),
            algorithms.index(row["algorithm"]),
            budgets.index(int(row["evaluations"])),
            seeds.index(int(row["seed"])),
        )
        values[(slice(None), *place)] = [float(row[name]) for name in MEASURES]
        spent[place] = int(row[SPENT])
    by_problem = {row["problem"]: row for row in read_rows(seconds_path)}
    seconds = np.array([[float(by_problem[p][a]) for a in algorithms] for p in problems])
    return Scores(problems, algorithms, budgets, seeds, values, spent, seconds)


def _in_order(rows: Sequence[dict[str, str]], name: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(row[name] for row in rows))


STORED = Stored(read_scores, format_scores, format_seconds)
