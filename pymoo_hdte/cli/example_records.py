"""Records of a drive that differs from its catalogue page: of a bench and of a campaign."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.identification import BEARING, COMPLETE, LOOPS
from pymoo_hdte.discrepancy import read_limits, write_campaign
from pymoo_hdte.discrepancy._plan.imagined import imagined_campaign, possible_tests
from pymoo_hdte.discrepancy._records.believed_model import believed_of_model
from pymoo_hdte.discrepancy._records.known_values import known_values
from pymoo_hdte.drive import (
    CataloguePage,
    DriveModel,
    MeshStiffnessVariation,
    built_in_page,
    complete,
    drive_of,
    input_torque,
    load_page,
    quasi_static_torsion,
)
from pymoo_hdte.identification.damping import INPUT_SPEEDS
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

PAGE, LIMITS, BENCH, CAMPAIGN = WRITTEN = ("gear.toml", "limits.toml", "bench", "campaign")

TRUTH = {
    "K1": 1.05,
    "K2": 1.04,
    "K3": 1.04,
    "hysteresis_loss": 0.6,
    "no_load_running_torque": 0.95,
    "no_load_starting_torque": 0.9,
}
"""Figures of the drive that was measured, as multiples of its page."""
VARIATION = MeshStiffnessVariation(0.06, 0.7)
"""What the measured drive has besides."""
TOLERANCE = 0.1
"""By how much values of the page may be off, as the campaign states it."""
TOLERANCES = {
    **dict.fromkeys(("softening", "stiffening", "torsion"), TOLERANCE),
    "level": 0.25,
    "force": 0.9,
}
"""The same of numbers of its effects: makers print the starting torque to 25 %, and of the
hysteresis loss a limit, of which most drives have a part."""
PROTOTYPES, SCATTER = 4, 0.02
HELD_OUT = 3
"""Every so many running records one is held out."""

_LIMITS = """\
# What the rig can do: pymoo-hdte plan gear.toml --limits limits.toml --out plan

input_speeds_rpm = [200, 1200]
load_torques_Nm = [0, {half:g}, {rated:g}] # positive ones brake, negative ones drive
directions = ["forward", "reverse"]
torsion_sweeps_Nm = [{rated:g}] # with the input locked
sample_rate_Hz = 1000
most_records = 12

[rig]
proportional_Nms_per_rad = 0.02
integral_Nm_per_rad = 0.5
angle_noise_arcsec = 0.7
input_torque_noise_Nm = 0.003
output_torque_noise_Nm = 0.2
repeatability_arcsec = 0.3
torsion_angle_noise_arcsec = 0.2
"""


def write_example(folder: Path, size: int) -> list[str]:
    """Write the example, completely or not at all; return the names of what was written.

    Raises
    ------
    InvalidInput
        If the folder is not empty, or there is no page of that size.
    OSError
        If it cannot be written.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidInput("FOLDER", str(folder), "a folder that is new or empty")
    source = built_in_page(size)
    page = load_page(source)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".example-", dir=folder.parent) as workshop:
        draft = Path(workshop) / "example"
        draft.mkdir()
        text = source.read_text(encoding="utf-8")
        (draft / PAGE).write_text(text, encoding="utf-8", newline="\n")
        rated = complete(page)["rated_torque"].value
        limits = _LIMITS.format(half=rated / 2.0, rated=rated)
        (draft / LIMITS).write_text(limits, encoding="utf-8", newline="\n")
        rng = np.random.default_rng(1)
        _write_bench(draft / BENCH, page, rng)
        _write_campaign(draft, page, rng)
        if folder.exists():
            folder.rmdir()
        draft.rename(folder)
    return list(WRITTEN)


def true_drive(page: CataloguePage, factor: float = 1.0) -> DriveModel:
    """Return the drive that is measured, its stiffness and friction times a factor."""
    entries = complete(page)
    for name, multiple in TRUTH.items():
        entries[name] = replace(entries[name], value=entries[name].value * multiple * factor)
    return drive_of(page, entries)


def _write_bench(folder: Path, page: CataloguePage, rng: np.random.Generator) -> None:
    """Write torsion loops and no-load torques of a few prototypes."""
    folder.mkdir()
    rated = complete(page)["rated_torque"].value
    rows: dict[str, list[tuple[float, ...]]] = {LOOPS: [], BEARING: [], COMPLETE: []}
    legs = ((0.0, 1.0, 100), (1.0, -1.0, 200), (-1.0, 0.0, 100))
    torque = rated * np.concatenate([np.linspace(*leg) for leg in legs])
    for prototype in range(1, PROTOTYPES + 1):
        drive = true_drive(page, 1.0 + SCATTER * rng.standard_normal())
        torsion = quasi_static_torsion(drive.coefficients(drive.nominal[None]), torque)[0]
        torsion = torsion / ARCSEC + 0.2 * rng.standard_normal(len(torque))
        rows[LOOPS] += _rows(prototype, torque, torsion)
        whole = input_torque(drive, INPUT_SPEEDS, 0.0)
        speed = INPUT_SPEEDS / REVOLUTION_PER_MINUTE
        # A quarter of the loss is the bearing's own.
        for name, share in ((BEARING, 0.25), (COMPLETE, 1.0)):
            noisy = share * whole + 2e-4 * rng.standard_normal(len(whole))
            rows[name] += _rows(prototype, speed, noisy)
    columns = {LOOPS: ("torque_Nm", "torsion_arcsec")}
    for name, lines in rows.items():
        header = ("prototype", "repeat", *columns.get(name, ("speed_r_min", "torque_Nm")))
        (folder / name).write_text(csv_text(header, lines), encoding="utf-8", newline="\n")


def _rows(prototype: int, *columns: Iterable[float]) -> list[tuple[float, ...]]:
    values = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    return [(prototype, 1, *row) for row in values]


def _write_campaign(draft: Path, page: CataloguePage, rng: np.random.Generator) -> None:
    """Write records of the true drive, described as its page describes it."""
    limits = read_limits(draft / LIMITS)
    rated = max(limits.loads)
    tests = [test for test in possible_tests(limits) if abs(test.load) in (0.0, rated)]
    campaign = imagined_campaign(
        believed_of_model(true_drive(page)), limits, tests, rng, (VARIATION,)
    )
    running = tuple(
        replace(record, role="held_out" if place % HELD_OUT == 1 else "train")
        for place, record in enumerate(campaign.running)
    )
    described = believed_of_model(drive_of(page), TOLERANCE)
    # Figures held to be exact would leave an effect to explain by how much they are off.
    numbers = {
        name: TOLERANCES[number]
        for name in known_values(described.effects)
        if (number := name.rpartition(".")[2]) in TOLERANCES
    }
    campaign = replace(
        campaign,
        title=f"{page.name}, computed records",
        believed=replace(described, tolerances=numbers),
        running=running,
    )
    write_campaign(campaign, draft / CAMPAIGN)
