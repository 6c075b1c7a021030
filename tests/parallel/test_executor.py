"""Evaluations on any workers: the bytes of a run alone, lost designs told, nothing made twice."""

import concurrent.futures
import contextlib
import gc
import itertools
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time
from threading import Timer

import numpy as np
import pytest
from costly_problems import MISHAPS, KillsOnce, Parabolas, calls
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import ElementwiseEvaluationFunction
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.parallel import ExecutorParallelization, VirtualWorkers, minimize_asynchronously
from pymoo_hdte.problems import Robust, SimulatorFailed

BUDGET = ("n_eval", 60)


def digest(result):
    return result.X.tobytes(), result.F.tobytes(), result.G.tobytes()


def optimised(problem, budget=BUDGET):
    return minimize(problem, CompactSwarm(), budget, seed=1)


@contextlib.contextmanager
def workers(kind):
    if kind == "none":
        yield None
    elif kind == "processes of our own":
        yield 2
    elif kind == "threads":
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            yield pool
    else:
        distributed = pytest.importorskip("distributed")
        local = {"processes": False, "dashboard_address": "127.0.0.1:0", "n_workers": 1}
        with distributed.Client(**local) as client:
            yield client


@pytest.mark.parametrize("kind", ["none", "processes of our own", "threads", "dask"])
def test_any_workers_give_the_bytes_of_one_alone_in_any_order_of_arrival(kind):
    expected = digest(optimised(Parabolas()))
    with workers(kind) as executor, ExecutorParallelization(executor) as runner:
        found = optimised(Parabolas(seconds=0.01, elementwise_runner=runner))
    assert digest(found) == expected
    assert (found.evaluations.made, found.evaluations.n_lost) == (60, 0)


def test_each_kind_of_loss_is_nan_in_its_place_and_counted():
    problem = Parabolas(dict.fromkeys(MISHAPS, 0.2))
    X = np.random.default_rng(4).uniform(-1.0, 2.0, (40, 3))
    fates = [problem.fate(x) for x in X]
    # Two of each: every process that ends takes a while to be replaced.
    rows = [k for k, fate in enumerate(fates) if fates[:k].count(fate) < 2]
    X, fates = X[rows], [fates[k] for k in rows]
    assert len(fates) == 10
    good = np.array([fate is None for fate in fates])
    with ExecutorParallelization(4, time_limit=0.4, tries=1) as runner:
        problem.elementwise_runner = runner
        F, G = problem.evaluate(X)
    assert np.array_equal(np.isfinite(F).all(axis=1), good)
    assert np.array_equal(np.isfinite(G[:, 0]), good)
    assert np.array_equal(F[good], Parabolas().evaluate(X[good])[0])
    kinds = ("raised", "not a number", "over the time limit", "worker lost")
    told = {kind: fates.count(fate) for kind, fate in zip(kinds, MISHAPS, strict=True)}
    assert runner.counts.lost == told
    assert f"{sum(told.values())} designs lost" in str(runner.counts)


def test_what_a_hanging_simulator_started_ends_with_it(tmp_path):
    signs = tmp_path / "signs"

    def hangs(x):
        program = f"while :; do echo alive >> {signs}; sleep 0.02; done"
        subprocess.run(["sh", "-c", program], check=True)

    with ExecutorParallelization(time_limit=0.3) as runner, pytest.raises(SimulatorFailed):
        runner(hangs, np.zeros((1, 2)))
    size = signs.stat().st_size
    assert size > 0
    time.sleep(0.2)
    assert signs.stat().st_size == size


# From Python 3.12 on a fork warns where there are threads, as progress bars have.
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_pool_that_a_killed_worker_broke_is_replaced(tmp_path):
    X = np.random.default_rng(4).random((8, 3))
    fork = multiprocessing.get_context("fork")
    with (
        concurrent.futures.ProcessPoolExecutor(2, fork) as pool,
        ExecutorParallelization(pool) as runner,
        pytest.warns(RuntimeWarning, match="go on in 2 processes of our own"),
    ):
        found = runner(KillsOnce(str(tmp_path / "killed")), X)
    assert [one["F"] for one in found] == [[float(x @ x)] for x in X]


def test_a_failure_that_does_not_come_again_costs_one_more_evaluation():
    met = set()

    def flaky(x):
        first = x[0] not in met
        met.add(x[0])
        if first and len(met) % 5 == 2:
            raise RuntimeError("no licence")
        return {"F": x}

    X = np.arange(10.0)[:, None]
    runner = ExecutorParallelization()
    assert np.array_equal([one["F"] for one in runner(flaky, X)], X)
    assert (runner.counts.repeated, runner.counts.made) == (2, 10)


LOSSES = {"raises": 0.1, "gives NaN": 0.1}
OPTIMISERS = {"generations": minimize, "asynchronous": minimize_asynchronously}


def study(folder, executor, optimise):
    runner = ExecutorParallelization(executor, tries=1, cache=folder / "runs")
    problem = Parabolas(LOSSES, folder / "log", 0.005, elementwise_runner=runner)
    with runner, pytest.warns(RuntimeWarning, match="designs were lost"):
        return optimise(problem, CompactSwarm(), BUDGET, seed=1)


def killed(folder, count, *arguments):
    """Run a study in a process of its own, kill it after so many calls; return what it kept."""
    process = multiprocessing.get_context("fork").Process(target=study, args=(folder, *arguments))
    process.start()
    while process.is_alive() and len(calls(folder / "log")) < count:
        time.sleep(1e-3)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    with open(folder / "runs", "a") as file:
        # What a kill may leave of the last line.
        file.write('{"at": ["0x')
    return finished(folder)


def finished(folder):
    lines = [
        json.loads(one) for one in (folder / "runs").read_text().splitlines() if one[-1] == "}"
    ]
    return [" ".join(one["at"]) for one in lines if "at" in one]


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize(
    ("executor", "optimise"),
    [
        (None, "generations"),
        pytest.param(None, "asynchronous", marks=pytest.mark.nightly),
        pytest.param(2, "generations", marks=pytest.mark.nightly),
        (2, "asynchronous"),
    ],
)
def test_after_a_kill_nothing_finished_is_evaluated_again(tmp_path, executor, optimise):
    arguments = executor, OPTIMISERS[optimise]
    kept = killed(tmp_path, 25, *arguments)
    before = calls(tmp_path / "log")
    assert 10 < len(kept) < 60
    result = study(tmp_path, *arguments)
    after = calls(tmp_path / "log")[len(before) :]
    assert not set(after) & set(kept)
    assert finished(tmp_path)[: len(kept)] == kept
    # A design that the swarm asks for again is known.
    assert len(finished(tmp_path)) == len(set(finished(tmp_path))) <= 60
    counts = result.evaluations
    assert counts.made + counts.from_file + counts.n_lost == 60
    assert counts.from_file > 8
    whole = tmp_path / "whole"
    whole.mkdir()
    if optimise == "generations" or executor is None:
        assert digest(result) == digest(study(whole, *arguments))
    # What came back in another order on another day comes back in this one now.
    again = study(tmp_path, *arguments)
    assert (again.evaluations.made, digest(again)) == (0, digest(result))


def test_designs_are_not_given_up_for_ever_where_nothing_has_run(tmp_path):
    file = tmp_path / "runs"
    broken, mended = Parabolas({"raises": 1.0}), Parabolas()
    broken.elementwise_runner = ExecutorParallelization(cache=file)
    with pytest.raises(SimulatorFailed, match="no convergence"):
        optimised(broken)
    mended.elementwise_runner = ExecutorParallelization(cache=file)
    assert digest(optimised(mended)) == digest(optimised(Parabolas()))


def test_designs_over_the_time_limit_are_tried_again_under_a_longer_one(tmp_path):
    def lost(limit):
        lasts = itertools.cycle([1.0, 3.0])
        queue = VirtualWorkers(1, lambda: next(lasts), time_limit=limit)
        runner = ExecutorParallelization(queue, cache=tmp_path / "runs")
        # An interrupted run's file: a finished one is checked, and its failures are tried anyway.
        X = np.random.default_rng(1).random((4, 3))
        runner(ElementwiseEvaluationFunction(Parabolas(), (), {}), X)
        return runner.counts.n_lost, runner.counts.made, runner.counts.from_file

    assert lost(2.0) == (2, 2, 0)
    assert lost(1.5) == (2, 0, 2)
    assert lost(4.0) == (0, 2, 2)
    assert lost(4.0) == (0, 0, 4)


@pytest.mark.skipif(os.name == "nt", reason="nothing is locked there")
def test_a_file_that_another_process_writes_to_is_refused_until_that_one_ends(tmp_path):
    file = tmp_path / "runs"
    runner = ExecutorParallelization(cache=file)
    optimised(Parabolas(elementwise_runner=runner))
    held = f"import fcntl; file = open({str(file)!r}, 'a'); fcntl.lockf(file, fcntl.LOCK_EX"
    # This process holds it as long as the runner is there.
    refused = subprocess.run([sys.executable, "-c", f"{held} | fcntl.LOCK_NB)"], check=False)
    assert refused.returncode
    del runner
    gc.collect()
    holds = [sys.executable, "-uc", f"{held}); print('held'); input()"]
    with subprocess.Popen(holds, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(InvalidInput, match=r"cache.*no other process"):
            optimised(Parabolas(elementwise_runner=ExecutorParallelization(cache=file)))
        other.kill()
    again = optimised(Parabolas(elementwise_runner=ExecutorParallelization(cache=file)))
    assert again.evaluations.made == 0


def test_a_file_of_another_problem_is_refused(tmp_path):
    optimised(Parabolas(elementwise_runner=ExecutorParallelization(cache=tmp_path / "runs")))

    class Others(Parabolas):
        def _evaluate(self, x, out, *args, **kwargs):
            super()._evaluate(2.0 * x, out)

    with pytest.raises(InvalidInput, match="runs of this simulator"):
        optimised(Others(elementwise_runner=ExecutorParallelization(cache=tmp_path / "runs")))


def test_a_robust_problem_is_made_from_one_whose_evaluations_run_elsewhere():
    with ExecutorParallelization(2) as runner:
        problem = Parabolas(elementwise_runner=runner)
        found = Robust(problem, scatter=0.05, accuracy=0.05, progress=False)
    # A square of a uniform deviation of 0.05 has the mean 0.05^2 / 3.
    mean = 3.0 * (0.5**2 + 0.05**2 / 3.0)
    F, _ = found.evaluate(np.full((1, 3), 0.5))
    assert F[0] == pytest.approx([mean, mean], rel=1e-6)
    assert runner.counts.made == found.n_runs


def test_other_algorithms_take_a_large_number_for_what_is_lost():
    runner = ExecutorParallelization(tries=1)
    problem = Parabolas(LOSSES, elementwise_runner=runner, replace_nan_values_by=1e30)
    result = minimize(problem, NSGA2(pop_size=20), ("n_eval", 200), seed=1)
    assert runner.counts.n_lost > 20
    assert result.F.max() < 1e3


def test_a_stored_problem_asks_for_workers():
    with ExecutorParallelization(2) as runner:
        stored = pickle.dumps(Parabolas(elementwise_runner=runner))
    with pytest.raises(InvalidInput, match="workers are not stored"):
        optimised(pickle.loads(stored))


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"executor": "four"}, "executor"),
        ({"executor": 0}, "executor"),
        ({"time_limit": 0.0}, "time_limit"),
        ({"tries": 0}, "tries"),
        ({"executor": VirtualWorkers(2, lambda: 1.0), "time_limit": 1.0}, "time_limit"),
    ],
)
def test_wrong_arguments_are_refused_by_name(given, named):
    with pytest.raises(InvalidInput) as refusal:
        ExecutorParallelization(**given)
    assert refusal.value.field == named


@pytest.mark.nightly
def test_dask_workers_end_what_hangs_and_may_be_killed():
    distributed = pytest.importorskip("distributed")
    problem = Parabolas(dict.fromkeys(MISHAPS, 0.1), seconds=0.1)
    with ExecutorParallelization(4, time_limit=1.0, tries=1) as runner:
        problem.elementwise_runner = runner
        with pytest.warns(RuntimeWarning, match="designs were lost"):
            expected = digest(optimised(problem))
    local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
    with distributed.Client(**local) as client:
        pids = list(client.run(os.getpid).values())
        Timer(3.0, os.kill, (pids[0], signal.SIGKILL)).start()
        problem.elementwise_runner = ExecutorParallelization(client, time_limit=1.0, tries=1)
        with pytest.warns(RuntimeWarning, match="designs were lost"):
            found = optimised(problem)
    assert digest(found) == expected
    kinds = found.evaluations.lost
    assert {*kinds} == {"raised", "not a number", "over the time limit", "worker lost"}
