"""Plots that stand as files beside a report: a picture, and the plotted numbers as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_hdte._reports.figures import AFTER, BEFORE, FAINT, GREY, svg, svg_uri

MOST_POINTS = 1500
"""Points of a panel beyond which rows are skipped, evenly."""
_COLOURS = (AFTER, BEFORE, "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9")
_MARKERS, _DASHES = "os^vDP*", ("-", "--", "-.", ":")
_MANY = 200
"""Points beyond which they are small and pale, so that a line over them shows."""


@dataclass(frozen=True, eq=False)
class Series:
    """Numbers under one name, drawn as points or as a line.

    Attributes
    ----------
    label : str
        Series of one label have one colour and one entry in the legend.
    x, y : ndarray, shape (n,)
        In the units of the panel.
    drawn : {"points", "held out", "line"}
        Held-out points are filled.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    drawn: str = "line"


@dataclass(frozen=True, eq=False)
class Panel:
    """Series over the same axes; the axes' names hold their units."""

    title: str
    x_name: str
    y_name: str
    series: tuple[Series, ...]


@dataclass(frozen=True, eq=False)
class Plot:
    """Panels below each other, with the stem of their files and a caption.

    Attributes
    ----------
    name : {"friction", "torsion", "campbell"}
    title, caption : str
    panels : tuple of Panel
    """

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]

    def figure(self) -> Figure:
        """Return the picture."""
        figure = Figure(figsize=(6.4, 0.3 + 2.8 * len(self.panels)), layout="constrained")
        axes = figure.subplots(len(self.panels), 1, squeeze=False)[:, 0]
        for axis, panel in zip(axes, self.panels, strict=True):
            _draw(axis, panel)
        return figure

    @cached_property
    def picture(self) -> str:
        """The picture as SVG."""
        return svg(self.figure())

    @property
    def address(self) -> str:
        """The picture as the address of an inline SVG."""
        return svg_uri(self.picture)

    def table(self) -> str:
        """Return the plotted numbers as CSV, a row a point."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(["panel", "series", "drawn", "x_name", "x", "y_name", "y"])
        for panel in self.panels:
            for series in panel.series:
                words = panel.title, series.label, series.drawn
                for x, y in zip(series.x.tolist(), series.y.tolist(), strict=True):
                    rows.writerow([*words, panel.x_name, repr(x), panel.y_name, repr(y)])
        return text.getvalue()

    def files(self) -> dict[str, str]:
        """Return the files by name."""
        return {f"{self.name}.csv": self.table(), f"{self.name}.svg": self.picture}

    def as_dict(self) -> dict[str, Any]:
        """Return the entry in the verdict as plain values."""
        return {"name": self.name, "csv": f"{self.name}.csv", "picture": f"{self.name}.svg"}


def plot_files(plots: Sequence[Plot]) -> dict[str, str]:
    """Return the files of plots, by name."""
    return {name: text for plot in plots for name, text in plot.files().items()}


def _draw(axis: Axes, panel: Panel) -> None:
    labels = list(dict.fromkeys(series.label for series in panel.series))
    told: set[str] = set()
    for series in panel.series:
        place = labels.index(series.label)
        colour = _COLOURS[place % len(_COLOURS)]
        label = None if series.label in told else series.label
        told.add(series.label)
        if series.drawn == "line":
            style = _DASHES[place % len(_DASHES)]
            axis.plot(series.x, series.y, style, color=colour, lw=1.8, label=label, zorder=3)
        else:
            marker = _MARKERS[place % len(_MARKERS)]
            many = len(series.x) > _MANY
            axis.plot(
                series.x, series.y, marker, color=colour, label=label,
                mfc=colour if series.drawn == "held out" else "none",
                ms=3 if many else 5, alpha=0.35 if many else 0.9,
            )  # fmt: skip
    axis.set_xlabel(panel.x_name)
    axis.set_ylabel(panel.y_name)
    if panel.title:
        axis.set_title(panel.title, fontsize=10, loc="left")
    axis.axhline(0.0, color=GREY, lw=0.6)
    axis.grid(color=FAINT, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    # Beside the axes, where it hides no point.
    axis.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
