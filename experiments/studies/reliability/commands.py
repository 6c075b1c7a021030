"""The commands of the command line on an input: a whole report, or a line for each complaint."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path

from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import identification_report, optimum_report, simulation_report
from pymoo_hdte.discrepancy._report import folder as report_folder


class Wrong(Exception):
    """Invalid input was accepted, or files were left behind."""


def discrepancy(folder: Path) -> None:
    """Judge the campaign or rig in a folder; errors as `_run`."""
    _run(["discrepancy", str(folder)], folder, report_folder.FOLDER)


def simulate(folder: Path) -> None:
    """Simulate the drive in a folder; errors as `_run`."""
    _run(["simulate", *_drive(folder)], folder, simulation_report.FOLDER)


def optimise(folder: Path) -> None:
    """Optimise the drive in a folder over its duty cycle, shortly; errors as `_run`."""
    shortly = ["--cycle", str(folder / "cycle.csv"), "--designs", "40"]
    _run(["optimise", *_drive(folder), *shortly], folder, optimum_report.FOLDER)


def identify(folder: Path) -> None:
    """Identify what the records in a folder tell; errors as `_run`."""
    sheet = ["--datasheet", str(folder / "sheet.toml")]
    _run(["identify", str(folder), *sheet], folder, identification_report.FOLDER)


COMMANDS: tuple[Callable[[Path], None], ...] = (discrepancy, simulate, optimise, identify)


def _drive(folder: Path) -> list[str]:
    return [str(folder / "sheet.toml"), "--model", str(folder / "model.toml")]


def _run(arguments: list[str], folder: Path, report: ReportFolder) -> None:
    """Run a command; raise `InvalidInput` where it refuses, `Wrong` where it does so wrongly."""
    out, errors = folder.parent / "out", io.StringIO()
    with redirect_stderr(errors):
        code = cli.main([*arguments, "--out", str(out), "--quiet"])
    written = {path.name for path in out.iterdir()} if out.is_dir() else set()
    beside = {path.name for path in folder.parent.iterdir()} - {folder.name, out.name}
    if beside:
        raise Wrong(f"left beside the report: {beside}")
    if code == cli.MISTAKE:
        if written or out.exists():
            raise Wrong(f"written in spite of code 2: {written}")
        lines = errors.getvalue().splitlines()
        if not lines or not all(line.startswith("pymoo-hdte: error: ") for line in lines):
            raise Wrong(f"not a line for each complaint: {lines!r}"[:200])
        # The first stands for all: what is refused is told in one line here.
        raise InvalidInput(arguments[0], None, lines[0])
    if code != 0 or not set(report.always) <= written <= set(report.files):
        raise Wrong(f"code {code} and {written}")
    json.loads((out / report.document).read_text(encoding="utf-8"))
