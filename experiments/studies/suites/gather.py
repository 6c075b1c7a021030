"""The stored outcome from runs of the protocol, some of which were made earlier than others.

``python -m experiments.studies.suites.gather FOLDER...`` takes every finished run in folders of
campaigns (``OUT/runs/ORIGIN``), and what is stored already, as far as it belongs to a whole group
of the protocol (``groups`` of its parts), and writes the CSV files that the repository keeps. No
other choice is made. After a change of an algorithm, ``--anew NAME,NAME`` leaves out what is stored
of it; `only` runs some algorithms.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from experiments.runner.campaign import read_run
from experiments.runner.committed import DATA
from experiments.runner.result import Cell, Column, Table
from experiments.studies.suites.data import Outcome, stored, write_outcome
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.peers import ON_BBOB, ON_SUITES
from experiments.studies.suites.protocol import STORED, BbobPart
from pymoo_hdte.checks import InvalidInput, one_of

COMMAND = (
    "python -m experiments.studies.suites.gather; whole groups of runs only, those of algorithms "
    "that did not change kept from before"
)


def gathered(folders: Sequence[Path], before: Outcome) -> Outcome:
    """Return the outcome of all whole groups among the runs in folders and in another outcome.

    A run that lies in several places is taken from the first folder that has it.

    Raises
    ------
    InvalidInput
        If a file and the other outcome tell differently of a run: its algorithm changed, so that
        nothing that is stored of it may stand beside new runs.
    """
    outcome = Outcome()
    for part in STORED:
        groups: Iterable[Sequence[SuiteRun | BbobRun]] = part.groups()
        for group in groups:
            found = [path_of(folders, job.key) for job in group]
            if not all(path or before.has(job) for job, path in zip(group, found, strict=True)):
                continue
            for job, path in zip(group, found, strict=True):
                if path:
                    outcome.add([job], [read_run(path)])
                    _check_same(job, outcome, before)
                else:
                    outcome.take(job, before)
    return outcome


def _check_same(job: SuiteRun | BbobRun, outcome: Outcome, before: Outcome) -> None:
    if before.has(job) and not np.array_equal(
        outcome.numbers(job), before.numbers(job), equal_nan=True
    ):
        allowed = f"what is stored, if its algorithm did not change, else --anew {job.algorithm}"
        raise InvalidInput(job.key, outcome.numbers(job).tolist(), allowed)


def path_of(folders: Sequence[Path], key: str) -> Path | None:
    """Return the file of a finished run in the first folder that has it."""
    paths = (folder / f"{key}.csv" for folder in folders)
    return next((path for path in paths if path.is_file()), None)


def kept_table(outcome: Outcome) -> Table:
    """Show of which parts of the stored protocol how many groups are there."""
    rows: list[tuple[Cell, ...]] = []
    for part in STORED:
        groups = [*part.groups()]
        whole = sum(all(map(outcome.has, group)) for group in groups)
        if isinstance(part, BbobPart):
            instances = ", ".join(map(str, part.instances))
            name, budgets = f"bbob-biobj, instance {instances}", part.told
        else:
            name, budgets = f"{part.suite}, {part.seeds} seeds", part.budgets
        who = (part.algorithm,) if isinstance(part, BbobPart) else part.algorithms
        told = ", ".join(f"{budget:,}" for budget in budgets)
        many = ", ".join(who) if len(who) < 4 else f"{len(who)} algorithms"
        rows.append((name, many, told, whole, len(groups)))
    columns = ("part", "algorithms", "evaluations", "kept", "of groups")
    return Table(
        "kept",
        "What was run of the stored protocol",
        tuple(Column(name) for name in columns),
        tuple(rows),
        note="A group is one algorithm with one seed on all functions of bbob-biobj of one "
        "dimension, instance and budget, or on all problems of a suite. What is missing was not "
        "run to its end: COMO-CMA-ES took all memory on IMOP3 after 25,000 evaluations. Every "
        "group that was whole is kept, no other choice was made. Runs of algorithms that did not "
        "change are kept from before.",
        folded=True,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Write what was gathered over the stored outcome."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.suites.gather")
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="OUT/runs/ORIGIN")
    parser.add_argument("--anew", default="", metavar="NAME,NAME", help="keep nothing stored of it")
    options = parser.parse_args(arguments)
    anew = [name for name in options.anew.split(",") if name]
    for name in anew:
        one_of("--anew", name, [*ON_SUITES, *ON_BBOB])
    before = stored().without(anew)
    write_outcome(gathered(options.folders, before), DATA, COMMAND)


if __name__ == "__main__":
    main()
