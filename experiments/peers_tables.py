"""Tables of the peer comparison."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.contest.problems import BENCHMARKS
from experiments.indicators import SMALLER_IS_BETTER
from experiments.peers_data import Scores, takes_part
from experiments.ranks import (
    RivalTest,
    average_ranks,
    friedman,
    holm_against,
    medians,
    outcomes,
    rank_intervals,
    win_tie_loss,
)
from experiments.result import Cell, Column, Finding, Table, significant

OURS = "ElitistSwarm"
FAITHFUL = "AMP-MOPSO"
NAMES = {
    "igd": "IGD",
    "igd_plus": "IGD+",
    "hypervolume": "hypervolume",
    "spacing": "Spacing",
}
SPACING_PLACE = 3
MOVED_ZDT4_IGD = 0.3


def smaller_is_better(indicator: str) -> bool:
    """Return whether a smaller value of an indicator is better."""
    return getattr(SMALLER_IS_BETTER, indicator)


def median_values(
    scores: Scores, indicator: str, evaluations: int, *, tuning: bool | None = None
) -> NDArray[np.float64]:
    """Return medians over the seeds, shape (problems, algorithms)."""
    values = scores.of(indicator, evaluations, tuning=tuning)
    return medians(values, smaller_is_better=smaller_is_better(indicator))


def must_reach_table(scores: Scores) -> Table:
    """Hold the scores against what was demanded before the comparison was run."""
    findings = []
    for evaluations in scores.budgets:
        for indicator, place in (("igd", 1), ("hypervolume", 1), ("spacing", SPACING_PLACE)):
            findings.append(_place_finding(scores, indicator, evaluations, place))
        findings.append(_faithful_finding(scores, evaluations))
        if "ZDT4-moved" in scores.problems:
            findings.append(_moved_finding(scores, evaluations))
    rows = tuple(("yes" if finding.agrees else "no", finding.sentence) for finding in findings)
    return Table(
        "must_reach",
        "What was demanded, and what came out",
        (Column("met"), Column("finding")),
        rows,
        note="Only held-out problems count, but for moved ZDT4, which is one that tuning saw.",
    )


def _place_finding(scores: Scores, indicator: str, evaluations: int, place: int) -> Finding:
    values = median_values(scores, indicator, evaluations, tuning=False)
    better = smaller_is_better(indicator)
    ranks = average_ranks(values, smaller_is_better=better)
    ours = scores.algorithms.index(OURS)
    reached = 1 + int(np.sum(ranks < ranks[ours]))
    tests = _rival_tests(scores, indicator, evaluations)
    beaten = [t.rival for t in tests if t.p < 0.05 and t.better > t.worse]
    ahead = [t.rival for t in tests if t.p < 0.05 and t.better < t.worse]
    rivals = len(scores.algorithms) - 1
    best = scores.algorithms[int(np.argmin(np.where(np.arange(len(ranks)) == ours, 99, ranks)))]
    sentence = (
        f"{NAMES[indicator]} at {evaluations:,} evaluations: place {reached} of "
        f"{len(scores.algorithms)} by average rank ({ranks[ours]:.2f}; the best rival, {best}, has "
        f"{ranks[scores.algorithms.index(best)]:.2f}); better than {len(beaten)} of {rivals} "
        "rivals beyond chance (Wilcoxon over the problems, Holm)"
        + (f", worse than {', '.join(ahead)}" if ahead else "")
        + f". Demanded: place {place}{'' if place == 1 else ' or better'}."
    )
    return Finding(reached <= place, sentence, check=True)


def _rival_tests(scores: Scores, indicator: str, evaluations: int) -> list[RivalTest]:
    values = median_values(scores, indicator, evaluations, tuning=False)
    better = smaller_is_better(indicator)
    # Ratios of distances mean the same on all problems, differences of hypervolumes do as well.
    compared = np.log(values) if better else values
    return holm_against(OURS, scores.algorithms, compared, smaller_is_better=better)


def _faithful_finding(scores: Scores, evaluations: int) -> Finding:
    pair = (OURS, FAITHFUL)
    columns = [scores.algorithms.index(name) for name in pair]
    worse = []
    for indicator in ("igd", "hypervolume"):
        values = scores.of(indicator, evaluations)[:, columns]
        verdicts = outcomes(OURS, pair, values, smaller_is_better=smaller_is_better(indicator))[
            :, 0
        ]
        lost = [scores.problems[row] for row in np.flatnonzero(verdicts < 0)]
        worse += [f"{problem} ({NAMES[indicator]})" for problem in lost]
    sentence = (
        f"Against the faithful {FAITHFUL} at {evaluations:,} evaluations, worse beyond the noise "
        f"on {', '.join(worse) if worse else 'no problem'} (IGD and hypervolume, Mann-Whitney with "
        "Holm)."
    )
    return Finding(not worse, sentence, check=True)


def _moved_finding(scores: Scores, evaluations: int) -> Finding:
    values = median_values(scores, "igd", evaluations)
    value = values[scores.problems.index("ZDT4-moved"), scores.algorithms.index(OURS)]
    sentence = (
        f"Median IGD on moved ZDT4 at {evaluations:,} evaluations: {significant(value, 2)}; "
        f"demanded: below {MOVED_ZDT4_IGD}."
    )
    return Finding(bool(value < MOVED_ZDT4_IGD), sentence, check=True)


def ranks_table(scores: Scores) -> Table:
    """Average ranks of every algorithm, with what the seeds leave open."""
    rng = np.random.default_rng(1)
    columns = [Column("algorithm")]
    cells: list[list[Cell]] = [[name] for name in scores.algorithms]
    for evaluations in scores.budgets:
        for indicator, name in NAMES.items():
            group = f"{name}, {evaluations:,}"
            columns += [Column("rank", "", 3, group), Column("95 %", "", 3, group)]
            values = scores.of(indicator, evaluations, tuning=False)
            better = smaller_is_better(indicator)
            ranks = average_ranks(
                medians(values, smaller_is_better=better), smaller_is_better=better
            )
            intervals = rank_intervals(values, rng, smaller_is_better=better)
            for row, rank, (low, high) in zip(cells, ranks, intervals, strict=True):
                row += [float(rank), f"{low:.1f}..{high:.1f}"]
    order = sorted(range(len(cells)), key=lambda row: float(cells[row][1] or 0.0))
    tests = [
        f"{NAMES[indicator]} at {evaluations:,}: chi-square "
        f"{significant(test.chi_square, 3)}, p = {significant(test.f_p, 2)}"
        for evaluations in scores.budgets
        for indicator in NAMES
        for test in [
            friedman(
                median_values(scores, indicator, evaluations, tuning=False),
                smaller_is_better=smaller_is_better(indicator),
            )
        ]
    ]
    return Table(
        "ranks",
        f"Average ranks over the {len(scores.rows(False))} held-out problems, 1 being the best",
        tuple(columns),
        tuple(tuple(cells[row]) for row in order),
        note="Ranks of medians over the seeds; intervals by bootstrap over the seeds. An algorithm "
        "that cannot take a problem ranks last there. Friedman's test that all rank alike: "
        + "; ".join(tests)
        + ".",
    )


def tuning_table(scores: Scores) -> Table:
    """Average ranks on the problems that our algorithm was tuned on, which prove nothing."""
    ranks = {
        (evaluations, indicator): average_ranks(
            median_values(scores, indicator, evaluations, tuning=True),
            smaller_is_better=smaller_is_better(indicator),
        )
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


def rivals_table(scores: Scores) -> Table:
    """Test our algorithm against every rival on the held-out problems."""
    columns = [Column("rival"), Column("evaluations")]
    for name in ("IGD", "hypervolume"):
        columns += [
            Column("p, Wilcoxon with Holm", digits=2, group=name),
            *(Column(word, group=name) for word in ("better", "worse")),
            *(Column(word, group=f"{name}, single problems") for word in ("win", "tie", "loss")),
        ]
    rows: dict[tuple[str, int], list[Cell]] = {}
    for evaluations in scores.budgets:
        for indicator in ("igd", "hypervolume"):
            counts = win_tie_loss(
                OURS,
                scores.algorithms,
                scores.of(indicator, evaluations, tuning=False),
                smaller_is_better=smaller_is_better(indicator),
            )
            for test, count in zip(
                _rival_tests(scores, indicator, evaluations), counts, strict=True
            ):
                row = rows.setdefault((test.rival, evaluations), [test.rival, evaluations])
                row += [test.p, test.better, test.worse, count.wins, count.ties, count.losses]
    return Table(
        "rivals",
        f"{OURS} against every rival on the held-out problems",
        tuple(columns),
        tuple(tuple(row) for _, row in sorted(rows.items(), key=lambda item: item[0][1])),
        note="Better and worse compare medians. Win and loss are problems on which the runs differ "
        "beyond chance (Mann-Whitney, Holm over all problems and rivals), so a tie is no equality.",
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
