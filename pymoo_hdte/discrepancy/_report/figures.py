"""Figures of the report: told apart by marker and line style as well as by colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_hdte._reports.figures import AFTER, BEFORE, FAINT, GREY
from pymoo_hdte.discrepancy._answers.where.map import Location
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._report.optimum import OptimumShift
from pymoo_hdte.discrepancy._verdicts.validation_drive import Overlay, PredictionError, Validation

MAP_COLOURS = "cividis"
LARGEST_SHOWN = 30.0
"""Misfit, in standard deviations, at which the colour scale ends."""

WORDS = {name: name.replace("_", " ") for name in CHANNELS}


def misfit_overview(location: Location) -> Figure:
    """Draw channel over order: the largest misfit of all records, and how many are flagged."""
    sizes = _deviations(location)
    size = np.max(np.nan_to_num(sizes, nan=0.0), axis=0)
    count = location.flagged.sum(axis=0)
    figure = Figure(figsize=(6.4, 2.1), layout="constrained")
    axis = figure.subplots()
    _heat(figure, axis, np.where(np.all(np.isnan(sizes), axis=0), np.nan, size))
    for row, column in np.argwhere(count > 0):
        dark = size[row, column] < LARGEST_SHOWN**0.5
        axis.text(
            column, row, str(count[row, column]), ha="center", va="center", fontsize=8,
            fontweight="bold", color="white" if dark else "black",
        )  # fmt: skip
    axis.set_yticks(range(len(CHANNELS)), [WORDS[name] for name in CHANNELS])
    _order_axis(axis, location.orders)
    return figure


def misfit_map(location: Location) -> Figure:
    """Draw record over order for every channel; flagged cells carry a cross."""
    rows = np.lexsort([location.load_torque, np.round(location.speed_rpm)])
    size = _deviations(location)[rows]
    flagged = location.flagged[rows]
    height = 1.6 + 0.36 * len(rows)
    figure = Figure(figsize=(11.0, height), layout="constrained")
    for place, axis in enumerate(figure.subplots(2, 2, sharex=True, sharey=True).flat):
        _heat(figure, axis, size[:, place], labelled=place == 1)
        record, order = np.nonzero(flagged[:, place])
        axis.plot(order, record, "x", color="white", markersize=5.5, markeredgewidth=2.6)
        axis.plot(order, record, "x", color="black", markersize=5, markeredgewidth=1.2)
        axis.set_title(WORDS[CHANNELS[place]], fontsize=10)
        if place >= 2:
            _order_axis(axis, location.orders)
    labels = [
        f"{location.speed_rpm[k]:.0f} r/min, {location.load_torque[k]:z.0f} N.m" for k in rows
    ]
    axis.set_yticks(range(len(rows)), labels, fontsize=7)
    return figure


def error_by_channel(validation: Validation) -> Figure:
    """Draw every channel's error before and after, in multiples of its noise floor."""
    errors = [*validation.channels.values(), validation.overall]
    labels = [*(WORDS[name] for name in validation.channels), "all together"]
    figure = Figure(figsize=(6.4, 2.0), layout="constrained")
    axis = figure.subplots()
    _dumbbells(axis, errors, labels, relative=True)
    axis.axvline(1.0, color=GREY, linestyle=":", linewidth=1.5)
    axis.set_xscale("log")
    # Without an error the axis would otherwise magnify differences of a few per cent.
    low, high = axis.get_xlim()
    axis.set_xlim(min(low, 0.5), max(high, 10.0))
    axis.set_xlabel("prediction error on held-out records / noise floor", fontsize=9)
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter("")
    return figure


def error_by_order(validation: Validation) -> Figure:
    """Draw the error of each order line of the transmission error, and the peak-to-peak values."""
    figure = Figure(figsize=(11.0, 3.8), layout="constrained")
    residual, right = figure.subplots(1, 2)
    _dumbbells(residual, validation.by_order, [_order_word(order) for order in validation.orders])
    floors = [error.noise_floor for error in validation.by_order]
    residual.plot(floors, range(len(floors)), "|", color=GREY, markersize=9, label="noise floor")
    residual.set_xscale("log")
    residual.set_xlabel("prediction error [arcsec]")
    residual.set_ylabel("order of the input")
    residual.legend(fontsize=8, frameon=False)
    measured, before, after = validation.dte
    ends = [validation.dte.min(), validation.dte.max()]
    right.plot(ends, ends, color=GREY, linewidth=1)
    right.plot(measured, before, "s", color=BEFORE, mfc="none", label="before")
    right.plot(measured, after, "o", color=AFTER, label="after")
    right.set_xlabel("measured peak-to-peak [arcsec]")
    right.set_ylabel("predicted [arcsec]")
    right.legend(fontsize=8, frameon=False)
    _tidy(right)
    return figure


def overlay(validation: Validation) -> Figure:
    """Draw measured, before and after of the held-out record with the largest error of the base."""
    figure = Figure(figsize=(11.0, 5.6), layout="constrained")
    panels = figure.subplots(len(validation.overlays), 1, sharex=True, squeeze=False)[:, 0]
    for axis, overlaid in zip(panels, validation.overlays, strict=True):
        _draw_overlay(axis, overlaid)
    panels[0].legend(fontsize=8, frameon=False, ncols=4, loc="upper right")
    panels[-1].set_xlabel("input turns")
    return figure


def optimum_fronts(shift: OptimumShift) -> Figure:
    """Draw both fronts, and the designs chosen on the first as the new model evaluates them."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axis = figure.subplots()
    looks = ((BEFORE, "s", "before"), (AFTER, "o", "after"))
    for front, (colour, marker, word) in zip(shift.fronts, looks, strict=True):
        axis.plot(*front.T, marker, color=colour, mfc="none", markersize=5, label=f"front {word}")
    for choice in shift.choices:
        axis.plot(*np.transpose([choice.promised, choice.delivered]), color=GREY, linewidth=1.0)
    delivered = np.transpose([choice.delivered for choice in shift.choices])
    axis.plot(*delivered, "x", color="black", markersize=8, label="old choices, revised model")
    axis.margins(0.15)
    axis.set_xlabel("mean DTE [arcsec]", fontsize=9)
    axis.set_ylabel("standard deviation [arcsec]", fontsize=9)
    axis.legend(fontsize=8, frameon=False)
    _tidy(axis)
    return figure


def _draw_overlay(axis: Axes, overlaid: Overlay) -> None:
    axis.plot(
        overlaid.sample_turns, overlaid.samples, ".", color="#A9B2BB", markersize=4, label="samples"
    )
    axis.plot(
        overlaid.turns,
        overlaid.measured,
        color="black",
        linewidth=2.2,
        label="measured order lines",
    )
    axis.plot(overlaid.turns, overlaid.before, "--", color=BEFORE, linewidth=1.6, label="before")
    axis.plot(overlaid.turns, overlaid.after, "-.", color=AFTER, linewidth=1.6, label="after")
    axis.set_ylabel(f"{WORDS[overlaid.channel]} [{overlaid.unit}]")
    _tidy(axis)


def _dumbbells(
    axis: Axes, errors: Sequence[PredictionError], labels: Sequence[str], relative: bool = False
) -> None:
    units = [error.noise_floor if relative else 1.0 for error in errors]
    before = [error.before / unit for error, unit in zip(errors, units, strict=True)]
    after = [error.after / unit for error, unit in zip(errors, units, strict=True)]
    rows = range(len(errors))
    axis.hlines(rows, before, after, color="#A9B2BB", linewidth=2)
    axis.plot(before, rows, "s", color=BEFORE, mfc="none", markersize=7, label="before")
    axis.plot(after, rows, "o", color=AFTER, markersize=5, label="after")
    axis.set_yticks(rows, labels, fontsize=8)
    axis.invert_yaxis()
    axis.legend(fontsize=8, frameon=False)
    _tidy(axis)


def _deviations(location: Location) -> NDArray[np.float64]:
    """Return the root mean square misfit of each cell in standard deviations."""
    degrees_of_freedom = np.where(location.orders == 0.0, 1.0, 2.0)
    return np.sqrt(location.chi_square / degrees_of_freedom)


def _heat(figure: Figure, axis: Axes, size: NDArray[np.float64], labelled: bool = True) -> None:
    image = axis.imshow(
        np.clip(size, 1.0, LARGEST_SHOWN),
        cmap=MAP_COLOURS,
        norm=LogNorm(1.0, LARGEST_SHOWN),
        aspect="auto",
        interpolation="nearest",
    )
    if labelled:
        bar = figure.colorbar(image, ax=axis, ticks=[1, 3, 10, 30], pad=0.01)
        bar.ax.yaxis.set_major_formatter("{x:g}")
        bar.ax.minorticks_off()
        bar.set_label("misfit / noise", fontsize=8)


def _order_axis(axis: Axes, orders: NDArray[np.float64]) -> None:
    labels = [_order_word(order) for order in orders]
    axis.set_xticks(range(len(orders)), labels, fontsize=8, rotation=60)
    axis.set_xlabel("order of the input", fontsize=9)


def _order_word(order: float) -> str:
    return "mean" if order == 0.0 else f"{order:.3g}"


def _tidy(axis: Axes) -> None:
    axis.grid(color=FAINT, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
