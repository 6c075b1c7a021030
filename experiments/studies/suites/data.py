"""Outcomes on suites: computed, and as the two CSV files that the repo keeps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.runner.committed import committed_file, read_rows, rounded, table_with_origin
from experiments.runner.registry import Context, require
from experiments.studies.suites.coco import EXTRA
from experiments.studies.suites.jobs import MEASURES, BbobRun, SuiteRun
from experiments.studies.suites.peers import OF_OUR_SIZE, OURS, PEERS, takes
from experiments.studies.suites.problems import PROBLEMS, SUITES, problem_of
from experiments.studies.suites.protocol import STORED, SuitePart
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.store import write_atomically

NAME = "suites"
BBOB = f"{NAME}_bbob"
DIGITS = 6
COMMAND = "python -m experiments suites --full"
"""What an outcome is made by, unless `renew` made it; told in its first line."""
SUITE_COLUMNS = ("problem", "algorithm", "evaluations", "seed", "spent", *MEASURES)
BBOB_COLUMNS = (
    "dimension",
    "function",
    "instance",
    "seed",
    "algorithm",
    "told",
    "evaluations",
    "share",
)

SEEDS = range(1, 1 + max(part.seeds for part in STORED))
"""All seeds that any part has."""

SuiteKey = tuple[str, str, int, int]
"""Problem, algorithm, budget and seed."""


@dataclass
class Outcome:
    """What was found.

    Attributes
    ----------
    suites : dict of tuple
        By problem, algorithm, budget and seed: evaluations spent and the `MEASURES`.
    bbob : dict of dict
        By run: the share of targets by number of evaluations.
    """

    suites: dict[SuiteKey, tuple[float, ...]] = field(default_factory=dict)
    bbob: dict[BbobRun, dict[int, float]] = field(default_factory=dict)

    def add(self, jobs: Sequence[SuiteRun | BbobRun], runs: Sequence[Run]) -> None:
        """Take what finished jobs give, rounded as the CSV keeps it."""
        for job, run in zip(jobs, runs, strict=True):
            if isinstance(job, BbobRun):
                self.bbob[job] = {int(mark): rounded(share, DIGITS) for mark, share in run.values}
                continue
            for budget, *numbers in run.values.tolist():
                key = job.problem, job.algorithm, int(budget), job.seed
                self.suites[key] = tuple(rounded(number, DIGITS) for number in numbers)

    def has(self, job: SuiteRun | BbobRun) -> bool:
        """Say whether a job's run is there, at all its budgets."""
        if isinstance(job, BbobRun):
            return job in self.bbob
        keys = ((job.problem, job.algorithm, budget, job.seed) for budget in job.budgets)
        return all(key in self.suites for key in keys)

    def take(self, job: SuiteRun | BbobRun, other: Outcome) -> None:
        """Take over what another outcome has of a job."""
        if isinstance(job, BbobRun):
            self.bbob[job] = other.bbob[job]
            return
        for budget in job.budgets:
            key = job.problem, job.algorithm, budget, job.seed
            self.suites[key] = other.suites[key]

    def without(self, algorithms: Collection[str]) -> Outcome:
        """Return the outcome without the runs of some algorithms."""
        return Outcome(
            {key: row for key, row in self.suites.items() if key[1] not in algorithms},
            {run: row for run, row in self.bbob.items() if run.algorithm not in algorithms},
        )

    def budgets(self, suite: str) -> list[int]:
        """Return the budgets at which ours and another were judged on a suite, rising."""
        ran = {key[2] for key in self.suites if PROBLEMS[key[0]].suite == suite}
        return sorted(budget for budget in ran if len(self.algorithms(suite, budget)) > 1)

    def seeds(self, suite: str) -> int:
        """Return with how many seeds ours ran on each problem of a suite that it ran on, or more.

        The fewest of all budgets at which it was judged there beside another.
        """
        counts = [
            len(self.runs(problem, OURS, budget, 0))
            for budget in self.budgets(suite)
            for problem in self.problems(suite, budget)
        ]
        return min(counts, default=0)

    def algorithms(self, suite: str, budget: int) -> list[str]:
        """Return who ran on a suite at a budget, in the order of `PEERS`, sized rivals last.

        One that could take a problem, but was not run on it, is left out: it would rank last there.
        """
        problems = self.problems(suite, budget)
        names = [*PEERS, *OF_OUR_SIZE]
        ran = {
            (problem, name)
            for problem in problems
            for name in names
            if self.runs(problem, name, budget, 0)
        }
        return [
            name
            for name in names
            if any((problem, name) in ran for problem in problems)
            and all(
                (problem, name) in ran or not takes(name, problem_of(problem))
                for problem in problems
            )
        ]

    def problems(self, suite: str, budget: int, control: str = OURS) -> list[str]:
        """Return the problems of a suite on which ours, or another, was judged at a budget."""
        ran = {key[0] for key in self.suites if key[1:3] == (control, budget)}
        return [problem.name for problem in SUITES[suite] if problem.name in ran]

    def medians(
        self,
        suite: str,
        budget: int,
        measure: str,
        algorithms: Sequence[str],
        control: str = OURS,
    ) -> NDArray[np.float64]:
        """Return medians over the seeds, shape (problems, algorithms); NaN where none ran.

        On the problems and with the seeds of ``control``, with which all are compared.
        """
        place = 1 + MEASURES.index(measure)
        problems = self.problems(suite, budget, control)
        values = np.full((len(problems), len(algorithms)), np.nan)
        for row, problem in enumerate(problems):
            for column, algorithm in enumerate(algorithms):
                runs = self.runs(problem, algorithm, budget, place, control)
                if runs:
                    values[row, column] = np.median(runs)
        return values

    def runs(
        self, problem: str, algorithm: str, budget: int, place: int, control: str = OURS
    ) -> list[float]:
        """Return one number of the runs of an algorithm on a problem, by rising seed.

        Only of seeds with which ours, or another ``control``, ran there as well: with more, a rival
        would be compared otherwise.
        """
        keys = (
            (problem, algorithm, budget, seed)
            for seed in SEEDS
            if (problem, control, budget, seed) in self.suites
        )
        return [self.suites[key][place] for key in keys if key in self.suites]

    def shares(self, dimension: int, algorithm: str, told: int, instance: int) -> dict[int, float]:
        """Return the mean share by number of evaluations over problems, empty if none ran."""
        gathered: dict[int, list[float]] = defaultdict(list)
        for run, shares in self.bbob.items():
            place = run.dimension, run.algorithm, run.told, run.instance
            if place == (dimension, algorithm, told, instance):
                for mark, share in shares.items():
                    gathered[mark].append(share)
        return {mark: float(np.mean(gathered[mark])) for mark in sorted(gathered)}


def outcome_for(context: Context) -> Outcome:
    """Return the stored outcome, or run what it takes."""
    if not context.full:
        return stored()
    for package, extra in (("cocoex", EXTRA), ("comocma", EXTRA), ("jmetal", EXTRA)):
        require(package, extra)
    outcome = Outcome()
    for part in STORED:
        jobs: list[SuiteRun | BbobRun] = list(part.jobs())
        name = part.suite if isinstance(part, SuitePart) else f"bbob-biobj, {part.algorithm}"
        outcome.add(jobs, context.campaign.run(jobs, name))
    write_outcome(outcome, context.out / NAME)
    return outcome


def stored() -> Outcome:
    """Return the outcome that the repository keeps."""
    return read_outcome(*(committed_file(f"{name}.csv", NAME) for name in (NAME, BBOB)))


def write_outcome(outcome: Outcome, folder: Path, command: str = COMMAND) -> None:
    """Write both CSV files into a folder."""
    for name, text in (
        (NAME, suites_text(outcome, command)),
        (BBOB, bbob_text(outcome, command)),
    ):
        write_atomically(folder / f"{name}.csv", text.encode())


def suites_text(outcome: Outcome, command: str = COMMAND) -> str:
    """Return the CSV text of the runs on suites, with origin in a first comment line."""
    rows = ([*key, *(f"{n:.{DIGITS}g}" for n in row)] for key, row in outcome.suites.items())
    return table_with_origin(SUITE_COLUMNS, rows, command=command)


def bbob_text(outcome: Outcome, command: str = COMMAND) -> str:
    """Return the CSV text of the shares on bbob-biobj."""
    rows = (
        [
            *(run.dimension, run.function, run.instance, run.seed, run.algorithm, run.told),
            mark,
            f"{share:.{DIGITS}g}",
        ]
        for run, shares in outcome.bbob.items()
        for mark, share in shares.items()
    )
    return table_with_origin(BBOB_COLUMNS, rows, command=command)


def read_outcome(suites: Path, bbob: Path) -> Outcome:
    """Read what `suites_text` and `bbob_text` wrote."""
    outcome = Outcome()
    for row in read_rows(suites):
        key = row["problem"], row["algorithm"], int(row["evaluations"]), int(row["seed"])
        outcome.suites[key] = tuple(float(row[name]) for name in ("spent", *MEASURES))
    for row in read_rows(bbob):
        function, dimension, instance, told, seed = (
            int(row[name]) for name in ("function", "dimension", "instance", "told", "seed")
        )
        run = BbobRun(function, dimension, instance, row["algorithm"], told, seed)
        outcome.bbob.setdefault(run, {})[int(row["evaluations"])] = float(row["share"])
    return outcome
