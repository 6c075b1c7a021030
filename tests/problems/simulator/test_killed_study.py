"""A study killed at any moment goes on: no call is made twice, and the bytes are the same."""

import math
import multiprocessing
import os
import signal
import threading
import time
from functools import partial

import chaospy
import numpy as np
import pytest
from night import others_at_night

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Design, robust_problem
from pymoo_hdte.problems._simulator.identity import identity
from pymoo_hdte.problems._simulator.run_file import RunFile

NAMES = ("x", "a")
RUNS, PROBLEM = "runs.jsonl", "problem.npz"
OPTIONS = {"accuracy": 0.05, "progress": False}


def noting(log, x, a):
    """Note the call on disk, as a kill leaves nothing in memory, and work for a while."""
    with open(log, "a") as file:
        file.write(f"{x.hex()} {a.hex()}\n")
    time.sleep(1e-3)
    return np.exp(x * a)


def study(folder, simulator=None):
    """Make a problem, whose cache, log of calls and file are in the folder."""
    designs, noise = {"x": Design(0.5, 1.0, deviation=0.05)}, {"a": chaospy.Uniform(0.0, 1.0)}
    simulator = simulator or partial(noting, str(folder.resolve() / "log"))
    problem = robust_problem(simulator, designs, noise, cache=folder / RUNS, **OPTIONS)
    problem.save(folder / PROBLEM)


def calls(folder):
    log = folder / "log"
    return log.read_text().splitlines() if log.exists() else []


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a study that nobody killed."""
    folder = tmp_path_factory.mktemp("whole")
    study(folder)
    assert len(calls(folder)) == len(set(calls(folder)))
    return folder


def same(folder, whole):
    """Check what a study left behind; its log has another path, which the cache knows of."""
    lines = [(one / RUNS).read_bytes().split(b"\n", 1)[1] for one in (folder, whole)]
    assert lines[0] == lines[1]
    assert (folder / PROBLEM).read_bytes() == (whole / PROBLEM).read_bytes()


def killed_at(folder, count, target=study):
    """Run a study in a process of its own and kill it when it has made so many calls."""
    process = multiprocessing.get_context("fork").Process(target=target, args=(folder,))
    process.start()
    while process.is_alive() and len(calls(folder)) < count:
        time.sleep(1e-4)
    if process.is_alive():
        os.kill(process.pid, signal.SIGKILL)
    process.join()
    return process.exitcode


# From Python 3.12 on a fork warns where there are threads, as progress bars have.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(k, marks=pytest.mark.nightly) for k in range(2, 12))]
)
def test_a_killed_process_goes_on_without_a_call_made_twice(tmp_path, whole, seed):
    rng = np.random.default_rng(seed)
    total, kills = len(calls(whole)), 0
    for count in np.sort(rng.choice(total - 2, 4, replace=False)) + 1:
        kills += killed_at(tmp_path, count) == -signal.SIGKILL
        made, kept = calls(tmp_path), (tmp_path / RUNS).read_bytes().count(b'"at"')
        assert kept <= len(set(made))
    assert kills >= 2
    study(tmp_path)
    made = calls(tmp_path)
    # A call that the kill interrupted has no result, so that it is made again.
    again = len(made) - len(set(made))
    assert again <= kills
    assert set(made) == set(calls(whole))
    same(tmp_path, whole)


@pytest.mark.nightly
def test_any_part_of_the_file_that_a_kill_leaves_is_gone_on_from(tmp_path, whole):
    """The file only grows, so that a kill leaves one of its beginnings."""
    contents = (whole / RUNS).read_bytes()
    ends = np.cumsum([len(line) for line in contents.splitlines(keepends=True)])
    cuts = [0, 1, ends[0] - 1, ends[0], ends[1] - 3, ends[1], ends[9] + 9]
    for place, cut in enumerate([*cuts, ends[-2], ends[-1] - 1]):
        folder = tmp_path / str(place)
        folder.mkdir()
        # The simulator's identity holds the path of its log.
        simulator = partial(noting, str(whole / "log"))
        (folder / RUNS).write_bytes(contents[:cut])
        before = len(calls(whole))
        study(folder, simulator)
        kept = contents[:cut].count(b"\n") - 2
        assert len(calls(whole)) - before == (ends.size - 3) - max(min(kept, ends.size - 3), 0)
        assert (folder / RUNS).read_bytes() == contents
        same(folder, whole)


@pytest.mark.slow
def test_the_first_run_is_made_again_where_the_simulator_may_be_another(tmp_path, whole):
    before = (whole / RUNS).read_bytes()
    unfinished = before[: before.rindex(b"\n", 0, -1) + 1]
    (tmp_path / RUNS).write_bytes(unfinished)
    again = []

    def other(x, a):
        again.append((x, a))
        return np.exp(x * a)

    study(tmp_path, other)
    assert len(again) == 1
    # A study that came to its end may be looked at much later, by another version of the program.
    count = len(calls(whole))
    study(whole)
    assert len(calls(whole)) - count == 1
    assert (whole / RUNS).read_bytes() == before
    with pytest.raises(InvalidInput, match="runs of this simulator"):
        study(tmp_path, lambda x, a: 1.1 * np.exp(x * a))


def function(x, a):
    return x * a


def test_a_simulator_is_known_by_its_state_and_its_source(tmp_path, monkeypatch):
    class Local:
        def __call__(self, x, a):
            return x

    assert identity(function) == identity(function)
    assert identity(partial(function, 1.0)) != identity(partial(function, 2.0))
    # What cannot be told is not guessed.
    for one in (lambda x, a: x, Local(), math.hypot):
        assert identity(one) is None
    sources = [tmp_path / "own.py", tmp_path / "own.py"]
    monkeypatch.syspath_prepend(tmp_path)
    found = []
    for text in ("LENGTH = 1.0\n", "LENGTH = 2.0\n"):
        sources[0].write_text(text + "def beam(x):\n    return LENGTH * x\n")
        import own

        found.append(identity(own.beam))
    assert found[0] != found[1]


LENGTH = 1.0


def scaled(x, a):
    return _with_length(x * a)


def _with_length(value):
    return LENGTH * value


def times(factor):
    """Return a function that pickle knows by its name only, without the closure."""

    def decorated(x, a):
        return factor * x * a

    decorated.__qualname__ = "decorated"
    return decorated


class Machine:
    def __call__(self, x, a):
        return self.run(x, a)

    def run(self, x, a):
        return LENGTH * x * a


@pytest.mark.parametrize("simulator", [scaled, partial(scaled, a=1.0), Machine(), Machine().run])
def test_a_simulator_is_known_by_the_globals_it_reads(simulator, monkeypatch):
    """A script may read them from its command line or a file, the text of both being the same."""
    before = identity(simulator)
    assert before is not None
    assert identity(simulator) == before
    monkeypatch.setitem(globals(), "UNUSED", 2.0)
    assert identity(simulator) == before
    monkeypatch.setitem(globals(), "LENGTH", 2.0)
    assert identity(simulator) != before
    # What cannot be written down is not guessed.
    monkeypatch.setitem(globals(), "LENGTH", threading.Lock())
    assert identity(simulator) is None


def test_a_simulator_is_known_by_its_closure_and_its_defaults(monkeypatch):
    found = []
    for factor in (1.0, 2.0, 2.0):
        monkeypatch.setitem(globals(), "decorated", times(factor))
        found.append(identity(globals()["decorated"]))
    assert None not in found
    assert found[0] != found[1] == found[2]
    before = identity(scaled)
    monkeypatch.setitem(globals(), "_with_length", function)
    assert identity(scaled) != before
    before = identity(function)
    monkeypatch.setattr(function, "__defaults__", (1.0,))
    assert identity(function) != before


def test_a_simulator_is_known_by_the_modules_it_calls(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "calls_helper.py").write_text(
        "import helper\nfrom helper import solve\n"
        "def whole(x):\n    return helper.solve(x)\n"
        "def part(x):\n    return solve(x)\n"
    )
    (tmp_path / "helper.py").write_text("def solve(x):\n    return x\n")
    import calls_helper

    simulators = calls_helper.whole, calls_helper.part
    before = [identity(one) for one in simulators]
    assert None not in before
    (tmp_path / "helper.py").write_text("def solve(x):\n    return 2.0 * x\n")
    for one, old in zip(simulators, before, strict=True):
        assert identity(one) != old


def test_a_study_with_another_global_does_not_take_the_runs_of_a_killed_one(tmp_path, monkeypatch):
    study(tmp_path, scaled)
    contents = (tmp_path / RUNS).read_bytes()
    (tmp_path / RUNS).write_bytes(contents[: contents.rindex(b"\n", 0, -1) + 1])
    monkeypatch.setitem(globals(), "LENGTH", 1.1)
    with pytest.raises(InvalidInput, match="runs of this simulator"):
        study(tmp_path, scaled)


def test_runs_that_cannot_be_made_again_are_not_taken(tmp_path):
    """A first run that fails tells nothing: the next ones are made; if all fail, none is taken."""

    def right(x, a):
        return x * a

    study(tmp_path, right)
    kept = RunFile(tmp_path / RUNS, NAMES, None)
    first = next(iter(kept.runs))

    def failing(x, a):
        raise ValueError("no licence")

    def wrong(x, a):
        return math.nan if (x, a) == first else 2.0 * x * a

    for other in (failing, wrong):
        with pytest.raises(InvalidInput, match="runs of this simulator"):
            study(tmp_path, other)
    # A run that fails now and then is no reason to refuse the others.
    study(tmp_path, lambda x, a: math.nan if (x, a) == first else x * a)


DAMAGED = {
    "cut": b'{"at": ["0x1',
    "no number": b'{"at": ["x", "y"], "gave": [1.0]}',
    "too few inputs": b'{"at": ["0x1p0"], "gave": [1.0]}',
    "inputs that are no list": b'{"at": 3, "gave": [1.0]}',
    "inputs that are no texts": b'{"at": [1.0, 2.0], "gave": [1.0]}',
    "endless inputs": b'{"at": ["inf", "nan"], "gave": [1.0]}',
    "inputs beyond all floats": b'{"at": ["0x1p9999", "0x1p0"], "gave": [1.0]}',
    "nothing given": b'{"at": ["0x1p0", "0x1p0"], "gone": 1}',
    "too many responses": b'{"at": ["0x1p0", "0x1p0"], "gave": [1.0, 2.0]}',
    "text as a response": b'{"at": ["0x1p0", "0x1p0"], "gave": ["1.0"]}',
    "truth as a response": b'{"at": ["0x1p0", "0x1p0"], "gave": [true]}',
    "null as a response": b'{"at": ["0x1p0", "0x1p0"], "gave": null}',
    "a table as a response": b'{"at": ["0x1p0", "0x1p0"], "gave": {"response": 1.0}}',
    "NaN as a response": b'{"at": ["0x1p0", "0x1p0"], "gave": [NaN]}',
    "a whole number beyond all floats": b'{"at": ["0x1p0", "0x1p0"], "gave": [1%s]}' % (b"0" * 400),
    "more digits than Python reads": b'{"at": ["0x1p0", "0x1p0"], "gave": [1%s]}' % (b"0" * 9999),
    "a failure without words": b'{"at": ["0x1p0", "0x1p0"], "failed": {"why": 1}}',
    "responses that are no list": b'{"responses": 3}',
    "responses that are no texts": b'{"responses": [[1]]}',
    "other responses": b'{"responses": ["stress"]}',
    "a number": b"3",
    "a list": b"[1, 2]",
    "unknown": b'{"other": 1}',
    "nested too deeply": b"[" * 100_000,
    "nested too deeply, whole": b'{"at": %s%s}' % (b"[" * 100_000, b"]" * 100_000),
    "no text": b'{"at": ["0x1p0", "0x1p0"], "failed": "\xff\xfe"}',
    "UTF-16": '{"finished": true}'.encode("utf-16"),
    "empty": b"",
}


def damaged(whole, kind):
    """Return the file of a study whose sixth line is damaged."""
    lines = (whole / RUNS).read_bytes().split(b"\n")
    return b"\n".join([*lines[:5], DAMAGED[kind], *lines[6:]])


@pytest.mark.slow
@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_line_is_told_and_left_out(tmp_path, whole, kind):
    (tmp_path / RUNS).write_bytes(damaged(whole, kind))
    (tmp_path / "whole").write_bytes((whole / RUNS).read_bytes())
    with pytest.warns(RuntimeWarning, match="line 6"):
        runs = RunFile(tmp_path / RUNS, NAMES, None).runs
    assert (tmp_path / RUNS).read_bytes() == damaged(whole, kind)
    undamaged = RunFile(tmp_path / "whole", NAMES, None).runs
    # Two lines above the runs name the inputs and the responses.
    del undamaged[[*undamaged][3]]
    assert [*runs.items()] == [*undamaged.items()]


@pytest.mark.slow
@pytest.mark.parametrize("kind", others_at_night(DAMAGED, "cut"))
def test_the_run_of_a_damaged_line_is_made_again(tmp_path, whole, kind):
    (tmp_path / RUNS).write_bytes(damaged(whole, kind))
    before = len(calls(whole))
    with pytest.warns(RuntimeWarning, match="line 6"):
        study(tmp_path, partial(noting, str(whole / "log")))
    # The run of the damaged line, and the first one, as the study had come to its end.
    assert len(calls(whole)) - before == 2
    assert (tmp_path / PROBLEM).read_bytes() == (whole / PROBLEM).read_bytes()


@pytest.mark.slow
def test_a_file_whose_names_of_responses_are_damaged_keeps_its_runs(tmp_path, whole):
    lines = (whole / RUNS).read_bytes().split(b"\n")
    (tmp_path / RUNS).write_bytes(b"\n".join([lines[0], b'{"responses": nul', *lines[2:-2], b""]))
    before = len(calls(whole))
    with pytest.warns(RuntimeWarning, match="line 2"):
        study(tmp_path, partial(noting, str(whole / "log")))
    assert len(calls(whole)) - before == 1
    assert (tmp_path / PROBLEM).read_bytes() == (whole / PROBLEM).read_bytes()


def test_a_file_of_no_runs_is_refused_and_left_alone(tmp_path):
    file = tmp_path / "notes.txt"
    others = '{"inputs": [1, 2], "mine": true}', '{"inputs": ["x", "a"], "mine": true}'
    for text in (
        "[" * 100_000 + "\n",
        "my notes\n",
        "my notes",
        '{"inputs": 3}\n',
        '{"inputs": ["y"]}\n',
        *others,
    ):
        file.write_text(text)
        with pytest.raises(InvalidInput, match="cache"):
            RunFile(file, NAMES, None)
        assert file.read_text() == text
