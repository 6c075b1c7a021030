"""Tables of the cards, for the report and for the pages of the documentation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import kruskal

from experiments.runner.texts import paragraphs
from experiments.studies.cards.data import Numbers
from experiments.studies.cards.hardness import NEAR, POINTS, STARTS, Hardness
from experiments.studies.contest.peers_data import MEASURES, Scores
from pymoo_hdte._comparing.indicators import NAMES, smaller_is_better
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.ranks import costs_of, medians
from pymoo_hdte._comparing.statistics import holm, state_of
from pymoo_hdte._runner.result import Cell, Column, Finding, Table, scored

RANDOM = "random search"
REACHES = 2.0
"""A median IGD of at most so many times the floor reaches the front."""
LEAST_SPREAD = 2.0
"""Factor between the upper and the lower quartile of the algorithms' medians that matters to a
user; the extremes do not count, as one algorithm fails everywhere."""
FEWEST = 4
"""Algorithms below which the quartiles of the medians are their extremes, and nothing is said."""


class Separation(NamedTuple):
    """How far the algorithms lie apart on one problem at one budget, by IGD, random search aside.

    Attributes
    ----------
    problem : str
    evaluations : int
    algorithms : int
        That ran.
    p : float
        Of Kruskal and Wallis's test that all runs are alike.
    spread : float
        Factor between the upper and the lower quartile of the algorithms' medians.
    scatter : float
        Factor between the worst and the best seed, of the median algorithm that has all finite.
    reached : int
        Algorithms whose median IGD is at most `REACHES` times the floor.
    """

    problem: str
    evaluations: int
    algorithms: int
    p: float
    spread: float
    scatter: float
    reached: int

    @property
    def separates(self) -> bool | None:
        """Whether they differ for sure, and by as much as matters; None if too few ran to say."""
        if self.algorithms < FEWEST:
            return None
        return self.p <= SIGNIFICANT and self.spread >= LEAST_SPREAD


def separations(scores: Scores, hardness: dict[str, Hardness]) -> list[Separation]:
    """Return one entry a problem and budget at which at least two algorithms ran."""
    igd = scores.values[MEASURES.index("igd")]
    chosen = [place for place, name in enumerate(scores.algorithms) if name != RANDOM]
    separated = []
    for row, problem in enumerate(scores.problems):
        for column, budget in enumerate(scores.budgets):
            ran = [i for i in chosen if np.all(scores.spent[row, i, column] > 0)]
            if len(ran) < 2:
                continue
            values = igd[row, ran, column][None]
            separated.append(_separation(problem, budget, values, hardness[problem].floor))
    return separated


def _separation(problem: str, budget: int, values: np.ndarray, floor: float) -> Separation:
    costs = costs_of(values, True, ("problems", "algorithms", "seeds"))[0]
    medians = np.median(costs, axis=1)
    finite = costs[np.isfinite(costs).all(axis=1)]
    scatter = float(np.median(finite.max(axis=1) / finite.min(axis=1))) if len(finite) else np.nan
    # A quartile is one of the medians: between a finite one and an infinite one there is none.
    low, high = np.quantile(medians, (0.25, 0.75), method="nearest")
    return Separation(
        problem,
        budget,
        len(costs),
        float(kruskal(*costs).pvalue),
        float(high / low) if np.isfinite(low) else np.nan,
        scatter,
        int(np.sum(medians <= REACHES * floor)),
    )


HARDNESS_NOTE, SEPARATION_NOTE = paragraphs(
    "cards_tables",
    starts=STARTS,
    near=f"{NEAR[0]:g}",
    wide=f"{NEAR[1]:g}",
    points=POINTS,
    random=RANDOM,
    significant=f"{SIGNIFICANT:g}",
    least_spread=f"{LEAST_SPREAD:g}",
    reaches=f"{REACHES:g}",
    fewest=FEWEST,
)
_SAID = {True: "yes", False: "no", None: "too few to say"}


def hardness_table(numbers: Numbers) -> Table:
    """Return what makes each problem hard."""
    return Table(
        "hardness",
        "What makes each problem hard",
        (
            Column("problem"),
            Column("local optima"),
            Column("starts that reach the best", "%", 3),
            Column("pieces of the front"),
            Column("allowed designs", "%", 3),
            *(Column(f"within {share:g} widths", "% of designs", 2) for share in NEAR),
            Column("floor of the IGD", "", 3),
        ),
        tuple(
            (
                name,
                hardness_of.optima,
                _percent(hardness_of.best_reached),
                hardness_of.pieces,
                *(
                    _percent(share)
                    for share in (hardness_of.feasible, hardness_of.near, hardness_of.wide)
                ),
                hardness_of.floor,
            )
            for name, hardness_of in numbers.hardness.items()
        ),
        note=HARDNESS_NOTE,
    )


def separation_table(numbers: Numbers) -> Table:
    """Return how far the algorithms lie apart, with a sentence on which problems separate them."""
    separated = separations(numbers.scores, numbers.hardness)
    return Table(
        "separation",
        "Which problems separate algorithms",
        (
            Column("problem"),
            Column("evaluations"),
            Column("algorithms"),
            Column("p", "", 2),
            Column("upper by lower quartile", "times", 3),
            Column("scatter of the seeds", "times", 3),
            Column("reach the front"),
            Column("separates"),
        ),
        tuple((*entry, _SAID[entry.separates]) for entry in separated),
        note=SEPARATION_NOTE,
        findings=(summary(separated),),
    )


def summary(separated: list[Separation]) -> Finding:
    """Say which problems separate algorithms at which budgets."""
    counts, parts = [], []
    for budget in sorted({entry.evaluations for entry in separated}):
        names = [
            entry.problem for entry in separated if entry.evaluations == budget and entry.separates
        ]
        counts.append(f"{len(names)} after {budget:,}")
        if names:
            parts.append(f"After {budget:,}: {', '.join(names)}.")
    largest = max(entry.evaluations for entry in separated)
    last = [
        finding
        for finding in separated
        if finding.evaluations == largest and finding.separates is not None
    ]
    corrected = holm([separation.p for separation in last])
    separate = [bool(separation.separates) for separation in last]
    shown = any(
        separation and p <= SIGNIFICANT for separation, p in zip(separate, corrected, strict=True)
    )
    return scored(
        state_of(any(separate), shown=shown),
        f"Robust problems that separate the algorithms: {', '.join(counts)} evaluations; at least "
        f"one is wanted at the largest budget, with p after Holm over the {len(last)} problems "
        f"there. {' '.join(parts)}".rstrip(),
        answers=True,
    )


def medians_table(scores: Scores, problem: str) -> Table:
    """Return the medians of every algorithm at every budget on one problem, best IGD first."""
    row = scores.problems.index(problem)
    ran = scores.spent[row].min(axis=-1) > 0
    budgets = [place for place in range(len(scores.budgets)) if ran[:, place].any()]
    columns = [Column("algorithm")]
    cells: list[list[Cell]] = [[name] for name in scores.algorithms]
    order = np.zeros(len(cells))
    for place in budgets:
        for indicator, name in NAMES.items():
            better = smaller_is_better(indicator)
            values = scores.of(indicator, scores.budgets[place])[row][None]
            middle = medians(values, smaller_is_better=better)[0]
            group = f"{scores.budgets[place]:,} evaluations"
            columns.append(Column(name, "", 3, group))
            for line, value, took_part in zip(cells, middle, ran[:, place], strict=True):
                line.append(float(value) if took_part else None)
            if indicator == "igd":
                order = np.where(ran[:, place], middle, np.inf)
    rows = [cells[i] for i in np.argsort(order, kind="stable") if ran[i].any()]
    return Table(
        f"medians_{problem}",
        f"{problem}: medians of {len(scores.seeds)} seeds",
        tuple(columns),
        tuple(tuple(line) for line in rows),
        folded=True,
    )


def _percent(share: float | None) -> Cell:
    return None if share is None else 100.0 * share
