"""Valid inputs of every kind that the package reads, the same bytes every time."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Sequence
from functools import cache
from importlib.resources import files as package_files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from experiments.studies.blind.cases import BELIEVED, RIG
from experiments.studies.reliability.mutations import Files
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.discrepancy import write_campaign
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate

SEED = 7


@cache
def campaign_files() -> Files:
    """Return a campaign of five running records and a sweep, without any hidden effect."""
    conditions = tuple(
        Condition(speed, load, 1000.0, 1, role)
        for speed, load, role in (
            (1000.0, 10.0, "train"),
            (1400.0, 40.0, "train"),
            (2000.0, 0.0, "train"),
            (2000.0, 40.0, "train"),
            (1400.0, 20.0, "held_out"),
        )
    )
    rng = np.random.default_rng(SEED)
    campaign = run_campaign(draw_rig(BELIEVED, (), rng), BELIEVED, RIG, rng, conditions)
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(campaign, Path(folder) / "campaign")
        return {path.name: path.read_bytes() for path in (Path(folder) / "campaign").iterdir()}


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


def _oscillation(seed: int) -> dict[str, NDArray[np.float64]]:
    """Return a steady multisine test of an oscillator in closed form, position in mm."""
    rng = np.random.default_rng([SEED, seed])
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    omega = 2.0 * np.pi * np.arange(1, int(HIGHEST * DURATION)) / DURATION
    turning = np.exp(1j * (np.outer(time, omega) + rng.uniform(0.0, 2.0 * np.pi, len(omega))))
    response = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    force, position = 2.0 * turning.sum(axis=1).real, 2.0 * (turning @ response).real
    noise = rng.standard_normal((2, len(time)))
    return {"t": time, "x": 1e3 * (position + 1e-5 * noise[0]), "F": force + 0.02 * noise[1]}


@cache
def rig_files() -> Files:
    """Return an oscillator with three tests in CSV files."""
    files: Files = {"rig.toml": _rig_toml("csv", "csv")}
    for seed, name in enumerate(("one", "two", "three")):
        columns = _oscillation(seed)
        rows = np.column_stack(list(columns.values())).tolist()
        lines = [",".join(columns), *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]
        files[f"{name}.csv"] = ("\n".join(lines) + "\n").encode()
    return files


@cache
def matlab_rig_files() -> Files:
    """Return the same in MATLAB files, one of them compressed."""
    files: Files = {"rig.toml": _rig_toml("matlab", "mat")}
    for seed, name in enumerate(("one", "two", "three")):
        packed = io.BytesIO()
        savemat(packed, _oscillation(seed), do_compression=name == "two")
        # The first 116 bytes are free text, in which SciPy writes the time of day.
        files[f"{name}.mat"] = b"MATLAB 5.0".ljust(116) + packed.getvalue()[116:]
    return files


def _rig_toml(form: str, ending: str) -> bytes:
    return (RIG_MODEL + RECORDS.replace("FORMAT", form).replace("ENDING", ending)).encode()


def datasheet_files() -> Files:
    """Return the data sheet of the paper's drive."""
    path = package_files("pymoo_hdte.drive") / "data" / "hs_20_100.toml"
    return {"sheet.toml": path.read_bytes()}


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


def model_files() -> Files:
    """Return the calibrated model with three more effects."""
    path = package_files("pymoo_hdte.drive") / "data" / "calibrated.toml"
    return {"model.toml": path.read_bytes() + EFFECTS.encode()}


ROBUST_STUDY = """
[simulator]
command = ["sh", "${study}/solve.sh", "${input_file}"]
input_file = "case.in"
template = "case.txt"
responses = ["mass", "stress"]
[design.width]
lower = 0.02
upper = 0.06
deviation = { distribution = "normal", mean = 0, std = 0.0005 }
[noise.load]
scenarios = [1, 2, 5]
weights = [0.5, 0.25, 0.25]
[noise.heat]
interval = [0, 1]
[[scenarios]]
names = ["speed", "torque"]
rows = [[1, 2], [3, 4]]
[[objective]]
statistic = "quantile"
p = 0.9
response = "stress"
[[constraint]]
statistic = "failure_probability"
any_of = [{ response = "mass", above = 3 }, { response = "stress", below = 1 }]
at_most = 0.01
[search]
algorithm = "DE"
population = 20
"""
TEMPLATE = "w = ${width}, p = ${load}\nt = ${heat}, n = ${speed}, m = ${torque}\n"


def robust_study_files() -> Files:
    """Return a study of a program, its template and a script that no reader runs."""
    texts = {"study.toml": ROBUST_STUDY, "case.txt": TEMPLATE, "solve.sh": "exit 1\n"}
    return {name: text.encode() for name, text in texts.items()}


def duty_cycle_files() -> Files:
    """Return the duty cycle of the package."""
    path = package_files("pymoo_hdte.problems") / "data" / "duty_cycle.csv"
    return {"cycle.csv": path.read_bytes()}


def drive_files() -> Files:
    """Return a data sheet and a model."""
    return datasheet_files() | model_files()


def study_files() -> Files:
    """Return a data sheet, a model and a duty cycle."""
    return drive_files() | duty_cycle_files()


TORQUES = [0, 10, 20, 30, 40, 30, 20, 10, 0, -10, -20, -30, -40, -30, -20, -10, 0]


def _csv(name: str, header: str, rows: Sequence[tuple[float, ...]]) -> Files:
    rng = np.random.default_rng(SEED)
    lines = [
        ",".join([f"{p},{r}", *(f"{cell * (1.0 + 1e-4 * rng.normal()):.6g}" for cell in row)])
        for p in (1, 2, 3, 4, 5)
        for r in (1, 2, 3)
        for row in rows
    ]
    return {name: ("\n".join([header, *lines]) + "\n").encode()}


def torsion_files() -> Files:
    """Return torsion loops of five prototypes."""
    rows = [(float(time), float(torque), 8.0 * torque) for time, torque in enumerate(TORQUES)]
    return _csv("loops.csv", "prototype,repeat,time_s,torque_Nm,torsion_arcsec", rows)


def no_load_files() -> Files:
    """Return no-load runs of five prototypes."""
    rows = [(float(speed), 0.02 + 1e-5 * speed) for speed in range(200, 2001, 200)]
    return _csv("runs.csv", "prototype,repeat,speed_r_min,torque_Nm", rows)


def error_files() -> Files:
    """Return measurements of two errors of five prototypes."""
    return _csv("errors.csv", "prototype,repeat,dFp1_um,e13_um", [(3.0, 7.0)])


def bench_files() -> Files:
    """Return all records of prototypes that ``identify`` reads, and a data sheet."""
    torsion, no_load = torsion_files()["loops.csv"], no_load_files()["runs.csv"]
    runs = ("no_load_bearing.csv", "no_load_complete.csv", "no_load_output.csv")
    records = {"torsion_loops.csv": torsion, **dict.fromkeys(runs, no_load)}
    return records | error_files() | datasheet_files()


def surrogate_files() -> Files:
    """Return a surrogate in two variables."""
    coefficients = np.random.default_rng(SEED).normal(size=(3, 4))
    box = Box(("theta_s", "K"), np.array([0.1, 1 / 3]), np.array([0.3, 2 / 3]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "surrogate.npz"
        ChebyshevSurrogate(box, coefficients, {"model": "calibrated", "kappa": 0.055}).save(path)
        return {path.name: path.read_bytes()}
