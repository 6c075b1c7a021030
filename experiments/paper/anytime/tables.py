"""Tables: who is ahead where, the means, and the ranked readings of Table 7."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from experiments.paper.anytime.data import OF_TABLE_7, Case, Contested, Scores
from experiments.paper.anytime.duels import COMPARED, Duel, duels
from experiments.paper.anytime.measures import EQUAL, NORMALISED, RETURNED, TRUE, Scale
from experiments.paper.anytime.moments import EXACT, N_SAMPLES
from experiments.paper.anytime.readings import PRINTED, Reading
from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.runs import AS_PRINTED
from pymoo_hdte._comparing.statistics import mean_intervals
from pymoo_hdte._runner.result import Cell, Column, Finding, Table

OURS = "AMP-MOPSO"
RIVALS = tuple(name for name in OF_TABLE_7 if name != OURS)
STATED = 100, 10_000
"""Population and evaluations that the paper states."""
SHOWN = 12
"""Readings that the page lists, besides the closest at the stated setting."""
SCALE = Scale(TRUE, NORMALISED)
"""How Table 7's page measures."""
WHERE = Column("problem"), Column("first velocities")
CONTESTED = WHERE[0], Column("moments"), WHERE[1]
"""Columns that say what algorithms were compared on, with exact moments and in general."""


class Contest(NamedTuple):
    """On what and by which measure AMP-MOPSO meets the rivals of Table 7."""

    contested: Contested
    indicator: str
    counted: str = RETURNED

    @property
    def measure(self) -> str:
        """What is compared, in words."""
        return NAMES[self.indicator] + ("" if self.counted == RETURNED else f", {self.counted}")


Contests = dict[Contest, list[Duel]]


def contests(scores: Scores) -> Contests:
    """Return the duels on every drive model, with exact moments and either law of velocities.

    By IGD, which more designs make smaller, also with no more designs than the population.
    """
    asked = [
        Contest(contested, *what)
        for contested in exactly(scores)
        for what in (("igd",), ("igd", EQUAL), ("spacing",), ("hypervolume",))
    ]
    return {
        contest: duels(scores, contest.contested, OURS, RIVALS, contest.indicator, contest.counted)
        for contest in asked
    }


def exactly(scores: Scores) -> list[Contested]:
    """Return what ran with exact moments: every drive model with every law of velocities."""
    return [contested for contested in scores.contested() if contested.moments == EXACT]


def _where(contested: Contested) -> tuple[str, str]:
    """Return the cells of `WHERE`."""
    return contested.model, contested.velocity


def drawn(contested: Contested) -> str:
    """Say how first velocities are drawn, as a part of a sentence."""
    printed = contested.velocity == AS_PRINTED
    return "as printed" if printed else "so that the first step stays within the bounds"


def standings_table(found: Contests, findings: Sequence[Finding]) -> Table:
    """Say for every population and budget whom AMP-MOPSO beats beyond chance."""
    budgets = sorted({duel.evaluations for duel in next(iter(found.values()))})
    rows: list[tuple[Cell, ...]] = []
    for contest, entries in found.items():
        for population, of_population in groupby(entries, key=lambda duel: duel.population):
            by_budget = groupby(of_population, key=lambda duel: duel.evaluations)
            words = [standing(list(of_budget)) for _, of_budget in by_budget]
            rows.append((*_where(contest.contested), contest.measure, population, *words))
    columns = [Column(f"{budget:,}", group="evaluations") for budget in budgets]
    return Table(
        "standings",
        f"{OURS} beside the rivals of Table 7, beyond chance (Wilcoxon with Holm, 5 %)",
        (*WHERE, Column("indicator"), Column("population"), *columns),
        tuple(rows),
        findings=tuple(findings),
    )


def standing(entries: Sequence[Duel]) -> str:
    """Say in words whom ours is ahead of and behind."""
    parts = []
    for word, sign in (("ahead of", 1), ("behind", -1)):
        names = [duel.rival for duel in entries if duel.ahead == sign]
        if names:
            parts.append(f"{word} {'both' if len(names) == len(RIVALS) else names[0]}")
    return ", ".join(parts) or "level"


def stated_table(scores: Scores) -> Table:
    """Give Table 7's indicators at its stated budget for every kind of moments and velocities."""
    rows: list[tuple[Cell, ...]] = []
    for contested in scores.contested():
        cases = [Case(*contested, RETURNED, *STATED, name) for name in OF_TABLE_7]
        if all(case in scores.values for case in cases):
            igd, spacing = (
                [float(scores.of(case, f"{name}_{SCALE.suffix}").mean()) for case in cases]
                for name in ("igd", "spacing")
            )
            seeds = len(scores.values[cases[0]])
            rows.append((*contested, *igd, *spacing, seeds))
    paper = (("the paper", None, None, *PRINTED.T.ravel().tolist(), 20),) if rows else ()
    return Table(
        "stated",
        "The stated 100 x 100 evaluations with other moments and other first velocities: means",
        (
            *CONTESTED,
            *(Column(name, digits=3, group="IGD") for name in OF_TABLE_7),
            *(Column(name, digits=3, group="Spacing") for name in OF_TABLE_7),
            Column("seeds"),
        ),
        (*paper, *rows),
        note=f"Common moments are those of {N_SAMPLES:,} samples that all designs share, as the "
        "paper draws them; sets found with samples are measured by their exact moments. "
        "Indicators are normalised by the true front.",
    )


def duels_table(found: Contests) -> Table:
    """Give every duel: ratio of the means, A12 with its interval, and p."""
    columns = [*WHERE, *(Column(name) for name in ("population", "evaluations", "rival"))]
    rows: dict[tuple[Cell, ...], list[Cell]] = {}
    for indicator in COMPARED:
        columns += duel_columns(NAMES[indicator])
        for contest, entries in found.items():
            if contest[1:] == (indicator, RETURNED):
                for duel in entries:
                    setting = duel.population, duel.evaluations, duel.rival
                    where = (*_where(contest.contested), *setting)
                    rows.setdefault(where, []).extend(duel_cells(duel))
    return Table(
        "duels",
        f"{OURS} against each rival: ratio of the means, A12 (0.5: no difference) with its 95 % "
        "interval, p",
        tuple(columns),
        tuple((*where, *cells) for where, cells in rows.items()),
        folded=True,
    )


def duel_columns(group: str) -> list[Column]:
    """Return the columns that `duel_cells` fills."""
    return [
        Column("ratio", digits=3, group=group),
        Column("A12", digits=2, group=group),
        Column("95 %", group=group),
        Column("p", digits=2, group=group),
    ]


def duel_cells(duel: Duel) -> list[Cell]:
    """Return ratio of the means, A12 with its interval, and p."""
    return [duel.ratio, duel.better, _range(duel.low, duel.high), duel.p]


def means_table(scores: Scores) -> Table:
    """Give the means that the pictures show, with their intervals."""
    columns = [*CONTESTED, *(Column(name) for name in ("population", "evaluations", "algorithm"))]
    columns.append(Column("designs returned", digits=3))
    for indicator in COMPARED:
        unit = "" if indicator == "hypervolume" else "arcsec"
        columns.append(Column("mean", unit, 3, NAMES[indicator]))
        columns.append(Column("95 %", group=NAMES[indicator]))
    returned = [case for case in scores.values if case.counted == RETURNED]
    rows: list[tuple[Cell, ...]] = []
    for contested, group in groupby(returned, key=lambda case: case.contested):
        of_problem = list(group)
        found = [
            mean_intervals(np.array([scores.of(case, measure) for case in of_problem]))
            for measure in COMPARED.values()
        ]
        for i, case in enumerate(of_problem):
            cells = [cell for intervals in found for cell in _mean_cells(*intervals[i])]
            size = float(scores.of(case, "size").mean())
            where = *contested, case.population, case.evaluations, case.algorithm
            rows.append((*where, size, *cells))
    title = "Means over the seeds, against the true front"
    return Table("means", title, tuple(columns), tuple(rows), folded=True)


def _mean_cells(mean: float, low: float, high: float) -> tuple[Cell, Cell]:
    return mean, _range(low, high)


def _range(low: float, high: float) -> str | None:
    return f"{low:.3g}..{high:.3g}" if np.isfinite(low) else None


def readings_table(ranked: Sequence[Reading], findings: Sequence[Finding], note: str) -> Table:
    """List the readings that come closest to the printed numbers, and the stated setting."""
    shown = list(range(min(SHOWN, len(ranked))))
    stated = stated_place(ranked)
    if stated is not None and stated not in shown:
        shown.append(stated)
    columns = (
        Column("place"),
        *CONTESTED,
        *(Column(name) for name in ("reference", "unit")),
        *(Column(name) for name in ("designs counted", "population", "evaluations")),
        *(Column(name, digits=3, group="IGD") for name in TABLE_7),
        *(Column(name, digits=3, group="Spacing") for name in TABLE_7),
        Column("factor", digits=3, group="off by"),
        Column("95 %", group="off by"),
        Column("whatever the unit", digits=3, group="off by"),
        Column("printed order"),
    )
    paper: tuple[Cell, ...] = ("the paper", *[None] * (len(CONTESTED) + 3), *STATED)
    rows = [(*paper, *PRINTED.T.ravel().tolist(), None, None, None, "kept")]
    rows += [_reading_row(place, ranked[place]) for place in shown]
    return Table(
        "readings",
        f"Readings of Table 7 by closeness to its six numbers, {len(ranked)} in all",
        columns,
        tuple(rows),
        note=f"With {len(ranked)} readings for six numbers, some come close by chance: the first "
        f"places say what fits, not what was done. Intervals come from resampled seeds.{note}",
        findings=tuple(findings),
    )


def stated_place(ranked: Sequence[Reading]) -> int | None:
    """Return the place, from 0, of the closest reading at the stated setting, if it was run."""
    places = (
        i for i, reading in enumerate(ranked) if (reading.population, reading.evaluations) == STATED
    )
    return next(places, None)


def _reading_row(place: int, reading: Reading) -> tuple[Cell, ...]:
    return (
        f"{place + 1}",
        *reading.contested,
        reading.scale.reference,
        reading.scale.unit,
        reading.counted,
        reading.population,
        reading.evaluations,
        *reading.means.T.ravel().tolist(),
        reading.factor,
        _range(*reading.factor_interval()),
        reading.shape_factor,
        "kept" if reading.in_order else "not kept",
    )
