"""The figures of the five prototypes: records over an output turn, bars of predicted DTE."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.comparing.figures import BLUE, GREY, ORANGE, grid
from experiments.paper.prototypes.printed_validation import NUMBERS, Assignment, bounds
from experiments.paper.prototypes.records import Record

_INPUT_TURNS = 3


def records_figure(records: Mapping[int, Record]) -> Figure:
    """Draw each prototype's record: the whole output turn, and a few input turns of it."""
    figure, axes = grid(len(records), 2, width=5.0, height=2.9)
    for (number, record), (whole, part) in zip(records.items(), axes, strict=True):
        stretch = _INPUT_TURNS * 360.0 / record.ratio
        for axis, end in ((whole, 360.0), (part, stretch)):
            inside = (record.output_angle >= 0.0) & (record.output_angle <= end)
            angle = record.output_angle[inside]
            marker = {"linewidth": 0.5} if axis is whole else {"linewidth": 1.6}
            axis.plot(angle, record.raw[inside], color=GREY, label="unfiltered", **marker)
            axis.plot(angle, record.filtered[inside], color=BLUE, label="100 Hz low pass", **marker)
            axis.set_xlim(0.0, end)
            axis.set_xlabel("output angle [deg]")
        whole.set_ylabel("transmission error [arcsec]")
        whole.set_title(
            f"No. {number}: DTE {record.measured:.2f} arcsec after the chain", fontsize=10
        )
        part.set_title(f"No. {number}, first {_INPUT_TURNS} input turns", fontsize=10)
    labelled = axes[0, 1].get_legend_handles_labels()
    figure.legend(*labelled, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def bars(
    predicted: Mapping[str, NDArray[np.float64]], best_case: Mapping[str, Assignment | None]
) -> Figure:
    """Draw predicted DTE (5,) by model, with measured values that the printed facts allow."""
    figure, axes = grid(1, len(predicted), width=4.0, height=3.4)
    places = np.arange(len(NUMBERS))
    for (name, values), axis in zip(predicted.items(), axes[0], strict=True):
        axis.bar(places, values, 0.6, color=BLUE, alpha=0.75, label="predicted")
        nearest = best_case[name]
        if nearest is not None:
            label = "nearest allowed measurement"
            axis.plot(places, nearest.measured, "D", color=ORANGE, markersize=6, label=label)
        mean = bounds().measured_mean
        axis.axhline(mean, color=GREY, linewidth=1.2, label="implied measured mean")
        axis.set_xticks(places, [f"No. {number}" for number in NUMBERS])
        axis.set_ylim(0.0, 1.5 * max(mean, *values))
        axis.set_title(name, fontsize=10)
    axes[0, 0].set_ylabel("DTE [arcsec]")
    axes[0, 0].legend(fontsize=8, frameon=False, loc="upper left")
    return figure
