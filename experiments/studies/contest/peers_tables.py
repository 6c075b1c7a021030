"""Tables of ranks, medians and times of the peer comparison, all algorithms alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.indicators import NAMES, smaller_is_better
from experiments.comparing.ranks import average_ranks, friedman, medians, rank_intervals
from experiments.runner.result import Cell, Column, Table, significant
from experiments.studies.contest.peers_data import Scores, takes_part
from experiments.studies.contest.problems import BENCHMARKS

OURS = "ElitistSwarm"


def median_values(
    scores: Scores, indicator: str, evaluations: int, *, tuning: bool | None = None
) -> NDArray[np.float64]:
    """Return medians over the seeds, shape (problems, algorithms)."""
    values = scores.of(indicator, evaluations, tuning=tuning)
    return medians(values, smaller_is_better=smaller_is_better(indicator))


def median_ranks(
    scores: Scores, indicator: str, evaluations: int, *, tuning: bool
) -> NDArray[np.float64]:
    """Return average ranks of the medians over the seeds, shape (algorithms,)."""
    values = median_values(scores, indicator, evaluations, tuning=tuning)
    return average_ranks(values, smaller_is_better=smaller_is_better(indicator))


def in_one_sentence(scores: Scores) -> str:
    """Say who ranks best on the held-out problems, at every budget, by each indicator."""
    parts = []
    for evaluations in scores.budgets:
        best = dict[str, list[str]]()
        for indicator in ("igd", "igd_plus", "hypervolume"):
            ranks = median_ranks(scores, indicator, evaluations, tuning=False)
            first = int(np.argmin(ranks))
            words = f"{NAMES[indicator]} ({ranks[first]:.2f})"
            best.setdefault(scores.algorithms[first], []).append(words)
        told = ", ".join(f"{name} by {' and '.join(words)}" for name, words in best.items())
        parts.append(f"after {evaluations:,} evaluations {told}")
    return (
        f"Best of {len(scores.algorithms)} algorithms in average rank on the "
        f"{len(scores.rows(False))} held-out problems: {'; '.join(parts)}."
    )


def ranks_tables(scores: Scores) -> list[Table]:
    """Return average ranks of every algorithm, with what the seeds leave open, for each budget."""
    rng = np.random.default_rng(1)
    return [_ranks_table(scores, evaluations, rng) for evaluations in scores.budgets]


def _ranks_table(scores: Scores, evaluations: int, rng: np.random.Generator) -> Table:
    columns = [Column("algorithm")]
    cells: list[list[Cell]] = [[name] for name in scores.algorithms]
    tests = []
    for indicator, name in NAMES.items():
        columns += [Column("rank", "", 3, name), Column("95 %", "", 3, name)]
        values = scores.of(indicator, evaluations, tuning=False)
        better = smaller_is_better(indicator)
        middle = medians(values, smaller_is_better=better)
        ranks = average_ranks(middle, smaller_is_better=better)
        intervals = rank_intervals(values, rng, smaller_is_better=better)
        for row, rank, (low, high) in zip(cells, ranks, intervals, strict=True):
            row += [float(rank), f"{low:.1f}..{high:.1f}"]
        test = friedman(middle, smaller_is_better=better)
        tests.append(f"{name}: F = {significant(test.f, 3)}, p = {significant(test.f_p, 2)}")
    order = sorted(range(len(cells)), key=lambda row: float(cells[row][1] or 0.0))
    return Table(
        f"ranks_{evaluations}",
        f"Average ranks over the {len(scores.rows(False))} held-out problems at {evaluations:,} "
        "evaluations, 1 being the best",
        tuple(columns),
        tuple(tuple(cells[row]) for row in order),
        note="Ranks of medians over the seeds; intervals by bootstrap over the seeds. An algorithm "
        "that cannot take a problem ranks last there. That all rank alike, by Iman and Davenport's "
        "form of Friedman's test: " + "; ".join(tests) + ".",
    )


def tuning_table(scores: Scores) -> Table:
    """Average ranks on the problems that our algorithm was tuned on, which prove nothing."""
    ranks = {
        (evaluations, indicator): median_ranks(scores, indicator, evaluations, tuning=True)
        for evaluations in scores.budgets
        for indicator in NAMES
    }
    columns = [Column(NAMES[i], "", 3, f"{evaluations:,} evaluations") for evaluations, i in ranks]
    order = np.argsort(next(iter(ranks.values())), kind="stable")
    return Table(
        "tuning",
        f"Average ranks over the {len(scores.rows(True))} problems that tuning saw",
        (Column("algorithm"), *columns),
        tuple((scores.algorithms[i], *(float(r[i]) for r in ranks.values())) for i in order),
    )


def reductions_table(scores: Scores) -> Table:
    """Average ranks when the final sets are thinned out by another rule."""
    columns, ranks = [Column("algorithm")], []
    for evaluations in scores.budgets:
        for measure in ("igd", "igd_crowding", "hypervolume", "hypervolume_crowding"):
            rule = "by crowding" if measure.endswith("_crowding") else "evenly"
            name = NAMES[measure.removesuffix("_crowding")]
            columns.append(Column(rule, "", 3, f"{name}, {evaluations:,}"))
            ranks.append(median_ranks(scores, measure, evaluations, tuning=False))
    order = np.argsort(ranks[0], kind="stable")
    return Table(
        "reductions",
        "Average ranks on the held-out problems by the rule that thins out the final sets",
        tuple(columns),
        tuple((scores.algorithms[i], *(float(rank[i]) for rank in ranks)) for i in order),
        note="Thinning out evenly is the rule by which the elitist swarm itself survives, crowding "
        "that of NSGA-II, MOPSO-CD, SMPSO and OMOPSO.",
    )


def medians_tables(scores: Scores) -> list[Table]:
    """Return the medians of every algorithm on every problem, an indicator and budget each."""
    return [
        Table(
            f"medians_{indicator}_{evaluations}",
            f"Median {NAMES[indicator]} of the seeds at {evaluations:,} evaluations",
            (Column("problem"), Column("kind"), *map(Column, scores.algorithms)),
            tuple(
                (problem, _kind(problem), *_cells(scores.algorithms, problem, row))
                for problem, row in zip(
                    scores.problems, median_values(scores, indicator, evaluations), strict=True
                )
            ),
            folded=True,
        )
        for evaluations in scores.budgets
        for indicator in NAMES
    ]


def _cells(algorithms: Sequence[str], problem: str, row: NDArray[np.float64]) -> list[Cell]:
    return [
        float(value) if takes_part(algorithm, problem) else None
        for algorithm, value in zip(algorithms, row, strict=True)
    ]


def _kind(problem: str) -> str:
    return "tuning" if BENCHMARKS[problem].tuning else "held out"


def times_table(scores: Scores) -> Table:
    """Wall time of a run of the largest budget."""
    rows = [
        (name, *np.nanquantile(column, (0.5, 0.1, 0.9)).tolist())
        for name, column in zip(scores.algorithms, scores.seconds.T, strict=True)
    ]
    return Table(
        "times",
        f"Wall time of a run of {scores.budgets[-1]:,} evaluations, evaluation included",
        (
            Column("algorithm"),
            Column("median problem", "s", 2),
            Column("a tenth below", "s", 2),
            Column("a tenth above", "s", 2),
        ),
        tuple(rows[i] for i in np.argsort(np.nanmedian(scores.seconds, axis=0), kind="stable")),
        note="Other runs went on beside these; python -m experiments benchmark measures the ratio "
        "to NSGA-II in one run.",
        wall_times=True,
    )
