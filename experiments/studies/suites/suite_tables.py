"""What came out on the suites: in short, ranks, tests, feasible runs and medians."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.rivals import RivalTest, signs_against, tests_of_medians
from experiments.studies.suites.bbob_tables import BEST, CITED, reached, shares_of
from experiments.studies.suites.coco import FUNCTIONS
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.jobs import MEASURES
from experiments.studies.suites.peers import BBOB_PEERS, OURS
from experiments.studies.suites.problems import PROBLEMS, SUITES
from experiments.studies.suites.protocol import (
    BESIDE_PEERS,
    BOTH_SIZES,
    BUDGETS,
    CONSTRAINED,
    DIMENSIONS,
    HELD_OUT,
    VALIDATION,
)
from pymoo_hdte._comparing import indicators as measures
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.ranks import average_ranks
from pymoo_hdte._comparing.statistics import rate
from pymoo_hdte._runner.result import Cell, Column, Table

NAMES = {name: measures.NAMES[name] for name in ("hypervolume", "igd_plus")}
SWARMS = (OURS, "ElitistSwarm")


def indicators(suite: str) -> list[str]:
    """Return the indicators of a suite: IGD+ only where all fronts are known in closed form."""
    known = all(problem.front is not None for problem in SUITES[suite])
    return list(NAMES) if known else ["hypervolume"]


def named(outcome: Outcome, suite: str) -> str:
    """Return the name of a suite, with the number of its problems that ran if not all did."""
    ran = len(outcome.problems(suite, outcome.budgets(suite)[-1])) if outcome.budgets(suite) else 0
    whole = len(SUITES[suite])
    return suite if ran in (0, whole) else f"{suite} ({ran} of {whole} problems)"


def ranks(outcome: Outcome, suite: str, budget: int, measure: str) -> dict[str, float]:
    """Return average ranks of the medians over the seeds by algorithm, 1 being the best."""
    algorithms = outcome.algorithms(suite, budget)
    values = outcome.medians(suite, budget, measure, algorithms)
    means = average_ranks(values, smaller_is_better=measures.smaller_is_better(measure))
    return dict(zip(algorithms, means.tolist(), strict=True))


def tests(outcome: Outcome, suite: str, budget: int, measure: str) -> list[RivalTest]:
    """Test ours against every other over the problems of a suite, corrected after Holm.

    Only on problems that both took.
    """
    algorithms = outcome.algorithms(suite, budget)
    values = outcome.medians(suite, budget, measure, algorithms)
    return tests_of_medians(OURS, algorithms, missing_as_ours(values, algorithms), measure)


def can_show(problems: int, rivals: int) -> bool:
    """Say whether so few problems can show a lead over each of so many rivals beyond chance.

    If ours wins on all n problems, Wilcoxon's two-sided p is 2 / 2^n, and Holm multiplies the
    smallest p by the number of rivals.
    """
    return rivals * 2.0 ** (1 - problems) < SIGNIFICANT


def missing_as_ours(values: NDArray[np.float64], algorithms: Sequence[str]) -> NDArray[np.float64]:
    """Return the values with ours in the place of those of a problem that a rival cannot take."""
    ours = values[:, [list(algorithms).index(OURS)]]
    return np.where(np.isnan(values), ours, values)


def feasible_runs(outcome: Outcome, suite: str, budget: int, algorithm: str) -> tuple[int, int]:
    """Return in how many runs an algorithm found feasible solutions, and how many it made."""
    place = 1 + MEASURES.index("solutions")
    counts = [
        count
        for problem in outcome.problems(suite, budget)
        for count in outcome.runs(problem, algorithm, budget, place)
    ]
    return sum(count > 0 for count in counts), len(counts)


class Feasible(NamedTuple):
    """In how many runs ours found feasible solutions, a rival did, and ours alone, of how many."""

    ours: int
    theirs: int
    ours_alone: int
    runs: int

    @property
    def state(self) -> str:
        """Whether ours is feasible as often; shown by the runs in which one of the two is alone."""
        theirs_alone = self.theirs - (self.ours - self.ours_alone)
        return rate(self.ours_alone, self.ours_alone + theirs_alone).state(0.5)


def feasible_beside(outcome: Outcome, suite: str, budget: int, rival: str) -> Feasible:
    """Count the feasible runs of the pairs of problem and seed with which ours and a rival ran."""
    place = 1 + MEASURES.index("solutions")
    pairs = [
        (row[place] > 0, outcome.suites[problem, rival, budget, seed][place] > 0)
        for (problem, name, spent, seed), row in outcome.suites.items()
        if (name, spent) == (OURS, budget)
        and PROBLEMS[problem].suite == suite
        and (problem, rival, budget, seed) in outcome.suites
    ]
    ours, theirs = (sum(flags) for flags in zip(*pairs, strict=True))
    return Feasible(ours, theirs, pairs.count((True, False)), len(pairs))


def ranks_tables(outcome: Outcome) -> list[Table]:
    """Return average ranks on each suite that ran, the held-out one first."""
    suites = (*HELD_OUT, BOTH_SIZES, *VALIDATION)
    return [_ranks_table(outcome, suite) for suite in suites if outcome.budgets(suite)]


def _ranks_table(outcome: Outcome, suite: str) -> Table:
    budgets, measures = outcome.budgets(suite), indicators(suite)
    by_place = {(b, m): ranks(outcome, suite, b, m) for b in budgets for m in measures}
    algorithms = max(by_place.values(), key=len)
    order = sorted(algorithms, key=lambda name: by_place[budgets[-1], measures[0]].get(name, 99.0))
    columns = [Column("algorithm")]
    columns += [Column(NAMES[m], "", 3, f"{b:,} evaluations") for b, m in by_place]
    constrained = suite in CONSTRAINED
    rows: list[tuple[Cell, ...]] = []
    for name in order:
        row: list[Cell] = [name, *(entry.get(name) for entry in by_place.values())]
        if constrained:
            row.append("{} of {}".format(*feasible_runs(outcome, suite, budgets[-1], name)))
        rows.append(tuple(row))
    if constrained:
        columns.append(Column("feasible runs"))
    kind = "validation" if suite in VALIDATION else "held out"
    problems = outcome.problems(suite, budgets[-1])
    ran = f"{len(problems)} of its {len(SUITES[suite])} problems"
    if len(problems) < len(SUITES[suite]):
        ran += f" ({', '.join(problems)})"
    return Table(
        f"ranks_{suite.lower().replace('-', '')}",
        f"{suite}, {kind}: average ranks over {ran}, 1 being the best",
        tuple(columns),
        tuple(rows),
        note=f"Ranks of medians over {outcome.seeds(suite)} seeds or more, single runs if 1; one "
        "that cannot take a problem ranks last there.",
        folded=suite in VALIDATION,
    )


def rivals_tables(outcome: Outcome) -> list[Table]:
    """Test ours against each other on the held-out suites."""
    suites = (*HELD_OUT, BOTH_SIZES)
    return [_rivals_table(outcome, suite) for suite in suites if outcome.budgets(suite)]


def _rivals_table(outcome: Outcome, suite: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for budget in outcome.budgets(suite):
        by_measure = [tests(outcome, suite, budget, measure) for measure in NAMES]
        for pair in zip(*by_measure, strict=True):
            cells = [cell for test in pair for cell in (test.better, test.worse, test.p)]
            rows.append((pair[0].rival, budget, *cells))
    columns = [Column("rival"), Column("evaluations")]
    for name in NAMES.values():
        columns += [Column("better", group=name), Column("worse", group=name)]
        columns.append(Column("p", digits=2, group=name))
    return Table(
        f"rivals_{suite.lower()}",
        f"{suite}, held out: {OURS} against every other",
        tuple(columns),
        tuple(rows),
        note="Better and worse compare medians; on problems of which nobody found any hypervolume "
        "all are equal. p is Wilcoxon's over the problems that both take, after Holm over the "
        "rivals of a budget.",
        folded=True,
    )


def medians_tables(outcome: Outcome) -> list[Table]:
    """Return the median hypervolume of every algorithm on every problem at the largest budget."""
    tables = []
    for suite in SUITES:
        for budget in outcome.budgets(suite)[-1:]:
            algorithms = outcome.algorithms(suite, budget)
            values = outcome.medians(suite, budget, "hypervolume", algorithms)
            tables.append(
                Table(
                    f"medians_{suite.lower().replace('-', '')}",
                    f"{suite}: median hypervolume after {budget:,} evaluations",
                    (Column("problem"), *map(Column, algorithms)),
                    tuple(
                        (problem, *(None if np.isnan(value) else float(value) for value in row))
                        for problem, row in zip(
                            outcome.problems(suite, budget), values, strict=True
                        )
                    ),
                    folded=True,
                )
            )
    return tables


def in_short(outcome: Outcome) -> Table:
    """Shares of targets beside the best published, average ranks beside the best rival's."""
    rows = [_shares_in_short(outcome, dimension) for dimension in DIMENSIONS]
    rows += [_ranks_in_short(outcome, suite, measure) for suite in HELD_OUT for measure in NAMES]
    return Table(
        "in_short",
        "The held-out suites in short",
        (Column("suite"), *(Column(f"{budget:,}", group="evaluations") for budget in BUDGETS)),
        tuple(rows),
        note=f"bbob-biobj: {OURS}, in brackets the best published. Ranks: {' / '.join(SWARMS)}, in "
        "brackets the best of the others; 1 is the best.",
    )


def _shares_in_short(outcome: Outcome, dimension: int) -> tuple[str | None, ...]:
    cells: list[str | None] = [f"bbob-biobj, {dimension} dimensions: share of targets"]
    for budget in BUDGETS:
        share, cited = reached(outcome, dimension, budget), CITED.get((dimension, budget))
        beside = "" if cited is None else f" ({BEST} {cited:.3f})"
        cells.append(None if share is None else f"{share:.4f}{beside}")
    return tuple(cells)


def _ranks_in_short(outcome: Outcome, suite: str, measure: str) -> tuple[str | None, ...]:
    budgets = outcome.budgets(suite)
    count = max((len(outcome.algorithms(suite, budget)) for budget in budgets), default=0)
    cells: list[str | None] = [
        f"{named(outcome, suite)}: average rank of up to {count} by {NAMES[measure]}"
    ]
    for budget in BUDGETS:
        if budget not in budgets:
            cells.append(None)
            continue
        by_rank = ranks(outcome, suite, budget, measure)
        ours = " / ".join(f"{by_rank.pop(name):.2f}" for name in SWARMS if name in by_rank)
        best = min(by_rank, key=lambda name: by_rank[name])
        cells.append(f"{ours} ({best} {by_rank[best]:.2f})")
    return tuple(cells)


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
    medians = missing_as_ours(values(outcome, budget, names), names)
    return signs_against(OURS, names, medians, smaller_is_better=False)


def _shares(outcome: Outcome, name: str, budget: int) -> list[float] | None:
    """Return the share on each problem after a budget, None if one was not run."""
    shares = [
        share
        for dimension in DIMENSIONS
        for share in shares_of(outcome, dimension, name, BESIDE_PEERS, budget)
    ]
    return shares if len(shares) == len(DIMENSIONS) * len(FUNCTIONS) else None


def together_table(outcome: Outcome) -> Table:
    """Show average ranks over all problems, and ours against each."""
    rows: list[tuple[Cell, ...]] = []
    for budget in BUDGETS:
        tests = {test.rival: test for test in signs_together(outcome, budget)}
        by_rank = ranks_together(outcome, budget)
        for name in sorted(by_rank, key=lambda name: by_rank[name]):
            cells: tuple[Cell, ...] = (None, None, None)
            if name in tests:
                cells = tests[name].better, tests[name].worse, tests[name].p
            rows.append((budget, name, by_rank[name], *cells))
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
