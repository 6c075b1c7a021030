"""What each part of the elitist swarm is worth: the same runs with a part missing or added.

Without ``--full`` the report is made from ``experiments/data/swarm_parts.csv``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.rivals import tests_of_medians
from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.contest.peers_data import Extent, Scores, scores_for
from experiments.studies.contest.peers_tables import OURS
from experiments.studies.contest.reduced_swarms import SWARM_VARIANTS
from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.ranks import medians
from pymoo_hdte._runner.result import Cell, Column, Result, Table

FULL = Extent(budgets=(10_000,), seeds=21)
QUICK = Extent(budgets=(2_500,), seeds=5)
RESAMPLES = 1000

(SETTING,) = paragraphs("swarm_parts")


def run(context: Context) -> Result:
    """Run the variants or read their outcome, and compare each with the whole."""
    scores = scores_for(context, "swarm_parts", [OURS, *SWARM_VARIANTS], FULL, QUICK)
    parts, harmful = _parts_table(scores)
    return Result(
        title="What each part of the elitist swarm is worth",
        command=context.command("swarm_parts"),
        answer="Changes that make the swarm worse beyond chance on the held-out problems, which "
        f"shows that the part helps: {', '.join(harmful) or 'none'}.",
        paragraphs=(*stored_outcome(context, "swarm_parts"), SETTING),
        tables=(parts, _problems_table(scores)),
        notes=(f"{len(scores.seeds)} seeds, {scores.budgets[-1]:,} evaluations.",),
    )


def _parts_table(scores: Scores) -> tuple[Table, list[str]]:
    """Give the cost of every change, apart for tuning and held-out problems, and what is worse."""
    rng = np.random.default_rng(1)
    columns = [Column("variant")]
    rows: list[list[Cell]] = [[name] for name in scores.algorithms[1:]]
    for group, tuning in (("tuning problems", True), ("held-out problems", False)):
        columns += [
            Column("cost", "", 3, group),
            Column("95 %", group=group),
            Column("worse on", group=group),
            Column("better on", group=group),
            Column("p", "", 2, group),
        ]
        runs = scores.of("igd", scores.budgets[-1], tuning=tuning)
        cost, low, high = costs(runs, rng)
        middle = medians(runs, smaller_is_better=True)
        tests = tests_of_medians(OURS, scores.algorithms, middle, "igd")
        for variant, (row, test) in enumerate(zip(rows, tests, strict=True), start=1):
            interval = f"{low[variant]:.3f}..{high[variant]:.3f}"
            row += [float(cost[variant]), interval, test.better, test.worse, test.p]
        # The finding is about the last group, the held-out problems.
        shown = [test.rival for test in tests if test.beaten]
    order = np.argsort(-cost[1:], kind="stable")
    table = Table(
        "parts",
        f"Cost of leaving out, simplifying or adding a part, in {NAMES['igd']}",
        tuple(columns),
        tuple(tuple(rows[i]) for i in order),
        note=f"{len(scores.rows(True))} tuning and {len(scores.rows(False))} held-out problems; "
        "worse and better count medians, p is Wilcoxon's over the problems, after Holm. The mean "
        "may rest on a few problems, which p does not; the interval knows the scatter of seeds "
        "only.",
    )
    return table, shown


def costs(
    runs: NDArray[np.float64], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the ratio to the first algorithm and its 95 % interval, shape (algorithms,) each.

    ``runs`` are distances, shape (problems, algorithms, seeds); an algorithm whose median run
    failed anywhere has an infinite ratio.
    """

    def ratio(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        logs = np.log(medians(drawn, smaller_is_better=True))
        return np.exp(np.mean(logs - logs[:, :1], axis=0))

    resampled = [
        ratio(np.take_along_axis(runs, rng.integers(runs.shape[-1], size=runs.shape), axis=-1))
        for _ in range(RESAMPLES)
    ]
    # Between an infinite sample and another there is nothing to interpolate.
    low, high = np.quantile(resampled, (0.025, 0.975), axis=0, method="inverted_cdf")
    return ratio(runs), low, high


def _problems_table(scores: Scores) -> Table:
    values = medians(scores.of("igd", scores.budgets[-1]), smaller_is_better=True)
    return Table(
        "problems",
        f"Median {NAMES['igd']} on every problem",
        (Column("problem"), *map(Column, scores.algorithms)),
        tuple(
            (problem, *row.tolist()) for problem, row in zip(scores.problems, values, strict=True)
        ),
        folded=True,
    )
