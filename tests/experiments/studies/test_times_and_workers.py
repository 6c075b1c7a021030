"""How times are taken, what is said of the machine, and how busy workers are."""

import time

from experiments.runner.machine import machine_table
from experiments.studies import workers
from experiments.studies.cost import best_time
from experiments.studies.measured import real
from pymoo_hdte.surrogate.threads import usable_cores


def test_the_best_of_several_times_is_taken(monkeypatch):
    clock = iter([0.0, 5.0, 10.0, 12.0, 20.0, 29.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    assert best_time(lambda: None, 3) == 2.0


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
    rows = [["one", "workflow", "3.5"], ["two", "workflow", "21"], ["two", "other", "99"]]
    table = real.cpu_table(rows)
    assert table.rows[0] == ("one", "workflow", 3.5)
    (finding,) = table.findings
    assert not finding.agrees
    assert "21 s of CPU (two); 20 are allowed" in finding.sentence


def test_workers_that_wait_for_none_are_all_busy_where_times_are_equal(monkeypatch):
    monkeypatch.setattr(workers, "MANY", 4)
    monkeypatch.setattr(workers, "LONG", 5)
    table = workers.virtual_table()
    equal, *unequal = table.rows
    assert equal[1] == equal[2] == 1.0
    assert equal[3] == 1.0
    assert all(by_generations < asynchronous for _, by_generations, asynchronous, *_ in unequal)
