"""Figures of the report on measured records: told apart by line style as well as by colour."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from pymoo_hdte._reports.figures import AFTER, BEFORE, GREY
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import MechanismPredictionError
from pymoo_hdte.mechanism.quantity_units import unit_of

Values = NDArray[np.float64]

_POINTS = 2000
_BANDS = 30
_NARROW = 300.0
"""Ratio of frequencies below which decades alone would be too few ticks."""


def misfit_over_motion(finding: MechanismFinding) -> Figure:
    """Draw the residual of each balance over the speed and the position of a port."""
    names = finding.data.names
    figure = Figure(figsize=(8.4, 2.6 * len(names)), layout="constrained")
    axes = figure.subplots(len(names), 2, squeeze=False, sharey="row")
    before = finding.data.coefficients(finding.verdict.base.residuals)
    after = finding.data.coefficients(finding.accepted.residuals)
    named = bool(finding.accepted.candidates)
    for row, name in enumerate(names):
        port = _port_of(finding, name)
        # A port that is read shows a force: its motion is that of what the sensor sits on.
        read = finding.mechanism.port(port).read
        where = f"at sensor {port}" if read else f"of {port}"
        for record, balance in enumerate(finding.data.spectra):
            motion = balance.ports[port]
            rows = np.flatnonzero(balance.moving.whole)
            rows = rows[:: max(1, len(rows) * len(before) // _POINTS)]
            shown = [(before[record][row], BEFORE, ".", "before")]
            if named:
                shown.append((after[record][row], AFTER, "x", "after"))
            for column, over in enumerate((motion.speed, motion.position)):
                for residual, colour, marker, label in shown:
                    axes[row, column].plot(
                        over[rows], balance.in_time(residual)[rows], marker, ms=3, color=colour,
                        alpha=0.6, label=label if record == 0 else None,
                    )  # fmt: skip
        axes[row, 0].set_ylabel(f"residual of {name} [{unit_of(finding.mechanism, name)}]")
        for column, quantity in enumerate(("speed", "position")):
            unit = unit_of(finding.mechanism, port, quantity)
            axes[row, column].set_xlabel(f"{quantity} {where} [{unit}]")
        for axis in axes[row]:
            _plain(axis)
    axes[0, 0].legend(frameon=False)
    return figure


def misfit_over_frequency(finding: MechanismFinding) -> Figure:
    """Draw the amplitude density of the residual, beside that of the sensors' noise."""
    names = finding.data.names
    figure = Figure(figsize=(max(4.2 * len(names), 6.4), 3.0), layout="constrained")
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for part, name in enumerate(names):
        rows = finding.data.rows_of_parts()[part]
        frequency = finding.data.frequency[rows]
        edges = np.unique(np.geomspace(1, len(rows), _BANDS).astype(int))
        order = np.argsort(frequency, kind="stable")
        deviation = np.concatenate(
            [
                deviation[part][balance.kept[part]]
                for deviation, balance in zip(
                    finding.data.deviation, finding.data.spectra, strict=True
                )
            ]
        )
        noise = np.concatenate(
            [balance.noise[part][balance.kept[part]] for balance in finding.data.spectra]
        )
        lines = [("before", finding.verdict.base.residuals, BEFORE, "--")]
        if finding.accepted.candidates:
            lines.append(("after", finding.accepted.residuals, AFTER, "-"))
        for label, residuals, colour, style in lines:
            size = residuals[rows] * deviation
            axes[part].plot(
                *_banded(frequency[order], size[order], edges), style, color=colour, label=label
            )
        axes[part].plot(
            *_banded(frequency[order], noise[order], edges), ":", color=GREY, label="sensors"
        )
        unit = unit_of(finding.mechanism, name)
        axes[part].set(
            xscale="log",
            yscale="log",
            xlabel="frequency [Hz]",
            ylabel=f"residual of {name} [{unit}]",
        )
        _few_ticks(axes[part])
        _plain(axes[part])
    axes[0].legend(frameon=False)
    return figure


def overlay(finding: MechanismFinding, error: MechanismPredictionError) -> Figure:
    """Draw a held-out record: measured, before and after; below, the differences."""
    figure = Figure(figsize=(8.4, 3.8), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    stride = slice(None, None, max(1, len(error.time) // _POINTS))
    time = error.time[stride]
    upper.plot(time, error.measured[stride], color=GREY, lw=2.5, label="measured")
    upper.plot(time, error.predicted_before[stride], "--", color=BEFORE, label="before")
    upper.plot(time, error.predicted_after[stride], "-", color=AFTER, lw=1.0, label="after")
    upper.set_ylabel(f"{error.quantity} [{error.unit}]")
    # Above the axes, where it hides no curve.
    upper.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    lower.plot(time, (error.measured - error.predicted_before)[stride], "--", color=BEFORE)
    lower.plot(time, (error.measured - error.predicted_after)[stride], "-", color=AFTER)
    lower.set(xlabel="time [s]", ylabel="difference")
    lower.ticklabel_format(axis="x", useOffset=False)
    for axis in (upper, lower):
        _plain(axis)
    return figure


def errors_figure(errors: Sequence[MechanismPredictionError]) -> Figure:
    """Draw the errors on held-out records before and after, as ratios to the error before."""
    figure = Figure(figsize=(6.4, 0.7 + 0.42 * len(errors)), layout="constrained")
    axis = figure.subplots()
    for row, error in enumerate(errors):
        unit = error.before if error.before > 0.0 and np.isfinite(error.before) else 1.0
        axis.barh(row - 0.18, error.before / unit, 0.34, color=BEFORE, hatch="//",
                  edgecolor="white", label="before" if row == 0 else None)  # fmt: skip
        axis.barh(row + 0.18, error.after / unit, 0.34, color=AFTER,
                  label="after" if row == 0 else None)  # fmt: skip
        axis.plot([error.noise_floor / unit] * 2, [row - 0.4, row + 0.4], ":", color=GREY,
                  label="sensors" if row == 0 else None)  # fmt: skip
    axis.set_yticks(
        range(len(errors)), [f"{error.record}: {error.quantity}, {error.kind}" for error in errors]
    )
    axis.invert_yaxis()
    axis.set(xlabel="prediction error / error before")
    axis.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    _plain(axis)
    return figure


def _port_of(finding: MechanismFinding, balance: str) -> str:
    """Return the port over whose motion a balance is drawn."""
    if balance in finding.mechanism.port_names:
        return balance
    ports = [port for port in finding.mechanism.ports if not port.read]
    return next((port.name for port in ports if port.motion.get(balance)), ports[0].name)


def _banded(frequency: Values, size: Values, edges: NDArray[np.int_]) -> tuple[Values, Values]:
    """Return middle frequencies and root mean squares of bands between ranks."""
    parts = list(pairwise(edges))
    middle = np.array([frequency[low:high].mean() for low, high in parts])
    power = np.array([np.sqrt(np.mean(size[low:high] ** 2)) for low, high in parts])
    return middle, power


def _few_ticks(axis: Axes) -> None:
    """Write 1, 2 and 5 of each decade where there are few, and decades alone else."""
    low, high = axis.get_xlim()
    ratio = high / low
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ratio < _NARROW else (1.0,)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(NullFormatter())


def _plain(axis: Axes) -> None:
    axis.spines[["top", "right"]].set_visible(False)
