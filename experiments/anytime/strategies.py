"""The ablation at every budget: what the pyramid and the entropy weight each give."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from experiments.anytime.data import Scores
from experiments.anytime.duels import Duel, duels
from experiments.anytime.tables import NAMES, duel_cells, duel_columns, models
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
    columns = [Column(name) for name in ("problem", "population", "evaluations", "strategy")]
    columns.append(Column("in"))
    for indicator in ("igd", "spacing"):
        columns += duel_columns(NAMES[indicator])
        for model, strategy, pair, entries in strategies(scores, indicator):
            for duel in entries:
                where = (model, duel.population, duel.evaluations, strategy, pair)
                rows.setdefault(where, []).extend(duel_cells(duel))
    return Table(
        "strategies",
        "The ablation at every budget: with the strategy against without",
        tuple(columns),
        tuple((*where, *cells) for where, cells in rows.items()),
        note="A ratio of the means below 1 and an A12 above 0.5: better with the strategy.",
        folded=True,
    )


def gains_table(scores: Scores) -> Table:
    """Say in a word for every population and budget what each strategy gives by IGD."""
    rows: list[tuple[Cell, ...]] = []
    for model, strategy, pair, entries in strategies(scores, "igd"):
        for population, of_population in groupby(entries, key=lambda duel: duel.population):
            rows.append((model, strategy, pair, population, *map(_gain, of_population)))
    budgets = [Column(f"{budget:,}", group="evaluations") for budget in scores.budgets()]
    first = (Column("problem"), Column("strategy"), Column("in"), Column("population"))
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
    found = sorted(strategies(scores, "igd"), key=lambda one: (one[0], one[1]))
    for (model, strategy), group in groupby(found, key=lambda one: one[:2]):
        entries = [duel for *_, of_pair in group for duel in of_pair]
        better, worse = ([duel for duel in entries if duel.ahead == sign] for sign in (1, -1))
        budgets = sorted({duel.evaluations for duel in better})
        at = f", at {budgets[0]:,} to {budgets[-1]:,} evaluations" if len(budgets) > 1 else ""
        at = f", at {budgets[0]:,} evaluations" if len(budgets) == 1 else at
        yield Finding(
            len(better) > len(worse),
            f"On {model}, the {strategy} lowers the mean IGD beyond chance in {len(better)} of "
            f"{len(entries)} comparisons (populations, budgets, with and without the other "
            f"strategy){at}, and raises it in {len(worse)}; the paper has both strategies "
            "contribute.",
        )


def strategies(scores: Scores, indicator: str) -> Iterator[tuple[str, str, str, list[Duel]]]:
    """Yield drive model, strategy, the pair of algorithms that shows it, and their duels."""
    for model in models(scores):
        for strategy, having, without in STRATEGIES:
            entries = duels(scores, model, having, [without], indicator)
            yield model, strategy, f"{having} against {without}", entries


def _gain(duel: Duel) -> str:
    if not duel.ahead:
        return "none shown"
    percent = 100.0 * (duel.ratio - 1.0)
    return f"{percent:+.0f} %".replace("-", "\N{MINUS SIGN}")
