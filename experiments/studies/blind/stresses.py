"""Stresses of a campaign: what is stated of it is wrong, or it is poorer than it should be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from experiments.studies.blind.rig.campaign import restricted
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.sensors import Sensors
from experiments.studies.blind.rig.session import ARCSEC, SHEET, Circumstances

NOISE_FACTORS = (0.5, 1.5, 2.0, 3.0)
"""True noise of all sensors over what is stated."""
ONE_LOAD = 20.0
"""N.m."""
FEWEST_FIT, FEWEST_KEPT_OUT = 7, 3
"""Records that are left of thirteen to fit and six kept out."""
FAR_OFF = (0.15, 0.35)
"""Range of the relative error of base parameters, whose tolerance is 10 %."""
AMPLITUDE_OFF = (0.45, 0.7)
"""Range of that of one or two amplitudes of the static error, whose tolerance is 30 %."""
PARAMETERS = (
    "stiffness",
    "damping",
    "input_inertia",
    "input_damping",
    "output_damping",
    "load_inertia",
)


def stressed(about: Circumstances, stress: str, rng: np.random.Generator) -> Circumstances:
    """Return a session under a stress; noise and faulty rows come with the sensors later."""
    machine = about.machine
    if stress == "parameters":
        signs = rng.choice([-1.0, 1.0], len(PARAMETERS))
        off = 1.0 + signs * rng.uniform(*FAR_OFF, len(PARAMETERS))
        values: dict[str, Any] = {
            n: float(k * getattr(SHEET, n)) for n, k in zip(PARAMETERS, off, strict=True)
        }
        return replace(about, machine=replace(machine, **values))
    if stress == "amplitudes":
        amplitudes = np.array(machine.amplitudes)
        for line in rng.permutation(len(amplitudes))[: rng.integers(1, 3)]:
            off = rng.choice([-1.0, 1.0]) * rng.uniform(*AMPLITUDE_OFF)
            amplitudes[line] = SHEET.amplitudes[line] * (1.0 + off)
        return replace(about, machine=replace(machine, amplitudes=tuple(amplitudes.tolist())))
    if stress == "one_load":
        conditions = tuple(replace(one, load=ONE_LOAD) for one in about.conditions)
        loads = np.where(
            np.array([one.load for one in about.conditions]) == 0.0,
            ONE_LOAD,
            ONE_LOAD + about.loads - np.array([one.load for one in about.conditions]),
        )
        return replace(about, conditions=conditions, loads=loads)
    if stress == "half":
        kept: list[int] = []
        for role, count in (("train", FEWEST_FIT), ("held_out", FEWEST_KEPT_OUT)):
            places = [k for k, one in enumerate(about.conditions) if one.role == role]
            kept += rng.choice(places, count, replace=False).tolist()
        return restricted(about, sorted(kept))
    return about


def true_noise(sensors: Sensors, stress: str, rng: np.random.Generator) -> Sensors:
    """Return sensors with the noise that they have, whatever is stated."""
    if stress != "noise":
        return sensors
    factor = float(rng.choice(NOISE_FACTORS))
    return replace(
        sensors,
        angle_noise=factor * sensors.angle_noise,
        torsion_noise=factor * sensors.torsion_noise,
        input_noise=factor * sensors.input_noise,
        output_noise=factor * sensors.output_noise,
    )


def with_faults(rows: list[Matrix], stress: str, rng: np.random.Generator) -> list[Matrix]:
    """Return rows (4, n) of records, of which up to four have spikes and one perhaps a jump.

    Spikes are in 0.1 to 0.5 % of the rows of one channel: 20 to 200 arcsec of the output angle, or
    30 to 300 times the noise of a torque. A jump of the output encoder is 20 to 100 arcsec.
    """
    if stress != "outliers":
        return rows
    rows = [row.copy() for row in rows]
    places = rng.permutation(len(rows))[: rng.integers(1, 5)]
    for place in places:
        row = rows[place]
        channel = int(rng.integers(1, 4))
        unit = (0.0, ARCSEC, SHEET.input_noise, SHEET.output_noise)
        low, high = (20.0, 200.0) if channel == 1 else (30.0, 300.0)
        count = max(1, round(rng.uniform(0.001, 0.005) * row.shape[1]))
        at = rng.choice(row.shape[1], count, replace=False)
        sizes = rng.uniform(low, high, count) * rng.choice([-1.0, 1.0], count)
        row[channel, at] += sizes * unit[channel]
    if rng.random() < 1.0 / 3.0:
        row = rows[places[0]]
        begin = int(row.shape[1] * rng.uniform(0.2, 0.8))
        row[1, begin:] += rng.uniform(20.0, 100.0) * rng.choice([-1.0, 1.0]) * ARCSEC
    return rows
