"""Reliability: ten thousand wrong inputs, kill -9 at any moment, full disks, and memory.

Without an option the report is made from ``experiments/data/reliability.csv``, the committed
outcome of the last full run; with ``--full`` the suite runs (under an hour), goes on where it was
interrupted, and leaves the same files in the results folder; with ``--quick`` a small one runs.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Timer

import numpy as np

from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.reliability.data import (
    FUZZ,
    KILL,
    LIMIT,
    Peak,
    Tally,
    format_peaks,
    format_tallies,
    peak,
    read_peaks,
    read_tallies,
    tally_of_inputs,
    tally_of_kills,
    tally_of_limit,
)
from experiments.studies.reliability.fuzz import FuzzJob
from experiments.studies.reliability.inputs import KINDS, THROUGH_COMMANDS
from experiments.studies.reliability.kill import (
    COUNTS,
    EXPERIMENT,
    PATIENCE,
    ROOT,
    SEED,
    KillJob,
    judge,
    reference,
    run_until,
)
from experiments.studies.reliability.limits import LIMITS, LimitJob, MemoryJob
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte._runner.result import Column, Finding, Result, Table, significant
from pymoo_hdte._runner.store import TIMES, write_atomically

TALLIES, PEAKS = "reliability.csv", "reliability_memory.csv"

BLOCK, BLOCK_OF_COMMANDS = 250, 25
"""Inputs in one job."""
KILLS = 10
"""In one job."""
MOST_MEMORY = 2.0**30
"""Bytes that no experiment may exceed in one process."""


@dataclass(frozen=True)
class Extent:
    """How much is tried: inputs of each kind, kills by what is killed, limits, experiments."""

    inputs: Mapping[str, int]
    kills: Mapping[str, int]
    limits: tuple[str, ...]
    experiments: tuple[tuple[str, ...], ...]


ONE_WORKER = "command, one process"
TWO_WORKERS = "command, two worker processes"
DASK = "command and workers, Dask"

FULL = Extent(
    inputs={
        **dict.fromkeys(KINDS, 1000),
        **{"duty cycle": 750, "torsion loops": 750},
        **{"no-load runs": 750, "error measurements": 750},
        **{"campaign, whole command": 200, "rig, whole command": 400},
        **{"simulate, whole command": 100, "optimise, whole command": 100},
        **{"identify, whole command": 200},
    },
    kills={ONE_WORKER: 120, TWO_WORKERS: 120, DASK: 60},
    limits=tuple(LIMITS),
    experiments=(
        *(("table7",), ("table8",), ("sensitivity",), ("crosscheck",), ("calibration",)),
        ("blind",),
    ),
)
QUICK = Extent(
    inputs={name: 2 if name in THROUGH_COMMANDS else 20 for name in KINDS},
    kills={ONE_WORKER: 2, TWO_WORKERS: 2, DASK: 2},
    limits=("read-only folder", "two experiments at once"),
    experiments=(("table7",),),
)

SETTING, KILLING = paragraphs("reliability")
UPPER = "The upper bound is the exact one-sided 95 % limit of the rate of failures."


def run(context: Context) -> Result:
    """Run the suite or read its outcome, and judge."""
    if context.full or context.quick:
        tallies, peaks = _campaign(context, FULL if context.full else QUICK)
    else:
        tallies, peaks = _committed()
    return Result(
        title="Reliability: wrong inputs, kills, full disks, memory",
        command=context.command("reliability"),
        paragraphs=(*stored_outcome(context, "reliability"), SETTING, KILLING),
        tables=(
            _inputs_table([tally for tally in tallies if tally.part == FUZZ]),
            _kills_table([tally for tally in tallies if tally.part == KILL]),
            _limits_table([tally for tally in tallies if tally.part == LIMIT]),
            _memory_table(peaks),
        ),
    )


def _campaign(context: Context, extent: Extent) -> tuple[list[Tally], list[Peak]]:
    campaign = context.campaign
    tallies = [_fuzzed(campaign, kind, count) for kind, count in extent.inputs.items()]
    tallies += [_killed(campaign, what, kills) for what, kills in extent.kills.items()]
    for name in extent.limits:
        job = LimitJob(name)
        tallies += [tally_of_limit(job, run) for run in campaign.run([job], name)]
    jobs = [MemoryJob(name, tuple(options)) for name, *options in extent.experiments]
    peaks = list(map(peak, jobs, campaign.run(jobs, "memory")))
    out = context.out / "reliability"
    write_atomically(out / TALLIES, format_tallies(tallies).encode())
    times = context.out / TIMES / "reliability"
    write_atomically(times / PEAKS, format_peaks(peaks).encode())
    return tallies, peaks


def _fuzzed(campaign: Campaign, kind: str, count: int) -> Tally:
    block = BLOCK_OF_COMMANDS if kind in THROUGH_COMMANDS else BLOCK
    starts = range(0, count, block)
    jobs = [FuzzJob(kind, start, min(block, count - start)) for start in starts]
    return tally_of_inputs(kind, campaign.run(jobs, kind))


def _killed(campaign: Campaign, what: str, kills: int) -> Tally:
    sizes = [min(KILLS, kills - start) for start in range(0, kills, KILLS)]
    jobs: list[KillJob | DaskKillJob] = []
    for block, size in enumerate(sizes):
        if what == DASK:
            jobs.append(DaskKillJob(block, size))
        else:
            jobs.append(KillJob(block, size, 1 if what == ONE_WORKER else 2))
    return tally_of_kills(what, campaign.run(jobs, f"kills: {what}"))


def _committed() -> tuple[list[Tally], list[Peak]]:
    tallies, peaks = (committed_file(name, "reliability") for name in (TALLIES, PEAKS))
    return read_tallies(tallies), read_peaks(peaks)


def _below(total: Tally) -> str:
    """Say what rate of failures the trials leave possible."""
    return f" (a rate below {significant(100.0 * total.bound, 2)} %, one-sided 95 % limit)"


def _inputs_table(tallies: list[Tally]) -> Table:
    inputs, refused, accepted, failed = (
        sum(getattr(tally, name) for tally in tallies)
        for name in ("trials", "refused", "accepted", "failed")
    )
    total = Tally(FUZZ, "all", inputs, refused, accepted, failed)
    return Table(
        "inputs",
        "Mutated inputs by kind",
        (
            *(Column("kind"), Column("inputs"), Column("refused"), Column("accepted")),
            *(Column("failed"), Column("rate of failures below", "%", 2), Column("which failed")),
        ),
        tuple(
            (
                *(tally.kind, tally.trials, tally.refused, tally.accepted, tally.failed),
                *(100.0 * tally.bound, tally.failing or None),
            )
            for tally in (*tallies, total)
        ),
        note=UPPER,
        findings=(
            Finding(
                failed == 0,
                f"Of {inputs:,} inputs with a planted mistake {failed or 'none'} raised anything "
                f"but a clear error, hung, crashed or left anything half-done{_below(total)}.",
                check=True,
                answers=True,
            ),
        ),
    )


def _kills_table(tallies: list[Tally]) -> Table:
    kills, failed = sum(tally.trials for tally in tallies), sum(tally.failed for tally in tallies)
    total = Tally(KILL, "all", kills, 0, 0, failed)
    return Table(
        "kills",
        "Runs killed and resumed",
        (
            *(Column("killed"), Column("kills"), Column("runs that came to their end")),
            *(Column("failed"), Column("rate of failures below", "%", 2), Column("what failed")),
        ),
        tuple(
            (
                tally.kind,
                tally.trials,
                tally.accepted,
                tally.failed,
                100.0 * tally.bound,
                tally.failing or None,
            )
            for tally in tallies
        ),
        note=UPPER,
        findings=(
            Finding(
                failed == 0,
                f"After {kills} kills, {failed or 'no'} files or runs were partial, different from "
                "those of an undisturbed run, failed to resume, or left workers "
                f"behind{_below(total)}.",
                check=True,
                answers=True,
            ),
        ),
    )


def _limits_table(tallies: list[Tally]) -> Table:
    trials, failed = sum(tally.trials for tally in tallies), sum(tally.failed for tally in tallies)
    total = Tally(LIMIT, "all", trials, 0, 0, failed)
    return Table(
        "limits",
        "Full disks, folders without permission, and two runs in one folder",
        (Column("limit"), Column("trials"), Column("failed")),
        tuple((tally.kind, tally.trials or "not possible here", tally.failed) for tally in tallies),
        note="Disks of 0 to 512 kB in memory, which only the superuser may mount. A run on a full "
        "disk must end in a message, leave whole files only, and come to the bytes of an "
        "undisturbed run once there is space; where one must not write, it is refused before "
        "anything runs; of two reports into one folder at once one may be refused.",
        findings=(
            Finding(
                failed == 0,
                f"{failed} of {trials} runs that the machine denied something ended without a "
                f"clear message, or left a torn file{_below(total)}.",
                check=True,
            ),
        ),
    )


def _memory_table(peaks: list[Peak]) -> Table:
    largest = max(peaks, key=lambda tally: tally.memory)
    return Table(
        "memory",
        "Peak of resident memory in one process",
        (Column("experiment"), Column("memory", "MB", 3), Column("processor time", "s", 3)),
        tuple((need.experiment, need.memory / 1e6, need.seconds) for need in peaks),
        note="Jobs of a campaign are independent, so its length adds nothing but their results; "
        "every worker process needs as much again.",
        findings=(
            Finding(
                largest.memory <= MOST_MEMORY,
                f"The largest experiment, {largest.experiment}, takes {largest.memory / 1e6:.0f} "
                f"MB, of at most {MOST_MEMORY / 1e6:.0f}.",
                check=True,
            ),
        ),
        wall_times=True,
    )


WORKERS = 2


@dataclass(frozen=True)
class DaskKillJob:
    """Kills on one cluster: of a command, then of a worker while the command runs again."""

    block: int
    kills: int

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"dask_kill_{self.block}_{self.kills}_seed{SEED}"

    def execute(self) -> Run:
        """Count as `KillJob`; a run that loses a worker has to come to its end all the same."""
        rng = np.random.default_rng([SEED, 1, self.block])
        begin, counts = time.perf_counter(), dict.fromkeys(COUNTS, 0)
        with tempfile.TemporaryDirectory(prefix="kill-") as top, ExitStack() as stack:
            cluster = _Cluster(Path(top), stack)
            for number in range(self.kills // 2):
                folder = Path(top) / str(number)
                moments = rng.uniform(0.0, reference().seconds, size=2)
                judge(folder, _run(cluster, folder, moments[0]), counts)
                timer = Timer(moments[1], cluster.kill_a_worker)
                timer.start()
                judge(folder, _run(cluster, folder, PATIENCE), counts)
                timer.join()
                counts["kills"] += 1
        values = np.array([list(counts.values())], dtype=float)
        return Run(COUNTS, values, time.perf_counter() - begin)


def _run(cluster: _Cluster, folder: Path, moment: float) -> int | None:
    options = ("--dask", cluster.address, "--out", str(folder))
    return run_until(["experiments", *EXPERIMENT, *options], moment)


class _Cluster:
    """A scheduler and workers, all of them processes of their own, on free ports."""

    def __init__(self, top: Path, stack: ExitStack) -> None:
        self._top, self._stack = top, stack
        connection = top / "scheduler.json"
        self._start(
            *("scheduler", "--host", "127.0.0.1", "--port", "0"),
            *("--dashboard-address", "127.0.0.1:0", "--scheduler-file", str(connection)),
        )
        self.address = _address(connection)
        self.workers = [self.worker() for _ in range(WORKERS)]

    def worker(self) -> subprocess.Popen[bytes]:
        """Return a new worker."""
        return self._start(
            *("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard"),
            *("--local-directory", str(self._top / "scratch")),
        )

    def kill_a_worker(self) -> None:
        """Kill the older of the workers, and start another."""
        self.workers[0].kill()
        self.workers = [*self.workers[1:], self.worker()]

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        process = self._stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments], cwd=ROOT,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )
        )  # fmt: skip
        self._stack.callback(process.kill)
        return process


def _address(connection: Path) -> str:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        # The file is not there yet, or half-written.
        with suppress(OSError, ValueError):
            return json.loads(connection.read_text())["address"]
        time.sleep(0.05)
    raise TimeoutError("no Dask scheduler")
