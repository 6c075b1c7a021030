"""The command line: exit codes, what is printed where, nothing half-written."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import discrepancy
from pymoo_hdte.drive import UnstableDrive

DOCUMENT = {
    "status": "named",
    "sentence": "There is play between the teeth.",
    "effects": [
        {
            "name": "backlash",
            "port": "mesh",
            "order": None,
            "parameters": {"width": {"value": 1e-4, "interval95": [9e-5, 1.1e-4], "unit": "rad"}},
        }
    ],
    "location": {"sentence": "In the mean."},
    "held_out": {"before": 3.0, "after": 1.0, "unit": "arcsec"},
    "limits": ["No record was held out."],
    "next_experiment": {"description": "a sweep through zero"},
}


@pytest.fixture
def ready(monkeypatch):
    monkeypatch.setattr(discrepancy, "_analysed", lambda *arguments: DOCUMENT)


def run(*options):
    return cli.main(["discrepancy", "campaign", "--out", "report", *options])


def test_the_verdict_is_printed_in_words(ready, capsys):
    assert run() == 0
    printed = capsys.readouterr().out
    for words in (
        "named",
        "backlash (mesh)",
        "play between",
        "In the mean",
        "held out",
        "through zero",
    ):
        assert words in printed


def test_json_on_stdout_is_the_document(ready, capsys):
    assert run("--json") == 0
    assert json.loads(capsys.readouterr().out) == DOCUMENT


def test_quiet_prints_nothing(ready, capsys):
    assert run("--quiet") == 0
    assert capsys.readouterr() == ("", "")


def test_a_missing_campaign_is_one_line_and_writes_nothing(tmp_path, capsys):
    out = tmp_path / "report"
    arguments = ["discrepancy", str(tmp_path / "nowhere"), "--out", str(out), "--quiet"]
    assert cli.main(arguments) == 2
    printed = capsys.readouterr().err
    assert "nowhere" in printed
    assert printed.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["discrepancy", "."], "or rig.toml, of a robot's joint"),
        (["optimise", "hs_20_10"], "a TOML file that is there, or hs_20_100"),
    ],
)
def test_what_is_not_there_is_said_with_what_might_be(
    arguments, words, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*arguments, "--out", "report"]) == cli.MISTAKE
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (InvalidInput("believed.ratio", -1.0, "above 1"), "believed.ratio"),
        (PermissionError(13, "Permission denied", "/kept"), "/kept: Permission denied"),
        (UnstableDrive("at 877 Hz it grows"), "at 877 Hz"),
    ],
)
def test_a_mistake_is_named_without_a_traceback(error, words, monkeypatch, capsys):
    def fail(*arguments):
        raise error

    monkeypatch.setattr(discrepancy, "_analysed", fail)
    assert run() == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert "Traceback" not in printed


def test_an_interrupt_has_the_code_of_the_shell(monkeypatch, capsys):
    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(discrepancy, "_analysed", stop)
    assert run() == 130
    assert "nothing was written" in capsys.readouterr().err


@pytest.mark.parametrize("options", [[], ["discrepancy"], ["discrepancy", "x"]])
def test_what_is_missing_is_a_usage_error(options, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(options)
    assert stopped.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(r"required: .*; see pymoo-hdte.* --help$", line)


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.name)
def test_help_has_an_example_and_the_exit_codes(command, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main([command.name, "--help"])
    assert stopped.value.code == 0
    printed = capsys.readouterr().out
    assert f"  pymoo-hdte {command.name} " in printed
    assert "Exit codes: 0" in printed


def test_progress_goes_to_a_terminal_alone(monkeypatch, capsys):
    def tells(options, believed, say):
        say("reading the records")
        return DOCUMENT

    monkeypatch.setattr(discrepancy, "_analysed", tells)
    for terminal, told in ((True, "reading the records ...\n"), (False, "")):
        monkeypatch.setattr(sys.stderr, "isatty", lambda terminal=terminal: terminal)
        assert run("--json") == 0
        printed = capsys.readouterr()
        assert json.loads(printed.out) == DOCUMENT
        assert printed.err == told


def test_what_a_terminal_cannot_show_is_replaced():
    code = "from pymoo_hdte.cli import command_line as cli; cli._print('K 2·10⁻⁴')"
    options = {"env": os.environ | {"PYTHONIOENCODING": "latin-1"}, "capture_output": True}
    done = subprocess.run([sys.executable, "-c", code], check=True, **options)
    assert done.stdout == "K 2·10??\n".encode("latin-1")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_behind_stdout_is_one_line():
    code = (
        "import sys; from pymoo_hdte.cli import command_line as cli, discrepancy;"
        "from pymoo_hdte.discrepancy._report import summary;"
        "discrepancy._analysed = lambda *a: {'a': 1};"
        "summary.summary = lambda *a: 'found';"
        "sys.exit(cli.main(['discrepancy', 'x', '--out', 'y']))"
    )
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-c", code], stdout=full, stderr=subprocess.PIPE)
    assert done.returncode in (cli.MISTAKE, 120)
    assert b"Traceback" not in done.stderr


def test_help_waits_for_nothing_heavy():
    code = (
        "import sys; from pymoo_hdte.cli import command_line as cli;"
        "cli._parser(); print(*sys.modules)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"scipy", "pymoo", "matplotlib", "numba"} & set(loaded)
