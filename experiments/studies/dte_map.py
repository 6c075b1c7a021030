"""The DTE over input speed and load, and the resonances of each preset."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from tqdm import tqdm

from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, grid
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import Cell, Column, Picture, Result, Table, significant
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.drive.dte_map import (
    SpeedLoadMap,
    critical_speeds,
    neighbouring_resonances,
    speed_load_map,
    torsional_mode,
)

SPEEDS = np.arange(100.0, 4001.0, 50.0)
LOADS = np.arange(0.0, 41.0, 4.0)
RATED_SPEED = 2000.0
DRAWN_LOADS = {0.0: (GREY, ":"), 20.0: (GREEN, "--"), 40.0: (BLUE, "-")}

(SETTING,) = paragraphs("dte_map")


def run(context: Context) -> Result:
    """Map all presets."""
    maps = [
        speed_load_map(robust_problem(name).model, SPEEDS, LOADS)
        for name in tqdm(PRESETS, desc="maps", leave=False)
    ]
    return Result(
        title="DTE over input speed and load",
        command="python -m experiments dte_map",
        paragraphs=(SETTING,),
        answer=" ".join(_resonances(entry) for entry in reversed(maps)),
        models=models_of(*PRESETS),
        tables=(_modes_table(maps), _peaks_table(maps)),
        pictures=(
            Picture(
                "map",
                "Left: DTE over input speed and load, one row a preset. Right: at three loads. "
                "Dash-dotted lines mark the resonances of excited orders within the range, the "
                "cross the rated condition.",
                _figure(maps),
            ),
        ),
    )


def _resonances(entry: SpeedLoadMap) -> str:
    """Say where a drive model resonates."""
    mode = torsional_mode(entry.model)
    met = [
        f"{significant(speed, 4)} r/min by order {order:g}"
        for order, speed in critical_speeds(entry.model)
    ]
    where = f"torsional mode at {significant(mode.frequency, 4)} Hz"
    if not met:
        return f"The model {entry.model.name} resonates at no input speed ({where})."
    return f"The model {entry.model.name} resonates at {' and '.join(met)} ({where})."


def _met(entry: SpeedLoadMap) -> list[str]:
    """Return the orders that meet the torsional mode, each with its input speed in r/min."""
    return [
        f"order {order:g} at {significant(speed, 4)}"
        for order, speed in critical_speeds(entry.model)
    ]


def _modes_table(maps: Sequence[SpeedLoadMap]) -> Table:
    rows = []
    for entry in maps:
        mode = torsional_mode(entry.model)
        ends = np.nanmin(entry.dte), np.nanmax(entry.dte)
        total = entry.dte.size
        cells = (mode.frequency, mode.damping_ratio, ", ".join(_met(entry)) or "none")
        rows.append((entry.model.name, *cells, *ends, f"{entry.unstable} of {total}"))
    columns = (
        Column("model"),
        Column("torsional mode", "Hz", 4),
        Column("damping ratio", "", 2),
        Column("resonances", "r/min"),
        Column("least DTE", "arcsec", 4),
        Column("greatest DTE", "arcsec", 4),
        Column("conditions without a steady state"),
    )
    return Table("modes", "Torsional modes and range of the maps", columns, tuple(rows))


def _peaks_table(maps: Sequence[SpeedLoadMap]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for entry in maps:
        for row in (0, len(LOADS) - 1):
            peaks = entry.peaks(row)
            rows += [(entry.model.name, float(LOADS[row]), speed, dte) for speed, dte in peaks]
            if not peaks:
                rows.append((entry.model.name, float(LOADS[row]), None, None))
    columns = (
        Column("model"),
        Column("load", "N.m", 2),
        Column("input speed", "r/min", 4),
        Column("DTE", "arcsec", 4),
    )
    title = "Peaks of the DTE over input speed, unloaded and at rated load"
    note = f"Speeds are {SPEEDS[1] - SPEEDS[0]:g} r/min apart. A dash: no peak."
    return Table("peaks", title, columns, tuple(rows), note=note)


def _figure(maps: Sequence[SpeedLoadMap]) -> Figure:
    figure, axes = grid(len(maps), 2, width=5.2, height=3.2)
    for entry, (axis, right) in zip(maps, axes, strict=True):
        _draw_map(figure, axis, entry)
        _draw_curves(right, entry)
        for orders, speed in neighbouring_resonances(entry.model, float(SPEEDS[-1])):
            _mark_resonance(axis, right, f"order {orders}", speed)
    return figure


def _mark_resonance(axis: Axes, right: Axes, label: str, speed: float) -> None:
    axis.axvline(speed, color="white", linestyle="-.", linewidth=1.2)
    right.axvline(speed, color=ORANGE, linestyle="-.", linewidth=1.2)
    right.annotate(
        label,
        (speed, 1.0),
        xycoords=right.get_xaxis_transform(),
        xytext=(0, 2),
        textcoords="offset points",
        ha="center",
        color=ORANGE,
        fontsize=8,
    )


def _draw_map(figure: Figure, axis: Axes, entry: SpeedLoadMap) -> None:
    colours = colormaps["viridis"].with_extremes(bad="black")
    axis.grid(visible=False)
    image = axis.pcolormesh(
        entry.speeds,
        entry.loads,
        np.ma.masked_invalid(entry.dte),
        cmap=colours,
        norm=LogNorm(),
        shading="nearest",
        rasterized=True,
    )
    bar = figure.colorbar(image, ax=axis, label="DTE [arcsec]", format="{x:.3g}")
    bar.ax.yaxis.set_minor_formatter("{x:.3g}")
    bar.ax.tick_params(which="both", labelsize=8)
    axis.set_facecolor("black")
    axis.plot(RATED_SPEED, LOADS[-1], "x", color=ORANGE, markersize=8, mew=2, clip_on=False)
    axis.set_title(entry.model.name, fontsize=10)
    axis.set_xlabel("input speed [r/min]")
    axis.set_ylabel("load [N.m]")


def _draw_curves(axis: Axes, entry: SpeedLoadMap) -> None:
    for load, (colour, line) in DRAWN_LOADS.items():
        row = int(np.flatnonzero(entry.loads == load)[0])
        axis.plot(entry.speeds, entry.dte[row], line, color=colour, label=f"{load:g} N.m")
    axis.set_ylim(0.0, 1.1 * float(np.nanmax(entry.dte)))
    axis.set_xlabel("input speed [r/min]")
    axis.set_ylabel("DTE [arcsec]")
    axis.legend(fontsize=8, frameon=False)
