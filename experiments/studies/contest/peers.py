"""The elitist swarm against the best peers, on problems it was tuned on and on others.

Without an option the report is made from ``experiments/data/peers.csv``, the committed outcome of
the last full comparison; with ``--full`` the comparison runs (hours), goes on where it was
interrupted, and leaves the same files in the results folder; with ``--quick`` a small one runs
(minutes).
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from experiments.comparing.contestants import CONTESTANTS
from experiments.comparing.peers_pymoo import POPULATION
from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.contest.peers_data import FINAL_SIZE, Extent, Scores, scores_for
from experiments.studies.contest.peers_tables import (
    OURS,
    in_one_sentence,
    median_ranks,
    median_values,
    medians_tables,
    must_reach_table,
    ranks_tables,
    reductions_table,
    rivals_table,
    subsets_table,
    times_table,
)
from experiments.studies.contest.problems import BENCHMARKS
from pymoo_hdte._comparing.figures import critical_difference_plot, rank_heatmap
from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.ranks import nemenyi_difference, problem_ranks
from pymoo_hdte._runner.result import NEW, Picture, Result

FULL = Extent(budgets=(10_000, 25_000), seeds=21)
QUICK = Extent(budgets=(2_500,), seeds=5)

SETTING, HELD_OUT, PEERS_NOTE = paragraphs("peers", final_size=FINAL_SIZE)


def _new(scores: Scores) -> str:
    """Say for the first page how our swarm ranks at the largest budget, where it ranks worst."""
    ours, evaluations, places = scores.algorithms.index(OURS), scores.budgets[-1], []
    for indicator in ("igd", "hypervolume"):
        ranks = median_ranks(scores, indicator, evaluations, tuning=False)
        places.append(f"{1 + int(np.sum(ranks < ranks[ours]))} by {NAMES[indicator]}")
    return (
        f"a swarm without settings whose average rank on {len(scores.rows(False))} held-out "
        f"problems takes place {' and '.join(places)} among {len(scores.algorithms)} algorithms "
        f"after {evaluations:,} evaluations"
    )


def run(context: Context) -> Result:
    """Run the comparison or read its outcome, and rank."""
    present = [name for name, entry in CONTESTANTS.items() if entry.available]
    scores = scores_for(context, "peers", present, FULL, QUICK)
    return Result(
        title="The elitist swarm against its peers",
        command=context.command("peers"),
        answer=in_one_sentence(scores),
        paragraphs=(*stored_outcome(context, "peers"), SETTING, HELD_OUT, PEERS_NOTE),
        tables=(
            must_reach_table(scores),
            *ranks_tables(scores),
            subsets_table(scores),
            rivals_table(scores),
            reductions_table(scores),
            *medians_tables(scores),
            times_table(scores),
        ),
        pictures=tuple(_pictures(scores)),
        notes=(*_extent(scores), *_absent(scores), *_broken_off(scores), *_without_volume(scores)),
        first_page={NEW: _new(scores)},
    )


def _absent(scores: Scores) -> list[str]:
    return [
        f"{name} did not take part: {entry.library} is not installed (pip install '.[peers]')."
        for name, entry in CONTESTANTS.items()
        if name not in scores.algorithms
    ]


def _extent(scores: Scores) -> list[str]:
    budgets = ", ".join(f"{budget:,}" for budget in scores.budgets)
    return [
        f"{len(scores.problems)} problems, {len(scores.algorithms)} algorithms, "
        f"{len(scores.seeds)} seeds (of {FULL.seeds} in full), budgets of {budgets}."
    ]


def _broken_off(scores: Scores) -> list[str]:
    # A generation has at most 100 solutions, the population of all algorithms.
    least = np.array(scores.budgets)[:, np.newaxis] - POPULATION
    early = (scores.spent > 0) & (scores.spent < least)
    counts = dict(zip(scores.algorithms, early[:, :, -1].sum(axis=(0, 2)).tolist(), strict=True))
    runs = [f"{count} of {name}" for name, count in counts.items() if count]
    if not runs:
        return []
    return [f"Runs that broke off by themselves, judged by what they held: {', '.join(runs)}."]


def _without_volume(scores: Scores) -> list[str]:
    values = scores.of("hypervolume", scores.budgets[-1])
    best = np.nanmax(values.reshape(len(scores.problems), -1), axis=1)
    empty = [name for name, value in zip(scores.problems, best, strict=True) if value == 0.0]
    if not empty:
        return []
    return [f"No run dominates any hypervolume on {', '.join(empty)}: a tie of all there."]


def _pictures(scores: Scores) -> list[Picture]:
    evaluations = scores.budgets[-1]
    pictures = []
    for indicator in ("igd", "hypervolume"):
        ranks = median_ranks(scores, indicator, evaluations, tuning=False)
        difference = nemenyi_difference(len(ranks), len(scores.rows(False)))
        pictures.append(
            Picture(
                f"difference_{indicator}",
                f"Average ranks by {NAMES[indicator]} on the held-out problems at {evaluations:,} "
                "evaluations. A bar joins algorithms that do not differ (Nemenyi, 5 %).",
                critical_difference_plot(scores.algorithms, ranks, difference, OURS),
            )
        )
    pictures.append(
        Picture(
            "ranks",
            f"Rank by median IGD at {evaluations:,} evaluations on every problem.",
            _heatmap(scores, evaluations),
        )
    )
    return pictures


def _heatmap(scores: Scores, evaluations: int) -> Figure:
    ranks = problem_ranks(median_values(scores, "igd", evaluations), smaller_is_better=True)
    order = np.argsort(ranks[scores.rows(False)].mean(axis=0), kind="stable")
    groups = ["tuning" if BENCHMARKS[p].tuning else "held out" for p in scores.problems]
    names = [scores.algorithms[column] for column in order]
    return rank_heatmap(ranks[:, order], scores.problems, groups, names, OURS)
