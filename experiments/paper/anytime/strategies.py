"""The ablation at every budget: what the pyramid and the entropy weight each give."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from experiments.comparing.indicators import NAMES
from experiments.paper.anytime.data import Contested, Scores
from experiments.paper.anytime.duels import Duel, duels
from experiments.paper.anytime.tables import WHERE, drawn, duel_cells, duel_columns, exactly
from experiments.runner.result import Cell, Column, Finding, Table

STRATEGIES = (
    ("pyramid", "MP-MOPSO", "MOPSO"),
    ("pyramid", "AMP-MOPSO", "A-MOPSO"),
    ("entropy weight", "A-MOPSO", "MOPSO"),
    ("entropy weight", "AMP-MOPSO", "MP-MOPSO"),
)
"""A strategy, an algorithm that has it, and the same without."""


def strategies_table(scores: Scores) -> Table:
    """Say what the pyramid and the entropy weight give at every population and budget."""
    rows: dict[tuple[Cell, ...], list[Cell]] = {}
    columns = [*WHERE, *(Column(n) for n in ("population", "evaluations", "strategy", "in"))]
    for indicator in ("igd", "spacing"):
        columns += duel_columns(NAMES[indicator])
        for contested, strategy, pair, entries in strategies(scores, indicator):
            for duel in entries:
                setting = duel.population, duel.evaluations, strategy, pair
                where = contested.model, contested.velocity, *setting
                rows.setdefault(where, []).extend(duel_cells(duel))
    return Table(
        "strategies",
        "The ablation at every budget: with the strategy against without",
        tuple(columns),
        tuple((*where, *cells) for where, cells in rows.items()),
        note="A ratio of the means below 1 and an A12 above 0.5: better with the strategy. p is "
        "Wilcoxon's after Holm's correction over the populations and budgets of a pair.",
        folded=True,
    )


def gains_table(scores: Scores) -> Table:
    """Say in a word for every population and budget what each strategy gives by IGD."""
    rows: list[tuple[Cell, ...]] = []
    for contested, strategy, pair, entries in strategies(scores, "igd"):
        where = contested.model, contested.velocity, strategy, pair
        for population, of_population in groupby(entries, key=lambda duel: duel.population):
            rows.append((*where, population, *map(_gain, of_population)))
    budgets = [Column(f"{budget:,}", group="evaluations") for budget in scores.budgets()]
    first = (*WHERE, Column("strategy"), Column("in"), Column("population"))
    return Table(
        "gains",
        "The ablation at every budget: change of the mean IGD by a strategy",
        (*first, *budgets),
        tuple(rows),
        note="A number where the difference is beyond chance (Wilcoxon with Holm, 5 %).",
        findings=tuple(_gain_findings(scores)),
    )


def _gain_findings(scores: Scores) -> Iterator[Finding]:
    """Say at how many populations and budgets a strategy gives anything by IGD."""
    ordered = sorted(strategies(scores, "igd"), key=lambda entry: entry[:2])
    for (contested, strategy), group in groupby(ordered, key=lambda entry: entry[:2]):
        entries = [duel for *_, of_pair in group for duel in of_pair]
        better, worse = ([duel for duel in entries if duel.ahead == sign] for sign in (1, -1))
        budgets = sorted({duel.evaluations for duel in better})
        at = f", at {budgets[0]:,} to {budgets[-1]:,} evaluations" if len(budgets) > 1 else ""
        at = f", at {budgets[0]:,} evaluations" if len(budgets) == 1 else at
        yield Finding(
            len(better) > len(worse),
            f"On {contested.model} with velocities drawn {drawn(contested)}, the {strategy} "
            f"lowers the mean IGD beyond chance in {len(better)} of {len(entries)} comparisons "
            f"(populations, budgets, with and without the other strategy){at}, and raises it in "
            f"{len(worse)}; the paper has both strategies contribute.",
        )


def strategies(scores: Scores, indicator: str) -> Iterator[tuple[Contested, str, str, list[Duel]]]:
    """Yield what was contested, strategy, the pair of algorithms that shows it, and their duels."""
    for contested in exactly(scores):
        for strategy, having, without in STRATEGIES:
            entries = duels(scores, contested, having, [without], indicator)
            yield contested, strategy, f"{having} against {without}", entries


def _gain(duel: Duel) -> str:
    if not duel.ahead:
        return "none shown"
    percent = 100.0 * (duel.ratio - 1.0)
    return f"{percent:+.0f} %".replace("-", "\N{MINUS SIGN}")
