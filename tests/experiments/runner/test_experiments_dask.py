"""Campaigns on a Dask cluster: the bytes of a serial run, whatever becomes of the cluster."""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor
from pathlib import Path

import numpy as np
import pytest
import walk_jobs
from places import ROOT
from walk_jobs import DeadlyWalk, EndlesslyDeadlyWalk, Walk

from pymoo_hdte._comparing.runs import OptimisationRun
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.workers import WorkerLost, WrongWorker, make_executor
from pymoo_hdte.checks import InvalidInput

pytest.importorskip("distributed", reason="needs the extra dask")

HELPERS = Path(walk_jobs.__file__).parent
PATIENCE = 60.0
"""Seconds after which what should happen at once has failed."""


class Cluster:
    """A scheduler and workers, all of them processes of their own, on free ports.

    Workers have ``home`` as their working directory, and write what Dask itself needs elsewhere.
    """

    def __init__(self, folder: Path, stack: contextlib.ExitStack, settings: dict[str, str]) -> None:
        self.home = folder / "home"
        self.home.mkdir()
        self._folder, self._stack = folder, stack
        connection = folder / "scheduler.json"
        self.scheduler = self._start(
            *(
                "scheduler",
                "--host",
                "127.0.0.1",
                "--port",
                "0",
                "--dashboard-address",
                "127.0.0.1:0",
            ),
            *("--idle-timeout", "300", "--scheduler-file", str(connection)),
            environment={f"DASK_DISTRIBUTED__SCHEDULER__{k}": v for k, v in settings.items()},
        )
        self.address = wait_for(lambda: json.loads(connection.read_text())["address"])

    def worker(self, *options: str, source: Path = HELPERS) -> subprocess.Popen:
        return self._start(
            *("worker", self.address, "--nthreads", "1", "--no-dashboard"),
            *("--death-timeout", "60", "--local-directory", str(self._folder / "scratch")),
            *options,
            environment={"PYTHONPATH": os.pathsep.join([str(source), str(ROOT)])},
        )

    def _start(self, *arguments: str, environment: dict[str, str]) -> subprocess.Popen:
        log = self._stack.enter_context((self._folder / "log").open("a"))
        process = self._stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments],
                cwd=self.home, env=os.environ | environment, stdout=log, stderr=log,
            )
        )  # fmt: skip
        self._stack.callback(end, process)
        return process


def end(process: subprocess.Popen) -> None:
    process.terminate()  # Unlike a kill, it lets a nanny take its worker with it.
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()


@contextlib.contextmanager
def cluster(folder: Path, **settings: str):
    folder.mkdir()
    with contextlib.ExitStack() as stack:
        yield Cluster(folder, stack, settings)


def wait_for(answer):
    """Return the first true answer; files that are not there yet or half-written are no answer."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with contextlib.suppress(OSError, ValueError):
            if found := answer():
                return found
        time.sleep(0.01)
    raise TimeoutError


@contextlib.contextmanager
def once(condition, action):
    """Do ``action`` on another thread as soon as ``condition`` holds."""
    thread = threading.Thread(target=lambda: wait_for(condition) and action())
    thread.start()
    yield
    thread.join()


def values(folder: Path) -> dict[str, bytes]:
    """Every file of the results by its path, but for wall times."""
    times = folder / "times"
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and times not in path.parents
    }


def finished(folder: Path) -> dict[str, int]:
    """The moment of writing, ns, of every finished job by its name."""
    return {path.stem: path.stat().st_mtime_ns for path in folder.glob("runs/*/*.csv")}


@pytest.fixture(autouse=True)
def impatient():
    """Turn an endless wait into a failure of the test."""

    handler = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("waits without end"))
    # Again and again, because what is interrupted may begin another wait.
    signal.setitimer(signal.ITIMER_REAL, 2.0 * PATIENCE, 5.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, handler)


@pytest.fixture
def interruptible():
    """Ctrl-C interrupts, even where the tests run in the background of a shell."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, handler)


@pytest.mark.parametrize(
    ("n_workers", "algorithms"),
    [(2, ()), (3, ("NSGA-II", "AMP-MOPSO"))],
)
@pytest.mark.nightly
def test_workers_of_which_one_is_killed_write_the_bytes_of_one_process(
    n_workers, algorithms, tmp_path
):
    cartridge = tmp_path / "cartridge"
    walks = [Walk(seed) for seed in range(1, 12)]
    walks.insert(4, DeadlyWalk(12, cartridge))
    runs = [
        OptimisationRun("calibrated", algorithm, seed=1, population=20, generations=5)
        for algorithm in algorithms
    ]
    jobs = [*walks, *runs]
    alone = Campaign(tmp_path / "alone").run(jobs, "walks")
    cartridge.touch()
    with cluster(tmp_path / "cluster") as dask:
        workers = [dask.worker("--no-nanny") for _ in range(n_workers)]
        with make_executor(1, dask.address) as executor:
            together = Campaign(tmp_path / "together", executor).run(jobs, "walks")
        assert [w.poll() for w in workers].count(-signal.SIGKILL) == 1
        assert [w.poll() for w in workers].count(None) == n_workers - 1
    assert values(tmp_path / "together") == values(tmp_path / "alone")
    assert len(finished(tmp_path / "together")) == len(jobs)
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
    # Workers measure the time and touch no file: a cluster needs no disk in common.
    assert {run.parts[0] for run in together[: len(walks)]} <= {float(w.pid) for w in workers}
    assert list(dask.home.iterdir()) == []


@pytest.mark.nightly
def test_a_job_that_kills_every_worker_is_named_and_all_others_are_kept(tmp_path):
    jobs = [Walk(seed) for seed in range(1, 8)]
    jobs.insert(1, EndlesslyDeadlyWalk(8))
    # Without a second chance, jobs that wait at the killed worker are suspects as well.
    with cluster(tmp_path / "cluster", ALLOWED_FAILURES="0") as dask:
        dask.worker()
        with (
            make_executor(1, dask.address) as executor,
            pytest.raises(WorkerLost, match=r"No worker survives walk_seed8\."),
        ):
            Campaign(tmp_path, executor).run(jobs, "walks")
    assert finished(tmp_path).keys() == {f"walk_seed{seed}" for seed in range(1, 8)}


@pytest.mark.nightly
def test_without_a_scheduler_nothing_finished_is_lost_and_a_rerun_does_the_rest(tmp_path):
    jobs = [Walk(seed) for seed in range(1, 13)]
    out = tmp_path / "out"
    with cluster(tmp_path / "cluster") as dask:
        for _ in range(2):
            dask.worker("--no-nanny")
        with (
            once(lambda: len(finished(out)) >= 3, dask.scheduler.kill),
            make_executor(1, dask.address) as executor,
            pytest.raises(BrokenExecutor, match=f"scheduler at {dask.address} is gone"),
        ):
            Campaign(out, executor).run(jobs, "walks")
    kept = finished(out)
    assert 3 <= len(kept) < len(jobs)
    Campaign(out).run(jobs, "walks")
    assert kept.items() <= finished(out).items()
    Campaign(tmp_path / "alone").run(jobs, "walks")
    assert values(out) == values(tmp_path / "alone")


@pytest.mark.nightly
@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_leaves_whole_files_and_a_cluster_that_does_the_rest(tmp_path, capsys, caplog):
    jobs = [Walk(seed) for seed in range(1, 13)]
    out = tmp_path / "out"
    with cluster(tmp_path / "cluster") as dask:
        dask.worker("--no-nanny")
        with make_executor(1, dask.address) as executor:
            campaign = Campaign(out, executor)
            with (
                once(lambda: len(finished(out)) >= 2, lambda: os.kill(os.getpid(), signal.SIGINT)),
                pytest.raises(KeyboardInterrupt),
            ):
                campaign.run(jobs, "walks")
            kept = finished(out)
            assert 2 <= len(kept) < len(jobs)
            assert "Stopping; waiting for" in capsys.readouterr().err
            campaign.run(jobs, "walks")
    assert [record for record in caplog.records if record.levelname == "ERROR"] == []
    assert kept.items() <= finished(out).items()
    Campaign(tmp_path / "alone").run(jobs, "walks")
    assert values(out) == values(tmp_path / "alone")


@pytest.mark.nightly
def test_a_worker_with_another_source_or_none_is_refused(tmp_path):
    other, none = tmp_path / "other", tmp_path / "none"
    other.mkdir()
    shutil.copy(HELPERS / "walk_jobs.py", other)
    (none / "experiments").mkdir(parents=True)
    (none / "experiments" / "__init__.py").touch()
    with cluster(tmp_path / "cluster") as dask, make_executor(1, dask.address) as executor:
        campaign = Campaign(tmp_path / "out", executor)
        for source, reason in (
            (other, "source or versions"),
            (none, "does not find what a job needs"),
        ):
            worker = dask.worker("--no-nanny", source=source)
            with pytest.raises(WrongWorker, match=reason):
                campaign.run([Walk(seed) for seed in range(1, 4)], "walks")
            # It is refused, and not broken.
            assert worker.poll() is None
            end(worker)
        assert finished(tmp_path / "out") == {}
        dask.worker("--no-nanny")
        campaign.run([Walk(1)], "walks")
    assert finished(tmp_path / "out").keys() == {"walk_seed1"}


def test_a_scheduler_can_end_the_wait_for_workers(tmp_path):
    with (
        cluster(tmp_path / "cluster", NO_WORKERS_TIMEOUT="100ms") as dask,
        make_executor(1, dask.address) as executor,
        pytest.raises(Exception, match="without any running workers"),
    ):
        Campaign(tmp_path / "out", executor).run([Walk(1), Walk(2)], "walks")


def test_a_silent_service_at_the_dask_address_is_refused(monkeypatch):
    monkeypatch.setattr("pymoo_hdte._runner.workers.CONNECT_SECONDS", 0.2)
    with (
        socket.create_server(("127.0.0.1", 0)) as service,
        pytest.raises(InvalidInput, match="the address of a running Dask scheduler"),
    ):
        make_executor(2, f"tcp://127.0.0.1:{service.getsockname()[1]}")
