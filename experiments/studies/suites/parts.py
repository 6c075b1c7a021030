"""Our swarm with all parts beside itself with one left out: which are shown to help, and where."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from experiments.comparing.rivals import RivalTest, holm_against
from experiments.studies.suites.bbob_tables import duels
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.protocol import BUDGETS, CONSTRAINED, OF_PARTS, PLAIN
from experiments.studies.suites.reduced import ALONE, ON_CONSTRAINED, ON_PLAIN, WHOLE
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.statistics import holm
from pymoo_hdte._runner.result import Column, Table

JUDGED_AT = BUDGETS[2]
"""Evaluations after which suites are judged, and the most on bbob-biobj."""


class PartTest(NamedTuple):
    """The whole swarm and one that lacks something on the same problems."""

    part: str
    where: str
    evaluations: int
    problems: int
    whole: float
    less: float
    test: RivalTest

    @property
    def helps(self) -> bool:
        """Whether the whole swarm is better beyond chance."""
        return self.test.beaten

    @property
    def gain(self) -> float:
        """What is gained without it, in the mean."""
        return self.less - self.whole


def part_tests(outcome: Outcome) -> list[PartTest]:
    """Return the tests of all parts left out alone; p after Holm over all of them."""
    tests = [
        test for part in ALONE for test in (*on_bbob(outcome, part), *_on_suites(outcome, part))
    ]
    corrected = holm([finding.test.p for finding in tests])
    return [
        test._replace(test=test.test._replace(p=float(p)))
        for test, p in zip(tests, corrected, strict=True)
    ]


def on_bbob(outcome: Outcome, less: str) -> Iterable[PartTest]:
    """Yield the tests by the share of targets, uncorrected."""
    where = f"bbob-biobj, instance {OF_PARTS}"
    for budget in BUDGETS[: 1 + BUDGETS.index(JUDGED_AT)]:
        for duel in duels(outcome, budget, [less], WHOLE):
            yield PartTest(less, where, budget, duel.problems, duel.ours, duel.theirs, duel.test)


def _on_suites(outcome: Outcome, less: str) -> Iterable[PartTest]:
    for suites, parts in ((PLAIN, ON_PLAIN), (CONSTRAINED, ON_CONSTRAINED)):
        if less in parts:
            yield from on_suites(outcome, less, suites, JUDGED_AT)


def on_suites(
    outcome: Outcome, less: str, suites: Sequence[str], budget: int
) -> Iterable[PartTest]:
    """Yield the test by the median hypervolume on some suites together, if both ran there."""
    names = [WHOLE, less]
    medians = [outcome.medians(suite, budget, "hypervolume", names, WHOLE) for suite in suites]
    values = np.concatenate(medians)
    values = values[~np.isnan(values).any(axis=1)]
    if len(values):
        (test,) = holm_against(WHOLE, names, values, smaller_is_better=False)
        whole, without = values.mean(axis=0).tolist()
        yield PartTest(less, " and ".join(suites), budget, len(values), whole, without, test)


def parts_table(outcome: Outcome) -> Table:
    """Show what a part brings."""
    rows = [
        (
            *(test.part, test.where, test.evaluations, test.problems, test.whole, test.less),
            *(test.test.better, test.test.worse, test.test.p, "yes" if test.helps else "no"),
        )
        for test in part_tests(outcome)
    ]
    return Table(
        "parts",
        f"{OURS} with a part left out",
        (
            *(Column("left out"), Column("where"), Column("evaluations"), Column("problems")),
            *(Column(name, "", 3, "mean") for name in ("whole", "less")),
            *(Column("whole better"), Column("worse"), Column("p", digits=2)),
            Column("shown to help"),
        ),
        tuple(rows),
        note="bbob-biobj by the share of targets, in both dimensions; other suites, of validation, "
        "by the median hypervolume up to 1.1 in normalised objectives. p is Wilcoxon's over the "
        f"problems, after Holm over all rows; shown to help is p below {SIGNIFICANT}.",
    )
