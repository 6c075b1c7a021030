"""Ctrl-C while modules are imported, a pipe that is closed, and a folder that another run uses."""

import os
import re
import signal
import subprocess
import sys
from threading import Thread

import pytest
from night import others_at_night
from places import ROOT

from pymoo_hdte._interrupts import INTERRUPTED, UNREAD, ended_quietly, orderly
from pymoo_hdte._reports.in_use import in_use
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.command_line import COMMANDS, MISTAKE

# Whatever this process inherits: a shell starts programs in the background without Ctrl-C.
MINDED = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
AT_IMPORT = """
import os, runpy, signal, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
sys.argv = {arguments!r}
runpy.run_module({program!r}, run_name="__main__", alter_sys=True)
"""
ARGUMENTS = {
    "optimise": ["hs_20_100"],
    "simulate": ["hs_20_100"],
    "identify": ["records"],
    "plan": ["model.toml", "--limits", "limits.toml"],
    "discrepancy": ["campaign"],
    "export": ["model.toml", "--to", "urdf"],
    "init": ["logs"],
    "robust": ["study.toml", "--out", "new/out"],
    "example": ["new/example"],
    "decide": ["gear.toml", "--out", "new/out"],
    "table7": ["--out", "new/out"],
}
HELD = """
import sys, time
from pathlib import Path
from pymoo_hdte._reports.in_use import in_use
with in_use(Path(sys.argv[1]), "folder", Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def python(*arguments, **options):
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, timeout=60, **options
    )


def interrupted(program, arguments, module, folder):
    code = MINDED + AT_IMPORT.format(
        module=module, arguments=[program, *arguments], program=program
    )
    return python("-c", code, cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)})


@pytest.mark.parametrize(
    "name", others_at_night([command.name for command in COMMANDS], "discrepancy", "simulate")
)
def test_ctrl_c_during_imports_of_a_command(name, tmp_path):
    command = next(command for command in COMMANDS if command.name == name)
    arguments = [name, *ARGUMENTS[name], *(["--out", "new/out"] if command.out else [])]
    done = interrupted("pymoo_hdte.cli", arguments, "scipy", tmp_path)
    assert done.stderr == "pymoo-hdte: interrupted, nothing was written\n"
    assert done.returncode == INTERRUPTED
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("module", ["argparse", "numpy", "numpy._core", "experiments.command_line"])
def test_ctrl_c_during_early_imports(module, tmp_path):
    program = "experiments" if "experiments" in module else "pymoo_hdte.cli"
    done = interrupted(program, ["--help"], module, tmp_path)
    assert re.fullmatch(r"[\w. -]+: interrupted, nothing was written\n", done.stderr)
    assert done.returncode == INTERRUPTED


@pytest.mark.slow
def test_ctrl_c_after_the_folder_is_held_leaves_nothing(tmp_path):
    arguments = ["discrepancy", "none", "--out", "new/out"]
    module = "pymoo_hdte.discrepancy._records.campaign_keys"
    done = interrupted("pymoo_hdte.cli", arguments, module, tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (INTERRUPTED, 1)
    assert not list(tmp_path.iterdir())


def test_a_program_in_the_background_goes_on_ignoring_ctrl_c(tmp_path):
    code = f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n{AT_IMPORT}"
    code = code.format(module="numpy", arguments=["x", "--version"], program="pymoo_hdte.cli")
    done = python("-c", code, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    "command",
    ["-m pymoo_hdte.cli --help", "-m pymoo_hdte.cli simulate --help", "-m experiments --list"],
)
def test_output_that_nobody_reads(command):
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "wb") as closed:
        done = subprocess.run(
            [sys.executable, *command.split()],
            cwd=ROOT,
            stdout=closed,
            stderr=subprocess.PIPE,
            env={key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"},
            check=False,
        )
    assert (done.returncode, done.stderr) == (UNREAD, b"")


def test_a_folder_in_use_is_refused_with_the_process_that_holds_it(tmp_path):
    file = tmp_path / "new" / ".out.in-use"
    command = [sys.executable, "-c", HELD, str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        out = str(tmp_path / "new" / "out")
        second = python("-m", "pymoo_hdte.cli", "simulate", "hs_20_100", "--out", out)
        assert second.returncode == MISTAKE
        assert second.stderr.count("\n") == 1
        assert f"process {holder.pid} on" in second.stderr
        holder.send_signal(signal.SIGKILL)
    # The file of a killed process holds nothing.
    assert file.exists()
    with in_use(file, "folder", file):
        assert file.exists()
    assert not file.exists()


@pytest.mark.parametrize("kind", ["symbolic", "dangling", "hard", "pipe"])
def test_nothing_is_written_through_what_somebody_put_in_the_place_of_the_lock(tmp_path, kind):
    target, lock = tmp_path / "thesis.txt", tmp_path / ".out.in-use"
    target.write_text("years of work")
    if kind == "hard":
        os.link(target, lock)
    elif kind == "pipe":
        os.mkfifo(lock)
    else:
        lock.symlink_to(target if kind == "symbolic" else tmp_path / "nowhere")
    holding = in_use(lock, "folder of the report", tmp_path / "out")
    with pytest.raises(InvalidInput, match="in-use"), holding:
        pass
    assert target.read_text() == "years of work"
    assert {one.name for one in tmp_path.iterdir()} == {"thesis.txt", ".out.in-use"}


def test_folders_made_for_the_lock_go_with_it(tmp_path):
    again = in_use(tmp_path / "a" / "b" / "lock", "folder", tmp_path)
    with in_use(tmp_path / "a" / "b" / "lock", "folder", tmp_path):
        allowed = pytest.raises(InvalidInput, match=f"process {os.getpid()} on")
        with allowed, again:
            pass
    assert not list(tmp_path.iterdir())


def test_a_folder_taken_in_turns_has_one_holder_and_no_mishap(tmp_path):
    inside, mishaps, turns = [], [], []

    def take():
        for _ in range(150):
            try:
                with in_use(tmp_path / "a" / "b" / "lock", "folder", tmp_path):
                    inside.append(1)
                    turns.append(len(inside))
                    inside.pop()
            except InvalidInput:
                pass
            except Exception as error:
                mishaps.append(error)

    threads = [Thread(target=take) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert not mishaps
    assert turns
    assert set(turns) == {1}


def test_ctrl_c_where_nobody_has_put_things_in_order_yet(capfd):
    def waits_for_a_scheduler():
        with orderly():
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    try:
        assert ended_quietly("program", waits_for_a_scheduler) == INTERRUPTED
    finally:
        signal.signal(signal.SIGINT, before)
    assert capfd.readouterr().err == "program: interrupted, nothing was written\n"


def test_a_second_run_of_the_experiments_is_refused(tmp_path):
    with in_use(tmp_path / ".in-use", "--out", tmp_path):
        done = python("-m", "experiments", "table2", "--out", str(tmp_path), cwd=ROOT)
    assert done.returncode == MISTAKE
    assert f"process {os.getpid()} on" in done.stderr
    assert not list(tmp_path.iterdir())
