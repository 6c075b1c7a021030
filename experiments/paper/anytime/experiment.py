"""Table 7 and the ablation at every budget and population, and in every reading.

Without an option the report is made from ``experiments/data/anytime.csv``, the committed outcome of
the last full run; with ``--full`` it runs (some forty minutes on two cores) and leaves the same
files in the results folder; with ``--quick`` a small one runs (a minute).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from experiments.paper.anytime.data import (
    NAME,
    OF_TABLE_7,
    Contested,
    Scores,
    cases,
    committed_scores,
    scores_for,
)
from experiments.paper.anytime.duels import COMPARED, Duel, duels
from experiments.paper.anytime.readings import Reading, readings
from experiments.paper.anytime.sentences import (
    SPOKEN_OF,
    advantage_findings,
    first_page,
    leads_table,
    number_of_designs,
    opening,
    readings_findings,
)
from experiments.paper.anytime.tables import (
    CONTESTED,
    WHERE,
    contests,
    drawn,
    duel_cells,
    duel_columns,
    duels_table,
    exactly,
    means_table,
    readings_table,
    standings_table,
    stated_table,
)
from experiments.runner.committed import committed_file, read_origin, stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import ALGORITHM_STYLES, grid, panel, plain_log_scale
from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.statistics import mean_intervals
from pymoo_hdte._runner.result import Cell, Column, Finding, Picture, Result, Table

LABELS = {"igd": "IGD [arcsec]", "spacing": "Spacing [arcsec]", "hypervolume": "hypervolume"}
PRINTED = ("igd", "spacing")
"""What the paper prints."""


def over_budget(
    scores: Scores, contested: Contested, algorithms: Sequence[str], *, printed: bool
) -> Figure:
    """Draw mean IGD, Spacing and hypervolume with their 95 % intervals over the evaluations.

    One column for each population; with ``printed``, a dashed line for what the paper prints.
    """
    populations = scores.populations()
    figure, axes = grid(len(LABELS), len(populations), width=3.3, height=2.6, share_rows=True)
    for row, indicator in zip(axes, LABELS, strict=True):
        for axis, population in zip(row, populations, strict=True):
            for algorithm in algorithms:
                _curve(axis, scores, contested, population, algorithm, indicator)
                if printed and indicator in PRINTED:
                    value = getattr(TABLE_7[algorithm], indicator)
                    colour = ALGORITHM_STYLES[algorithm][0]
                    axis.axhline(value, color=colour, linewidth=1.2, linestyle="--")
            axis.set_xscale("log")
            axis.xaxis.set_major_formatter("{x:,g}")
            if indicator in PRINTED:
                plain_log_scale(axis)
        row[0].set_ylabel(LABELS[indicator])
    for axis, population in zip(axes[0], populations, strict=True):
        axis.set_title(f"population {population}", fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("evaluations")
    _legend(figure, axes[0, 0], printed=printed)
    return figure


def _curve(
    axis: Axes,
    scores: Scores,
    contested: Contested,
    population: int,
    algorithm: str,
    indicator: str,
) -> None:
    points = {
        budget: scores.of(cell, COMPARED[indicator])
        for size, budget, (cell,) in cases(scores, contested, [algorithm])
        if size == population
    }
    budgets = list(points)
    middle, low, high = mean_intervals(np.array(list(points.values()))).T
    colour, marker = ALGORITHM_STYLES[algorithm]
    axis.fill_between(budgets, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(budgets, middle, marker=marker, color=colour, markersize=4, label=algorithm)


def _legend(figure: Figure, axis: Axes, *, printed: bool) -> None:
    handles, labels = axis.get_legend_handles_labels()
    if printed:
        handles.append(axis.plot([], [], color="black", linewidth=1.2, linestyle="--")[0])
        labels.append("printed in the paper")
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)


STATED = 100
"""The population that the paper states, with 10,000 evaluations."""


def at_the_stated_population(scores: Scores, contested: Contested) -> Figure:
    """Draw mean IGD over the evaluations for the population of the paper, beside its numbers."""
    figure, axis = panel()
    for algorithm in OF_TABLE_7:
        _curve(axis, scores, contested, STATED, algorithm, "igd")
        colour = ALGORITHM_STYLES[algorithm][0]
        axis.axhline(TABLE_7[algorithm].igd, color=colour, linewidth=1.6, linestyle="--")
    axis.set_xscale("log")
    axis.xaxis.set_major_formatter("{x:,g}")
    plain_log_scale(axis)
    axis.set(xlabel="evaluations", ylabel=LABELS["igd"])
    axis.plot([], [], color="black", linewidth=1.6, linestyle="--", label="printed, at 10,000")
    figure.legend(loc="outside upper center", ncols=2, fontsize=13, frameon=False)
    return figure


def closeness(readings: Sequence[Reading]) -> Figure:
    """Draw, for each population and budget, by what factor the closest reading is off."""
    populations = sorted({reading.population for reading in readings})
    budgets = sorted({reading.evaluations for reading in readings})
    best = np.full((len(populations), len(budgets)), np.nan)
    for one in reversed(readings):
        # The closest comes last and stays.
        best[populations.index(one.population), budgets.index(one.evaluations)] = one.factor
    figure, axes = grid(1, 1, width=6.4, height=3.0)
    axis = axes[0, 0]
    axis.grid(visible=False)
    axis.imshow(best, cmap="viridis_r", norm=LogNorm(1.0, np.nanmax(best)), aspect="auto")
    middle = np.sqrt(np.nanmax(best))
    for (row, column), factor in np.ndenumerate(best):
        colour = "white" if factor > middle else "black"
        axis.text(column, row, f"{factor:.1f}", ha="center", va="center", color=colour)
    axis.set_xticks(range(len(budgets)), [f"{budget:,}" for budget in budgets])
    axis.set_yticks(range(len(populations)), [str(size) for size in populations])
    axis.set_xlabel("evaluations")
    axis.set_ylabel("population")
    return figure


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


VARIANTS = ("AMP-MOPSO", "A-MOPSO", "MP-MOPSO", "MOPSO")

SETTING, READINGS = paragraphs("anytime")


def run(context: Context) -> Result:
    """Run the comparison at every budget or read its outcome, and rank the readings."""
    scores = scores_for(context)
    found, ranked = contests(scores), readings(scores)
    return Result(
        title="Table 7 and Fig. 17 at every budget, and what the printed numbers may mean",
        command=context.command(NAME),
        paragraphs=(*stored_outcome(context, NAME), SETTING, READINGS),
        tables=(
            standings_table(found, list(advantage_findings(found))),
            readings_table(
                ranked, list(readings_findings(ranked)), number_of_designs(scores, ranked)
            ),
            leads_table(scores),
            gains_table(scores),
            duels_table(found),
            strategies_table(scores),
            means_table(scores),
            _seconds_table(scores),
        ),
        pictures=tuple(_pictures(scores, ranked)),
        notes=tuple(_extent(scores)),
        answer=opening(scores, found, ranked),
        first_page=first_page(scores, found),
        shown_first="stated",
    )


def table_7_picture() -> Picture:
    """Return the picture that the section on Table 7 begins with, from the committed outcome."""
    picture = _table_7(committed_scores())
    made = read_origin(committed_file(f"{NAME}.csv", NAME))["date"]
    caption = f"{picture.caption} Made from the stored outcome of {made} of the experiment {NAME}."
    return Picture(picture.name, caption, picture.figure, leading=True)


def at_the_stated_setting() -> Table:
    """Return the table that the section on Table 7 shows beside its own, from the same outcome."""
    return stated_table(committed_scores())


def _table_7(scores: Scores) -> Picture:
    return Picture(
        "anytime",
        f"Table 7 at every budget: means over the seeds on {SPOKEN_OF.model}, exact moments, first "
        "velocities as printed, arcsec to the "
        "true front (hypervolume: normalised by it, up to 1.1); bands are 95 % intervals, dashed "
        "lines the printed numbers. The paper states a population of 100 and 10,000 evaluations: "
        "the right end of the last column.",
        over_budget(scores, SPOKEN_OF, OF_TABLE_7, printed=True),
    )


def _pictures(scores: Scores, ranked: Sequence[Reading]) -> list[Picture]:
    lead = _table_7(scores)
    return [
        Picture(lead.name, lead.caption, lead.figure, leading=True),
        Picture(
            "stated",
            "Table 7 with the paper's population of 100: mean distance from the true front over "
            f"the evaluations, on the fitted drive model {SPOKEN_OF.model}, with 95 % intervals.",
            at_the_stated_population(scores, SPOKEN_OF),
        ),
        Picture(
            "closeness",
            "By what factor the closest reading of each population and budget is off the six "
            "printed numbers.",
            closeness(ranked),
        ),
        Picture(
            "ablation",
            f"The ablation at every budget, measured as above on {SPOKEN_OF.model}. A wide band "
            "stems from a few runs that stay away from the front.",
            over_budget(scores, SPOKEN_OF, VARIANTS, printed=False),
        ),
    ]


def _extent(scores: Scores) -> list[str]:
    return [
        f"{contested.model} with {contested.moments} moments and velocities drawn "
        f"{drawn(contested)}: {', '.join(scores.algorithms(contested))}; {seeds} seeds."
        for contested in scores.contested()
        for seeds in {
            len(runs) for case, runs in scores.values.items() if case.contested == contested
        }
    ]


def _seconds_table(scores: Scores) -> Table:
    columns = [*CONTESTED, Column("population"), Column("algorithm")]
    return Table(
        "seconds",
        "Seconds of one seed over all budgets, median",
        (*columns, Column("time", "s", 3)),
        tuple((*key, value) for key, value in scores.seconds.items()),
        folded=True,
        wall_times=True,
    )
