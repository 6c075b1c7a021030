"""Pictures of a comparison: fronts, IGD of every run, targets reached, and average ranks."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from pymoo_hdte._comparing.figures import (
    critical_difference_plot,
    fronts,
    igd_of_runs,
    targets_reached,
)
from pymoo_hdte._comparing.paired import Comparison
from pymoo_hdte._comparing.ranks import average_ranks, nemenyi_difference
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._comparing.trace import TARGETS, profile
from pymoo_hdte._runner.result import Picture


def file_name(name: str) -> str:
    """Return the name of a problem or an algorithm as part of the name of a file."""
    return re.sub(r"[^\w.-]", "..", name)


def front_pictures(comparisons: Sequence[Comparison], like: str = "") -> tuple[Picture, ...]:
    """Return a picture of the median runs on every problem; ``like`` names one of the paper's."""
    begin = f"as {like}, " if like else ""
    pictures = []
    for comparison in comparisons:
        grey = "the reference front"
        if len(comparison.objectives) > 3:
            grey = f"{grey}, from its least to its largest value in each objective"
        caption = (
            f"Fronts on {comparison.model}: {begin}for every algorithm the run of median IGD; grey "
            f"is {grey}."
        )
        name = f"fronts_{file_name(comparison.model)}"
        pictures.append(Picture(name, caption, fronts(comparison)))
    return tuple(pictures)


def run_pictures(
    comparisons: Sequence[Comparison], setting: Setting, highlight: str
) -> tuple[Picture, ...]:
    """Return pictures of all runs: IGD, targets reached over evaluations, average ranks."""
    algorithms = comparisons[0].algorithms
    profiles = [
        profile(
            [(trace, one.truth) for one in comparisons for trace in one.traces(algorithm)],
            setting.evaluations,
        )
        for algorithm in algorithms
    ]
    pictures = [
        Picture("igd", "IGD of every run: bars mark the medians.", igd_of_runs(comparisons)),
        Picture(
            "targets",
            f"Targets reached: share of {len(TARGETS)} targets a run that had been reached by each "
            f"number of evaluations, over all {_runs(comparisons)}. A target is a hypervolume of "
            "all found so far that lacks 79 to 0.1 % of the reference front's, in equal steps of "
            "the logarithm. Higher is better.",
            targets_reached(comparisons, profiles),
        ),
    ]
    if len(algorithms) > 1:
        igd = np.vstack(
            [np.column_stack([one.values(name, "igd") for name in algorithms])
             for one in comparisons]
        )  # fmt: skip
        ranks = average_ranks(igd, smaller_is_better=True)
        difference = nemenyi_difference(len(algorithms), len(igd))
        pictures.append(
            Picture(
                "ranks",
                f"Average ranks: by IGD over all {_runs(comparisons)}; 1 is best, ties share their "
                "rank. Bars join algorithms that differ by less than the critical difference of "
                "Nemenyi's test at 5 %. This speaks of these problems alone: its blocks are "
                "runs, not problems.",
                critical_difference_plot(algorithms, ranks, difference, highlight),
            )
        )
    return tuple(pictures)


def _runs(comparisons: Sequence[Comparison]) -> str:
    problems, seeds = len(comparisons), len(comparisons[0].seeds)
    of = f"{problems} problems with {seeds}" if problems > 1 else f"{seeds}"
    return f"{of} seed{'s' if seeds > 1 else ''}{' each' if problems > 1 else ''}"
