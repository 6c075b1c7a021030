"""The page on the command line: a design that is optimised is simulated next."""

import json
import re
import shlex
from pathlib import Path

import pytest
from places import DOCS

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import optimum_report

PAGE = (DOCS / "command_line.md").read_text(encoding="utf-8")


def commands():
    """Return the arguments of `optimise` and `simulate`, of the sheet that the package brings."""
    lines = [
        line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.S) for line in block.splitlines()
    ]
    optimise, simulate = (
        next(shlex.split(line)[1:] for line in lines if f"pymoo-hdte {command} " in line)
        for command in ("optimise", "simulate optimum/optimum_sheet.toml")
    )
    optimise[1] = "hs_20_100"
    return optimise, simulate


def test_the_simulation_takes_what_the_optimisation_wrote():
    optimise, simulate = (cli._parser().parse_args(words) for words in commands())
    written = {Path(optimise.out, name) for name in optimum_report.FOLDER.files}
    assert {Path(simulate.datasheet), Path(simulate.model)} <= written


@pytest.mark.nightly
def test_the_commands_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    optimise, simulate = commands()
    assert cli.main(optimise) == cli.main(simulate) == 0
    out = Path(cli._parser().parse_args(optimise).out)
    found = json.loads((out / "optimum.json").read_text(encoding="utf-8"))
    (chosen,) = (found["designs"][name] for name in found["designs"] if name in " ".join(optimise))
    for name in ("mean_dte_arcsec", "std_dte_arcsec"):
        assert chosen[name] < found["initial"][name]
    assert Path(cli._parser().parse_args(simulate).out, "report.html").is_file()
