"""Runs of a simulator: failures, resumed studies, workers, and what it may return."""

import concurrent.futures
import time
from contextlib import closing

import chaospy
import numpy as np
import pytest
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import (
    Design,
    Mean,
    SimulatorFailed,
    UntrustedSurrogate,
    robust_problem,
)
from pymoo_hdte.problems._simulator.run_file import RunFile
from pymoo_hdte.problems._simulator.runs import Simulator
from pymoo_hdte.problems._simulator.workers import Workers


def quiet(simulator, designs, noise=None, **options):
    return robust_problem(simulator, designs, noise, progress=False, **options)


class Flaky:
    """A simulator that notes its calls and fails where it is told to."""

    def __init__(self, fails=lambda call, x: False):
        self.calls, self.fails = [], fails

    def __call__(self, x, a):
        self.calls.append((x, a))
        if self.fails(len(self.calls), x):
            raise RuntimeError("no convergence")
        return np.exp(x * a)


PLAIN = {"x": Design(0.5, 1.0, deviation=0.05)}, {"a": chaospy.Uniform(0.0, 1.0)}
PRECISE = {"accuracy": 1e-6}
"""Takes more than 40 runs."""


@pytest.fixture(scope="module")
def steady():
    """What a simulator that never fails gives, and its number of calls."""
    calm = Flaky()
    return quiet(calm, *PLAIN, **PRECISE).evaluate(np.array([[0.7]])), len(calm.calls)


@pytest.mark.slow
def test_a_run_that_fails_once_is_made_again(steady):
    met = set()

    def every_seventh_point_once(call, x):
        first = x not in met
        met.add(x)
        return first and len(met) % 7 == 3

    flaky, (expected, calls) = Flaky(every_seventh_point_once), steady
    found = quiet(flaky, *PLAIN, **PRECISE).evaluate(np.array([[0.7]]))
    assert np.array_equal(found, expected)
    assert len(flaky.calls) == calls + (len(met) + 4) // 7


@pytest.mark.slow
def test_runs_that_always_fail_are_told():
    with pytest.warns(RuntimeWarning, match=r"\d+ of \d+ runs failed: x = 0\.4"):
        problem = quiet(Flaky(lambda call, x: x < 0.48), *PLAIN, accuracy=0.05)
    assert len(problem.failed) > 0
    assert np.all(problem.failed[:, 0] < 0.48)
    mean = problem.evaluate(np.array([[0.8]]))[0, 0]
    x = np.linspace(0.75, 0.85, 2001)
    assert mean == pytest.approx(np.mean((np.exp(x) - 1.0) / x), rel=0.02)


def test_a_simulator_that_never_runs_says_why():
    with pytest.raises(SimulatorFailed, match=r"failed in all .*no convergence") as failure:
        quiet(Flaky(lambda call, x: True), *PLAIN)
    assert "no convergence" in str(failure.value.__cause__)


@pytest.mark.slow
def test_a_simulator_that_fails_in_half_of_the_box_is_refused_with_its_region():
    with pytest.raises(UntrustedSurrogate, match=r"probability of failing .* so where x is 0\.5"):
        quiet(Flaky(lambda call, x: x < 0.72), *PLAIN, accuracy=0.9, budget=60)


@pytest.mark.parametrize(
    ("gives", "words"),
    [
        (lambda x: "a", "what the simulator returns is 'a'"),
        (lambda x: 1j * x, "what the simulator returns"),
        (lambda x: 1e200 * x, "choose another unit"),
        (lambda x: 1e-150 * x, "choose another unit"),
        (lambda x: {"y" if x < 0.7 else "z": x}, "names of the responses"),
    ],
)
def test_what_is_no_response_is_refused(gives, words):
    with pytest.raises(InvalidInput, match=words):
        quiet(gives, PLAIN[0])


@pytest.mark.nightly
def test_a_killed_study_goes_on_without_a_run_made_twice(tmp_path):
    whole = Flaky()
    expected = quiet(whole, *PLAIN, **PRECISE).evaluate(np.array([[0.7]]))
    file = tmp_path / "runs.jsonl"

    def killed(call, x):
        if call == 40:
            raise KeyboardInterrupt
        return False

    first = Flaky(killed)
    with pytest.raises(KeyboardInterrupt):
        quiet(first, *PLAIN, **PRECISE, cache=file)
    # A line that was being written when the process died.
    file.write_text(file.read_text() + '{"at": ["0x1.', encoding="utf-8")
    second = Flaky()
    found = quiet(second, *PLAIN, **PRECISE, cache=file).evaluate(np.array([[0.7]]))
    assert np.array_equal(found, expected)
    # The first run is made again, to see whether the file is this simulator's.
    assert set(first.calls[:39]) & set(second.calls) == {first.calls[0]}
    assert len(second.calls) == len(set(whole.calls)) - 38
    third = Flaky()
    quiet(third, *PLAIN, **PRECISE, cache=file, objectives=[Mean(response="response")])
    assert third.calls == first.calls[:1]
    with pytest.raises(InvalidInput, match="runs of this simulator"):
        quiet(lambda x, a: 1.1 * np.exp(x * a), *PLAIN, cache=file)
    with pytest.raises(InvalidInput, match="cache"):
        quiet(lambda x, b: x * b, PLAIN[0], {"b": chaospy.Uniform(0.0, 1.0)}, cache=file)


@pytest.fixture(params=["threads", "dask"])
def workers(request):
    if request.param == "threads":
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            yield pool
        return
    distributed = pytest.importorskip("distributed")
    # Any free port: that of the dashboard may be taken by another run of the tests.
    local = {"processes": False, "dashboard_address": "127.0.0.1:0", "n_workers": 1}
    with distributed.Client(**local) as client:
        yield client


FAILED_ONCE = set()


def fails_once_everywhere(x, a):
    """Fail at the first call at every seventh point; what Dask sends holds no state."""
    if int(1e6 * x) % 7 == 3 and x not in FAILED_ONCE:
        FAILED_ONCE.add(x)
        raise RuntimeError("no licence")
    return np.exp(x * a)


@pytest.mark.slow
def test_workers_give_the_same_and_make_failed_runs_again(workers, steady):
    FAILED_ONCE.clear()
    problem = quiet(fails_once_everywhere, *PLAIN, **PRECISE, executor=workers)
    assert np.array_equal(problem.evaluate(np.array([[0.7]])), steady[0])
    assert FAILED_ONCE
    assert not len(problem.failed)


def test_a_run_that_hangs_is_left_out_and_no_failed_one_comes_again_after_a_kill(tmp_path):
    """As `robust_problem` makes runs; the values of the problem follow from them."""
    log, path = tmp_path / "log", tmp_path / "runs.jsonl"

    # Within the test, so that the processes need not import this file.
    def function(x):
        with open(log, "a") as file:
            file.write(f"{x:g}\n")
        if x == 3.0:
            time.sleep(1000.0)
        if x == 5.0:
            raise RuntimeError("no convergence")
        return 2.0 * x

    def responses():
        file = RunFile(path, ("x",), "the same")
        with closing(Workers(2, 0.3)) as workers:
            runs = Simulator(function, ("x",), False, workers, 2, file, tqdm(disable=True))
            return [runs(values)[:, 0] for values in np.arange(8.0).reshape(2, 4, 1)]

    expected = [0.0, 2.0, 4.0, np.nan, 8.0, np.nan, 12.0, 14.0]
    np.testing.assert_array_equal(np.concatenate(responses()), expected)
    # What fails is tried again, what lasts too long is not.
    assert sorted(log.read_text().split()) == sorted("012345567")
    lines = path.read_text().splitlines(keepends=True)
    lost = [line for line in lines if "failed" in line]
    assert len(lost) == 2
    # As a kill before the last run leaves it.
    last = next(line for line in reversed(lines) if "gave" in line)
    lines.remove(last)
    path.write_text("".join(lines))
    log.unlink()
    np.testing.assert_array_equal(np.concatenate(responses()), expected)
    assert len(log.read_text().split()) == 1


def test_a_vectorised_simulator_has_no_time_limit():
    with pytest.raises(InvalidInput, match="time_limit"):
        quiet(Flaky(), *PLAIN, vectorised=True, time_limit=1.0)


def test_runs_and_memory_are_told_before_the_first_run(capsys):
    def told(x, a):
        assert "2 inputs, 35 to 1000 runs, at most" in capsys.readouterr().err
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        robust_problem(told, *PLAIN)


@pytest.mark.parametrize("unit", [1e-90, 1.0, 1e90])
def test_moments_scale_with_the_unit_of_a_response(unit):
    """A product with uniform noise on 0 to 1: mean x / 2, deviation x / sqrt(12)."""
    designs, noise = {"x": Design(0.5, 1.0)}, {"a": chaospy.Uniform(0.0, 1.0)}
    problem = quiet(lambda x, a: unit * x * a, designs, noise)
    moments = problem.evaluate(np.array([[0.7]]))[0] / unit
    assert moments == pytest.approx([0.35, 0.7 / np.sqrt(12.0)], rel=1e-6)
