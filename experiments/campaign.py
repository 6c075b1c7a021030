"""Many independent jobs on many workers, each finished one kept on disk.

A job carries its own seed and reads nothing but its fields, so neither the number of workers nor
the order in which jobs finish can change what it gives. Results come back in the order of the jobs.
"""

from __future__ import annotations

import csv
import inspect
import json
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.provenance import environment, fingerprint
from experiments.store import TIMES, csv_bytes, write_atomically
from experiments.workers import interrupts_held_off


@dataclass(frozen=True)
class Run:
    """What one job gives: named columns of numbers (n, columns), and the seconds it took.

    ``parts`` are the seconds of its parts, where somebody asks for them.
    """

    columns: tuple[str, ...]
    values: NDArray[np.float64]
    seconds: float
    parts: tuple[float, ...] = ()


class Job(Protocol):
    """A unit of work that can be pickled and names itself uniquely by all its settings."""

    @property
    def key(self) -> str:
        """File name without suffix; two jobs with the same key do the same."""

    def execute(self) -> Run:
        """Do the work; the same job gives the same columns and values every time."""


class Campaign:
    """Runs jobs and keeps every finished one in ``out/runs/<fingerprint>/<key>.csv``.

    Seconds are kept apart, in ``out/times/runs``, because they differ from run to run.

    Parameters
    ----------
    out
        Folder of the results.
    executor
        Where the jobs run; None for this process.
    """

    def __init__(self, out: Path, executor: Executor | None = None) -> None:
        self.out = out
        self.executor = executor

    def run(self, jobs: Sequence[Job], title: str) -> list[Run]:
        """Return the runs in the order of ``jobs``; only those not on disk are executed.

        On an interrupt, jobs that have begun on other processes are finished and kept, the others
        are dropped, and the interrupt goes on to the caller.
        """
        pending = [job for job in jobs if not self._path(job).is_file()]
        done = len(jobs) - len(pending)
        with tqdm(total=len(jobs), initial=done, desc=title, unit="run", delay=2.0) as progress:

            def keep(job: Job, run: Run) -> None:
                self._keep(job, run)
                progress.update()

            if self.executor is None:
                for job in pending:
                    keep(job, job.execute())
            else:
                _run_in_executor(self.executor, pending, keep)
        return [self._read(job) for job in jobs]

    def _path(self, job: Job) -> Path:
        # A job's outcome may depend on any module of its package, not only on its own.
        source = fingerprint(*sorted(Path(inspect.getfile(type(job))).parent.glob("*.py")))
        return self.out / "runs" / source / f"{job.key}.csv"

    def _time_path(self, job: Job) -> Path:
        path = self._path(job).relative_to(self.out)
        return (self.out / TIMES / path).with_suffix(".txt")

    def _keep(self, job: Job, run: Run) -> None:
        settings = self._path(job).parent / "versions.json"
        if not settings.is_file():
            write_atomically(settings, (json.dumps(environment(), indent=1) + "\n").encode())
        times = "".join(f"{seconds!r}\n" for seconds in (run.seconds, *run.parts))
        write_atomically(self._time_path(job), times.encode())
        # The values come last: their file is the sign that the job is finished.
        write_atomically(self._path(job), csv_bytes(run.columns, run.values.tolist()))

    def _read(self, job: Job) -> Run:
        with self._path(job).open(newline="") as file:
            heading, *rows = csv.reader(file)
        values = np.array(rows, dtype=float).reshape(len(rows), len(heading))
        seconds, *parts = map(float, self._time_path(job).read_text().split())
        return Run(tuple(heading), values, seconds, tuple(parts))


def _run_in_executor(
    executor: Executor, jobs: Sequence[Job], keep: Callable[[Job, Run], None]
) -> None:
    with interrupts_held_off():
        waiting: dict[Future[Run], Job] = {executor.submit(execute, job): job for job in jobs}
    try:
        for future in as_completed(list(waiting)):
            run = future.result()
            keep(waiting.pop(future), run)
    except BrokenExecutor:
        # The workers are gone: nothing has begun that could still be waited for.
        raise
    except BaseException:
        with interrupts_held_off():
            begun = [future for future in waiting if not future.cancel()]
            tqdm.write(f"Stopping; waiting for {len(begun)} runs under way.", file=sys.stderr)
            for future in wait(begun).done:
                if future.exception() is None:
                    keep(waiting[future], future.result())
        raise


def execute(job: Job) -> Run:
    """Execute ``job`` in a worker process."""
    return job.execute()
