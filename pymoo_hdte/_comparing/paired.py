"""Algorithms compared on the same problems and seeds, against true fronts or the union of runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._comparing.indicators import smaller_is_better
from pymoo_hdte._comparing.named import OpenRun, problem_named, source_of
from pymoo_hdte._comparing.quality import Quality, TrueFront
from pymoo_hdte._comparing.references import MODELS, objective_names, reference
from pymoo_hdte._comparing.runs import ALGORITHMS, OptimisationRun
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._comparing.statistics import effect_size, holm, wilcoxon_p
from pymoo_hdte._runner.campaign import Campaign, Run

SIGNIFICANT = 0.05
"""Level of the paired tests, after Holm's correction."""


@dataclass(frozen=True)
class PairedTest:
    """How one algorithm does against a rival on the same seeds.

    ``better`` is the probability that a run of the algorithm beats one of the rival (A12, ties
    counted half); ``p`` is Wilcoxon's after Holm's correction over all rivals; ``equal`` is the
    number of seeds on which both have the same value.
    """

    rival: str
    p: float
    better: float
    equal: int

    @property
    def significant(self) -> bool:
        """Whether the two differ beyond chance."""
        return self.p < SIGNIFICANT


def least_seeds(tests: int) -> int:
    """Return with how many seeds the smallest of so many tests can fall below `SIGNIFICANT`.

    Wilcoxon's least p of n pairs is 2 / 2**n, and Holm multiplies the smallest by their number.
    """
    return math.floor(math.log2(2 * max(tests, 1) / SIGNIFICANT)) + 1


def too_few_seeds(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Return the note that explains missing verdicts, if there are too few seeds for them."""
    if all(comparison.can_be_judged for comparison in comparisons):
        return ()
    least = least_seeds(len(comparisons[0].algorithms) - 1)
    return (f"Fewer than {least} seeds: too few to judge differences, so no verdicts.",)


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
        """Whether there are seeds enough for one against its rivals to differ significantly."""
        return len(self.seeds) >= least_seeds(len(self.algorithms) - 1)

    def values(self, algorithm: str, indicator: str) -> NDArray[np.float64]:
        """Return a field of `Quality` for every run, shape (seeds,)."""
        return np.array([getattr(q, indicator) for q in self.qualities[algorithm]], dtype=float)

    def seconds(self, algorithm: str) -> NDArray[np.float64]:
        """Return the wall time of every run, shape (seeds,)."""
        return np.array([run.seconds for run in self.runs[algorithm]])

    def traces(self, algorithm: str) -> list[NDArray[np.float64]]:
        """Return what every run noted on its way, see `trace.TracingEvaluator`."""
        return [run.trace for run in self.runs[algorithm] if run.trace is not None]

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
        equal = [int(np.sum(ours == values)) for values in theirs]
        tests = zip(rivals, adjusted.tolist(), better, equal, strict=True)
        return [PairedTest(*entry) for entry in tests]


@dataclass(frozen=True)
class Standing:
    """How the algorithms of a comparison stand by one indicator.

    Tests are Wilcoxon's on the same seeds, with Holm's correction over all pairs of algorithms.

    Attributes
    ----------
    ordered
        Names, the best mean first.
    level, behind, ahead
        Those that the tests do not tell from the first, those that are worse on the seeds' ranks,
        and those that are better though their mean is not; each with its p.
    same
        Groups of two names or more that have the same value on every seed.
    decidable
        Whether there are seeds enough for any pair to differ significantly.
    """

    ordered: tuple[str, ...]
    level: dict[str, float]
    behind: dict[str, float]
    ahead: dict[str, float]
    same: tuple[tuple[str, ...], ...]
    decidable: bool


def standing(comparison: Comparison, indicator: str) -> Standing:
    """Return who is ahead on an indicator of `Quality`, and who is level."""
    sign = 1.0 if smaller_is_better(indicator) else -1.0
    costs = {name: sign * comparison.values(name, indicator) for name in comparison.algorithms}
    best, *others = ordered = sorted(costs, key=lambda name: float(costs[name].mean()))
    pairs = list(combinations(ordered, 2))
    p = holm([wilcoxon_p(costs[one], costs[other]) for one, other in pairs]).tolist()
    # Pairs with the first come first.
    beside = dict(zip(others, p, strict=False))
    differ = [name for name in others if beside[name] < SIGNIFICANT]
    better = {name: effect_size(costs[name], costs[best]) > 0.5 for name in differ}
    groups: dict[bytes, tuple[str, ...]] = {}
    for name, of_one in costs.items():
        groups[of_one.tobytes()] = (*groups.get(of_one.tobytes(), ()), name)
    return Standing(
        tuple(ordered),
        {name: beside[name] for name in others if name not in differ},
        {name: beside[name] for name in differ if better[name]},
        {name: beside[name] for name in differ if not better[name]},
        tuple(names for names in groups.values() if len(names) > 1),
        len(comparison.seeds) >= least_seeds(len(pairs)),
    )


Job = OptimisationRun | OpenRun


def compare(
    setting: Setting, seeds: range, campaign: Campaign, algorithms: Sequence[str], title: str
) -> list[Comparison]:
    """Run every algorithm on every problem of the setting with every seed; measure final sets.

    ``algorithms`` are those of the table, unless the setting names others.
    """
    names = setting.algorithms or tuple(algorithms)
    entries = list(product(setting.problems, names, seeds))
    jobs = [_job(setting, *entry) for entry in entries]
    runs = campaign.run(jobs, title)
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
