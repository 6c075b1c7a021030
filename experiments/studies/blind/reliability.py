"""Whether what is said with a probability is true as often as that."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from experiments.comparing.statistics import Estimate
from experiments.runner.result import Cell, Column, Table
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.targets import share

EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Of the groups of probabilities; the last holds its upper end."""


def reliability(outcomes: Sequence[Outcome]) -> list[tuple[float, Estimate]]:
    """Return the mean probability said in each group, and the share of what was true."""
    found = []
    for _, _, chosen in _groups(outcomes):
        if chosen:
            said = float(np.mean([one.probability for one in chosen]))
            found.append((said, share([one.true_statement for one in chosen])))
    return found


def reliability_table(outcomes: Sequence[Outcome]) -> Table:
    """Return the groups of said probabilities beside what was true."""
    rows: list[tuple[Cell, ...]] = []
    for low, high, chosen in _groups(outcomes):
        said = float(np.mean([one.probability for one in chosen])) if chosen else None
        true = share([one.true_statement for one in chosen])
        value = true.value if chosen else None
        rows.append((f"{low:g} to {high:g}", len(chosen), said, value, true.low, true.high))
    columns = (
        Column("probability said"),
        Column("answers"),
        Column("mean", "", 3, "said"),
        Column("share", "", 3, "true"),
        Column("low", "", 3, "true"),
        Column("high", "", 3, "true"),
    )
    silent = sum(one.probability is None for one in outcomes)
    note = (
        "A statement is true if every name in it is hidden, if a class of at most three holds what "
        "is hidden, if nothing is hidden where the model is called adequate, and if no list holds "
        "what is hidden where it is called unlisted. Intervals are Clopper and Pearson's. "
        f"Without probability: {silent} of {len(outcomes)} answers."
    )
    return Table("reliability", "What is said with a probability", columns, tuple(rows), note=note)


def _groups(outcomes: Sequence[Outcome]) -> list[tuple[float, float, list[Outcome]]]:
    said = [one for one in outcomes if one.probability is not None]
    values = np.array([one.probability for one in said], dtype=float)
    places = np.searchsorted(np.array(EDGES), values, side="right") - 1
    places = np.minimum(places, len(EDGES) - 2)
    return [
        (low, high, [one for one, place in zip(said, places, strict=True) if place == number])
        for number, (low, high) in enumerate(pairwise(EDGES))
    ]
