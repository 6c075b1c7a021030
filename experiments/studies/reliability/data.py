"""Outcomes of the reliability suite: as objects, and as the small CSV files that are kept.

Memory and seconds are in a separate file, because they differ from run to run. ``python -m
experiments.studies.reliability.data FILE`` tells what failed in a file of tallies, since an
experiment ends well whatever it finds.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from scipy.stats import binomtest

from experiments.runner.committed import read_rows, table_with_origin
from experiments.studies.reliability.fuzz import ACCEPTED, REFUSED
from experiments.studies.reliability.limits import LimitJob, MemoryJob
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.campaign import Run

FUZZ, KILL, LIMIT = "fuzz", "kill", "limit"
LEVEL = 0.95


@dataclass(frozen=True)
class Tally:
    """Trials of one kind, and how many of them went wrong.

    Attributes
    ----------
    part : str
        `FUZZ`, `KILL` or `LIMIT`.
    kind : str
    trials : int
        Inputs, kills, or runs under a limit; 0 where the machine does not let us try.
    refused, accepted : int
        Of inputs; runs that came to their end count as accepted where they were killed before.
    failed : int
    failing : str
        Numbers of the inputs that failed, or names of what failed.
    """

    part: str
    kind: str
    trials: int
    refused: int
    accepted: int
    failed: int
    failing: str = ""

    @property
    def bound(self) -> float:
        """Upper end of the exact one-sided 95 % interval of the rate of failures."""
        if not self.trials:
            return 1.0
        test = binomtest(min(self.failed, self.trials), self.trials, alternative="less")
        return float(test.proportion_ci(LEVEL, method="exact").high)


@dataclass(frozen=True)
class Peak:
    """Peak of resident memory (bytes) and processor time (s) of one experiment."""

    experiment: str
    memory: float
    seconds: float


def tally_of_inputs(kind: str, runs: Sequence[Run]) -> Tally:
    """Count the outcomes of all inputs of a kind."""
    rows = [row for run in runs for row in run.values.astype(int).tolist()]
    outcomes = [outcome for _, outcome in rows]
    failing = [str(number) for number, outcome in rows if outcome not in (REFUSED, ACCEPTED)]
    counts = len(rows), outcomes.count(REFUSED), outcomes.count(ACCEPTED), len(failing)
    return Tally(FUZZ, kind, *counts, " ".join(failing))


def tally_of_kills(kind: str, runs: Sequence[Run]) -> Tally:
    """Count kills, runs that came to their end, and all that must not happen."""
    total = {
        name: int(sum(run.values[0, index] for run in runs))
        for index, name in enumerate(runs[0].columns)
    }
    kills, finished = total.pop("kills"), total.pop("finished")
    failing = " ".join(f"{name}:{count}" for name, count in total.items() if count)
    return Tally(KILL, kind, kills, 0, finished, sum(total.values()), failing)


def tally_of_limit(job: LimitJob, run: Run) -> Tally:
    """Count the trials under a limit."""
    trials, failed = run.values[0].astype(int).tolist()
    return Tally(LIMIT, job.name, trials, 0, trials - failed, failed)


def peak(job: MemoryJob, run: Run) -> Peak:
    """Return what an experiment needed."""
    if run.values[0, 0] != 0.0:
        raise RuntimeError(f"{job.name} ended with code {run.values[0, 0]:g}")
    return Peak(" ".join((job.name, *job.options)), run.parts[0], run.seconds)


def format_tallies(tallies: Iterable[Tally]) -> str:
    """Return the CSV text of tallies, with date and versions in a first comment line."""
    return table_with_origin(_columns(Tally), map(astuple, tallies))


def format_peaks(peaks: Iterable[Peak]) -> str:
    """Return the CSV text of peaks."""
    return csv_text(_columns(Peak), map(astuple, peaks))


def _columns(kind: type[Tally] | type[Peak]) -> list[str]:
    return [field.name for field in fields(kind)]


def read_tallies(path: Path) -> list[Tally]:
    """Read what `format_tallies` wrote."""
    return [
        Tally(
            part=row["part"],
            kind=row["kind"],
            trials=int(row["trials"]),
            refused=int(row["refused"]),
            accepted=int(row["accepted"]),
            failed=int(row["failed"]),
            failing=row["failing"],
        )
        for row in read_rows(path)
    ]


def read_peaks(path: Path) -> list[Peak]:
    """Read what `format_peaks` wrote."""
    return [
        Peak(row["experiment"], float(row["memory"]), float(row["seconds"]))
        for row in read_rows(path)
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Tell what failed in a file of tallies; 0 if nothing did."""
    (path,) = sys.argv[1:] if arguments is None else arguments
    failed = [tally for tally in read_tallies(Path(path)) if tally.failed]
    for one in failed:
        print(f"{one.part}, {one.kind}: {one.failed} of {one.trials} failed: {one.failing}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
