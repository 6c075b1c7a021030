"""Scores of all runs: measured, and as the CSV that the repo keeps with the seconds apart."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.stored import Stored
from experiments.paper.anytime.job import AnytimeRun
from experiments.paper.anytime.measures import MEASURES, RETURNED, measure
from experiments.paper.anytime.moments import COMMON, EXACT, FRESH
from experiments.runner.committed import read_rows, rounded, table_with_origin
from experiments.runner.registry import Context
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.references import true_front
from pymoo_hdte._comparing.runs import AS_PRINTED, VELOCITIES
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.campaign import Campaign

NAME = "anytime"
OF_TABLE_7 = tuple(TABLE_7)
EVERYONE = (*OF_TABLE_7, "A-MOPSO", "MP-MOPSO")
DIGITS = 4
"""Digits kept of an indicator; the paper prints three or four."""


class Contested(NamedTuple):
    """What algorithms are compared on: drive model, kind of moments, first velocities of swarms.

    NSGA-II has no velocities; its runs stand beside those of the swarms under either law.
    """

    model: str
    moments: str
    velocity: str


class Part(NamedTuple):
    """Algorithms compared on the same problem with the same law of velocities, seeds from 1."""

    contested: Contested
    algorithms: tuple[str, ...]
    seeds: int


class Extent(NamedTuple):
    """How much is run."""

    parts: tuple[Part, ...]
    populations: tuple[int, ...]
    budgets: tuple[int, ...]


FULL = Extent(
    parts=(
        *(
            Part(Contested(model, EXACT, velocity), EVERYONE, 50)
            for model, velocity in product(("calibrated", "resonant"), VELOCITIES)
        ),
        *(Part(Contested("calibrated", COMMON, law), OF_TABLE_7, 50) for law in VELOCITIES),
        # Every evaluation costs a thousand of the surrogate: fewer seeds.
        Part(Contested("calibrated", FRESH, AS_PRINTED), OF_TABLE_7, 6),
    ),
    populations=(10, 20, 50, 100),
    budgets=(100, 200, 500, 1000, 2000, 5000, 10_000),
)
QUICK = Extent(
    parts=(
        *(Part(Contested("calibrated", EXACT, law), EVERYONE, 7) for law in VELOCITIES),
        Part(Contested("calibrated", COMMON, AS_PRINTED), OF_TABLE_7, 7),
        Part(Contested("calibrated", FRESH, AS_PRINTED), OF_TABLE_7, 7),
    ),
    populations=(10, 20),
    budgets=(100, 200, 500),
)


class Case(NamedTuple):
    """What all seeds of one algorithm share."""

    model: str
    moments: str
    velocity: str
    counted: str
    population: int
    evaluations: int
    algorithm: str

    @property
    def contested(self) -> Contested:
        """What it is compared on."""
        return Contested(self.model, self.moments, self.velocity)


@dataclass(frozen=True)
class Scores:
    """The `MEASURES` of every run.

    Attributes
    ----------
    values : dict of ndarray, shape (seeds, measures)
        By case, in the order of the seeds.
    seconds : dict of float
        Median of a run over all budgets, by model, moments, velocity, population and algorithm.
    """

    values: dict[Case, NDArray[np.float64]]
    seconds: dict[tuple[str, str, str, int, str], float]

    def of(self, case: Case, name: str) -> NDArray[np.float64]:
        """Return one of the `MEASURES` of every run, shape (seeds,)."""
        return self.values[case][:, MEASURES.index(name)]

    def contested(self) -> list[Contested]:
        """Return what algorithms were compared on, in the order of the table."""
        return list(dict.fromkeys(case.contested for case in self.values))

    def algorithms(self, contested: Contested) -> list[str]:
        """Names of the algorithms that were compared there."""
        names = (case.algorithm for case in self.values if case.contested == contested)
        return list(dict.fromkeys(names))

    def populations(self) -> list[int]:
        """All sizes of the population, ascending."""
        return sorted({case.population for case in self.values})

    def budgets(self) -> list[int]:
        """All budgets of evaluations, ascending."""
        return sorted({case.evaluations for case in self.values})


def scores_for(context: Context) -> Scores:
    """Return the committed scores, or those of a full or quick run."""
    extent = FULL if context.full else QUICK
    return STORED.of(context, NAME, lambda: run_scores(context.campaign, extent))


def committed_scores() -> Scores:
    """Return the scores of the last full run; errors as `committed_file`."""
    return STORED.committed(NAME)


def run_scores(campaign: Campaign, extent: Extent) -> Scores:
    """Run every part of an extent, and measure its sets."""
    values: dict[Case, NDArray[np.float64]] = {}
    seconds = {}
    for part in extent.parts:
        jobs = _jobs(part, extent)
        runs = dict(zip(jobs, campaign.run(jobs, ", ".join(part.contested)), strict=True))
        for population, algorithm in product(extent.populations, part.algorithms):
            times = [r.seconds for j, r in runs.items() if _is(j, population, algorithm)]
            seconds[*part.contested, population, algorithm] = float(np.median(times))
        for population, budget in product(extent.populations, extent.budgets):
            chosen = {(j.algorithm, j.seed): r for j, r in runs.items() if _is(j, population)}
            measured = measure(chosen, budget, population, true_front(part.contested.model))
            for counted, algorithm in dict.fromkeys(key[:2] for key in measured):
                case = Case(*part.contested, counted, population, budget, algorithm)
                rows = [measured[counted, algorithm, 1 + seed] for seed in range(part.seeds)]
                values[case] = np.vectorize(rounded)(np.array(rows), DIGITS)
    return Scores(values, seconds)


def _jobs(part: Part, extent: Extent) -> list[AnytimeRun]:
    entries = product(range(1, part.seeds + 1), part.algorithms, extent.populations)
    model, moments, velocity = part.contested
    return [
        AnytimeRun(
            model,
            moments,
            algorithm,
            population,
            seed,
            extent.budgets,
            AS_PRINTED if algorithm == "NSGA-II" else velocity,
        )
        for seed, algorithm, population in entries
    ]


def _is(job: AnytimeRun, population: int, algorithm: str | None = None) -> bool:
    return job.population == population and algorithm in (None, job.algorithm)


def format_scores(scores: Scores) -> str:
    """Return the CSV text of the scores, with date and versions in a first comment line."""
    rows = (
        [*case, seed, *(f"{value:.{DIGITS}g}" for value in row)]
        for case, runs in scores.values.items()
        for seed, row in enumerate(runs, start=1)
    )
    return table_with_origin([*Case._fields, "seed", *MEASURES], rows)


def format_seconds(scores: Scores) -> str:
    """Return the CSV text of the seconds."""
    rows = ([*key, f"{value:.3g}"] for key, value in scores.seconds.items())
    return csv_text([*Contested._fields, "population", "algorithm", "seconds"], rows)


def read_scores(path: Path, seconds_path: Path) -> Scores:
    """Read what `format_scores` and `format_seconds` wrote."""
    values: dict[Case, list[list[float]]] = {}
    for row in read_rows(path):
        values.setdefault(_case(row), []).append([float(row[name]) for name in MEASURES])
    seconds = {
        (*_contested(row), int(row["population"]), row["algorithm"]): float(row["seconds"])
        for row in read_rows(seconds_path)
    }
    return Scores({case: np.array(rows) for case, rows in values.items()}, seconds)


STORED = Stored(read_scores, format_scores, format_seconds)


def _case(row: dict[str, str]) -> Case:
    numbers = int(row["population"]), int(row["evaluations"])
    return Case(*_contested(row), row["counted"], *numbers, row["algorithm"])


def _contested(row: dict[str, str]) -> Contested:
    return Contested(*(row[name] for name in Contested._fields))


def cases(
    scores: Scores, contested: Contested, algorithms: Sequence[str], counted: str = RETURNED
) -> Iterable[tuple[int, int, list[Case]]]:
    """Yield every population and budget with the cases of some algorithms compared there.

    Those at which nothing was counted this way are left out.
    """
    for population, budget in product(scores.populations(), scores.budgets()):
        chosen = [Case(*contested, counted, population, budget, name) for name in algorithms]
        if all(case in scores.values for case in chosen):
            yield population, budget, chosen
