"""The held-out outcome in few rows, for the beginning of the page and for the README."""

from __future__ import annotations

from experiments.runner.result import Column, Table
from experiments.suites.bbob_tables import reached
from experiments.suites.data import Outcome
from experiments.suites.peers import OURS
from experiments.suites.protocol import BUDGETS, DIMENSIONS, HELD_OUT
from experiments.suites.published import BEST, CITED
from experiments.suites.suite_tables import NAMES, named, ranks

SWARMS = (OURS, "ElitistSwarm")


def in_short(outcome: Outcome) -> Table:
    """Shares of targets beside the best published, average ranks beside the best rival's."""
    rows = [_shares(outcome, dimension) for dimension in DIMENSIONS]
    rows += [_ranks(outcome, suite, measure) for suite in HELD_OUT for measure in NAMES]
    return Table(
        "in_short",
        "The held-out suites in short",
        (Column("suite"), *(Column(f"{budget:,}", group="evaluations") for budget in BUDGETS)),
        tuple(rows),
        note=f"bbob-biobj: {OURS}, in brackets the best published. Ranks: {' / '.join(SWARMS)}, in "
        "brackets the best of the others; 1 is the best.",
    )


def _shares(outcome: Outcome, dimension: int) -> tuple[str | None, ...]:
    cells: list[str | None] = [f"bbob-biobj, {dimension} dimensions: share of targets"]
    for budget in BUDGETS:
        share, cited = reached(outcome, dimension, budget), CITED.get((dimension, budget))
        beside = "" if cited is None else f" ({BEST} {cited:.3f})"
        cells.append(None if share is None else f"{share:.3f}{beside}")
    return tuple(cells)


def _ranks(outcome: Outcome, suite: str, measure: str) -> tuple[str | None, ...]:
    budgets = outcome.budgets(suite)
    count = max((len(outcome.algorithms(suite, budget)) for budget in budgets), default=0)
    cells: list[str | None] = [
        f"{named(outcome, suite)}: average rank of {count} by {NAMES[measure]}"
    ]
    for budget in BUDGETS:
        if budget not in budgets:
            cells.append(None)
            continue
        found = ranks(outcome, suite, budget, measure)
        ours = " / ".join(f"{found.pop(name):.2f}" for name in SWARMS if name in found)
        best = min(found, key=lambda name: found[name])
        cells.append(f"{ours} ({best} {found[best]:.2f})")
    return tuple(cells)
