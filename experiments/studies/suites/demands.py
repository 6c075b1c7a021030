"""What had to be reached, and what came out; the sentences of the page's beginning."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from experiments.comparing.rivals import RivalTest, better_than_each
from experiments.studies.suites.bbob_tables import BEST, CITED, reached, reached_shares
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.protocol import (
    BOTH_SIZES,
    BUDGETS,
    CONSTRAINED,
    FEASIBLE_RIVALS,
    HELD_OUT,
    LARGEST_SHORTFALL,
    RIVAL_ON_RE,
)
from experiments.studies.suites.suite_tables import (
    NAMES,
    can_show,
    feasible_beside,
    indicators,
    named,
    ranks,
    ranks_together,
    signs_together,
    tests,
)
from pymoo_hdte._comparing.statistics import Estimate, mean, rate, state_of
from pymoo_hdte._runner.result import SCORE_STATES, Cell, Column, Table, scored, significant


class Demand(NamedTuple):
    """One demand: what was asked, at which budget, what came out.

    ``state`` is one of `SCORE_STATES`, or None if it was not run.
    """

    asked: str
    evaluations: int
    measured: str
    beside: str
    state: str | None


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
    judged = demands(outcome)
    rows: list[tuple[Cell, ...]] = [
        (*finding[:-1], (finding.state or "not run").lower()) for finding in judged
    ]
    return Table(
        "must_reach",
        "What was demanded, and what came out",
        (
            *(Column("demand"), Column("evaluations"), Column("measured")),
            *(Column("beside"), Column("state")),
        ),
        tuple(rows),
        note="Demands were written before the runs. A first place is shown if ours is better than "
        "each other beyond chance, a mean share if its 95 % interval over the functions reaches "
        "what was asked, each with one run. Own time per generation of at most half of NSGA-II's "
        "was demanded too and is missed: see the table of own time.",
        findings=tuple(
            scored(
                finding.state,
                f"{finding.asked}, after {finding.evaluations:,} evaluations: {_out(finding)}.",
            )
            for finding in judged
            if finding.state is not None
        ),
    )


def _out(demand: Demand) -> str:
    return demand.measured + (f" (beside {demand.beside})" if demand.beside else "")


def counted(outcome: Outcome) -> str:
    """Count the demands by what came out."""
    states = [demand.state for demand in demands(outcome)]
    counts = ", ".join(f"{states.count(state)} {state.lower()}" for state in SCORE_STATES)
    return f"Of {sum(state is not None for state in states)} demands that were run: {counts}."


def _shares(outcome: Outcome) -> Iterable[Demand]:
    shares = {place: reached_shares(outcome, *place) for place in CITED}
    for (dimension, evaluations), cited in CITED.items():
        yield _share(
            f"bbob-biobj, {dimension} dimensions: share of targets at most {LARGEST_SHORTFALL} "
            f"below {BEST}",
            evaluations,
            mean(shares[dimension, evaluations]),
            cited,
            cited - LARGEST_SHORTFALL,
        )
    complete = len({len(of_functions) for of_functions in shares.values()}) == 1
    of_all = mean(np.mean([*shares.values()], axis=0).tolist() if complete else [])
    cited = float(np.mean([*CITED.values()]))
    demand = f"bbob-biobj, all budgets and dimensions: share of targets above {BEST}"
    yield _share(demand, BUDGETS[-1], of_all, cited, cited)


def _share(demand: str, evaluations: int, share: Estimate, cited: float, required: float) -> Demand:
    return Demand(
        demand,
        evaluations,
        f"{share.value:.4f} ({share.low:.3f} to {share.high:.3f})" if share.n else "not run",
        f"{BEST} {cited:.3f}",
        share.state(required) if share.n else None,
    )


def _first_of_all(outcome: Outcome) -> Iterable[Demand]:
    for evaluations in BUDGETS:
        by_rank = ranks_together(outcome, evaluations)
        beaten = signs_together(outcome, evaluations)
        where = "all held-out suites together"
        yield _first(by_rank, beaten, evaluations, f"{where}: lowest average rank, hypervolume")
        yield _better_than_each(beaten, evaluations, where, "hypervolume")
    for suite in (*HELD_OUT, BOTH_SIZES):
        where = named(outcome, suite)
        for evaluations in BUDGETS:
            ran = evaluations in outcome.budgets(suite)
            for measure, name in NAMES.items():
                by_rank = ranks(outcome, suite, evaluations, measure) if ran else {}
                beaten = tests(outcome, suite, evaluations, measure) if ran else []
                yield _first(by_rank, beaten, evaluations, f"{where}: lowest average rank, {name}")
                problems = len(outcome.problems(suite, evaluations))
                too_few = "" if can_show(problems, len(beaten)) else "; too few problems to show it"
                yield _better_than_each(beaten, evaluations, where, name, too_few)


def _first(
    by_rank: dict[str, float], tests: list[RivalTest], evaluations: int, demand: str
) -> Demand:
    """Ask for the lowest of average ranks by algorithm, which are empty if it was not run."""
    if not by_rank:
        return Demand(demand, evaluations, "not run", "", None)
    ours = by_rank[OURS]
    others = {name: rank for name, rank in by_rank.items() if name != OURS}
    best = min(others, key=lambda name: others[name])
    place = 1 + sum(rank < ours for rank in others.values())
    shared = ", shared" if ours in others.values() else ""
    measured = f"place {place} of {len(by_rank)}{shared}, rank {ours:.2f}"
    state = state_of(place == 1 and not shared, shown=all(test.beaten for test in tests))
    return Demand(demand, evaluations, measured, f"{best} {others[best]:.2f}", state)


def _better_than_each(
    tests: list[RivalTest], evaluations: int, where: str, name: str, further: str = ""
) -> Demand:
    demand = f"{where}: better than each beyond chance (Holm), {name}"
    if not tests:
        return Demand(demand, evaluations, "not run", "", None)
    measured = f"{sum(test.beaten for test in tests)} of {len(tests)}{further}"
    return Demand(demand, evaluations, measured, "", better_than_each(tests))


def _on_engineering(outcome: Outcome) -> Iterable[Demand]:
    demand = f"RE: no worse than {RIVAL_ON_RE}, hypervolume"
    for budget in outcome.budgets("RE") or BUDGETS[2:3]:
        if RIVAL_ON_RE not in outcome.algorithms("RE", budget):
            yield Demand(demand, budget, "not run", "", None)
            continue
        results = tests(outcome, "RE", budget, "hypervolume")
        test = next(finding for finding in results if finding.rival == RIVAL_ON_RE)
        measured = f"{test.better} better, {test.worse} worse, p = {significant(test.p, 2)}"
        state = rate(test.better, test.better + test.worse).state(0.5)
        yield Demand(demand, budget, measured, "", state)


def _constrained(outcome: Outcome) -> Iterable[Demand]:
    for suite in CONSTRAINED:
        for budget in outcome.budgets(suite) or BUDGETS[2:3]:
            for rival in FEASIBLE_RIVALS:
                demand = f"{suite}: feasible in as many runs as {rival}"
                if rival not in outcome.algorithms(suite, budget):
                    yield Demand(demand, budget, "not run", "", None)
                    continue
                runs = feasible_beside(outcome, suite, budget, rival)
                measured = f"{runs.ours} of {runs.runs}"
                yield Demand(demand, budget, measured, f"{rival} {runs.theirs}", runs.state)
            measure = indicators(suite)[0]
            ran = budget in outcome.budgets(suite)
            by_rank = ranks(outcome, suite, budget, measure) if ran else {}
            against = tests(outcome, suite, budget, measure) if ran else []
            yield _first(by_rank, against, budget, f"{suite}: first by hypervolume")


def in_one_sentence(outcome: Outcome) -> str:
    """Say what falls short first, then what is reached."""
    ahead = {
        place: share - cited
        for place, cited in CITED.items()
        if (share := reached(outcome, *place)) is not None
    }
    short = [
        f"{-gain:.3f} in {dimension}-D after {evaluations:,}"
        for (dimension, evaluations), gain in ahead.items()
        if gain < -LARGEST_SHORTFALL
    ]
    parts = []
    if ahead:
        parts.append(
            f"On the held-out bbob-biobj {OURS} falls short of {BEST} by more than "
            f"{LARGEST_SHORTFALL} in {len(short)} of {len(ahead)} cases"
            + (f": {', '.join(short)}" if short else "")
        )
    for suite in HELD_OUT:
        budgets = outcome.budgets(suite)
        places = []
        for budget in budgets:
            by_measure = []
            for measure, name in NAMES.items():
                by_rank = ranks(outcome, suite, budget, measure)
                place = 1 + int(np.sum([rank < by_rank[OURS] for rank in by_rank.values()]))
                others = [rank for rival, rank in by_rank.items() if rival != OURS]
                shared = " (shared)" if by_rank[OURS] in others else ""
                by_measure.append(f"{place}{shared} by {name}")
            places.append(f"{' and '.join(by_measure)} after {budget:,}")
        if places:
            count = len(outcome.algorithms(suite, budgets[0]))
            parts.append(
                f"On {named(outcome, suite)} its place among up to {count} is {', '.join(places)}"
            )
    return f"{'. '.join(parts)}." if parts else "Nothing was run."
