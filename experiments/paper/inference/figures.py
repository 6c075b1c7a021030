"""Pictures: the published optima beside those of models, and the profiles of the parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.comparing.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, grid
from experiments.paper.calibrating.ladder import LOGARITHMIC
from experiments.paper.inference.data import Draws, Profiled
from experiments.paper.inference.knowledge import BOUND, title
from experiments.paper.inference.likelihood import BAND, OBSERVED, box_axes
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.verdicts import Named
from experiments.published_values import TABLE_8

COLOURS = (BLUE, ORANGE, GREEN, PINK, GREY)
_GRID = 17
BEYOND = 7.0
"""Of the published optima, shown on either side, arcsec."""


def objectives(shown: Sequence[Named], draws: Sequence[Draws]) -> Figure:
    """Draw optima and fronts of the models, and the optima of the posteriors' draws."""
    figure, axes = grid(1, 2, width=6.6, height=4.6)
    left, right = axes.flat
    for named, colour in zip(shown, COLOURS, strict=False):
        predicted = named.fit.evaluation.predicted
        left.plot(*_front(named).T, "-", color=colour, linewidth=1)
        left.plot(predicted[1:4], predicted[5:8], "o", color=colour, label=named.label)
    left.plot(OBSERVED[1:4], OBSERVED[5:8], "x", color=BLACK, markersize=9, label="the paper")
    # A front that the target has drawn close runs on far beyond all others.
    left.set_xlim(OBSERVED[1] - BEYOND, OBSERVED[3] + BEYOND)
    left.set_ylim(OBSERVED[7] - 0.3 * BEYOND, OBSERVED[5] + 0.2 * BEYOND)
    _labels(left)
    for drawn, colour in zip(draws, COLOURS, strict=False):
        values = drawn.optima["mean_balanced"], drawn.optima["std_balanced"]
        label = f"balanced, {title(drawn.target, drawn.rung)}"
        right.plot(*values, ".", color=colour, alpha=0.6, label=label)
    paper = TABLE_8["balanced"]
    right.plot(paper.mean_arcsec, paper.std_arcsec, "x", color=BLACK, markersize=9,
               label="balanced, the paper")  # fmt: skip
    _labels(right)
    return figure


def curves(profiled: Sequence[Profiled]) -> Figure:
    """Draw the profile of every parameter of every posterior."""
    names = list(profiled[0].curves)
    figure, axes = grid(-(-len(names) // 3), 3, width=3.6, height=2.4)
    for axis, name in zip(axes.flat, names, strict=False):
        for one, colour in zip(profiled, COLOURS, strict=False):
            values, deviance = one.curves[name].T
            shown = np.exp(values) if name in LOGARITHMIC else values
            axis.plot(shown, deviance - deviance.min(), "o-", color=colour, markersize=3,
                      label=title(one.target, one.rung))  # fmt: skip
        axis.axhline(BOUND, color=GREY, linewidth=1)
        axis.set_ylim(-0.5, 12.0)
        axis.set_xlabel(name.replace("_", " "))
    axes.flat[0].set_ylabel("deviance above the least")
    # No panel has room for it.
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", frameon=False, fontsize=8, ncols=2)
    return figure


def _front(named: Named) -> np.ndarray:
    surrogate = TensorSurrogate.fit(named.fit.rung, named.fit.parameters)
    moments = surrogate.on_designs(box_axes(surrogate, _GRID), BAND)
    values = np.column_stack([part.ravel() for part in moments])
    rising = values[np.lexsort((values[:, 1], values[:, 0]))]
    lowest = np.minimum.accumulate(rising[:, 1])
    return rising[np.concatenate([[True], rising[1:, 1] < lowest[:-1]])]


def _labels(axis: Axes) -> None:
    axis.set_xlabel("mean [arcsec]")
    axis.set_ylabel("standard deviation [arcsec]")
    axis.legend(frameon=False, fontsize=7)
