"""The benchmark's arithmetic and its facts on the machine; times are not tested."""

import time

import pytest

from experiments.runner.machine import machine_table
from experiments.studies import benchmark_verdicts
from experiments.studies.benchmark_verdicts import CASES, verdict_times
from experiments.studies.measured import real
from experiments.studies.timing import Ratio, best_time, ratio_table
from pymoo_hdte.surrogate.threads import usable_cores


def test_the_best_of_several_times_is_taken(monkeypatch):
    clock = iter([0.0, 5.0, 10.0, 12.0, 20.0, 29.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    assert best_time(lambda: None, 3) == 2.0


def test_a_ratio_says_whether_it_is_reached():
    slow = Ratio("a", "old", 3.0, "new", 0.5, "at least 3", True)
    free = Ratio("b", "old", 1.0, "new", 2.0, "", True)
    table = ratio_table([slow, free])
    assert [row[5] for row in table.rows] == [6.0, 0.5]
    assert [row[2] for row in table.rows] == [3000.0, 1000.0]
    (finding,) = table.findings
    assert finding.agrees
    assert "6; at least 3" in finding.sentence
    assert table.wall_times


def test_the_machine_is_described():
    facts = dict(machine_table().rows)
    assert facts["cores this process may use"] == str(usable_cores())
    assert float(facts["memory"].split()[0]) > 0.1
    assert "numpy" in facts["versions"]
    assert all(facts.values())


def test_cores_are_those_the_scheduler_leaves(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {1, 5, 6}, raising=False)
    assert usable_cores() == 3
    monkeypatch.delattr("os.sched_getaffinity")
    monkeypatch.setattr("os.cpu_count", lambda: None)
    assert usable_cores() == 1


def test_the_time_of_measured_rigs_is_shown_beside_what_is_allowed():
    taken = [("one", "workflow", "3.5"), ("two", "workflow", "21"), ("two", "other", "99")]
    rows = [[*row, "a machine"] for row in (*taken, ("two", real.COMMAND, "30"))]
    table = real.seconds_table(rows, [["two", "a maker", "2", "3", "a = 1", "right", "x"]])
    assert table.rows[0] == ("one", "workflow", 3.5, "a machine")
    workflow, command = table.findings
    assert not workflow.agrees
    assert "21 s of CPU (two); 20 are allowed" in workflow.sentence
    assert command.agrees
    assert "at most 30 s" in command.sentence
    assert "at most 3 lines" in command.sentence


@pytest.mark.nightly
def test_the_time_of_verdicts_is_shown_beside_what_is_allowed(monkeypatch):
    pytest.importorskip("pysindy", reason="needs the extra blind")
    clean = [case for case in CASES if case.kind == "none"][:1]
    (table,) = verdict_times(tuple(clean))
    ((_, _, cases, _, seconds, *_),) = table.rows
    assert cases == 1
    assert 0.0 < seconds < 600.0
    assert table.wall_times
    monkeypatch.setattr(benchmark_verdicts, "find_spec", lambda name: None)
    assert verdict_times() == ()


@pytest.mark.parametrize("seconds", [1e-9, 1.0])
def test_ratios_have_no_unit(seconds):
    assert Ratio("a", "x", 2.0 * seconds, "y", seconds, "", True).value == pytest.approx(2.0)
