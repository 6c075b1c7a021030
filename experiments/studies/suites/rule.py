"""Remove parts from the swarm one after another, by the rule of `protocol`.

``python -m experiments.studies.suites.rule OUT`` runs the swarms that the rule needs and stores the
runs in ``OUT/runs/ORIGIN``, from which `gather` reads them. If it is interrupted, call it again and
it continues; ``--done`` names further folders with stored runs. As soon as a swarm is found worse
on one group of problems, its runs on the others are skipped.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from experiments.comparing.paired import SIGNIFICANT
from experiments.runner.campaign import Campaign, read_run
from experiments.runner.result import Cell, Column, Table
from experiments.studies.suites.data import Outcome, stored
from experiments.studies.suites.gather import path_of
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.parts import (
    PartTest,
    on_bbob,
    on_suites,
    part_tests,
)
from experiments.studies.suites.problems import problem_of
from experiments.studies.suites.protocol import (
    OURS,
    BbobPart,
    SuitePart,
    where_parts_leave,
)
from experiments.studies.suites.reduced import (
    LACKED,
    LESS,
    WHOLE,
    twins_without_constraints,
    without_all,
)

PLACES = 6
"""Tests of a step: three budgets of bbob-biobj and three groups of suites."""


class Step(NamedTuple):
    """A part that is left out beside all that left before, against the swarm with all parts."""

    part: str
    less: str
    tests: list[PartTest]

    @property
    def worse(self) -> list[PartTest]:
        """Return where the swarm is worse, p uncorrected."""
        return [one for one in self.tests if one.test.ahead and one.test.p < SIGNIFICANT]

    @property
    def leaves(self) -> bool:
        """Whether the part leaves."""
        return not self.worse

    @property
    def decided(self) -> bool:
        """Whether enough was run: everything, or where the swarm is worse."""
        return not self.leaves or len(self.tests) == PLACES


def order(outcome: Outcome) -> list[str]:
    """Return the parts that are not shown to help by themselves, the one missed least first."""
    gains: dict[str, float] = defaultdict(float)
    helps = set()
    for one in part_tests(outcome):
        gains[one.part] += one.gain
        if one.helps:
            helps.add(one.part)
    rest = [name for name in LACKED if name in gains and name not in helps]
    return [LACKED[name] for name in sorted(rest, key=lambda name: -gains[name])]


def steps(outcome: Outcome) -> list[Step]:
    """Follow the rule as far as the outcome has the runs of its swarms."""
    left: list[str] = []
    found = []
    for part in order(outcome):
        step = step_of(outcome, left, part)
        if not step.decided:
            break
        found.append(step)
        if step.leaves:
            left.append(part)
    return found


def step_of(outcome: Outcome, left: Sequence[str], part: str) -> Step:
    """Test the swarm without a part and without those that left before, where all was run."""
    less = without_all([*left, part])
    tests: list[PartTest] = []
    for place in where_parts_leave(less) if less in LESS else ():
        jobs = [job for one in place for job in one.jobs()]
        alike = [] if any(map(_constrained, jobs)) else twins_without_constraints(less)
        for name in (less, *alike):
            if all(outcome.has(replace(job, algorithm=name)) for job in jobs):
                tests += _tests(outcome, name, place)
                break
    return Step(part, less, tests)


def _tests(
    outcome: Outcome, less: str, place: Sequence[SuitePart | BbobPart]
) -> Iterable[PartTest]:
    suites = [one for one in place if isinstance(one, SuitePart)]
    if not suites:
        return on_bbob(outcome, less)
    return on_suites(outcome, less, [one.suite for one in suites], suites[0].budgets[0])


def steps_table(outcome: Outcome) -> Table:
    """Show what came of the rule."""
    rows: list[tuple[Cell, ...]] = []
    for step in steps(outcome):
        for one in step.tests:
            rows.append(
                (
                    *(step.part, one.where, one.evaluations, one.whole, one.less),
                    *(one.test.better, one.test.worse, one.test.p),
                    "leaves" if step.leaves else "stays",
                )
            )
    return Table(
        "rule",
        f"Parts that left {OURS} one after another, and parts that stay",
        (
            *(Column("left out too"), Column("where"), Column("evaluations")),
            *(Column(name, "", 3, "mean") for name in ("whole", "less")),
            *(Column("whole better"), Column("worse"), Column("p", digits=2), Column("so it")),
        ),
        tuple(rows),
        note="Parts that are not shown to help by themselves, the one that is missed least first, "
        "each left out together with all that left before it. It leaves unless the whole swarm is "
        f"better anywhere with p below {SIGNIFICANT}, Wilcoxon's over the problems, uncorrected.",
        folded=True,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Carry the rule to its end and say what comes of it."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.suites.rule")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--done", nargs="*", default=[], type=Path, metavar="FOLDER")
    options = parser.parse_args(arguments)
    campaign, outcome = Campaign(options.out), stored()
    left: list[str] = []
    _run(campaign, options.done, outcome, chain(*where_parts_leave(WHOLE)))
    for lacking in order(outcome):
        for place in where_parts_leave(without_all([*left, lacking])):
            _run(campaign, options.done, outcome, place)
            step = step_of(outcome, left, lacking)
            if not step.leaves:
                break
        for one in step.tests:
            found = f"gain {one.gain:+.4f}, whole better {one.test.better}, worse {one.test.worse}"
            print(f"{step.less}: {one.where}, {one.evaluations}: {found}, p {one.test.p:.3g}")
        print(f"{lacking} {'leaves' if step.leaves else 'stays'}", flush=True)
        if step.leaves:
            left.append(lacking)


def _run(
    campaign: Campaign,
    done: Sequence[Path],
    outcome: Outcome,
    parts: Iterable[SuitePart | BbobPart],
) -> None:
    """Add what an outcome lacks; runs that are done, or those of a twin, are taken."""
    missing: list[SuiteRun | BbobRun] = []
    for job in (job for part in parts for job in part.jobs()):
        twins = [] if _constrained(job) else twins_without_constraints(job.algorithm)
        alike = [name for name in twins if outcome.has(replace(job, algorithm=name))]
        path = path_of(done, job.key)
        if outcome.has(job):
            continue
        if path:
            outcome.add([job], [read_run(path)])
        elif alike:
            outcome.take(job, outcome, alike[0])
        else:
            missing.append(job)
    outcome.add(missing, campaign.run(missing, missing[0].key if missing else ""))


def _constrained(job: SuiteRun | BbobRun) -> bool:
    return isinstance(job, SuiteRun) and problem_of(job.problem).has_constraints()


if __name__ == "__main__":
    main()
