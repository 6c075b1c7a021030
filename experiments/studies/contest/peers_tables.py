"""Tables of ranks, medians and times of the peer comparison, all algorithms alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu

from experiments.comparing.rivals import better_than_each, tests_of_medians
from experiments.studies.contest.peers_data import Scores, takes_part
from experiments.studies.contest.problems import BENCHMARKS
from pymoo_hdte._comparing.indicators import NAMES, smaller_is_better
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.ranks import average_ranks, friedman, medians, rank_intervals
from pymoo_hdte._comparing.statistics import median, state_of
from pymoo_hdte._runner.result import (
    Cell,
    Column,
    Finding,
    Table,
    scored,
    signed_percent,
    significant,
)

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
        words_of = ", ".join(f"{name} by {' and '.join(words)}" for name, words in best.items())
        parts.append(f"after {evaluations:,} evaluations {words_of}")
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


FAITHFUL = "AMP-MOPSO"
SUBSETS: dict[str, tuple[str, ...]] = {
    "all": (),
    "without WFG": ("WFG",),
    "without WFG and rotated ZDT": ("WFG", "ZDT rotated"),
}
"""Subsets of the held-out problems, with the families left out."""
SPACING_PLACE = 3
MOVED_ZDT4_IGD = 0.3


def must_reach_table(scores: Scores) -> Table:
    """Hold the scores against what was demanded before the comparison was run."""
    rows: list[tuple[Cell, ...]] = []
    for evaluations in scores.budgets:
        for indicator, place in (("igd", 1), ("hypervolume", 1), ("spacing", SPACING_PLACE)):
            rows.append(_place_row(scores, indicator, evaluations, place))
        for indicator in ("igd", "hypervolume"):
            rows.append(_beyond_chance_row(scores, indicator, evaluations))
        rows.append(_faithful_row(scores, evaluations))
        rows.append(_moved_row(scores, evaluations))
    return Table(
        "must_reach",
        "What was demanded, and what came out",
        (
            Column("demand"),
            Column("evaluations"),
            Column("measured"),
            Column("best rival"),
            Column("state"),
        ),
        tuple(rows),
        note="On the held-out problems, but for the last two demands: the faithful version is "
        "compared on all problems, and moved ZDT4 is one that tuning saw. Tests over problems are "
        "Wilcoxon's with Holm's correction. Against the faithful version each problem is tested on "
        "its own (Mann-Whitney, 2.5 % on this side), so that one or two may be chance. A place is "
        "shown if few enough rivals are not beaten beyond chance, never worse if ours is better on "
        "each problem, a median if its 95 % interval is on the right side.",
        findings=tuple(_finding(row) for row in rows),
    )


def _finding(row: tuple[Cell, ...]) -> Finding:
    asked, evaluations, measured, beside, state = row
    words = f"{asked}, after {evaluations:,} evaluations: {measured}"
    words += f" ({beside})" if beside else ""
    return scored(str(state).capitalize(), f"{OURS}: {words}.")


def _place_row(scores: Scores, indicator: str, evaluations: int, place: int) -> tuple[Cell, ...]:
    ranks = median_ranks(scores, indicator, evaluations, tuning=False)
    ours, best, rank = _ours_and_best(scores.algorithms, ranks)
    reached = 1 + int(np.sum(ranks < ours))
    values = median_values(scores, indicator, evaluations, tuning=False)
    tests = tests_of_medians(OURS, scores.algorithms, values, indicator)
    unbeaten = sum(not test.beaten for test in tests)
    return (
        f"place {place}{' or better' if place > 1 else ''} by average rank, {NAMES[indicator]}",
        evaluations,
        f"place {reached} of {len(scores.algorithms)}, rank {ours:.2f}",
        f"{best}, rank {rank:.2f}",
        state_of(reached <= place, shown=unbeaten < place).lower(),
    )


def _ours_and_best(
    algorithms: Sequence[str], values: NDArray[np.float64]
) -> tuple[float, str, float]:
    """Return our value, and which rival has the smallest and how small; shape (algorithms,)."""
    rivals = dict(zip(algorithms, values.tolist(), strict=True))
    ours = rivals.pop(OURS)
    best = min(rivals, key=lambda name: rivals[name])
    return ours, best, rivals[best]


def _beyond_chance_row(scores: Scores, indicator: str, evaluations: int) -> tuple[Cell, ...]:
    values = median_values(scores, indicator, evaluations, tuning=False)
    tests = tests_of_medians(OURS, scores.algorithms, values, indicator)
    unbeaten = [
        f"{test.rival} (p = {significant(test.p, 2)}, {test.better}:{test.worse})"
        for test in tests
        if not test.beaten
    ]
    return (
        f"better than every peer beyond chance, {NAMES[indicator]}",
        evaluations,
        f"{len(tests) - len(unbeaten)} of {len(tests)} peers",
        f"not: {', '.join(unbeaten)}" if unbeaten else None,
        better_than_each(tests).lower(),
    )


def _faithful_row(scores: Scores, evaluations: int) -> tuple[Cell, ...]:
    ours, faithful = (scores.algorithms.index(name) for name in (OURS, FAITHFUL))
    worse, better = [], []
    for indicator in ("igd", "hypervolume"):
        sides = ("greater", "less") if smaller_is_better(indicator) else ("less", "greater")
        for problem, runs in zip(scores.problems, scores.of(indicator, evaluations), strict=True):
            behind, ahead = (
                mannwhitneyu(runs[ours], runs[faithful], alternative=side).pvalue < SIGNIFICANT / 2
                for side in sides
            )
            better.append(ahead)
            if behind:
                change = _change(np.median(runs[ours]), np.median(runs[faithful]))
                worse.append(f"{problem} ({NAMES[indicator]}{change})")
    return (
        f"never worse than {FAITHFUL} beyond the noise",
        evaluations,
        f"worse on {', '.join(worse)}" if worse else "worse on no problem",
        None,
        state_of(not worse, shown=all(better)).lower(),
    )


def _change(value: float, reference: float) -> str:
    """Say how far a median lies from another, where that can be said in per cent."""
    if not (np.isfinite([value, reference]).all() and reference):
        return ""
    return f", {signed_percent([100.0 * (value / reference - 1.0)])}"


def _moved_row(scores: Scores, evaluations: int) -> tuple[Cell, ...]:
    place = scores.problems.index("ZDT4-moved")
    row = median_values(scores, "igd", evaluations)[place]
    ours, best, value = _ours_and_best(scores.algorithms, row)
    runs = scores.of("igd", evaluations)[place, scores.algorithms.index(OURS)]
    return (
        f"median IGD on moved ZDT4 below {MOVED_ZDT4_IGD}",
        evaluations,
        significant(ours, 2),
        f"{best}, {significant(value, 2)}",
        median(runs.tolist()).state(MOVED_ZDT4_IGD, at_least=False).lower(),
    )


def rivals_table(scores: Scores) -> Table:
    """Test our algorithm against every rival on the held-out problems."""
    columns = [Column("rival"), Column("evaluations")]
    for name in ("IGD", "hypervolume"):
        columns += [
            Column("p", digits=2, group=name),
            *(Column(word, group=name) for word in ("better", "worse")),
        ]
    rows: dict[tuple[str, int], list[Cell]] = {}
    for evaluations in scores.budgets:
        for indicator in ("igd", "hypervolume"):
            values = median_values(scores, indicator, evaluations, tuning=False)
            tests = tests_of_medians(OURS, scores.algorithms, values, indicator)
            for test in tests:
                row = rows.setdefault((test.rival, evaluations), [test.rival, evaluations])
                row += [test.p, test.better, test.worse]
    return Table(
        "rivals",
        f"{OURS} against every rival on the held-out problems",
        tuple(columns),
        tuple(tuple(row) for _, row in sorted(rows.items(), key=lambda item: item[0][1])),
        note="p is Wilcoxon's over the problems, after Holm. Better and worse compare medians.",
    )


def subsets_table(scores: Scores) -> Table:
    """Rank again without the held-out families that may favour our algorithm."""
    columns = [Column("held-out problems"), Column("number"), Column("evaluations")]
    for indicator in ("igd", "hypervolume"):
        heads = (OURS, "best rival", "its rank", "beaten")
        columns += [Column(head, "", 3, NAMES[indicator]) for head in heads]
    families = np.array([BENCHMARKS[scores.problems[row]].family for row in scores.rows(False)])
    rows: list[tuple[Cell, ...]] = []
    for subset, left_out in SUBSETS.items():
        chosen = ~np.isin(families, left_out)
        if not chosen.any():
            continue
        for evaluations in scores.budgets:
            cells: list[Cell] = [subset, int(chosen.sum()), evaluations]
            for indicator in ("igd", "hypervolume"):
                values = median_values(scores, indicator, evaluations, tuning=False)[chosen]
                cells += _standing(scores.algorithms, values, indicator)
            rows.append(tuple(cells))
    return Table(
        "subsets",
        "Average ranks on parts of the held-out problems",
        tuple(columns),
        tuple(rows),
        note="An earlier prototype of the elitist swarm had been judged on WFG, and the rotated "
        "problems are relatives of some that tuning saw. Fewer problems also give the tests less "
        "power. Beaten are rivals that ours is better than beyond chance.",
    )


def _standing(
    algorithms: Sequence[str], medians: NDArray[np.float64], indicator: str
) -> list[Cell]:
    ranks = average_ranks(medians, smaller_is_better=smaller_is_better(indicator))
    tests = tests_of_medians(OURS, algorithms, medians, indicator)
    won = sum(test.beaten for test in tests)
    return [*_ours_and_best(algorithms, ranks), f"{won} of {len(tests)}"]
