"""All held-out suites together, by hypervolume: ZCAT and one instance of bbob-biobj.

A problem of ZCAT gives the median hypervolume, one of bbob-biobj, with both dimensions counted, the
share of targets, which rises with the hypervolume of all points evaluated. They have no common
unit, so that ranks and signs are what is compared. IGD+ needs a front; bbob-biobj has none in
closed form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.ranks import average_ranks
from experiments.comparing.rivals import RivalTest, signs_against
from experiments.runner.result import Cell, Column, Table
from experiments.studies.suites.bbob.coco import FUNCTIONS
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.jobs import BbobRun
from experiments.studies.suites.peers import BBOB_PEERS, OURS
from experiments.studies.suites.protocol import BESIDE_PEERS, BUDGETS, DIMENSIONS, HELD_OUT
from experiments.studies.suites.suite_tables import missing_as_ours

MEASURE = "hypervolume"


def entrants(outcome: Outcome, budget: int) -> list[str]:
    """Return who ran on all problems of all held-out suites, none if ours did not."""
    names = [
        name
        for name in BBOB_PEERS
        if all(name in outcome.algorithms(suite, budget) for suite in HELD_OUT)
        and _shares(outcome, name, budget) is not None
    ]
    return names if OURS in names and len(names) > 1 else []


def values(outcome: Outcome, budget: int, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the hypervolumes and shares of those who ran on all, shape (problems, algorithms)."""
    medians = [outcome.medians(suite, budget, MEASURE, names) for suite in HELD_OUT]
    shares = [_shares(outcome, name, budget) for name in names]
    return np.vstack([*medians, np.array(shares, dtype=float).T])


def ranks_together(outcome: Outcome, budget: int) -> dict[str, float]:
    """Return average ranks over all problems by algorithm; empty if it was not run."""
    names = entrants(outcome, budget)
    if not names:
        return {}
    means = average_ranks(values(outcome, budget, names), smaller_is_better=False)
    return dict(zip(names, means.tolist(), strict=True))


def signs_together(outcome: Outcome, budget: int) -> list[RivalTest]:
    """Test ours against each other by the signs over all problems, corrected after Holm."""
    names = entrants(outcome, budget)
    if not names:
        return []
    found = missing_as_ours(values(outcome, budget, names), names)
    return signs_against(OURS, names, found, smaller_is_better=False)


def _shares(outcome: Outcome, name: str, budget: int) -> list[float] | None:
    """Return the share on each problem after a budget, None if one was not run."""
    anew = BBOB_PEERS[name].starts_anew
    found = []
    for dimension in DIMENSIONS:
        for function in FUNCTIONS:
            for told in (budget,) if anew else (budget, *BUDGETS[::-1]):
                run = BbobRun(function, dimension, BESIDE_PEERS, name, told)
                if budget in outcome.bbob.get(run, ()):
                    found.append(outcome.bbob[run][budget])
                    break
            else:
                return None
    return found


def together_table(outcome: Outcome) -> Table:
    """Show average ranks over all problems, and ours against each."""
    rows: list[tuple[Cell, ...]] = []
    for budget in BUDGETS:
        tests = {test.rival: test for test in signs_together(outcome, budget)}
        found = ranks_together(outcome, budget)
        for name in sorted(found, key=lambda one: found[one]):
            cells: tuple[Cell, ...] = (None, None, None)
            if name in tests:
                cells = tests[name].better, tests[name].worse, tests[name].p
            rows.append((budget, name, found[name], *cells))
    problems = len(DIMENSIONS) * len(FUNCTIONS)
    return Table(
        "together",
        "All held-out suites together, by hypervolume: average ranks over the problems",
        (
            *(Column("evaluations"), Column("algorithm"), Column("average rank", digits=2)),
            *(Column(f"{OURS} better"), Column("worse"), Column("p", digits=2)),
        ),
        tuple(rows),
        note=f"The problems of {' and '.join(HELD_OUT)} by their median hypervolume, {problems} of "
        f"bbob-biobj (instance {BESIDE_PEERS}, {' and '.join(map(str, DIMENSIONS))} dimensions) by "
        "the share of targets; of those who ran on all of them. p is that of the sign test over "
        "the problems, after Holm over the rivals of a budget; two dimensions of a function count "
        "as two problems. IGD+ needs a front, which bbob-biobj has not.",
    )
