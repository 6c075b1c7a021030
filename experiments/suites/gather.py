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
from experiments.runner.store import write_atomically
from experiments.suites.data import BBOB, COMMAND, NAME, Outcome, bbob_text, suites_text
from experiments.suites.protocol import STORED

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


def main(folder: Path) -> None:
    """Write what was gathered over the stored outcome."""
    outcome = gathered(folder)
    for name, text in (
        (NAME, suites_text(outcome, STOPPED)),
        (BBOB, bbob_text(outcome, STOPPED)),
    ):
        write_atomically(DATA / f"{name}.csv", text.encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
