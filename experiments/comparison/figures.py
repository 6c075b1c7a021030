"""How figures look: one palette, one marker for each algorithm, no global state of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.comparison.paired import Comparison

# Okabe and Ito's palette, told apart by colour-blind readers.
BLUE, ORANGE, GREEN, PINK, YELLOW = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
GREY = "#9AA5B1"

ALGORITHM_STYLES = {
    "AMP-MOPSO": (BLUE, "o"),
    "MOPSO": (ORANGE, "s"),
    "NSGA-II": (GREEN, "^"),
    "A-MOPSO": (PINK, "D"),
    "MP-MOPSO": (YELLOW, "v"),
}


def grid(
    rows: int, columns: int, width: float = 4.0, height: float = 3.4
) -> tuple[Figure, NDArray]:
    """Return a figure and its axes, shape (rows, columns); sizes of one panel in inches."""
    figure = Figure(figsize=(columns * width, rows * height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.grid(color="#E4E8EC", linewidth=0.6)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def fronts(comparisons: Sequence[Comparison]) -> Figure:
    """Draw the run of median IGD of every algorithm over the surrogate's front, one row each."""
    algorithms = comparisons[0].algorithms
    figure, axes = grid(len(comparisons), len(algorithms))
    for comparison, row in zip(comparisons, axes, strict=True):
        for algorithm, axis in zip(algorithms, row, strict=True):
            colour, marker = ALGORITHM_STYLES[algorithm]
            draw_true_front(axis, comparison.truth.pieces)
            points = comparison.median_front(algorithm)
            axis.plot(*points.T, marker, color=colour, markersize=4, mfc="none", label=algorithm)
            axis.set_title(f"{algorithm}, {comparison.model}", fontsize=10)
            axis.set_xlabel("mean DTE [arcsec]")
            axis.legend(fontsize=8, frameon=False)
        row[0].set_ylabel("std of DTE [arcsec]")
    return figure


def draw_true_front(axis: Axes, pieces: Sequence[NDArray[np.float64]]) -> None:
    """Draw the pieces (n, 2) of the surrogate's true front as one grey line each."""
    for number, piece in enumerate(pieces):
        label = "surrogate's true front" if number == 0 else None
        axis.plot(*piece.T, color=GREY, linewidth=3, solid_capstyle="round", label=label)


def igd_of_runs(comparisons: Sequence[Comparison]) -> Figure:
    """Draw every run's IGD on a logarithmic axis, with the median marked."""
    figure, axes = grid(1, len(comparisons), width=5.0, height=3.2)
    for comparison, axis in zip(comparisons, axes[0], strict=True):
        for place, algorithm in enumerate(comparison.algorithms):
            colour, marker = ALGORITHM_STYLES[algorithm]
            values = np.sort(comparison.values(algorithm, "igd"))
            # A regular spread beside the centre line keeps equal values apart, without chance.
            spread = place + 0.5 * ((np.arange(len(values)) % 7) / 6.0 - 0.5)
            axis.plot(spread, values, marker, color=colour, markersize=5, mfc="none")
            axis.hlines(np.median(values), place - 0.35, place + 0.35, colour, linewidth=2)
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter("{x:g}")
        axis.tick_params(which="both", labelsize=8)
        axis.set_xticks(range(len(comparison.algorithms)), comparison.algorithms)
        axis.set_ylabel("IGD")
        axis.set_title(comparison.model, fontsize=10)
    return figure


def reference_line(axis: Axes, *values: NDArray[np.float64]) -> None:
    """Draw the diagonal over the range of all ``values``, for a plot of predicted on true."""
    ends = [min(v.min() for v in values), max(v.max() for v in values)]
    axis.plot(ends, ends, color=GREY, linewidth=1)
