"""What the law of first velocities decides: where AMP-MOPSO leads below 100 particles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from experiments.comparing.runs import AS_PRINTED
from experiments.paper.anytime.data import OF_TABLE_7, Case, Contested, Scores, cases
from experiments.paper.anytime.duels import COMPARED, duels
from experiments.paper.anytime.measures import RETURNED
from experiments.paper.anytime.tables import OURS, SCALE, STATED, WHERE, drawn, exactly
from experiments.runner.result import Cell, Column, Finding, Table

RIVALS = ("MOPSO", "A-MOPSO", "MP-MOPSO", "NSGA-II")
BUDGETS = (200, 2000)
"""Range of evaluations counted: before the first, sets of two designs; after, all are alike."""


AWAY = 0.05
"""Normalised IGD above which a run misses the front: the distance at which Table 7's page counts a
piece of the front as lost."""


class Lead(NamedTuple):
    """In how many cells, populations times budgets, AMP-MOPSO is ahead of a rival and behind it."""

    rival: str
    ahead: int
    behind: int


class Totals(NamedTuple):
    """Over all drive models: cells, those ahead of each rival, and those in the printed order."""

    cells: int
    ahead: dict[str, int]
    in_order: int


def leads(scores: Scores, contested: Contested) -> list[Lead]:
    """Count the cells below 100 particles in which the mean IGD differs beyond chance.

    Beyond chance is Wilcoxon's test at 5 % after Holm's correction over the cells of a rival.
    """
    return [
        Lead(rival, *(sum(duel.ahead == sign for duel in entries) for sign in (1, -1)))
        for rival in RIVALS
        for entries in [
            [
                duel
                for duel in duels(scores, contested, OURS, [rival], "igd")
                if _counts(duel.population, duel.evaluations)
            ]
        ]
    ]


def cells_in_order(scores: Scores, contested: Contested) -> tuple[int, int]:
    """Return in how many cells the mean IGDs come in the printed order, and of how many.

    The paper prints NSGA-II worst, then MOPSO, then AMP-MOPSO.
    """
    ordered = [
        np.all(np.diff([scores.of(case, COMPARED["igd"]).mean() for case in of_cell]) < 0.0)
        for population, budget, of_cell in cases(scores, contested, OF_TABLE_7)
        if _counts(population, budget)
    ]
    return int(np.sum(ordered)), len(ordered)


def runs_that_find(scores: Scores, contested: Contested, algorithm: str) -> tuple[int, int]:
    """Return how many runs at the stated setting find the true front, and of how many."""
    case = Case(*contested, RETURNED, *STATED, algorithm)
    igd = scores.of(case, f"igd_{SCALE.suffix}")
    return int(np.sum(igd <= AWAY)), len(igd)


def who_finds(scores: Scores, contested: Contested) -> str:
    """Say which algorithms of Table 7 find the front at the stated setting; no full stop."""
    parts = []
    for algorithm in OF_TABLE_7:
        counts, runs = runs_that_find(scores, contested, algorithm)
        share = "all" if counts == runs else f"{counts or 'none'} of"
        parts.append(f"{algorithm} in {share} {runs} runs")
    return f"the front is found by {', '.join(parts[:-1])} and {parts[-1]}"


def _counts(population: int, evaluations: int) -> bool:
    return population < STATED[0] and BUDGETS[0] <= evaluations <= BUDGETS[1]


def leads_table(scores: Scores) -> Table:
    """Say what either law of velocities does to the lead of AMP-MOPSO below 100 particles."""
    rows: list[tuple[Cell, ...]] = []
    for contested in exactly(scores):
        cells, n_cells = cells_in_order(scores, contested)
        counts = [count for lead in leads(scores, contested) for count in lead[1:]]
        rows.append((contested.model, contested.velocity, n_cells, *counts, cells))
    words = ("ahead", "behind")
    return Table(
        "leads",
        f"Below 100 particles, {BUDGETS[0]} to {BUDGETS[1]:,} evaluations: in how many cells "
        f"{OURS} is ahead by IGD, beyond chance",
        (
            *WHERE,
            Column("cells"),
            *(Column(word, group=f"of {rival}") for rival in RIVALS for word in words),
            Column("printed order"),
        ),
        tuple(rows),
        note="A cell is a population and a budget. The printed order is AMP-MOPSO before MOPSO "
        "before NSGA-II in the mean IGD.",
        findings=tuple(
            Finding(2 * cells > n_cells, sentence)
            for contested in exactly(scores)
            for cells, n_cells in [cells_in_order(scores, contested)]
            for sentence in [
                f"On {contested.model} with velocities drawn {drawn(contested)}, the paper's "
                f"order AMP-MOPSO, MOPSO, NSGA-II holds in {cells} of {n_cells} cells below 100 "
                "particles."
            ]
        ),
    )


def totals_of(scores: Scores, velocity: str) -> Totals:
    """Add up over the drive models that were run under a law of velocities."""
    n_cells = in_order = 0
    ahead = dict.fromkeys(RIVALS, 0)
    for contested in exactly(scores):
        if contested.velocity == velocity:
            cells, of_all = cells_in_order(scores, contested)
            in_order, n_cells = in_order + cells, n_cells + of_all
            for lead in leads(scores, contested):
                ahead[lead.rival] += lead.ahead
    return Totals(n_cells, ahead, in_order)


def leads_sentence(scores: Scores) -> str:
    """Say in how many cells AMP-MOPSO leads as printed, over all drive models; no full stop."""
    totals = totals_of(scores, AS_PRINTED)
    counts = ", ".join(f"of {rival} in {count}" for rival, count in totals.ahead.items())
    return (
        f"of {totals.cells} cells below 100 particles, {OURS} is ahead {counts}, and the paper's "
        f"order of the three holds in {totals.in_order}"
    )
