"""The folder that a bench leaves: campaign.toml and a CSV file for each record."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.runs import Condition
from experiments.studies.blind.rig.session import (
    ARCSEC,
    RATIO,
    SHEET,
    SWEEP_RATE,
    Circumstances,
    Sheet,
    row_times,
)

_TITLES = "Time [s],Motor [deg],Output [deg],Motor torque [mN.m],Shaft torque [N.m]"
_TABLE = """
[table]
time = { column = "Time [s]", unit = "s" }
[table.channels]
input_angle = { column = "Motor [deg]", unit = "deg" }
output_angle = { column = "Output [deg]", unit = "deg" }
input_torque = { column = "Motor torque [mN.m]", unit = "mN.m" }
output_torque = { column = "Shaft torque [N.m]", unit = "N.m" }
"""
_ROW = "%.6f,%.7f,%.9f,%.5f,%.6f\n"
_SWEEP_TITLES, _SWEEP_ROW = "Time [s],Output [deg],Shaft torque [N.m]", "%.6f,%.9f,%.6f\n"


def write_campaign_folder(
    folder: Path, title: str, about: Circumstances, rows: list[Matrix], torsion: Matrix
) -> None:
    """Write a session into an empty folder.

    Parameters
    ----------
    folder : Path
    title : str
    about : Circumstances
    rows : list of ndarray, each of shape (4, n)
        Of the records, rad and N.m, as the sensors give them.
    torsion : ndarray, shape (2, n)
        Output angle and torque of the sweep.
    """
    degrees = 180.0 / math.pi
    parts = [_head(title, SHEET), _TABLE]
    for place, (condition, row) in enumerate(zip(about.conditions, rows, strict=True)):
        name = f"{place + 1:02d}_{condition.rpm:.0f}rpm_{condition.load:.0f}Nm.csv"
        times = row_times(condition, row.shape[1])
        columns = (times, row[0] * degrees, row[1] * degrees, row[2] * 1e3, row[3])
        _write(folder / name, _TITLES, _ROW, columns)
        parts.append(_record(name, condition, float(about.clocks[place])))
    name = "torsion.csv"
    times = np.arange(torsion.shape[1]) / SWEEP_RATE
    _write(folder / name, _SWEEP_TITLES, _SWEEP_ROW, (times, torsion[0] * degrees, torsion[1]))
    parts.append(
        f'\n[[record]]\nfile = "{name}"\ntest = "torsion"\nrole = "train"\n'
        f"sample_rate_Hz = {SWEEP_RATE:g}\n"
    )
    (folder / "campaign.toml").write_text("".join(parts), encoding="utf-8")


def _write(path: Path, titles: str, row: str, columns: tuple[Values, ...]) -> None:
    # One format over all numbers is several times as fast as one for each row.
    numbers = [number for numbers in zip(*columns, strict=True) for number in numbers]
    text = row * len(columns[0]) % tuple(numbers)
    path.write_text(f"{titles}\n{text}", encoding="utf-8")


def _head(title: str, sheet: Sheet) -> str:
    amplitudes = [amplitude / ARCSEC for amplitude in sheet.amplitudes]
    return f"""title = "{title}"
drive = "HS-20-100"

[believed]
ratio = {RATIO:g}
stiffness_Nm_per_rad = {sheet.stiffness!r}
damping_output_Nms_per_rad = {sheet.damping!r}
input_inertia_kgm2 = {sheet.input_inertia!r}
input_damping_Nms_per_rad = {sheet.input_damping!r}
output_damping_Nms_per_rad = {sheet.output_damping!r}
output_inertia_kgm2 = {sheet.output_inertia!r}
load_inertia_kgm2 = {sheet.load_inertia!r}
static_error_orders = {list(sheet.orders)}
static_error_amplitudes_arcsec = {amplitudes}
tolerance = {sheet.tolerance!r}
static_error_tolerance = {sheet.error_tolerance!r}

[rig]
proportional_Nms_per_rad = {sheet.proportional!r}
integral_Nm_per_rad = {sheet.integral!r}
angle_noise_arcsec = {sheet.angle_noise / ARCSEC!r}
angle_quantisation_arcsec = {sheet.angle_step / ARCSEC!r}
torsion_angle_noise_arcsec = {sheet.torsion_noise / ARCSEC!r}
input_torque_noise_Nm = {sheet.input_noise!r}
output_torque_noise_Nm = {sheet.output_noise!r}
input_torque_gain = {sheet.gain!r}
output_torque_gain = {sheet.gain!r}
input_torque_zero_Nm = {sheet.input_zero!r}
output_torque_zero_Nm = {sheet.output_zero!r}
repeatability_arcsec = {sheet.repeatability / ARCSEC!r}
"""


def _record(name: str, condition: Condition, elapsed: float) -> str:
    return f"""
[[record]]
file = "{name}"
test = "running"
role = "{condition.role}"
input_speed_rpm = {condition.rpm!r}
load_torque_Nm = {condition.load!r}
sample_rate_Hz = {condition.rate / condition.averaged!r}
samples_averaged = {condition.averaged}
elapsed_s = {elapsed!r}
"""
