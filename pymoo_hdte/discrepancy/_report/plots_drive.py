"""Plots of a harmonic drive: friction over speed, torsion over torque, and a Campbell diagram."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._report.plots import Panel, Plot, Series
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.drive.dte_map import critical_speeds, torsional_mode
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

_ALIKE = 0.05
"""Share of the largest load within which two records carry the same one."""
_SPEED = "input speed [r/min]"


def drive_plots(
    finding: DriveFinding, model: DriveModel | None, document: Mapping[str, Any]
) -> list[Plot]:
    """Return the plots of a drive.

    Parameters
    ----------
    finding : DriveFinding
    model : DriveModel or None
        The revised drive; None where a data sheet cannot describe it.
    document : mapping
        The verdict, for the orders of its effects.
    """
    plots = [_friction(finding)]
    if finding.data.torsion:
        plots.append(_torsion(finding))
    if model is not None:
        plots.append(_campbell(finding, model, document))
    return plots


def _friction(finding: DriveFinding) -> Plot:
    fitted, ratio = finding.verdict.accepted, finding.campaign.believed.ratio
    held_out = finding.held_out
    series: list[Series] = []
    parts = [(finding.data, "points")]
    if held_out is not None:
        parts.append((held_out, "held out"))
    scale = max(float(np.abs(data.features.conditions.output_torque).max()) for data, _ in parts)
    for data, drawn in parts:
        when = data.features.conditions
        through = when.output_torque / ratio
        base = fitted.values[None, : len(data.base)]
        predicted = data.predict(base, fitted.effects)[0]
        speed = when.input_speed / REVOLUTION_PER_MINUTE
        for load, rows in _by_load(when.output_torque, _ALIKE * scale):
            ordered = rows[np.argsort(speed[rows])]
            measured, modelled = (
                values[ordered, 1] - through[ordered]
                for values in (data.features.values, predicted)
            )
            label = f"{load:z.0f} N.m"
            series.append(Series(label, speed[ordered], measured, drawn))
            if drawn == "points":
                series.append(Series(label, speed[ordered], modelled))
    return Plot(
        "friction",
        "friction over speed",
        "Mean input torque less the load over the ratio, by load. Points: records, filled where "
        "held out; lines: the accepted model at the conditions of the fitted records.",
        (Panel("", _SPEED, "friction at the input [N.m]", tuple(series)),),
    )


def _by_load(torque: NDArray[np.float64], apart: float) -> Iterator[tuple[float, NDArray[np.int_]]]:
    """Return mean and rows of each group of loads, none further than ``apart`` from the next."""
    order = np.argsort(torque)
    breaks = 1 + np.flatnonzero(np.diff(torque[order]) > apart)
    for rows in np.split(order, breaks):
        yield float(torque[rows].mean()), rows


def _torsion(finding: DriveFinding) -> Plot:
    data: Data = finding.data
    fitted = finding.verdict.accepted
    base = fitted.values[: len(data.base)]
    series = []
    for number, (points, modelled) in enumerate(
        zip(data.torsion, data.swept_torsion(base, fitted.effects), strict=True), start=1
    ):
        # A sweep has an unknown constant: that of the model is the better one to show.
        angle = points.angle + np.mean(modelled - points.angle)
        sweep = f"sweep {number}" if len(data.torsion) > 1 else "sweep"
        series.append(Series(sweep, points.torque, angle / ARCSEC, "points"))
        series.append(Series(f"model of {sweep}", points.torque, modelled / ARCSEC))
    return Plot(
        "torsion",
        "torsion over torque",
        "Points: means of consecutive rows of the torsion sweep; line: the accepted model along "
        "the same path.",
        (Panel("", "output torque [N.m]", "torsion [arcsec]", tuple(series)),),
    )


def _campbell(finding: DriveFinding, model: DriveModel, document: Mapping[str, Any]) -> Plot:
    conditions = [finding.data.features.conditions]
    if finding.held_out is not None:
        conditions.append(finding.held_out.features.conditions)
    highest = max(float(np.abs(when.input_speed).max()) for when in conditions)
    speeds = np.array([0.0, highest / REVOLUTION_PER_MINUTE])
    mode = torsional_mode(model)
    orders = set(model.kinematic_error.orders) | {order for order, _ in critical_speeds(model)}
    orders |= {effect["order"] for effect in document["effects"] if effect.get("order")}
    series = [
        Series(f"order {order:.4g}", speeds, order * speeds / 60.0) for order in sorted(orders)
    ]
    crossings = np.array([mode.speed(order) for order in sorted(orders)])
    within = crossings[crossings <= speeds[1]]
    if mode.frequency > 0.0:
        series.append(Series("resonance", speeds, np.full(2, mode.frequency)))
    if mode.resonates and within.size:
        at = np.full(within.shape, mode.frequency)
        series.append(Series("where they meet", within, at, "points"))
    meeting = "They do not meet within the speeds of the records"
    if mode.resonates and within.size:
        meeting = f"They meet at {', '.join(f'{speed:.0f} r/min' for speed in np.sort(within))}"
    return Plot(
        "campbell",
        "Campbell diagram",
        f"Resonance of the revised drive at {mode.frequency:.3g} Hz (damping ratio "
        f"{mode.damping_ratio:.2g}) and orders of its error. {meeting}.",
        (Panel("", _SPEED, "frequency [Hz]", tuple(series)),),
    )
