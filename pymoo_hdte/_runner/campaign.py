"""Many independent jobs on many workers, each finished one kept on disk.

A job carries its own seed and reads nothing but its fields, so neither the number of workers nor
the order in which jobs finish can change what it gives. Results come back in the order of the jobs.
Only the process that asks writes files, and a worker that would give other bytes is refused.
"""

from __future__ import annotations

import hashlib
import inspect
import io
import json
import platform
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from pymoo_hdte._io.csv_table import csv_text, read_text_table
from pymoo_hdte._runner.provenance import environment, fingerprint
from pymoo_hdte._runner.store import TIMES, write_atomically
from pymoo_hdte._runner.workers import WorkerLost, WrongWorker, arithmetic, interrupts_held_off

SOURCE = "source or versions"
ONE_JOB = Lock()
"""Held by the job that runs in this process: jobs need not be safe for threads."""


@dataclass(frozen=True)
class Run:
    """What one job gives: named columns of numbers (n, columns), and the seconds it took.

    ``parts`` are the seconds of its parts, where they are needed; ``trace`` (k, columns) is what
    it noted on its way, where it did.
    """

    columns: tuple[str, ...]
    values: NDArray[np.float64]
    seconds: float
    parts: tuple[float, ...] = ()
    trace: NDArray[np.float64] | None = None


class Job(Protocol):
    """A unit of work that can be pickled and names itself uniquely by all its settings."""

    @property
    def key(self) -> str:
        """File name without suffix; two jobs with the same key do the same."""

    def execute(self) -> Run:
        """Do the work; the same job gives the same columns and values every time."""


Keep = Callable[[Job, Run], None]
"""What is done with a finished job."""


class Campaign:
    """Runs jobs and keeps every finished one in ``out/runs/<origin>/<key>.csv``.

    The folder is named by a hash of the `origin`, which ``versions.json`` in it spells out, so that
    no run is taken for that of another source, other versions or another kind of processor. Seconds
    are kept apart, in ``out/times/runs``, because they differ from run to run.

    Parameters
    ----------
    out
        Folder of the results.
    executor
        Where the jobs run; None for this process.
    silent
        Whether there is no bar of progress; None for one on terminals alone.
    """

    def __init__(
        self, out: Path, executor: Executor | None = None, silent: bool | None = False
    ) -> None:
        self.out = out
        self.executor = executor
        self.silent = silent

    def run(self, jobs: Sequence[Job], title: str) -> list[Run]:
        """Return the runs in the order of ``jobs``; only those not on disk are executed.

        On an interrupt, jobs that have begun on other processes are finished and kept, the others
        are dropped, and the interrupt goes on to the caller. A Dask scheduler drops both. The
        exception of a job goes on to the caller with the name of the job in a note.

        Raises
        ------
        WorkerLost
            A job ends every worker that runs it.
        WrongWorker
            A worker cannot give the bytes of this process.
        BrokenExecutor
            The executor itself has ended.
        """
        pending = [job for job in jobs if not self._finished(job)]
        done = len(jobs) - len(pending)
        bar = {"desc": title, "unit": "run", "delay": 2.0, "disable": self.silent}
        with tqdm(total=len(jobs), initial=done, **bar) as progress:

            def keep(job: Job, run: Run) -> None:
                self._keep(job, run)
                progress.update()

            try:
                self._execute(pending, keep)
            except Exception as error:
                error.add_note(f"What is finished is kept in {self.out}; a rerun goes on from it.")
                raise
        return [self._read(job) for job in jobs]

    def _execute(self, jobs: Sequence[Job], keep: Keep) -> None:
        if self.executor is not None:
            _run_in_executor(self.executor, jobs, keep)
            return
        for job in jobs:
            with _named(job):
                run = _undisturbed(job)
            keep(job, run)

    def _path(self, job: Job) -> Path:
        described = json.dumps(origin(_package(job)))
        folder = hashlib.sha256(described.encode()).hexdigest()[:16]
        return self.out / "runs" / folder / f"{job.key}.csv"

    def _time_path(self, job: Job) -> Path:
        path = self._path(job).relative_to(self.out)
        return (self.out / TIMES / path).with_suffix(".txt")

    def _trace_path(self, job: Job) -> Path:
        # Not with_suffix, which takes what follows a point in the name of a job for a suffix.
        path = self._path(job)
        return path.with_name(f"{job.key}.npy")

    def _finished(self, job: Job) -> bool:
        return self._path(job).is_file() and self._time_path(job).is_file()

    def _keep(self, job: Job, run: Run) -> None:
        settings = self._path(job).parent / "versions.json"
        if not settings.is_file():
            described = json.dumps(origin(_package(job)), indent=1)
            write_atomically(settings, f"{described}\n".encode())
        times = "".join(f"{seconds!r}\n" for seconds in (run.seconds, *run.parts))
        write_atomically(self._time_path(job), times.encode())
        if run.trace is not None:
            np.save(buffer := io.BytesIO(), run.trace)
            write_atomically(self._trace_path(job), buffer.getvalue())
        table = csv_text(run.columns, run.values.tolist())
        write_atomically(self._path(job), table.encode())

    def _read(self, job: Job) -> Run:
        run = read_run(self._path(job))
        seconds, *parts = map(float, self._time_path(job).read_text().split())
        noted = self._trace_path(job)
        trace = np.load(noted) if noted.is_file() else None
        return Run(run.columns, run.values, seconds, tuple(parts), trace)


def read_run(path: Path) -> Run:
    """Read a finished run from its file, without the seconds, which lie elsewhere."""
    table = read_text_table(path)
    values = np.column_stack([*table.numbers(table.titles, gaps=True).values()])
    return Run(tuple(table.titles), values, np.nan)


def _run_in_executor(executor: Executor, jobs: Sequence[Job], keep: Keep) -> None:
    with interrupts_held_off():
        waiting: dict[Future[Run], Job] = {
            executor.submit(execute, job, origin(_package(job))): job for job in jobs
        }
    suspects: list[Job] = []
    try:
        for future in as_completed(list(waiting)):
            with _named(waiting[future]):
                try:
                    run = future.result()
                except WorkerLost:
                    if len(jobs) == 1:
                        raise
                    suspects.append(waiting.pop(future))
                    continue
            keep(waiting.pop(future), run)
    except BrokenExecutor:
        # The workers are gone: nothing has begun that could still be waited for.
        _keep_finished(wait(waiting, timeout=0).done, waiting, keep)
        raise
    except BaseException:
        with interrupts_held_off():
            begun = [future for future in waiting if not future.cancel()]
            tqdm.write(f"Stopping; waiting for {len(begun)} runs under way.", file=sys.stderr)
            _keep_finished(wait(begun).done, waiting, keep)
        raise
    _run_one_by_one(executor, suspects, keep)


def _run_one_by_one(executor: Executor, suspects: Sequence[Job], keep: Keep) -> None:
    # Jobs on the worker of the job that ended it are lost too; alone, each shows if it was the
    # cause.
    caught: dict[str, WorkerLost] = {}
    for job in suspects:
        try:
            _run_in_executor(executor, [job], keep)
        except WorkerLost as error:
            caught[job.key] = error
    if caught:
        raise WorkerLost(f"No worker survives {', '.join(caught)}.") from [*caught.values()][-1]


def _keep_finished(done: Iterable[Future[Run]], jobs: dict[Future[Run], Job], keep: Keep) -> None:
    for future in done:
        if future.exception() is None:
            keep(jobs[future], future.result())


@contextmanager
def _named(job: Job) -> Iterator[None]:
    try:
        yield
    except BrokenExecutor:
        # The executor failed, not a job.
        raise
    except Exception as error:
        error.add_note(f"In the job {job.key}.")
        raise


def execute(job: Job, expected: dict[str, str]) -> Run:
    """Execute ``job`` in a worker whose `origin` is the ``expected`` one.

    Raises
    ------
    WrongWorker
        It is another.
    """
    package = _package(job)
    own = origin(package)
    if own != expected:
        differing = ", ".join(
            f"{name} {own.get(name)} instead of {value}"
            for name, value in expected.items()
            if own.get(name) != value
        )
        raise WrongWorker(
            f"The worker on {platform.node()} with {package} would give other bytes: {differing}. "
            "Give it the same source, versions and kind of processor, and start it anew."
        )
    return _undisturbed(job)


def _undisturbed(job: Job) -> Run:
    # How many threads BLAS has may change the last bits of a sum.
    with ONE_JOB, threadpool_limits(limits=1):
        return job.execute()


def _package(job: Job) -> Path:
    """Return the folder of the outermost package of a job's module, or that of a lone module."""
    folder = Path(inspect.getfile(type(job))).parent
    while (folder.parent / "__init__.py").is_file():
        folder = folder.parent
    return folder


@cache
def origin(package: Path) -> dict[str, str]:
    """Name all that determines the bytes of the results of jobs in the folder ``package``.

    A job's outcome may depend on any module of its package, not only on its own. The answer is
    kept, because what a process has loaded outlives a change of the files.
    """
    source = fingerprint(*sorted(package.rglob("*.py")))
    return {SOURCE: source, **environment(), "processor": arithmetic()}
