"""What had to be reached, and what came out; the sentences of the page's beginning."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from experiments.runner.result import Cell, Column, Table, significant
from experiments.suites.bbob_tables import reached
from experiments.suites.data import Outcome
from experiments.suites.peers import OURS
from experiments.suites.protocol import (
    BUDGETS,
    FEASIBLE_RIVALS,
    HELD_OUT,
    RIVAL_ON_RE,
    SHARES,
)
from experiments.suites.published import BEST, CITED
from experiments.suites.suite_tables import (
    NAMES,
    can_show,
    feasible_runs,
    indicators,
    named,
    ranks,
    tests,
)

CONSTRAINED = ("MW", "DAS-CMOP")


class Demand(NamedTuple):
    """One demand: what was asked, at which budget, what came out; ``met`` is None if not run."""

    asked: str
    evaluations: int
    measured: str
    beside: str
    met: bool | None


def demands(outcome: Outcome) -> list[Demand]:
    """Return all demands in the order of the text that set them."""
    return [
        *_shares(outcome),
        *_first_of_all(outcome),
        *_on_engineering(outcome),
        *_constrained(outcome),
    ]


def demands_table(outcome: Outcome) -> Table:
    """Show the demands."""
    words = {True: "yes", False: "no", None: "not run"}
    rows: list[tuple[Cell, ...]] = [
        (*demand[:-1], words[demand.met]) for demand in demands(outcome)
    ]
    return Table(
        "must_reach",
        "What was demanded, and what came out",
        (
            *(Column("demand"), Column("evaluations"), Column("measured")),
            *(Column("beside"), Column("met")),
        ),
        tuple(rows),
        note="Demands were written before the runs. That own time per generation is at most half "
        "of NSGA-II's, python -m experiments benchmark measures.",
    )


def _shares(outcome: Outcome) -> Iterable[Demand]:
    for (dimension, evaluations), asked in SHARES.items():
        share = reached(outcome, dimension, evaluations)
        yield Demand(
            f"bbob-biobj, {dimension} dimensions: share of targets {asked:.2f}",
            evaluations,
            "not run" if share is None else f"{share:.3f}",
            f"{BEST} {CITED[dimension, evaluations]:.3f}",
            None if share is None else share >= asked,
        )


def _first_of_all(outcome: Outcome) -> Iterable[Demand]:
    for suite in HELD_OUT:
        for evaluations in BUDGETS:
            for measure, name in NAMES.items():
                asked = f"{named(outcome, suite)}: lowest average rank, {name}"
                if evaluations not in outcome.budgets(suite):
                    yield Demand(asked, evaluations, "not run", "", None)
                    continue
                yield _first(outcome, suite, evaluations, measure, asked)
                beaten = tests(outcome, suite, evaluations, measure)
                shown = sum(test.beaten for test in beaten)
                problems = len(outcome.problems(suite, evaluations))
                too_few = "" if can_show(problems, len(beaten)) else "; too few problems to show it"
                yield Demand(
                    f"{named(outcome, suite)}: better than each beyond chance (Holm), {name}",
                    evaluations,
                    f"{shown} of {len(beaten)}{too_few}",
                    "",
                    shown == len(beaten),
                )


def _first(outcome: Outcome, suite: str, evaluations: int, measure: str, asked: str) -> Demand:
    found = ranks(outcome, suite, evaluations, measure)
    ours = found.pop(OURS)
    best = min(found, key=lambda name: found[name])
    place = 1 + sum(rank < ours for rank in found.values())
    measured = f"place {place} of {1 + len(found)}, rank {ours:.2f}"
    return Demand(asked, evaluations, measured, f"{best} {found[best]:.2f}", place == 1)


def _on_engineering(outcome: Outcome) -> Iterable[Demand]:
    asked = f"RE: no worse than {RIVAL_ON_RE}, hypervolume"
    budgets = outcome.budgets("RE")
    if not budgets:
        yield Demand(asked, BUDGETS[2], "not run", "", None)
    for budget in budgets:
        (test,) = (
            one for one in tests(outcome, "RE", budget, "hypervolume") if one.rival == RIVAL_ON_RE
        )
        measured = f"{test.better} better, {test.worse} worse, p = {significant(test.p, 2)}"
        yield Demand(asked, budget, measured, "", test.better >= test.worse)


def _constrained(outcome: Outcome) -> Iterable[Demand]:
    for suite in CONSTRAINED:
        budgets = outcome.budgets(suite)
        if not budgets:
            yield Demand(
                f"{suite}: feasible runs, first by hypervolume", BUDGETS[2], "not run", "", None
            )
        for budget in budgets:
            ours, runs = feasible_runs(outcome, suite, budget, OURS)
            theirs = {
                name: feasible_runs(outcome, suite, budget, name)[0]
                for name in FEASIBLE_RIVALS
                if name in outcome.algorithms(suite, budget)
            }
            yield Demand(
                f"{suite}: feasible in as many runs as {' and '.join(FEASIBLE_RIVALS)}",
                budget,
                f"{ours} of {runs}",
                ", ".join(f"{name} {theirs.get(name, 'not run')}" for name in FEASIBLE_RIVALS),
                all(ours >= count for count in theirs.values()),
            )
            yield _first(
                outcome, suite, budget, indicators(suite)[0], f"{suite}: first by hypervolume"
            )


def in_one_sentence(outcome: Outcome) -> str:
    """Say what falls short first, then what is reached."""
    short = [_short(outcome, *place) for place in SHARES]
    missed = [words for words, met in short if met is False]
    met = [words for words, met in short if met]
    parts = []
    if missed:
        parts.append(
            f"On the held-out bbob-biobj {OURS} falls short of what was demanded in {len(missed)} "
            f"of {len(missed) + len(met)} cases: {'; '.join(missed)}"
        )
    if met:
        parts.append(
            f"On the held-out bbob-biobj {OURS} reaches what was demanded {'; '.join(met)}"
        )
    for suite in HELD_OUT:
        budgets = outcome.budgets(suite)
        places = []
        for budget in budgets:
            by_measure = []
            for measure, name in NAMES.items():
                found = ranks(outcome, suite, budget, measure)
                place = 1 + int(np.sum([rank < found[OURS] for rank in found.values()]))
                by_measure.append(f"{place} by {name}")
            places.append(f"{' and '.join(by_measure)} after {budget:,}")
        if places:
            count = len(outcome.algorithms(suite, budgets[0]))
            parts.append(
                f"On {named(outcome, suite)} its place among up to {count} is {', '.join(places)}"
            )
    return f"{'. '.join(parts)}." if parts else "Nothing was run."


def _short(outcome: Outcome, dimension: int, evaluations: int) -> tuple[str, bool | None]:
    share, asked = reached(outcome, dimension, evaluations), SHARES[dimension, evaluations]
    if share is None:
        return "", None
    words = f"in {dimension}-D after {evaluations:,} ({share:.3f} of {asked:.2f}; "
    return f"{words}{BEST} {CITED[dimension, evaluations]:.3f})", share >= asked
