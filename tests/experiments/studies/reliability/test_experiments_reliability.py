"""The reliability suite in small: inputs, kills and full disks as in the full run, but fewer."""

import io
import os
import re
import signal
import subprocess
import sys
from contextlib import redirect_stdout
from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from places import ROOT

from experiments.command_line import main
from experiments.runner import committed
from experiments.runner.registry import Context
from experiments.studies.reliability import data
from experiments.studies.reliability import experiment as reliability
from experiments.studies.reliability import kill as reliability_kill
from experiments.studies.reliability.data import (
    FUZZ,
    KILL,
    LIMIT,
    Peak,
    Tally,
    format_peaks,
    format_tallies,
    read_peaks,
    read_tallies,
    tally_of_inputs,
    tally_of_kills,
)
from experiments.studies.reliability.fuzz import (
    ACCEPTED,
    CRASHED,
    HUNG,
    OUTCOMES,
    REFUSED,
    outcome,
    outcomes_of_process,
)
from experiments.studies.reliability.inputs import KINDS, THROUGH_COMMANDS, Wrong
from experiments.studies.reliability.mutations import Link, mutated, put
from experiments.studies.reliability.text import BYTES, TEXTS
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte._runner.result import Result

LOADERS = [name for name in KINDS if name not in THROUGH_COMMANDS]


@pytest.mark.parametrize("kind", LOADERS)
def test_an_original_is_read(kind, tmp_path):
    put(KINDS[kind].original(), tmp_path / "input")
    KINDS[kind].read(tmp_path / "input")


@pytest.mark.parametrize("kind", LOADERS)
@pytest.mark.filterwarnings("default")
def test_mutated_inputs_are_refused_or_read(kind):
    found = [outcome(kind, number) for number in range(25)]
    assert {OUTCOMES[one] for one, _ in found} <= {"refused", "accepted"}, found
    assert REFUSED in [one for one, _ in found]


@pytest.mark.parametrize("kind", THROUGH_COMMANDS)
def test_the_whole_command_refuses_in_one_line(kind):
    found = [outcome(kind, number) for number in range(4)]
    assert {OUTCOMES[one] for one, _ in found} <= {"refused", "accepted"}, found


def test_an_input_is_a_pure_function_of_kind_and_number():
    original = KINDS["duty cycle"].original()
    one, other, third = (mutated(original, np.random.default_rng(n)) for n in (5, 5, 6))
    assert one == other
    assert one != third
    assert original == KINDS["duty cycle"].original()


@pytest.mark.nightly
def test_every_mutation_is_drawn_and_leaves_nothing_but_files(tmp_path):
    names = set()
    for number in range(600):
        files, changes = mutated(KINDS["duty cycle"].original(), np.random.default_rng(number))
        names |= {change.split(" of ")[0].split(" by ")[0] for change in changes}
        assert all(isinstance(one, bytes | Link) or one for one in files.values())
        if number < 30:
            put(files, tmp_path / str(number))
    assert names == {change.__name__ for change in (*TEXTS, *BYTES)} | {"replacement", "encoding"}


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (ZeroDivisionError("oops"), "ZeroDivisionError"),
        (RecursionError("deep"), "RecursionError"),
        (Wrong("half a report"), "half a report"),
    ],
)
def test_whatever_is_no_clear_error_fails(fault, words, monkeypatch):
    def read(folder):
        raise fault

    monkeypatch.setitem(KINDS, "model", replace(KINDS["model"], read=read))
    found, said = outcome("model", 0)
    assert OUTCOMES[found] == "failed"
    assert words in said


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("then", "expected"),
    [
        ("time.sleep(60)", [REFUSED, ACCEPTED, HUNG]),
        ("os.abort()", [REFUSED, ACCEPTED, CRASHED]),
        ("print('outcome 0')", [REFUSED, ACCEPTED, REFUSED]),
        ("print(' ** On entry to DLASCL')", [REFUSED, ACCEPTED, CRASHED]),
        ("sys.stdout.write('outcome 1')", [REFUSED, ACCEPTED, CRASHED]),
    ],
)
def test_a_hang_or_a_crash_is_seen_from_outside(then, expected):
    told = "print('ready'); print('outcome 0'); print('outcome 1', flush=True)"
    script = f"import os, sys, time; {told}; {then}"
    assert outcomes_of_process([sys.executable, "-c", script], 3, 2.0) == expected


def test_tallies_count_and_bound():
    rows = np.array([[0, REFUSED], [1, ACCEPTED], [2, HUNG], [3, REFUSED]], dtype=float)
    tally = tally_of_inputs("model", [Run(("number", "outcome"), rows, 0.0)])
    assert tally == Tally(FUZZ, "model", 4, 2, 1, 1, "2")
    kills = [Run(reliability_kill.COUNTS, np.array([[10.0, 4, 0, 1, 0, 2]]), 0.0)] * 2
    assert tally_of_kills("x", kills) == Tally(KILL, "x", 20, 0, 8, 6, "different:2 orphaned:4")
    # Nothing in n trials: (1 - p)^n = 0.05.
    assert Tally(FUZZ, "x", 10_000, 0, 0, 0).bound == pytest.approx(1.0 - 0.05**1e-4)
    assert Tally(LIMIT, "x", 0, 0, 0, 0).bound == 1.0


def test_an_outcome_survives_its_files_and_makes_the_tables(tmp_path, monkeypatch):
    tallies = [
        Tally(FUZZ, "model", 1000, 900, 99, 1, "17"),
        Tally(KILL, "command, Dask", 60, 0, 30, 0),
        Tally(LIMIT, "full disk", 0, 0, 0, 0),
    ]
    peaks = [Peak("table7", 233242624.0, 38.021221)]
    (tmp_path / "reliability.csv").write_text(format_tallies(tallies))
    (tmp_path / "reliability_memory.csv").write_text(format_peaks(peaks))
    assert read_tallies(tmp_path / "reliability.csv") == tallies
    assert read_peaks(tmp_path / "reliability_memory.csv") == peaks
    monkeypatch.setattr(committed, "DATA", tmp_path)
    result = reliability.run(Context(1, tmp_path, Campaign(tmp_path)))
    agrees = {table.name: table.findings[0].agrees for table in result.tables}
    assert agrees == {"inputs": False, "kills": True, "limits": True, "memory": True}
    assert result.tables[2].rows[0][1] == "not possible here"


def test_without_an_outcome_the_report_says_what_to_run(tmp_path, monkeypatch):
    monkeypatch.setattr(committed, "DATA", tmp_path)
    with pytest.raises(FileNotFoundError, match="reliability --full"):
        reliability.run(Context(1, tmp_path, Campaign(tmp_path)))


def test_the_full_run_is_as_large_as_it_says():
    assert sum(reliability.FULL.inputs.values()) >= 10_000
    assert set(reliability.FULL.inputs) == set(KINDS) == set(reliability.QUICK.inputs)
    assert sum(reliability.FULL.kills.values()) >= 300


def test_the_committed_outcome_is_that_of_the_full_run():
    tallies = read_tallies(committed.DATA / reliability.TALLIES)
    assert {one.kind: one.trials for one in tallies if one.part == FUZZ} == reliability.FULL.inputs
    assert [one.kind for one in tallies if one.part == KILL] == list(reliability.FULL.kills)


def test_torn_and_differing_files_are_counted(tmp_path, monkeypatch):
    whole = {"a.csv": b"x\n", "b.json": b"{}\n"}
    monkeypatch.setattr(
        reliability_kill, "reference", lambda: reliability_kill.Reference(whole, 1.0)
    )

    def counted(ended, **files):
        for path in tmp_path.iterdir():
            path.unlink()
        for name, content in files.items():
            (tmp_path / name.replace("_", ".")).write_bytes(content)
        counts = dict.fromkeys(reliability_kill.COUNTS, 0)
        reliability_kill.judge(tmp_path, ended, counts)
        return {name for name, count in counts.items() if count}

    assert counted(0, a_csv=b"x\n", b_json=b"{}\n") == {"finished"}
    assert counted(-9, a_csv=b"x\n") == {"kills"}
    assert counted(0, a_csv=b"x\n") == {"finished", "different"}
    assert counted(-9, a_csv=b"x") == {"kills", "different", "partial"}
    assert counted(-9, b_json=b"{\n") == {"kills", "different", "partial"}
    assert counted(1, a_csv=b"x\n") == {"failed"}
    assert counted(None) == {"orphaned"}


@pytest.mark.parametrize(
    ("step", "names", "sizes"),
    [
        pytest.param(1, set(), {5}, marks=pytest.mark.nightly),
        pytest.param(2, set(), {10}, marks=pytest.mark.nightly),
        pytest.param(3, {"a"}, {5}, marks=pytest.mark.nightly),
        (4, {"a"}, {10}),
    ],
)
def test_a_kill_in_the_midst_of_writing_leaves_whole_files_only(step, names, sizes, tmp_path):
    script = (
        "from pathlib import Path; from experiments.studies.reliability.kill import _die_at; "
        "from pymoo_hdte._runner.store import write_atomically; _die_at({step}); "
        "[write_atomically(Path(r'{out}') / name, b'0123456789') for name in 'ab']"
    )
    command = [sys.executable, "-c", script.format(step=step, out=tmp_path)]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == -signal.SIGKILL
    assert {path.name for path in reliability_kill.visible(tmp_path)} == names
    assert {path.stat().st_size for path in tmp_path.glob(".*")} == sizes


def test_workers_end_with_a_command_that_is_killed():
    script = (
        "import time; from pymoo_hdte._runner.workers import make_executor\n"
        "executor = make_executor(2)\n"
        "list(executor.map(abs, range(8))); print('ready', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE) as one:
        assert one.stdout.readline() == b"ready\n"
        one.kill()
        # The pipe ends with the last process that holds it.
        assert one.communicate(timeout=20.0) == (b"", None)


@pytest.mark.parametrize("size", others_at_night([0, 10, 4096], 4096))
def test_a_disk_that_fills_up_keeps_the_former_file_and_no_part(tmp_path, size):
    path = tmp_path / "result.csv"
    path.write_bytes(b"former")
    script = (
        "import resource; from pathlib import Path\n"
        "from pymoo_hdte._runner.store import write_atomically\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))\n"
        f"write_atomically(Path({str(path)!r}), b'x' * 5000)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, check=False, capture_output=True, text=True
    )
    assert "OSError: [Errno 27]" in done.stderr
    assert path.read_bytes() == b"former"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_sentence_and_code_1(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device", str(tmp_path))

    monkeypatch.setattr("experiments.command_line.save", full)
    monkeypatch.setattr("experiments.studies.dte_map.run", lambda context: Result("", "", "done"))
    assert main(["dte_map", "--workers", "1", "--out", str(tmp_path)]) == 1
    assert "dte_map: [Errno 28] No space left on device" in capsys.readouterr().err


def test_a_folder_without_permission_is_refused_before_anything_runs(tmp_path, monkeypatch, capsys):
    # As root, who may write anywhere, the answer of the system has to be made up.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with redirect_stdout(io.StringIO()), pytest.raises(SystemExit) as stopped:
        main(["dte_map", "--out", str(tmp_path)])
    assert stopped.value.code == 2
    assert f"--out {tmp_path} cannot be written to" in capsys.readouterr().err


@pytest.mark.parametrize("failed", [0, 2])
def test_a_night_in_which_something_failed_ends_with_1(failed, tmp_path, capsys):
    tallies = [Tally(FUZZ, "rig", 5, 3, 2, 0), Tally(KILL, "Dask", 5, 0, 3, failed, "torn:2")]
    path = tmp_path / "reliability.csv"
    path.write_text(format_tallies(tallies), encoding="utf-8")
    assert data.main([str(path)]) == (failed > 0)
    assert ("torn:2" in capsys.readouterr().out) == (failed > 0)
    # The night reads the file that the suite writes.
    night = (ROOT / ".ci" / "nightly").read_text(encoding="utf-8")
    (out,) = re.findall(r"reliability --quick --out (\S+)", night)
    assert (
        f"experiments.studies.reliability.data {out}/reliability/{reliability.TALLIES}\n" in night
    )
