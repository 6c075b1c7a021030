"""How figures look: one palette, one marker for each algorithm, no global state of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogFormatter
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte._comparing.paired import MODELS, Comparison
from pymoo_hdte._comparing.ranks import cliques
from pymoo_hdte._comparing.trace import Profile
from pymoo_hdte.checks import InvalidInput, finite_array, one_of

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
        _prepare(axis)
    return figure, axes


def _prepare(axis: Axes) -> None:
    axis.grid(color="#E4E8EC", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def panel() -> tuple[Figure, Axes]:
    """Return a figure of one panel whose words can be read on a phone."""
    figure, axes = grid(1, 1, width=7.2, height=4.0)
    axis = axes[0, 0]
    axis.tick_params(which="both", labelsize=13)
    for label in (axis.xaxis.label, axis.yaxis.label):
        label.set_fontsize(14)
    return figure, axis


PANELS = 3
"""Panels side by side, which a page of 1280 pixels still shows large enough to be read."""


def fronts(comparison: Comparison) -> Figure:
    """Draw the run of median IGD of every algorithm on one problem over the reference front.

    Three objectives are drawn in three dimensions, more as parallel coordinates in which the
    reference front runs from 0 to 1.
    """
    algorithms, n_obj = comparison.algorithms, len(comparison.objectives)
    draw = {2: _in_the_plane, 3: _in_space}.get(n_obj, _as_lines)
    rows = -(-len(algorithms) // PANELS)
    columns = -(-len(algorithms) // rows)
    height = 4.0 if n_obj == 3 else 3.4
    figure = Figure(figsize=(4.0 * columns, height * rows), layout="constrained")
    for place, algorithm in enumerate(algorithms):
        projection = "3d" if n_obj == 3 else None
        axis = figure.add_subplot(rows, columns, place + 1, projection=projection)
        colour, marker = style(algorithm, place)
        draw(axis, comparison, comparison.median_front(algorithm), colour, marker)
        axis.set_title(f"{algorithm}, {comparison.model}", fontsize=10)
    return figure


def _in_the_plane(
    axis: Axes, comparison: Comparison, points: NDArray[np.float64], colour: str, marker: str
) -> None:
    _prepare(axis)
    if comparison.is_true:
        own = "front of the order-3 surrogate" if comparison.model in MODELS else "true front"
        draw_true_front(axis, comparison.truth.pieces, own)
    else:
        axis.plot(*comparison.truth.F.T, ".", color=GREY, markersize=2, label="union of runs")
    axis.plot(*points.T, marker, color=colour, markersize=4, mfc="none")
    axis.set(xlabel=comparison.objectives[0], ylabel=comparison.objectives[1])
    axis.legend(fontsize=8, frameon=False)


def _in_space(
    axis: Axes, comparison: Comparison, points: NDArray[np.float64], colour: str, marker: str
) -> None:
    axis.plot(*comparison.truth.F.T, ".", color=GREY, markersize=2, alpha=0.6)
    axis.plot(*points.T, marker, color=colour, markersize=4)
    axis.set(**dict(zip(("xlabel", "ylabel", "zlabel"), comparison.objectives, strict=True)))
    axis.tick_params(labelsize=7)
    # From the side of the ideal point, so that nothing hides the front.
    axis.view_init(elev=25.0, azim=225.0)  # type: ignore[attr-defined]
    # The layout knows nothing of the labels in space.
    axis.set_box_aspect(None, zoom=0.86)  # type: ignore[call-arg]


def _as_lines(
    axis: Axes, comparison: Comparison, points: NDArray[np.float64], colour: str, marker: str
) -> None:
    _prepare(axis)
    places = range(len(comparison.objectives))
    axis.axhspan(0.0, 1.0, color="#E4E8EC")
    axis.plot(places, comparison.truth.normalise(points).T, color=colour, linewidth=0.7)
    axis.set_xticks(places, comparison.objectives, fontsize=8)
    axis.set_ylabel("of the reference front's extent")


def draw_true_front(
    axis: Axes, pieces: Sequence[NDArray[np.float64]], name: str = "front of the order-3 surrogate"
) -> None:
    """Draw the pieces (n, 2) of a true front as one grey line each."""
    for number, piece in enumerate(pieces):
        label = name if number == 0 else None
        axis.plot(*piece.T, color=GREY, linewidth=3, solid_capstyle="round", label=label)


def igd_of_runs(comparisons: Sequence[Comparison]) -> Figure:
    """Draw every run's IGD on a logarithmic axis, with the median marked."""
    columns = min(len(comparisons), 2)
    figure, axes = grid(-(-len(comparisons) // columns), columns, width=5.0, height=3.2)
    for axis in axes.flat[len(comparisons) :]:
        axis.remove()
    for comparison, axis in zip(comparisons, axes.flat, strict=False):
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


def targets_reached(comparisons: Sequence[Comparison], shares: Sequence[Profile]) -> Figure:
    """Draw for every algorithm which share of all targets its runs had reached by each budget."""
    figure, axes = grid(1, 1, width=8.5, height=4.2)
    (axis,) = axes.flat
    # The later the thinner, so that equal lines are all seen.
    widths = np.linspace(4.0, 1.5, len(shares)).tolist()
    for place, (algorithm, profile, width) in enumerate(
        zip(comparisons[0].algorithms, shares, widths, strict=True)
    ):
        colour, marker = style(algorithm, place)
        axis.step(*profile, where="post", color=colour, linewidth=width, label=algorithm)
        axis.plot(*(values[-1] for values in profile), marker, color=colour, clip_on=False)
    axis.set_xscale("log")
    axis.xaxis.set_major_formatter("{x:,g}")
    axis.set(ylim=(0.0, 1.0), xlabel="evaluations", ylabel="share of targets reached")
    axis.legend(fontsize=9, frameon=False, loc="upper left")
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


_INK = "#1F2933"
_BAR_STEP, _NAME_STEP = 0.38, 0.75
"""Distances between bars of cliques and between names, where the axis of ranks is at 0."""


def critical_difference_plot(
    names: Sequence[str], average_ranks: ArrayLike, difference: float, highlight: str
) -> Figure:
    """Draw Demsar's diagram: a bar joins the algorithms whose average ranks do not differ.

    Parameters
    ----------
    names : sequence of str
        Of the algorithms.
    average_ranks : array_like, shape (algorithms,)
        1 is the best.
    difference : float
        Critical difference of two average ranks, from `ranks.nemenyi_difference`.
    highlight : str
        Algorithm to draw in bold.

    Raises
    ------
    InvalidInput
        For ranks that do not fit the names, a highlight that is none of them, or a difference
        that is not above zero.
    """
    ranks = finite_array("average_ranks", average_ranks, (len(names),))
    one_of("highlight", highlight, names)
    groups = [group for group in cliques(ranks, difference) if len(group) > 1]
    order = np.argsort(ranks, kind="stable").tolist()
    n = len(order)
    n_left = -(-n // 2)
    first_name = 0.6 + _BAR_STEP * len(groups)
    bottom = first_name + _NAME_STEP * n_left
    figure, axes = grid(1, 1, width=9.5, height=0.37 * (bottom + 2.6))
    axis = axes.flat[0]
    axis.set_axis_off()
    axis.set(xlim=(1 - 0.42 * (n - 1), n + 0.42 * (n - 1)), ylim=(bottom, -2.6))
    _draw_scale(axis, n, difference)
    # The outermost name of either side stands highest, so that no two leaders cross.
    for side, members in ((-1, order[:n_left]), (1, order[: n_left - 1 : -1])):
        for place, index in enumerate(members):
            height = first_name + _NAME_STEP * place
            _draw_leader(axis, side, n, names[index], ranks[index], height, highlight)
    for place, group in enumerate(groups):
        ends = ranks[[group[0], group[-1]]] + np.array([-0.005, 0.005]) * (n - 1)
        axis.plot(ends, [0.4 + _BAR_STEP * place] * 2, color=_INK, linewidth=4.5,
                  solid_capstyle="butt", zorder=3)  # fmt: skip
    return figure


def rank_heatmap(
    ranks: ArrayLike,
    problems: Sequence[str],
    groups: Sequence[str],
    algorithms: Sequence[str],
    highlight: str,
) -> Figure:
    """Print the rank of every algorithm on every problem, the darker the better.

    Parameters
    ----------
    ranks : array_like, shape (problems, algorithms)
        From `pymoo_hdte._comparing.ranks.problem_ranks`.
    problems : sequence of str
        Names of the rows.
    groups : sequence of str
        The group of each problem; groups stand apart, in the order of their first problems, each
        with its average ranks below.
    algorithms : sequence of str
        Names of the columns, drawn in this order.
    highlight : str
        Algorithm to draw in a frame.

    Raises
    ------
    InvalidInput
        For ranks or groups that do not fit the names, or a highlight that is none of them.
    """
    cells = finite_array("ranks", ranks, (len(problems), len(algorithms)))
    if len(groups) != len(problems):
        raise InvalidInput("number of groups", len(groups), f"{len(problems)}, one a problem")
    one_of("highlight", highlight, algorithms)
    rows, labels, heads, averages = _sections(cells, problems, groups)
    figure, axes = grid(1, 1, width=9.5, height=0.9 + 0.25 * len(rows))
    axis = axes.flat[0]
    axis.grid(False)
    axis.spines[:].set_visible(False)
    axis.imshow(rows, cmap="Blues_r", vmin=1, vmax=1.15 * len(algorithms), aspect="auto")
    for row, column in np.argwhere(np.isfinite(rows)):
        rank = rows[row, column]
        text = f"{rank:.2f}" if row in averages else f"{rank:g}"
        axis.text(column, row, text, ha="center", va="center", fontsize=9,
                  color="white" if rank < 0.46 * len(algorithms) else "black",
                  weight="bold" if row in averages else "normal")  # fmt: skip
    axis.set_yticks(range(len(rows)), labels, fontsize=9)
    for row in (*heads, *averages):
        axis.get_yticklabels()[row].set_fontweight("bold")
    _name_columns(axis, algorithms, highlight)
    place = list(algorithms).index(highlight)
    for head, average in zip(heads, averages, strict=True):
        axis.add_patch(Rectangle((place - 0.5, head + 0.5), 1, average - head,
                                 fill=False, edgecolor="black", linewidth=2,
                                 clip_on=False))  # fmt: skip
        axis.axhline(average - 0.5, color="white", linewidth=2)
    return figure


def _draw_scale(axis: Axes, n: int, difference: float) -> None:
    axis.plot([1, n], [0, 0], color=_INK, linewidth=1.2)
    for rank in range(1, n + 1):
        axis.plot([rank, rank], [0, -0.16], color=_INK, linewidth=1.2)
        axis.text(rank, -0.25, str(rank), ha="center", va="bottom", fontsize=10, color=_INK)
    axis.text(n + 0.06 * (n - 1), 0, "average rank\n(1 is best)", va="center", fontsize=10)
    axis.errorbar(1 + difference / 2, -1.3, xerr=difference / 2, color=_INK, capsize=5, fmt="none")
    axis.text(1, -1.55, f"critical difference {difference:.2f}", va="bottom", fontsize=10)


def _draw_leader(
    axis: Axes, side: int, n: int, name: str, rank: float, height: float, highlight: str
) -> None:
    """Lead from the rank on the scale down and out to the name, to the left for side -1."""
    bold = name == highlight
    colour, width, weight = (BLUE, 2.6, "bold") if bold else (_INK, 0.9, "normal")
    end = 1 - 0.06 * (n - 1) if side < 0 else n + 0.06 * (n - 1)
    axis.plot([rank, rank, end], [0, height, height], color=colour, linewidth=width,
              zorder=2.5 if bold else 2.0)  # fmt: skip
    words = f"{name}  {rank:.2f} " if side < 0 else f" {rank:.2f}  {name}"
    axis.text(end, height, words, ha="right" if side < 0 else "left", va="center",
              fontsize=10, color=colour, weight=weight)  # fmt: skip


def _sections(
    ranks: NDArray[np.float64], problems: Sequence[str], groups: Sequence[str]
) -> tuple[NDArray[np.float64], list[str], list[int], list[int]]:
    """Stack a blank row for the heading, the problems and their average, for each group.

    Returns the rows, their labels, and the numbers of the rows of headings and of averages.
    """
    blank = np.full((1, ranks.shape[1]), np.nan)
    blocks: list[NDArray[np.float64]] = []
    labels: list[str] = []
    heads, averages = [], []
    for group in dict.fromkeys(groups):
        members = [index for index, name in enumerate(groups) if name == group]
        blocks += [blank, ranks[members], ranks[members].mean(axis=0, keepdims=True)]
        heads.append(len(labels))
        labels += [group, *(problems[index] for index in members), "average rank"]
        averages.append(len(labels) - 1)
    return np.vstack(blocks), labels, heads, averages


def _name_columns(axis: Axes, algorithms: Sequence[str], highlight: str) -> None:
    axis.xaxis.tick_top()
    axis.set_xticks(range(len(algorithms)), algorithms, rotation=35, ha="left", fontsize=10)
    axis.tick_params(length=0)
    for label, name in zip(axis.get_xticklabels(), algorithms, strict=True):
        label.set_fontweight("bold" if name == highlight else "normal")
