"""How figures look: one palette, one marker for each algorithm, no global state of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter
from numpy.typing import NDArray

from experiments.comparing.paired import MODELS, Comparison

# Okabe and Ito's palette, told apart by colour-blind readers.
BLUE, ORANGE, GREEN, PINK, YELLOW = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
SKY, BLACK = "#56B4E9", "#000000"
GREY = "#9AA5B1"

ALGORITHM_STYLES = {
    "AMP-MOPSO": (BLUE, "o"),
    "MOPSO": (ORANGE, "s"),
    "NSGA-II": (GREEN, "^"),
    "A-MOPSO": (PINK, "D"),
    "MP-MOPSO": (YELLOW, "v"),
}

MOST_LETTERS = 40
"""Names of algorithms that fit side by side below one panel."""
_OTHERS = ((SKY, "P"), (BLACK, "X"), (PINK, "<"), (YELLOW, ">"), (GREEN, "h"), (ORANGE, "p"))


def style(algorithm: str, place: int) -> tuple[str, str]:
    """Return colour and marker of an algorithm; a stranger's go by its place in the comparison."""
    return ALGORITHM_STYLES.get(algorithm, _OTHERS[place % len(_OTHERS)])


def grid(
    rows: int, columns: int, width: float = 4.0, height: float = 3.4, *, share_rows: bool = False
) -> tuple[Figure, NDArray]:
    """Return a figure and its axes, shape (rows, columns); sizes of one panel in inches."""
    figure = Figure(figsize=(columns * width, rows * height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey="row" if share_rows else "none")
    for axis in axes.flat:
        axis.grid(color="#E4E8EC", linewidth=0.6)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def fronts(comparisons: Sequence[Comparison]) -> Figure:
    """Draw the run of median IGD of every algorithm over the reference front, one row each.

    Of more than two objectives, the first two are drawn.
    """
    algorithms = comparisons[0].algorithms
    figure, axes = grid(len(comparisons), len(algorithms))
    for comparison, row in zip(comparisons, axes, strict=True):
        for place, (algorithm, axis) in enumerate(zip(algorithms, row, strict=True)):
            colour, marker = style(algorithm, place)
            _draw_reference(axis, comparison)
            points = comparison.median_front(algorithm)[:, :2]
            axis.plot(*points.T, marker, color=colour, markersize=4, mfc="none", label=algorithm)
            axis.set_title(f"{algorithm}, {comparison.model}", fontsize=10)
            axis.set_xlabel(comparison.objectives[0])
            axis.legend(fontsize=8, frameon=False)
        row[0].set_ylabel(comparison.objectives[1])
    return figure


def _draw_reference(axis: Axes, comparison: Comparison) -> None:
    if comparison.is_true and len(comparison.objectives) == 2:
        own = "front of the order-3 surrogate" if comparison.model in MODELS else "true front"
        draw_true_front(axis, comparison.truth.pieces, own)
        return
    label = "true front" if comparison.is_true else "union of runs"
    axis.plot(*comparison.truth.F[:, :2].T, ".", color=GREY, markersize=2, label=label)


def draw_true_front(
    axis: Axes, pieces: Sequence[NDArray[np.float64]], name: str = "front of the order-3 surrogate"
) -> None:
    """Draw the pieces (n, 2) of a true front as one grey line each."""
    for number, piece in enumerate(pieces):
        label = name if number == 0 else None
        axis.plot(*piece.T, color=GREY, linewidth=3, solid_capstyle="round", label=label)


def igd_of_runs(comparisons: Sequence[Comparison]) -> Figure:
    """Draw every run's IGD on a logarithmic axis, with the median marked."""
    figure, axes = grid(1, len(comparisons), width=5.0, height=3.2)
    for comparison, axis in zip(comparisons, axes[0], strict=True):
        for place, algorithm in enumerate(comparison.algorithms):
            colour, marker = style(algorithm, place)
            values = np.sort(comparison.values(algorithm, "igd"))
            # A regular spread beside the centre line keeps equal values apart, without chance.
            spread = place + 0.5 * ((np.arange(len(values)) % 7) / 6.0 - 0.5)
            axis.plot(spread, values, marker, color=colour, markersize=5, mfc="none")
            axis.hlines(np.median(values), place - 0.35, place + 0.35, colour, linewidth=2)
        plain_log_scale(axis)
        axis.tick_params(which="both", labelsize=8)
        axis.set_xticks(range(len(comparison.algorithms)), comparison.algorithms)
        if len("".join(comparison.algorithms)) > MOST_LETTERS:
            axis.tick_params(axis="x", rotation=30)
        axis.set_ylabel("IGD")
        axis.set_title(comparison.model, fontsize=10)
    return figure


class _PlainNumbers(LogFormatter):
    """Labels what `LogFormatter` labels, without exponents."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def plain_log_scale(axis: Axes) -> None:
    """Make the vertical axis logarithmic, labelled without powers and not too densely."""
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter("{x:g}")
    # Above one decade and a half, only the powers of ten are labelled; below, all that fit.
    axis.yaxis.set_minor_formatter(_PlainNumbers(minor_thresholds=(1.5, 0.7)))


def reference_line(axis: Axes, *values: NDArray[np.float64]) -> None:
    """Draw the diagonal over the range of all ``values``, for a plot of predicted on true."""
    ends = [min(v.min() for v in values), max(v.max() for v in values)]
    axis.plot(ends, ends, color=GREY, linewidth=1)
