"""Algorithms compared on the same problems and seeds, against true fronts or the union of runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.indicators import smaller_is_better
from experiments.comparing.named import OpenRun, problem_named, source_of
from experiments.comparing.quality import Quality, TrueFront
from experiments.comparing.references import MODELS, objective_names, reference
from experiments.comparing.runs import ALGORITHMS, OptimisationRun
from experiments.comparing.statistics import effect_size, holm, wilcoxon_p
from experiments.runner.campaign import Run
from experiments.runner.registry import Context
from experiments.runner.setting import Setting

SIGNIFICANT = 0.05
"""Level of the paired tests, after Holm's correction."""


@dataclass(frozen=True)
class PairedTest:
    """How one algorithm does against a rival on the same seeds.

    ``better`` is the probability that a run of the algorithm beats one of the rival (A12, ties
    counted half); ``p`` is Wilcoxon's after Holm's correction over all rivals.
    """

    rival: str
    p: float
    better: float

    @property
    def significant(self) -> bool:
        """Whether the two differ beyond chance."""
        return self.p < SIGNIFICANT


LEAST_SEEDS = 7
"""With fewer, no Wilcoxon test against three rivals can fall below 5 % after Holm's correction."""


def too_few_seeds(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Return the note that explains missing verdicts, if there are too few seeds for them."""
    if all(comparison.can_be_judged for comparison in comparisons):
        return ()
    return (f"Fewer than {LEAST_SEEDS} seeds: too few to judge differences, so no verdicts.",)


@dataclass(frozen=True)
class Comparison:
    """Runs of several algorithms on one problem, in the order of their seeds.

    Attributes
    ----------
    model
        Name of the problem.
    truth
        The front against which they are measured.
    is_true
        Whether it is the problem's own; otherwise it is the union of all these runs.
    seeds
        Seeds of the runs of every algorithm.
    objectives
        Names of the objectives.
    fronts
        Final sets of every algorithm, each of shape (n, m).
    spent
        Evaluations of every run.
    runs, qualities
        Where they come from, and what they are worth.
    """

    model: str
    truth: TrueFront
    is_true: bool
    seeds: range
    objectives: tuple[str, ...]
    fronts: dict[str, list[NDArray[np.float64]]]
    spent: dict[str, list[int]]
    runs: dict[str, list[Run]]
    qualities: dict[str, list[Quality]]

    @property
    def algorithms(self) -> tuple[str, ...]:
        """Names of the algorithms compared."""
        return tuple(self.runs)

    @property
    def can_be_judged(self) -> bool:
        """Whether there are seeds enough for a difference to be significant at all."""
        return min(map(len, self.runs.values())) >= LEAST_SEEDS

    def values(self, algorithm: str, indicator: str) -> NDArray[np.float64]:
        """Return a field of `Quality` for every run, shape (seeds,)."""
        return np.array([getattr(q, indicator) for q in self.qualities[algorithm]], dtype=float)

    def seconds(self, algorithm: str) -> NDArray[np.float64]:
        """Return the wall time of every run, shape (seeds,)."""
        return np.array([run.seconds for run in self.runs[algorithm]])

    def median_front(self, algorithm: str) -> NDArray[np.float64]:
        """Return the objectives (n, m) of the run whose IGD is the (lower) median."""
        order = np.argsort(self.values(algorithm, "igd"), kind="stable")
        return self.fronts[algorithm][order[(len(order) - 1) // 2]]

    def paired_tests(self, algorithm: str, indicator: str) -> list[PairedTest]:
        """Test ``algorithm`` against each of the others on one indicator."""
        rivals = [name for name in self.algorithms if name != algorithm]
        ours = self.values(algorithm, indicator)
        theirs = [self.values(rival, indicator) for rival in rivals]
        adjusted = holm([wilcoxon_p(ours, values) for values in theirs])
        better = [
            effect_size(values, ours) if smaller_is_better(indicator) else effect_size(ours, values)
            for values in theirs
        ]
        return [PairedTest(*entry) for entry in zip(rivals, adjusted.tolist(), better, strict=True)]


Job = OptimisationRun | OpenRun


def compare(context: Context, algorithms: Sequence[str], title: str) -> list[Comparison]:
    """Run every algorithm on every problem of the setting with its seeds; measure the final sets.

    ``algorithms`` are those of the table, unless the setting names others.
    """
    setting, seeds = context.setting, context.seeds_to_run
    names = setting.algorithms or tuple(algorithms)
    entries = list(product(setting.problems, names, seeds))
    jobs = [_job(setting, *entry) for entry in entries]
    runs = context.campaign.run(jobs, title)
    finished = {entry: (job, run) for entry, job, run in zip(entries, jobs, runs, strict=True)}
    return [
        _comparison(problem, {a: [finished[problem, a, s] for s in seeds] for a in names}, seeds)
        for problem in setting.problems
    ]


def _job(setting: Setting, problem: str, algorithm: str, seed: int) -> Job:
    if problem not in MODELS or algorithm not in ALGORITHMS:
        budget = setting.population, setting.evaluations
        return OpenRun(problem, algorithm, seed, *budget, source_of(problem, algorithm))
    if (setting.population, setting.evaluations) == (Setting.population, Setting.evaluations):
        return OptimisationRun(problem, algorithm, seed)
    return OptimisationRun(problem, algorithm, seed, setting.population, setting.generations)


def _comparison(
    problem: str, finished: dict[str, list[tuple[Job, Run]]], seeds: range
) -> Comparison:
    values = {a: [_found(job, run) for job, run in of_one] for a, of_one in finished.items()}
    fronts = {a: [F for F, _ in of_one] for a, of_one in values.items()}
    truth, is_true = reference(problem, [F for of_one in fronts.values() for F in of_one])
    return Comparison(
        problem,
        truth,
        is_true,
        seeds,
        objective_names(problem),
        fronts,
        {a: [spent for _, spent in of_one] for a, of_one in values.items()},
        {a: [run for _, run in of_one] for a, of_one in finished.items()},
        {a: [truth.quality(F) for F in of_one] for a, of_one in fronts.items()},
    )


def _found(job: Job, run: Run) -> tuple[NDArray[np.float64], int]:
    """Return the final set of a run, shape (n, m), and the evaluations that it spent."""
    if isinstance(job, OpenRun):
        F = run.values[:, -problem_named(job.problem).n_obj :]
        return F[np.isfinite(F).all(axis=1)], int(run.values[0, 0])
    return objectives(run), job.population * job.generations


def objectives(run: Run) -> NDArray[np.float64]:
    """Return the objectives of an `OptimisationRun`, shape (n, 2): its last two columns."""
    return run.values[:, -2:]


def designs(run: Run) -> NDArray[np.float64]:
    """Return the designs of an `OptimisationRun`, shape (n, 4): all columns but the last two."""
    return run.values[:, :-2]
