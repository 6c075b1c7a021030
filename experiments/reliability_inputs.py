"""Inputs of every kind that the package reads, in order, and what it means to read one."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import dataclass
from functools import cache
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from experiments.blind_cases import BELIEVED, RIG
from experiments.reliability_mutations import Files
from pymoo_hdte import cli
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.discrepancy.report_folder import FILES, PAGE_FILE, VERDICT_FILE
from pymoo_hdte.discrepancy.rig_runs import Condition
from pymoo_hdte.discrepancy.virtual_rig import draw_rig, run_campaign
from pymoo_hdte.drive import UnstableDrive, hs_20_100, load_datasheet, load_model
from pymoo_hdte.identification import (
    error_statistics,
    read_error_measurements,
    read_no_load_runs,
    read_torsion_loops,
)
from pymoo_hdte.identification.damping import bearing_damping
from pymoo_hdte.identification.torsion import stiffness
from pymoo_hdte.measured.rig_files import read_rig, rig_toml
from pymoo_hdte.problems.duty_cycle import load_conditions, shares
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate

ORIGINAL_SEED = 7


class Wrong(Exception):
    """Something was accepted that must not be, or left behind."""


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


@cache
def _campaign_files() -> Files:
    conditions = [
        Condition(speed, load, 1000.0, 1, role)
        for speed, load, role in (
            (1000.0, 10.0, "train"),
            (1400.0, 40.0, "train"),
            (2000.0, 0.0, "train"),
            (2000.0, 40.0, "train"),
            (1400.0, 20.0, "held_out"),
        )
    ]
    rng = np.random.default_rng(ORIGINAL_SEED)
    campaign = run_campaign(draw_rig(BELIEVED, (), rng), BELIEVED, RIG, rng, conditions)
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(campaign, Path(folder) / "campaign")
        return {path.name: path.read_bytes() for path in (Path(folder) / "campaign").iterdir()}


def _read_campaign(folder: Path) -> None:
    campaign = read_campaign(folder)
    write_campaign(campaign, folder.parent / "again")
    again = read_campaign(folder.parent / "again")
    if [one.name for one in again.running] != [one.name for one in campaign.running]:
        raise Wrong("a campaign that is read back as another")


MASS, DAMPING, STIFFNESS = 1.0, 4.0, 4000.0
RATE, DURATION, HIGHEST = 200.0, 8.0, 12.0
"""Hz, s and Hz of the records of the oscillator."""
RIG_MODEL = """\
title = "An oscillator"
cutoff = 12.0
[coordinates.x]
inertia = { value = 1.0, tolerance = 0.1 }
[ports.spring]
motion = { x = 1.0 }
stiffness = { value = 4100.0, tolerance = 0.1 }
damping = { value = 5.0, tolerance = 0.5 }
[inputs.force]
acts = { x = 1.0 }
gain = { value = 1.0 }
[[effects]]
name = "coulomb_friction"
port = "spring"
level = 1e-6
[noise]
x = 1e-5
"""
RECORDS = """
[table]
format = "FORMAT"
time = { column = "t", unit = "s" }
channels.x = { column = "x", unit = "mm" }
channels.force = { column = "F", unit = "N", scale = 1.0 }
[[records]]
file = "one.ENDING"
role = "train"
[[records]]
file = "two.ENDING"
role = "train"
name = "another"
[[records]]
file = "three.ENDING"
role = "held_out"
"""


def _oscillation(seed: int) -> dict[str, np.ndarray]:
    """Return a steady multisine test of an oscillator in closed form, position in mm."""
    rng = np.random.default_rng([ORIGINAL_SEED, seed])
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    omega = 2.0 * np.pi * np.arange(1, int(HIGHEST * DURATION)) / DURATION
    turning = np.exp(1j * (np.outer(time, omega) + rng.uniform(0.0, 2.0 * np.pi, len(omega))))
    response = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    force, position = 2.0 * turning.sum(axis=1).real, 2.0 * (turning @ response).real
    noise = rng.standard_normal((2, len(time)))
    return {"t": time, "x": 1e3 * (position + 1e-5 * noise[0]), "F": force + 0.02 * noise[1]}


@cache
def _rig_files() -> Files:
    files: Files = {"rig.toml": _rig_toml("csv", "csv")}
    for seed, name in enumerate(("one", "two", "three")):
        columns = _oscillation(seed)
        rows = np.column_stack(list(columns.values())).tolist()
        lines = [",".join(columns), *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]
        files[f"{name}.csv"] = ("\n".join(lines) + "\n").encode()
    return files


@cache
def _matlab_rig_files() -> Files:
    files: Files = {"rig.toml": _rig_toml("matlab", "mat")}
    for seed, name in enumerate(("one", "two", "three")):
        packed = io.BytesIO()
        savemat(packed, _oscillation(seed), do_compression=name == "two")
        # The first 116 bytes are free text, in which SciPy writes the time of day.
        files[f"{name}.mat"] = b"MATLAB 5.0".ljust(116) + packed.getvalue()[116:]
    return files


def _rig_toml(form: str, ending: str) -> bytes:
    return (RIG_MODEL + RECORDS.replace("FORMAT", form).replace("ENDING", ending)).encode()


def _read_rig(folder: Path) -> None:
    rig = read_rig(folder)
    for record in rig.records:
        for name, values in record.channels.items():
            _finite(f"{name} of {record.name}", values)
    rig_toml(rig.title, rig.mechanism, rig.effects, rig.cutoff)


def _command(folder: Path) -> None:
    out, errors = folder.parent / "out", io.StringIO()
    with redirect_stderr(errors):
        code = cli.main(["discrepancy", str(folder), "--out", str(out), "--quiet"])
    written = {path.name for path in out.iterdir()} if out.is_dir() else set()
    beside = {path.name for path in folder.parent.iterdir()} - {folder.name, out.name}
    if beside:
        raise Wrong(f"left beside the report: {beside}")
    if code == cli.MISTAKE:
        if written or out.exists():
            raise Wrong(f"written in spite of code 2: {written}")
        line = errors.getvalue()
        if line.count("\n") != 1 or not line.startswith("pymoo-hdte: error: "):
            raise Wrong(f"not one line: {line[:200]!r}")
        raise InvalidInput("campaign", None, line.strip())
    if code != 0 or not {VERDICT_FILE, PAGE_FILE} <= written <= set(FILES):
        raise Wrong(f"code {code} and {written}")
    json.loads((out / VERDICT_FILE).read_text(encoding="utf-8"))


def _datasheet_files() -> Files:
    path = package_files("pymoo_hdte.drive") / "data" / "hs_20_100.toml"
    return {"sheet.toml": path.read_bytes()}


def _read_datasheet(folder: Path) -> None:
    sheet = load_datasheet(folder / "sheet.toml")
    _finite("the ratio", sheet.ratio)
    _finite("a rated value", (sheet.input_speed, sheet.load_torque))
    _finite("a nominal value", list(vars(sheet.nominal).values()))
    _finite("an order", list(sheet.error_orders.values()))


EFFECTS = """
[[effect]]
name = "kinematic_error"
order = 3.0
amplitude = { value = 1.5, unit = "arcsec" }
phase = { value = 20, unit = "deg" }

[[effect]]
name = "backlash"
port = "mesh"
half_width = { value = 10, unit = "arcsec" }

[[effect]]
name = "thermal_drift"
rate = { value = 1e-9, unit = "rad/s" }
time = { value = 600, unit = "s" }
"""


def _model_files() -> Files:
    path = package_files("pymoo_hdte.drive") / "data" / "calibrated.toml"
    return {"model.toml": path.read_bytes() + EFFECTS.encode()}


def _read_model(folder: Path) -> None:
    model = load_model(folder / "model.toml", hs_20_100())
    json.dumps(model.to_dict())
    try:
        _finite("a phasor", model.coefficients(model.nominal[None]).error_phasors)
    except UnstableDrive:
        return


def _duty_cycle_files() -> Files:
    path = package_files("pymoo_hdte.problems") / "data" / "duty_cycle.csv"
    return {"cycle.csv": path.read_bytes()}


def _read_duty_cycle(folder: Path) -> None:
    parts = shares(load_conditions(folder / "cycle.csv"))
    if not abs(parts.sum() - 1.0) < 1e-9:
        raise Wrong(f"shares that sum to {parts.sum()}")


TORQUES = [0, 10, 20, 30, 40, 30, 20, 10, 0, -10, -20, -30, -40, -30, -20, -10, 0]


def _csv(name: str, header: str, rows: list[tuple[float, ...]]) -> Files:
    rng = np.random.default_rng(ORIGINAL_SEED)
    lines = [
        ",".join([f"{p},{r}", *(f"{cell * (1.0 + 1e-4 * rng.normal()):.6g}" for cell in row)])
        for p in (1, 2, 3, 4, 5)
        for r in (1, 2, 3)
        for row in rows
    ]
    return {name: ("\n".join([header, *lines]) + "\n").encode()}


def _torsion_files() -> Files:
    rows = [(time, torque, 8.0 * torque) for time, torque in enumerate(TORQUES)]
    return _csv("loops.csv", "prototype,repeat,time_s,torque_Nm,torsion_arcsec", rows)


def _read_torsion(folder: Path) -> None:
    for loop in read_torsion_loops(folder / "loops.csv").values():
        _finite("a stiffness", stiffness(loop).slope)


def _no_load_files() -> Files:
    rows = [(speed, 0.02 + 1e-5 * speed) for speed in range(200, 2001, 200)]
    return _csv("runs.csv", "prototype,repeat,speed_r_min,torque_Nm", rows)


def _read_no_load(folder: Path) -> None:
    for run in read_no_load_runs(folder / "runs.csv").values():
        _finite("a damping", bearing_damping(run).slope)


def _error_files() -> Files:
    return _csv("errors.csv", "prototype,repeat,dFp1_um,e13_um", [(3.0, 7.0)])


def _read_errors(folder: Path) -> None:
    found = error_statistics(*read_error_measurements(folder / "errors.csv"))
    _finite("a mean", found.values)
    found.advice()


def _surrogate_files() -> Files:
    coefficients = np.random.default_rng(ORIGINAL_SEED).normal(size=(3, 4))
    box = Box(("theta_s", "K"), (0.1, 1 / 3), (0.3, 2 / 3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "surrogate.npz"
        ChebyshevSurrogate(box, coefficients, {"model": "calibrated", "kappa": 0.055}).save(path)
        return {path.name: path.read_bytes()}


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
        Kind("campaign", _campaign_files, _read_campaign),
        Kind("rig", _rig_files, _read_rig),
        Kind("MATLAB rig", _matlab_rig_files, _read_rig),
        Kind("data sheet", _datasheet_files, _read_datasheet),
        Kind("model", _model_files, _read_model),
        Kind("duty cycle", _duty_cycle_files, _read_duty_cycle),
        Kind("torsion loops", _torsion_files, _read_torsion),
        Kind("no-load runs", _no_load_files, _read_no_load),
        Kind("error measurements", _error_files, _read_errors),
        Kind("surrogate", _surrogate_files, _read_surrogate),
        Kind("campaign, whole command", _campaign_files, _command, 300.0),
        Kind("rig, whole command", _rig_files, _command, 300.0),
    )
}
