"""kill -9 on a Dask cluster: of a worker, or of the command that asked for the jobs."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Timer

import numpy as np

from experiments.runner.campaign import Run
from experiments.studies.reliability.kill import (
    COUNTS,
    EXPERIMENT,
    PATIENCE,
    ROOT,
    SEED,
    judge,
    reference,
    run_until,
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
