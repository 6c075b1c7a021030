"""What a bench does beside its nuisances that are effects: its loop, its set speed, its sensors.

It is told where the records show it. What the loop and the set speed do is in the covariance or
among the base's unknowns whether it shows or not, and rows beyond a sensor's range are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_unit
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import LOOP
from pymoo_hdte.discrepancy._records.cleaning.findings import UNITS
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding

SPEED_WANDERS, SATURATED, COARSE = "speed_wanders", "saturated_sensor", "coarse_sensor"


@dataclass(frozen=True)
class BenchFault:
    """A fault of the bench.

    Attributes
    ----------
    name : str
        One of `LOOP`, `SPEED_WANDERS`, `SATURATED` and `COARSE`.
    where : tuple of str
        Records in which it shows, or the channel; empty for the loop.
    value, variance : float
        Of the loop's unknown, of the reading at which a sensor saturates, or of its step; 0 for a
        set speed that wanders.
    unit : str
    """

    name: str
    where: tuple[str, ...] = ()
    value: float = 0.0
    variance: float = 0.0
    unit: str = ""


def bench_faults(finding: DriveFinding) -> list[BenchFault]:
    """Return the faults of the bench that the records show."""
    return [*_of_loop(finding), *_of_speed(finding), *_of_sensors(finding)]


def _of_loop(finding: DriveFinding) -> Iterator[BenchFault]:
    fitted, certain = finding.verdict.accepted, finding.verdict.rules.certain_deviations
    names = [parameter.name for parameter in fitted.parameters]
    for name in LOOP:
        row = names.index(name)
        value, variance = float(fitted.values[row]), float(fitted.covariance[row, row])
        if abs(value) > certain * np.sqrt(variance):
            yield BenchFault(name, (), value, variance, base_unit(name))


def _of_speed(finding: DriveFinding) -> Iterator[BenchFault]:
    features = finding.data.features
    if features.wander is not None and features.wander.any():
        rows = np.flatnonzero(features.wander.any(axis=1))
        yield BenchFault(SPEED_WANDERS, tuple(features.records[row].name for row in rows))


def _of_sensors(finding: DriveFinding) -> Iterator[BenchFault]:
    limits = {
        (fault.channel, fault.size) for fault in finding.rows.faults if fault.kind == "saturated"
    }
    for channel, reading in sorted(limits):
        yield BenchFault(SATURATED, (channel,), reading, unit=UNITS[channel])
    for noise in finding.rows.noise:
        if noise.step:
            channel = noise.name.removesuffix("_noise")
            yield BenchFault(COARSE, (channel,), noise.step, unit=noise.unit)
