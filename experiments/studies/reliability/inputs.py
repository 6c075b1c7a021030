"""Kinds of input that the package reads, and what it means to read one and to use it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.studies.reliability import originals
from experiments.studies.reliability.mutations import Files
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import identification_report, optimum_report, simulation_report
from pymoo_hdte.cli.robust_study import read_study
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._records.rig_model import model_text
from pymoo_hdte.discrepancy._report import folder as report_folder
from pymoo_hdte.drive import UnstableDrive, hs_20_100, load_datasheet, load_model
from pymoo_hdte.identification import (
    error_statistics,
    read_error_measurements,
    read_no_load_runs,
    read_torsion_loops,
)
from pymoo_hdte.identification.damping import bearing_damping
from pymoo_hdte.identification.torsion import stiffness
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.problems.operating_conditions import load_conditions, shares
from pymoo_hdte.surrogate import ChebyshevSurrogate


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


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes
    ----------
    name : str
    original : callable
        Returns the files of a valid input.
    read : callable
        Takes the folder with the files; returns whether they were accepted. Raises `InvalidInput`
        or `OSError` where they are refused, and `Wrong` where what was read cannot be used.
    seconds : float
        Limit for one input.
    """

    name: str
    original: Callable[[], Files]
    read: Callable[[Path], None]
    seconds: float = 20.0


def _finite(what: str, values: Any) -> None:
    if not np.all(np.isfinite(values)):
        raise Wrong(f"{what} is not finite")


def _read_campaign(folder: Path) -> None:
    campaign = read_campaign(folder)
    write_campaign(campaign, folder.parent / "again")
    again = read_campaign(folder.parent / "again")
    if [record.name for record in again.running] != [record.name for record in campaign.running]:
        raise Wrong("a campaign that is read back as another")


def _read_rig(folder: Path) -> None:
    rig = read_rig(folder)
    for record in rig.records:
        for name, values in record.channels.items():
            _finite(f"{name} of {record.name}", values)
    model_text(rig.model)


def _read_datasheet(folder: Path) -> None:
    sheet = load_datasheet(folder / "sheet.toml")
    _finite("the ratio", sheet.ratio)
    _finite("a rated value", (sheet.input_speed, sheet.load_torque))
    _finite("a nominal value", list(vars(sheet.nominal).values()))
    _finite("an order", list(sheet.error_orders.values()))


def _read_model(folder: Path) -> None:
    model = load_model(folder / "model.toml", hs_20_100())
    json.dumps(model.to_dict())
    try:
        _finite("a phasor", model.coefficients(model.nominal[None]).error_phasors)
    except UnstableDrive:
        return


def _read_duty_cycle(folder: Path) -> None:
    parts = shares(load_conditions(folder / "cycle.csv"))
    if not abs(parts.sum() - 1.0) < 1e-9:
        raise Wrong(f"shares that sum to {parts.sum()}")


def _read_robust_study(folder: Path) -> None:
    with read_study(folder / "study.toml") as study:
        for low, high in Inputs(**study.inputs).reach().values():
            _finite("the reach of an input", (low, high))


def _read_torsion(folder: Path) -> None:
    for loop in read_torsion_loops(folder / "loops.csv").values():
        _finite("a stiffness", stiffness(loop).slope)


def _read_no_load(folder: Path) -> None:
    for run in read_no_load_runs(folder / "runs.csv").values():
        _finite("a damping", bearing_damping(run).slope)


def _read_errors(folder: Path) -> None:
    statistics = error_statistics(*read_error_measurements(folder / "errors.csv"))
    _finite("a mean", statistics.values)
    statistics.advice()


def _read_surrogate(folder: Path) -> None:
    surrogate = ChebyshevSurrogate.load(folder / "surrogate.npz")
    _finite("a value", surrogate(surrogate.box.centre[None]))
    surrogate.save(folder.parent / "again.npz")
    again = ChebyshevSurrogate.load(folder.parent / "again.npz")
    if again.coefficients.tobytes() != surrogate.coefficients.tobytes():
        raise Wrong("a surrogate that is read back as another")


KINDS = {
    kind.name: kind
    for kind in (
        Kind("campaign", originals.campaign_files, _read_campaign),
        Kind("rig", originals.rig_files, _read_rig),
        Kind("MATLAB rig", originals.matlab_rig_files, _read_rig),
        Kind("data sheet", originals.datasheet_files, _read_datasheet),
        Kind("model", originals.model_files, _read_model),
        Kind("duty cycle", originals.duty_cycle_files, _read_duty_cycle),
        Kind("robust study", originals.robust_study_files, _read_robust_study),
        Kind("torsion loops", originals.torsion_files, _read_torsion),
        Kind("no-load runs", originals.no_load_files, _read_no_load),
        Kind("error measurements", originals.error_files, _read_errors),
        Kind("surrogate", originals.surrogate_files, _read_surrogate),
        Kind("campaign, whole command", originals.campaign_files, discrepancy, 300.0),
        Kind("rig, whole command", originals.rig_files, discrepancy, 300.0),
        Kind("simulate, whole command", originals.drive_files, simulate, 300.0),
        Kind("optimise, whole command", originals.study_files, optimise, 300.0),
        Kind("identify, whole command", originals.bench_files, identify, 300.0),
    )
}
THROUGH_COMMANDS = tuple(name for name, kind in KINDS.items() if kind.read in COMMANDS)
"""Kinds that go through the whole command line."""
