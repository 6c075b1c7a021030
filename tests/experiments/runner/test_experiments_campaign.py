"""Campaigns: same bytes for any number of workers, and after an interruption."""

import json
import os
import platform
import re
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from experiments.command_line import main
from pymoo_hdte._runner.campaign import Campaign, Run, execute, origin
from pymoo_hdte._runner.workers import WrongWorker, arithmetic, make_executor
from pymoo_hdte.checks import InvalidInput


@dataclass(frozen=True)
class RandomWalk:
    """A job whose later seeds finish first."""

    seed: int

    @property
    def key(self) -> str:
        return f"walk_seed{self.seed}"

    def execute(self) -> Run:
        begin = time.perf_counter()
        time.sleep(0.02 * (5 - self.seed))
        steps = np.random.default_rng(self.seed).normal(size=(4, 2))
        return Run(("x", "y"), steps.cumsum(axis=0), time.perf_counter() - begin)


@dataclass(frozen=True)
class InterruptedWalk(RandomWalk):
    """The same job, but the user presses Ctrl-C during seed 3."""

    def execute(self) -> Run:
        if self.seed == 3:
            raise KeyboardInterrupt
        return super().execute()


@dataclass(frozen=True)
class FailingWalk(RandomWalk):
    """The same job with a defect that shows at seed 3."""

    def execute(self) -> Run:
        if self.seed == 3:
            raise ArithmeticError("a step too far")
        return super().execute()


@dataclass(frozen=True)
class KilledWalk(RandomWalk):
    """The same job, but the operating system ends the worker at seed 3."""

    def execute(self) -> Run:
        if self.seed == 3:
            os._exit(1)
        return super().execute()


@dataclass(frozen=True)
class JealousWalk(RandomWalk):
    """The same job, but it fails beside another in the same process."""

    under_way: ClassVar[list[int]] = []

    def execute(self) -> Run:
        self.under_way.append(self.seed)
        run = super().execute()
        if self.under_way != [self.seed]:
            raise RuntimeError("not alone")
        self.under_way.clear()
        return run


@dataclass(frozen=True)
class ThreadCount(RandomWalk):
    """How many threads numerical libraries have."""

    def execute(self) -> Run:
        counts = [[float(library["num_threads"])] for library in threadpool_info()]
        return Run(("threads",), np.array(counts), 0.0)


class HalfBrokenExecutor(Executor):
    """Ends on seed 3, when everything else is finished and nothing has been asked for."""

    def submit(self, function, job, *arguments):
        future = Future()
        if job.seed == 3:
            future.set_exception(BrokenExecutor("the workers are gone"))
        else:
            future.set_result(function(job, *arguments))
        return future


SEEDS = range(1, 6)
WALKS = [RandomWalk(seed) for seed in SEEDS]
KEPT = "What is finished is kept in {}; a rerun goes on from it."


def files(folder: Path) -> dict[str, bytes]:
    """Every file of the runs by its path."""
    runs = folder / "runs"
    return {str(p.relative_to(runs)): p.read_bytes() for p in runs.rglob("*") if p.is_file()}


def test_values_come_back_to_the_last_bit_in_the_order_of_jobs(tmp_path):
    runs = Campaign(tmp_path).run(WALKS[::-1], "walks")
    for job, run in zip(WALKS[::-1], runs, strict=True):
        np.testing.assert_array_equal(run.values, job.execute().values)
        assert run.columns == ("x", "y")
        assert run.seconds > 0.0


@pytest.fixture(scope="module")
def two_workers():
    """Two processes, in an environment that gives numerical libraries two threads."""
    variables = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    with pytest.MonkeyPatch.context() as patch:
        for variable in variables:
            patch.setenv(variable, "2")
        with make_executor(2) as executor:
            yield executor


@pytest.fixture
def executor(workers, request):
    """Workers as many as the test asks for; None is the process itself."""
    return make_executor(1) if workers == 1 else request.getfixturevalue("two_workers")


def test_two_workers_write_the_same_bytes_as_one(two_workers, tmp_path):
    Campaign(tmp_path / "one").run(WALKS, "walks")
    Campaign(tmp_path / "two", two_workers).run(WALKS, "walks")
    assert files(tmp_path / "one") == files(tmp_path / "two")
    assert len(files(tmp_path / "one")) == len(WALKS) + 1


def test_interruption_keeps_what_is_finished_and_a_rerun_goes_on(tmp_path):
    campaign = Campaign(tmp_path / "interrupted")
    with pytest.raises(KeyboardInterrupt):
        campaign.run([InterruptedWalk(seed) for seed in SEEDS], "walks")
    kept = files(tmp_path / "interrupted")
    assert sorted(Path(p).name for p in kept) == [
        "versions.json",
        "walk_seed1.csv",
        "walk_seed2.csv",
    ]
    finished = [p for p in (tmp_path / "interrupted" / "runs").rglob("*.csv")]
    before = {p: p.stat().st_mtime_ns for p in finished}
    campaign.run(WALKS, "walks")
    Campaign(tmp_path / "through").run(WALKS, "walks")
    assert files(tmp_path / "interrupted") == files(tmp_path / "through")
    assert before == {p: p.stat().st_mtime_ns for p in finished}


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failing_job_is_reported_and_the_finished_ones_are_kept(tmp_path, executor):
    with pytest.raises(ArithmeticError, match="a step too far") as caught:
        Campaign(tmp_path, executor).run([FailingWalk(seed) for seed in SEEDS], "walks")
    assert caught.value.__notes__ == [
        "In the job walk_seed3.",
        KEPT.format(tmp_path),
    ]
    names = {Path(p).name for p in files(tmp_path)}
    assert {"walk_seed1.csv", "walk_seed2.csv"} <= names
    assert "walk_seed3.csv" not in names


@pytest.mark.nightly
def test_a_killed_worker_is_an_error_and_not_a_wait_without_end(tmp_path):
    with make_executor(2) as executor, pytest.raises(BrokenExecutor):
        Campaign(tmp_path, executor).run([KilledWalk(seed) for seed in SEEDS], "walks")


def test_an_executor_that_ends_takes_nothing_finished_with_it(tmp_path):
    with pytest.raises(BrokenExecutor, match="the workers are gone") as caught:
        Campaign(tmp_path, HalfBrokenExecutor()).run(WALKS, "walks")
    names = {Path(path).stem for path in files(tmp_path)}
    assert names == {"versions", *(f"walk_seed{seed}" for seed in (1, 2, 4, 5))}
    # No job is to blame.
    assert caught.value.__notes__ == [KEPT.format(tmp_path)]


@pytest.mark.parametrize("part", ["fingerprint", "arithmetic", "environment"])
def test_another_origin_does_not_reuse_the_runs(tmp_path, monkeypatch, part):
    another = {"numpy": "another"} if part == "environment" else "another"
    here = origin(Path(__file__).parent)
    Campaign(tmp_path).run(WALKS[:1], "walks")
    monkeypatch.setattr(f"pymoo_hdte._runner.campaign.{part}", lambda *sources: another)
    origin.cache_clear()
    Campaign(tmp_path).run(WALKS[:1], "walks")
    elsewhere = origin(Path(__file__).parent)
    origin.cache_clear()
    found = files(tmp_path)
    assert len([name for name in found if name.endswith(".csv")]) == 2
    stored = [json.loads(found[name]) for name in found if name.endswith("versions.json")]
    assert sorted(stored, key=lambda one: one != here) == [here, elsewhere]
    assert "another" in elsewhere.values()


def test_a_run_whose_time_is_lost_is_done_again(tmp_path):
    campaign = Campaign(tmp_path)
    before = campaign.run(WALKS, "walks")
    (lost,) = (tmp_path / "times").rglob("walk_seed2.txt")
    lost.unlink()
    after = campaign.run(WALKS, "walks")
    assert lost.is_file()
    seconds = [[run.seconds for run in runs] for runs in (before, after)]
    assert [one == other for one, other in zip(*seconds, strict=True)] == [
        seed != 2 for seed in SEEDS
    ]


def test_threads_of_one_process_take_turns(tmp_path):
    with ThreadPoolExecutor(4) as executor:
        Campaign(tmp_path, executor).run([JealousWalk(seed) for seed in SEEDS], "walks")


@pytest.mark.parametrize("workers", [1, 2])
def test_numerical_libraries_have_one_thread_wherever_a_job_runs(tmp_path, executor):
    with threadpool_limits(2):
        for run in Campaign(tmp_path, executor).run([ThreadCount(1), ThreadCount(2)], "threads"):
            np.testing.assert_array_equal(run.values, 1.0)


def test_a_worker_tells_in_what_it_differs():
    here = origin(Path(__file__).parent)
    assert here.keys() >= {"source or versions", "numpy", "processor"}
    job = WALKS[4]
    np.testing.assert_array_equal(execute(job, here).values, job.execute().values)
    for name in here:
        difference = re.escape(f"bytes: {name} {here[name]} instead of other.")
        with pytest.raises(WrongWorker, match=difference):
            execute(job, here | {name: "other"})


def test_a_worker_goes_by_the_source_that_it_has_loaded(tmp_path):
    source = tmp_path / "module_of_a_worker.py"
    source.write_text("answer = 1\n")
    loaded = origin(tmp_path)
    source.write_text("answer = 2\n")
    (tmp_path / "another.py").touch()
    assert origin(tmp_path) == loaded
    origin.cache_clear()
    assert origin(tmp_path) != loaded


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of its processors")
@pytest.mark.parametrize(
    ("variable", "one", "other"),
    [
        ("OPENBLAS_CORETYPE", "Haswell", "Nehalem"),
        ("NPY_DISABLE_CPU_FEATURES", "", "{features}"),
    ],
)
def test_another_processor_has_another_arithmetic(variable, one, other):
    features = " ".join(re.findall(r"X86_V[34]|AVX[0-9A-Z_]*[0-9A-Z]|FMA3", arithmetic()))
    names = set()
    for value in (one, other.format(features=features)):
        command = "from pymoo_hdte._runner.workers import arithmetic; print(arithmetic())"
        done = subprocess.run(
            [sys.executable, "-c", command],
            env=os.environ | {variable: value}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        names.add(done.stdout)
    assert len(names) == 2


def test_a_dask_address_without_a_scheduler_is_refused():
    with pytest.raises(InvalidInput, match="--dask"):
        make_executor(2, "not an address")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing"], "unknown experiment 'nothing'"),
        (["--seeds", "0"], "'0' is not a whole number of at least 1"),
        (["--workers", "two"], "'two' is not a whole number of at least 1"),
        (["table5", "--out", __file__], "cannot be made a folder"),
        (["table5", "--dask", "nowhere", "--out", "{tmp}"], "--dask"),
    ],
)
def test_bad_command_lines_end_with_a_message_and_code_2(tmp_path, arguments, message, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([argument.format(tmp=tmp_path) for argument in arguments])
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err


def test_list_names_every_experiment(capsys):
    assert main(["--list"]) == 0
    listed = capsys.readouterr().out
    for name in ("table5", "table7", "table8", "ablation"):
        assert name in listed
