"""Tables of a comparison of algorithms, beside the paper's numbers where it has them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.paired import Comparison, least_seeds, standing
from pymoo_hdte._comparing.published import AlgorithmQuality
from pymoo_hdte._comparing.runs import FINAL_SIZE
from pymoo_hdte._comparing.setting import Setting, in_words
from pymoo_hdte._comparing.statistics import summary
from pymoo_hdte._runner.result import Cell, Column, Finding, Table, significant
from pymoo_hdte.drive import PRESETS

WHO = (Column("problem"), Column("algorithm"))
TESTED = ("igd", "spacing", "hypervolume")


def answer(comparisons: Sequence[Comparison], seeds: range) -> str:
    """Say for every problem which algorithm is ahead by IGD, or which are level, with p."""
    return " ".join(_standing_in_words(comparison, in_words(seeds)) for comparison in comparisons)


def _standing_in_words(comparison: Comparison, seeds: str) -> str:
    found, where = standing(comparison, "igd"), f"On {comparison.model}, {seeds}"
    values = {name: comparison.values(name, "igd") for name in found.ordered}
    best, *others = found.ordered
    if not np.isfinite(values[best].mean()):
        return f"{where}: every algorithm has a run without a feasible design."
    means = {name: significant(float(of_one.mean()), 3) for name, of_one in values.items()}
    if not others:
        median = significant(float(np.median(values[best])), 3)
        return f"{where}: {best} has a mean IGD of {means[best]}, median {median}."
    end = f"; mean IGD {', '.join(f'{name} {mean}' for name, mean in means.items())}"
    end += "".join(f"; {_and(names)} have the same IGD on every seed" for names in found.same)
    if [len(names) for names in found.same] == [len(found.ordered)]:
        return f"{where}: no difference{end}."
    if not found.decidable:
        few = f"fewer than {least_seeds(math.comb(len(found.ordered), 2))} seeds"
        return f"{where}: undecided, {few} cannot show a difference{end}."
    clauses = []
    if found.level:
        least = significant(min(found.level.values()), 2)
        clauses.append(f"{_and([best, *found.level])} are level (p ≥ {least})")
    if found.behind:
        largest = significant(max(found.behind.values()), 2)
        clauses.append(f"{best} is ahead of {_and([*found.behind])} (p ≤ {largest})")
    if found.ahead:
        largest = significant(max(found.ahead.values()), 2)
        clauses.append(f"{_and([*found.ahead])} do better on most seeds (p ≤ {largest})")
    return f"{where}: {', '.join(clauses)}{end}."


def _and(names: Sequence[str]) -> str:
    """Join names as a sentence does."""
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]


def question(setting: Setting, comparisons: Sequence[Comparison]) -> str:
    """Ask what a comparison in another setting than the paper's answers."""
    names = _and(comparisons[0].algorithms)
    return (
        f"Which of {names} comes nearest to the front of "
        f"{_and(setting.problems)} within {setting.evaluations:,} evaluations?"
    )


def models_compared(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """Return what is said of the drive models among the problems compared."""
    return models_of(
        *(comparison.model for comparison in comparisons if comparison.model in PRESETS)
    )


def open_paragraphs(setting: Setting, comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Say what differs from the setting that the paper states; nothing if only the seeds do."""
    if setting.is_stated:
        return ()
    unions = [comparison.model for comparison in comparisons if not comparison.is_true]
    sentences = [
        "Not the setting of the paper, whose numbers are therefore left out: "
        f"{'; '.join(setting.differences())}.",
        f"Every run may spend {setting.evaluations:,} evaluations, with a population of "
        f"{setting.population} where the algorithm takes one, and its feasible, non-dominated "
        f"designs are thinned to at most {FINAL_SIZE} by crowding.",
        "IGD and Spacing come from pymoo, with ideal and nadir point of the reference front.",
        "p is that of paired Wilcoxon tests over the seeds, after Holm's correction: over all "
        "pairs of algorithms in the sentences, over the rivals of one in the table; level means "
        "that it is not below 5 %, not that there is no difference.",
    ]
    if unions:
        sentences.append(f"No true front is known of {', '.join(unions)}: the union of all runs.")
    return (" ".join(sentences), *_other_budgets(setting.evaluations, comparisons))


def _other_budgets(evaluations: int, comparisons: Sequence[Comparison]) -> Iterator[str]:
    for comparison in comparisons:
        for algorithm, spent in comparison.spent.items():
            if set(spent) != {evaluations}:
                few, many = min(spent), max(spent)
                shown = f"{few:,}" if few == many else f"{few:,} to {many:,}"
                yield (
                    f"On {comparison.model}, {algorithm} spent {shown} evaluations instead of "
                    f"{evaluations:,}."
                )


def subject(setting: Setting, of_the_paper: str) -> str:
    """Return the algorithm that the others are tested against: the first that was asked for."""
    return setting.algorithms[0] if setting.algorithms else of_the_paper


def quality_table(
    comparisons: Sequence[Comparison],
    published: Mapping[str, AlgorithmQuality],
    findings: Sequence[Finding],
) -> Table:
    """IGD and Spacing over the runs; the paper prints one number each."""

    def cells(comparison: Comparison, algorithm: str) -> Iterable[Cell]:
        paper = published.get(algorithm)
        for indicator in ("igd", "spacing"):
            yield from summary(comparison.values(algorithm, indicator))
            if published:
                yield getattr(paper, indicator) if paper else None

    columns = [
        column
        for name in ("IGD", "Spacing")
        for column in (*_summary_columns(name), *_paper_columns(name, published))
    ]
    return Table(
        "quality",
        "IGD and Spacing of the final sets, normalised by the reference front; smaller is better",
        (*WHO, *columns),
        _rows(comparisons, cells),
        findings=tuple(findings),
    )


def coverage_table(comparisons: Sequence[Comparison], findings: Sequence[Finding] = ()) -> Table:
    """Hypervolume, and pieces of the reference front that no solution comes near."""

    def cells(comparison: Comparison, algorithm: str) -> Iterable[Cell]:
        lost = comparison.values(algorithm, "lost_pieces")
        yield from summary(comparison.values(algorithm, "hypervolume"))
        yield len(comparison.truth.pieces)
        yield int(lost.sum())
        yield int((lost > 0).sum())

    columns = (
        *_summary_columns("hypervolume", digits=5),
        Column("of the reference front", group="pieces"),
        Column("lost in all runs", group="pieces"),
        Column("runs that lose one", group="pieces"),
    )
    title = "Hypervolume (reference point 1.1, 1.1; larger is better) and lost pieces of the front"
    rows = _rows(comparisons, cells)
    return Table("coverage", title, (*WHO, *columns), rows, findings=tuple(findings))


def paired_tests_table(comparisons: Sequence[Comparison], algorithm: str) -> Table:
    """Paired tests of ``algorithm`` against every other one."""
    rows = [
        (comparison.model, NAMES[indicator], test.rival, test.p, test.better, test.equal)
        for comparison in comparisons
        for indicator in TESTED
        for test in comparison.paired_tests(algorithm, indicator)
    ]
    columns = (
        Column("problem"),
        Column("indicator"),
        Column("rival"),
        Column("p, Wilcoxon with Holm", digits=2),
        Column(f"A12: {algorithm} better", digits=3),
        Column("seeds with equal values"),
    )
    title = f"{algorithm} against each rival on the same seeds (A12 = 0.5: no difference)"
    return Table("tests", title, columns, tuple(rows))


def runs_table(comparisons: Sequence[Comparison]) -> Table:
    """Every single run."""
    rows = [
        (comparison.model, algorithm, seed, spent, *quality)
        for comparison in comparisons
        for algorithm, qualities in comparison.qualities.items()
        for seed, spent, quality in zip(
            comparison.seeds, comparison.spent[algorithm], qualities, strict=True
        )
    ]
    names = ("seed", "evaluations", "IGD", "Spacing", "hypervolume", "lost pieces")
    columns = [Column(name) for name in names]
    return Table("runs", "Every run", (*WHO, *columns), tuple(rows), folded=True)


def times_table(
    comparisons: Sequence[Comparison],
    published: Mapping[str, AlgorithmQuality],
    findings: Sequence[Finding],
    evaluations: int,
) -> Table:
    """Wall time of a run, which no two executions repeat."""

    def cells(comparison: Comparison, algorithm: str) -> Iterable[Cell]:
        yield from summary(comparison.seconds(algorithm))
        if published:
            yield published[algorithm].seconds if algorithm in published else None

    columns = (*_summary_columns("time", "s"), *_paper_columns("time", published, "s", digits=4))
    title = f"Wall time of one run of {evaluations:,} evaluations, other runs going on beside it"
    rows = _rows(comparisons, cells)
    shown = tuple(findings)
    return Table("times", title, (*WHO, *columns), rows, findings=shown, wall_times=True)


def change(before: float, after: float) -> str:
    """Describe how ``after`` differs from ``before`` in percent, e.g. ``12 % below``."""
    if before == 0.0:
        return "equal to" if after == 0.0 else "above"
    percent = 100.0 * (after - before) / before
    return f"{significant(abs(percent), 2)} % {'above' if percent > 0 else 'below'}"


def _summary_columns(group: str, unit: str = "", digits: int = 3) -> tuple[Column, ...]:
    return (
        Column("mean", unit, digits, group),
        Column("median", unit, digits, group),
        Column("std", unit, 2, group),
    )


def _paper_columns(
    group: str, published: Mapping[str, AlgorithmQuality], unit: str = "", digits: int = 3
) -> tuple[Column, ...]:
    """Return the column of the paper's numbers, or none if they are not to stand here."""
    return (Column("paper", unit, digits, group, paper=True),) if published else ()


def _rows(
    comparisons: Sequence[Comparison], cells: Callable[[Comparison, str], Iterable[Cell]]
) -> tuple[tuple[Cell, ...], ...]:
    return tuple(
        (comparison.model, algorithm, *cells(comparison, algorithm))
        for comparison in comparisons
        for algorithm in comparison.algorithms
    )
