"""Pictures: indicators over the budget, and how close each setting comes to the printed numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from experiments.comparing.figures import ALGORITHM_STYLES, grid, plain_log_scale
from experiments.comparing.intervals import mean_intervals
from experiments.paper.anytime.data import Contested, Scores, cases
from experiments.paper.anytime.duels import COMPARED
from experiments.paper.anytime.readings import Reading
from experiments.published_values import TABLE_7

LABELS = {"igd": "IGD [arcsec]", "spacing": "Spacing [arcsec]", "hypervolume": "hypervolume"}
PRINTED = ("igd", "spacing")
"""What the paper prints."""


def over_budget(
    scores: Scores, contested: Contested, algorithms: Sequence[str], *, printed: bool
) -> Figure:
    """Draw mean IGD, Spacing and hypervolume with their 95 % intervals over the evaluations.

    One column for each population; with ``printed``, a dashed line for what the paper prints.
    """
    populations = scores.populations()
    figure, axes = grid(len(LABELS), len(populations), width=3.3, height=2.6, share_rows=True)
    for row, indicator in zip(axes, LABELS, strict=True):
        for axis, population in zip(row, populations, strict=True):
            for algorithm in algorithms:
                _curve(axis, scores, contested, population, algorithm, indicator)
                if printed and indicator in PRINTED:
                    value = getattr(TABLE_7[algorithm], indicator)
                    colour = ALGORITHM_STYLES[algorithm][0]
                    axis.axhline(value, color=colour, linewidth=1.2, linestyle="--")
            axis.set_xscale("log")
            axis.xaxis.set_major_formatter("{x:,g}")
            if indicator in PRINTED:
                plain_log_scale(axis)
        row[0].set_ylabel(LABELS[indicator])
    for axis, population in zip(axes[0], populations, strict=True):
        axis.set_title(f"population {population}", fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("evaluations")
    _legend(figure, axes[0, 0], printed=printed)
    return figure


def _curve(
    axis: Axes,
    scores: Scores,
    contested: Contested,
    population: int,
    algorithm: str,
    indicator: str,
) -> None:
    points = {
        budget: scores.of(one, COMPARED[indicator])
        for size, budget, (one,) in cases(scores, contested, [algorithm])
        if size == population
    }
    budgets = list(points)
    middle, low, high = mean_intervals(np.array(list(points.values()))).T
    colour, marker = ALGORITHM_STYLES[algorithm]
    axis.fill_between(budgets, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(budgets, middle, marker=marker, color=colour, markersize=4, label=algorithm)


def _legend(figure: Figure, axis: Axes, *, printed: bool) -> None:
    handles, labels = axis.get_legend_handles_labels()
    if printed:
        handles.append(axis.plot([], [], color="black", linewidth=1.2, linestyle="--")[0])
        labels.append("printed in the paper")
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)


def closeness(readings: Sequence[Reading]) -> Figure:
    """Draw, for each population and budget, by what factor the closest reading is off."""
    populations = sorted({one.population for one in readings})
    budgets = sorted({one.evaluations for one in readings})
    best = np.full((len(populations), len(budgets)), np.nan)
    for one in reversed(readings):
        # The closest comes last and stays.
        best[populations.index(one.population), budgets.index(one.evaluations)] = one.factor
    figure, axes = grid(1, 1, width=6.4, height=3.0)
    axis = axes[0, 0]
    axis.grid(visible=False)
    axis.imshow(best, cmap="viridis_r", norm=LogNorm(1.0, np.nanmax(best)), aspect="auto")
    middle = np.sqrt(np.nanmax(best))
    for (row, column), factor in np.ndenumerate(best):
        colour = "white" if factor > middle else "black"
        axis.text(column, row, f"{factor:.1f}", ha="center", va="center", color=colour)
    axis.set_xticks(range(len(budgets)), [f"{budget:,}" for budget in budgets])
    axis.set_yticks(range(len(populations)), [str(size) for size in populations])
    axis.set_xlabel("evaluations")
    axis.set_ylabel("population")
    return figure
