"""Algorithms compared on the same problems and seeds, against the true fronts of the surrogates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from experiments.comparison.quality import Quality, TrueFront
from experiments.comparison.runs import OptimisationRun, robust_problem
from experiments.comparison.statistics import effect_size, holm, wilcoxon_p
from experiments.runner.campaign import Run
from experiments.runner.registry import Context

MODELS = ("calibrated", "resonant")
"""Drive models on which algorithms are compared."""

SMALLER_IS_BETTER = {"igd": True, "spacing": True, "hypervolume": False, "lost_pieces": True}

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
    """Runs of several algorithms on one problem, in the order of their seeds."""

    model: str
    truth: TrueFront
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
        """Return the objectives (n, 2) of the run whose IGD is the (lower) median."""
        order = np.argsort(self.values(algorithm, "igd"), kind="stable")
        return objectives(self.runs[algorithm][order[(len(order) - 1) // 2]])

    def paired_tests(self, algorithm: str, indicator: str) -> list[PairedTest]:
        """Test ``algorithm`` against each of the others on one indicator."""
        rivals = [name for name in self.algorithms if name != algorithm]
        ours = self.values(algorithm, indicator)
        theirs = [self.values(rival, indicator) for rival in rivals]
        adjusted = holm([wilcoxon_p(ours, values) for values in theirs])
        better = [
            effect_size(values, ours) if SMALLER_IS_BETTER[indicator] else effect_size(ours, values)
            for values in theirs
        ]
        return [PairedTest(*entry) for entry in zip(rivals, adjusted.tolist(), better, strict=True)]


def compare(context: Context, algorithms: Sequence[str], title: str) -> list[Comparison]:
    """Run every algorithm on every problem with seeds 1..seeds and measure the final sets."""
    seeds = range(1, context.seeds + 1)
    truths = {model: TrueFront(true_front(model)) for model in MODELS}
    jobs = [OptimisationRun(*entry) for entry in product(MODELS, algorithms, seeds)]
    finished = dict(zip(jobs, context.campaign.run(jobs, title), strict=True))
    comparisons = []
    for model, truth in truths.items():
        runs = {
            algorithm: [finished[OptimisationRun(model, algorithm, seed)] for seed in seeds]
            for algorithm in algorithms
        }
        qualities = {
            algorithm: [truth.quality(objectives(run)) for run in of_algorithm]
            for algorithm, of_algorithm in runs.items()
        }
        comparisons.append(Comparison(model, truth, runs, qualities))
    return comparisons


def true_front(model: str) -> NDArray[np.float64]:
    """Return the stored true front of the surrogate of a drive model, shape (n, 2)."""
    front = robust_problem(model).pareto_front()
    if front is None:
        raise RuntimeError(f"no stored front of {model}: run python -m experiments reference_front")
    return front


def objectives(run: Run) -> NDArray[np.float64]:
    """Return the objectives of an `OptimisationRun`, shape (n, 2): its last two columns."""
    return run.values[:, -2:]


def designs(run: Run) -> NDArray[np.float64]:
    """Return the designs of an `OptimisationRun`, shape (n, 4): all columns but the last two."""
    return run.values[:, :-2]
