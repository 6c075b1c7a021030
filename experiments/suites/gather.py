"""The stored outcome from a run of the protocol that was stopped before its end.

``python -m experiments.suites.gather FOLDER`` takes every finished run in a folder of a campaign
(``OUT/runs/ORIGIN``) that belongs to a whole group of the protocol (``groups`` of its parts), and
writes the CSV files that the repository keeps. No other choice is made.
"""

from __future__ import annotations

import sys
from pathlib import Path

from experiments.runner.campaign import read_run
from experiments.runner.committed import DATA
from experiments.runner.result import Cell, Column, Table
from experiments.suites.data import COMMAND, Outcome, write_outcome
from experiments.suites.protocol import STORED, BbobPart

STOPPED = f"{COMMAND}, stopped before its end; whole groups of runs only"


def gathered(folder: Path) -> Outcome:
    """Return the outcome of all whole groups among the runs that lie in a folder."""
    outcome = Outcome()
    for part in STORED:
        for group in part.groups():
            paths = [folder / f"{job.key}.csv" for job in group]
            if all(path.is_file() for path in paths):
                outcome.add(group, [read_run(path) for path in paths])
    return outcome


def kept_table(outcome: Outcome) -> Table:
    """Show of which parts of the stored protocol how many groups are there."""
    rows: list[tuple[Cell, ...]] = []
    for part in STORED:
        groups = [*part.groups()]
        whole = sum(all(map(outcome.has, group)) for group in groups)
        if isinstance(part, BbobPart):
            instances = ", ".join(map(str, part.instances))
            name, budgets = f"bbob-biobj, instances {instances}", part.told
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
        note="A group is all functions of bbob-biobj of one dimension, instance and budget, or all "
        "algorithms of the part on one problem with one seed. The run was stopped before its end, "
        "because the time of the processor was over; every group that was whole is kept, no other "
        "choice was made.",
        folded=True,
    )


def main(folder: Path) -> None:
    """Write what was gathered over the stored outcome."""
    write_outcome(gathered(folder), DATA, STOPPED)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
