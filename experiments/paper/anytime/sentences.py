"""What holds of Table 7 and at which budget, in sentences computed from the scores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from experiments.paper.anytime.data import OF_TABLE_7, Case, Contested, Scores, cases
from experiments.paper.anytime.duels import COMPARED, Duel, duels
from experiments.paper.anytime.measures import EQUAL, RETURNED
from experiments.paper.anytime.moments import EXACT
from experiments.paper.anytime.readings import Reading
from experiments.paper.anytime.tables import (
    OURS,
    RIVALS,
    SCALE,
    STATED,
    WHERE,
    Contest,
    Contests,
    drawn,
    exactly,
    standing,
    stated_place,
)
from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.runs import AS_PRINTED
from pymoo_hdte._runner.result import AT_EVERY_BUDGET, Cell, Column, Finding, Table, significant

EVERY_RIVAL = ("MOPSO", "A-MOPSO", "MP-MOPSO", "NSGA-II")
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
        for rival in EVERY_RIVAL
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
            *(Column(word, group=f"of {rival}") for rival in EVERY_RIVAL for word in words),
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
    ahead = dict.fromkeys(EVERY_RIVAL, 0)
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
        f"in {totals.cells} settings with fewer particles, {OURS} is ahead {counts}, "
        f"and the paper's order of the three holds in {totals.in_order}"
    )


SPOKEN_OF = Contested("calibrated", EXACT, AS_PRINTED)
"""What the first sentence of the report speaks of."""


def advantage_findings(contests: Contests) -> Iterator[Finding]:
    """Say where AMP-MOPSO is ahead of both rivals, and how it stands at the stated setting."""
    for contest, entries in contests.items():
        at_stated = _of_stated(entries)
        if contest.indicator == "hypervolume" or not at_stated:
            continue
        word = standing(at_stated)
        yield Finding(
            word == "ahead of both",
            f"On {contest.contested.model} with velocities drawn {drawn(contest.contested)}, "
            f"{OURS} is ahead of both rivals in {NAMES[contest.indicator]} beyond chance "
            f"{settings_ahead(entries) or 'nowhere'}; at the stated 100 x 100 it is "
            f"{_level(word)}.",
        )


def _of_stated(entries: Sequence[Duel]) -> list[Duel]:
    """Return the duels at the setting that the paper states."""
    return [duel for duel in entries if (duel.population, duel.evaluations) == STATED]


def settings_ahead(entries: Sequence[Duel]) -> str:
    """Name the populations and budgets at which both rivals are beaten; empty if there are none."""
    populations: dict[str, list[int]] = {}
    for population, of_population in groupby(entries, key=lambda duel: duel.population):
        ahead = [
            (budget, all(duel.ahead == 1 for duel in of_budget))
            for budget, of_budget in groupby(of_population, key=lambda duel: duel.evaluations)
        ]
        spans = [
            [budget for budget, _ in span]
            for is_ahead, span in groupby(ahead, key=lambda entry: entry[1])
            if is_ahead
        ]
        if spans:
            populations.setdefault(" and ".join(map(_span, spans)), []).append(population)
    parts = [
        f"at {words} evaluations with {_listed(sizes)}" for words, sizes in populations.items()
    ]
    return "; ".join(parts)


def _listed(populations: Sequence[int]) -> str:
    *smallest, largest = map(str, populations)
    return f"{', '.join(smallest)} or {largest} particles" if smallest else f"{largest} particles"


def _span(budgets: Sequence[int]) -> str:
    return f"{budgets[0]:,}" if len(budgets) == 1 else f"{budgets[0]:,} to {budgets[-1]:,}"


def readings_findings(ranked: Sequence[Reading]) -> Iterator[Finding]:
    """Say which reading comes closest, and how close the stated setting does."""
    best, place = ranked[0], stated_place(ranked)
    if place is None:
        return
    yield Finding(
        (best.population, best.evaluations) == STATED,
        f"The six printed numbers come closest with {_setting(best)}: off by a factor of "
        f"{significant(best.factor, 2)}. At the stated 100 x 100 the closest of all readings "
        f"is off by {significant(ranked[place].factor, 2)}, place {place + 1} of {len(ranked)}.",
    )


def closest_sentence(ranked: Sequence[Reading]) -> str:
    """Say which setting comes closest to the six printed numbers, and how close the stated does."""
    best, place = ranked[0], stated_place(ranked)
    against = (
        "" if place is None else f", against {significant(ranked[place].factor, 2)} at 100 x 100"
    )
    return (
        f"The printed numbers come closest with {_setting(best)}: off by a factor of "
        f"{significant(best.factor, 2)}{against}."
    )


def number_of_designs(scores: Scores, ranked: Sequence[Reading]) -> str:
    """Say what the number of designs counted does to the lead in the closest reading."""
    best = ranked[0]
    ratios = [_lead(scores, best, counted) for counted in (RETURNED, EQUAL)]
    if not np.all(np.isfinite(ratios)):
        return ""
    return (
        f" In the first, NSGA-II's mean IGD is {significant(ratios[0], 2)} times {OURS}'s as "
        f"sets are returned, and {significant(ratios[1], 2)} times where the archives of the "
        f"swarms, too, count no more than {best.population} designs."
    )


def _lead(scores: Scores, reading: Reading, counted: str) -> float:
    """Return how many times AMP-MOPSO's mean IGD NSGA-II's is; NaN if that was not counted."""
    means = []
    for algorithm in ("NSGA-II", OURS):
        case = Case(*reading.contested, counted, reading.population, reading.evaluations, algorithm)
        if case not in scores.values:
            return np.nan
        means.append(scores.of(case, f"igd_{reading.scale.suffix}").mean())
    return float(means[0] / means[1])


def _setting(reading: Reading) -> str:
    unit = "in arcsec" if reading.scale.unit == "arcsec" else reading.scale.unit
    return (
        f"{reading.population} particles after {reading.evaluations:,} evaluations "
        f"({reading.contested.model}, {reading.contested.moments} moments, velocities drawn "
        f"{drawn(reading.contested)}, against the {reading.scale.reference}, {unit})"
    )


def opening(scores: Scores, contests: Contests, ranked: Sequence[Reading]) -> str:
    """Return the first sentences of the report, about the stated setting where it was run."""
    at_stated = _of_stated(contests.get(Contest(SPOKEN_OF, "igd"), []))
    if not at_stated:
        return f"O{leads_sentence(scores)[1:]}."
    igd, spacing = (
        settings_ahead(contests[Contest(SPOKEN_OF, indicator)]) or "nowhere"
        for indicator in ("igd", "spacing")
    )
    return (
        f"Of the paper's Table 7, {OURS}'s advantage over both MOPSO and NSGA-II holds, on "
        f"{SPOKEN_OF.model}, in IGD {igd}, and in Spacing {spacing}. At the stated 100 x 100 "
        f"evaluations {_at_stated(scores, standing(at_stated))} {closest_sentence(ranked)}"
    )


def first_page(scores: Scores, contests: Contests) -> dict[str, str]:
    """Return what holds of Table 7, and what does not, as a part of the first page."""
    entries = contests.get(Contest(SPOKEN_OF, "igd"), [])
    at_stated = _of_stated(entries)
    if not at_stated:
        return {}
    stated = f"at the stated 100 x 100 evaluations {OURS} is {_level(standing(at_stated))}"
    near = _near_each_other(scores)
    return {AT_EVERY_BUDGET: f"{stated}, where {near}; {leads_sentence(scores)}"}


def _level(word: str) -> str:
    return "level with both" if word == "level" else word


def _at_stated(scores: Scores, word: str) -> str:
    if word == "ahead of both":
        return "it holds in IGD as well."
    return f"it does not hold: {_near_each_other(scores)}."


def _near_each_other(scores: Scores) -> str:
    runs = [
        scores.of(Case(*SPOKEN_OF, RETURNED, *STATED, name), COMPARED["igd"])
        for name in (OURS, *RIVALS)
    ]
    medians = [float(np.median(run)) for run in runs]
    percent = 100.0 * (max(medians) / min(medians) - 1.0)
    return (
        f"{who_finds(scores, SPOKEN_OF)}, and the median IGDs lie within {significant(percent, 2)} "
        "% of each other"
    )
