"""All blind runs: what came of each with the code of its time, and of all together.

Only the outcome of the last run is kept case by case. A run starts where the one before it ended,
at cases that nobody has seen. ``python -m experiments blind --full`` leaves the row of what it ran
in the results; who stores it gives the commit that ran, which was stated before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from experiments.runner.committed import read_rows
from experiments.studies.blind.outcome import Outcome
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.result import Cell, Column, Table

RUNS = "blind_runs.csv"
SINCE = 3428
"""First case of the runs that met the score, which the figures are pooled from.

An earlier state of the score had met the cases of the run before it.
"""


@dataclass(frozen=True)
class Counts:
    """Numbers of answers or cases, each followed by how many of them came out as its name says."""

    plain: int
    plain_wrong: int
    single: int
    single_right: int
    pair: int
    pair_both: int
    triple: int
    triple_two: int
    clean: int
    clean_alarms: int
    interval: int
    interval_holds: int

    def __add__(self, other: Counts) -> Counts:
        pairs = zip(astuple(self), astuple(other), strict=True)
        return Counts(*(own + two for own, two in pairs))


@dataclass(frozen=True)
class BlindRun:
    """The cases from the first to the last of the list, counted from 1, and the code they met."""

    first: int
    last: int
    code: str
    counts: Counts


def run_of(outcomes: Sequence[Outcome], first: int, code: str = "") -> BlindRun:
    """Return the run of outcomes, which stand together in the list, from its first number on."""
    single, pair, triple, clean = (
        [outcome for outcome in outcomes if outcome.case.kind == kind]
        for kind in ("single", "pair", "triple", "none")
    )
    plain = [outcome for outcome in outcomes if outcome.confident]
    covered = [held for outcome in outcomes for held in outcome.covered]
    counts = Counts(
        plain=len(plain),
        plain_wrong=sum(outcome.wrong_confident for outcome in plain),
        single=len(single),
        single_right=sum(outcome.right for outcome in single),
        pair=len(pair),
        pair_both=sum(outcome.all_named for outcome in pair),
        triple=len(triple),
        triple_two=sum(outcome.two_named for outcome in triple),
        clean=len(clean),
        clean_alarms=sum(outcome.status != "adequate" for outcome in clean),
        interval=len(covered),
        interval_holds=sum(covered),
    )
    return BlindRun(first, first + len(outcomes) - 1, code, counts)


def read_runs(path: Path) -> list[BlindRun]:
    """Read what `format_runs` wrote."""
    return [
        BlindRun(
            int(row["first"]),
            int(row["last"]),
            row["code"],
            Counts(*(int(row[field.name]) for field in fields(Counts))),
        )
        for row in read_rows(path)
    ]


def format_runs(runs: Sequence[BlindRun]) -> str:
    """Return the CSV text of runs."""
    columns = ["first", "last", "code", *(field.name for field in fields(Counts))]
    rows = [(run.first, run.last, run.code, *astuple(run.counts)) for run in runs]
    return csv_text(columns, rows)


def total(runs: Sequence[BlindRun]) -> Counts:
    """Return the counts of several runs together."""
    return sum((run.counts for run in runs[1:]), runs[0].counts)


def recent(runs: Sequence[BlindRun]) -> list[BlindRun]:
    """Return the runs since case `SINCE`, or the last one if none begins there or later."""
    return [run for run in runs if run.first >= SINCE] or list(runs[-1:])


def runs_table(runs: Sequence[BlindRun]) -> Table:
    """Return a row a run, all of them together last."""
    rows: list[tuple[Cell, ...]] = [
        (f"{run.first} to {run.last}", run.code, *astuple(run.counts)) for run in runs
    ]
    rows.append((f"{runs[0].first} to {runs[-1].last}", "all", *astuple(total(runs))))
    groups = {
        "unqualified answers": "wrong",
        "one effect": "right",
        "two effects": "both",
        "three effects": "two",
        "nothing hidden": "alarms",
        "95 % intervals": "hold",
    }
    columns = [Column("cases"), Column("code")]
    for group, outcome in groups.items():
        columns += [Column("of", group=group), Column(outcome, group=group)]
    note = (
        "Each run met cases that nobody had seen, with the code of its time, which the runs "
        "before it had led to. Answers are counted as above, by the rules of now."
    )
    return Table("runs", "All runs so far", tuple(columns), tuple(rows), note=note)
