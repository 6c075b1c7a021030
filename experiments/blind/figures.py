"""Figures of the blind campaigns: confusion matrix and detection limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from experiments.blind.codes import ERROR
from experiments.blind.data import Outcome
from experiments.blind.limits import LIMITS, curve
from experiments.comparison.figures import BLUE, GREY, grid
from pymoo_hdte.virtual.hidden_forms import LISTED_FORMS, UNLISTED_FORMS

_TRUTHS = (*LISTED_FORMS, "parameter", "none", *UNLISTED_FORMS)
_ANSWERS = (*LISTED_FORMS, "parameter", "adequate", "unlisted", ERROR)
_COLUMNS = 5


def confusion_matrix(outcomes: Sequence[Outcome]) -> Figure:
    """Draw what is hidden against what is answered, for all cases that hide at most one effect."""
    counts = np.zeros((len(_TRUTHS), len(_ANSWERS)), dtype=int)
    for one in outcomes:
        if one.case.kind in ("pair", "detection"):
            continue
        truth = "parameter" if one.case.kind == "parameter" else one.case.truth
        counts[_TRUTHS.index(truth), _ANSWERS.index(one.answer)] += 1
    figure, axes = grid(1, 1, width=9.5, height=9.0)
    axis = axes.flat[0]
    axis.grid(False)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for row, column in np.argwhere(counts):
        colour = "white" if shares[row, column] > 0.5 else "black"
        axis.text(column, row, str(counts[row, column]), color=colour,
                  ha="center", va="center", fontsize=8)  # fmt: skip
    words = [[name.replace("_", " ") for name in names] for names in (_ANSWERS, _TRUTHS)]
    axis.set_xticks(range(len(_ANSWERS)), words[0], rotation=60, ha="right", fontsize=8)
    axis.set_yticks(range(len(_TRUTHS)), words[1], fontsize=8)
    axis.set_xlabel("answer")
    axis.set_ylabel("hidden")
    for place in (len(LISTED_FORMS), len(LISTED_FORMS) + 2):
        axis.axhline(place - 0.5, color=GREY, linewidth=1)
    axis.axvline(len(LISTED_FORMS) - 0.5, color=GREY, linewidth=1)
    return figure


def detection_limits(outcomes: Sequence[Outcome]) -> Figure:
    """Draw the rate of right verdicts over the size of each listed effect."""
    rows = -(-len(LISTED_FORMS) // _COLUMNS)
    figure, axes = grid(rows, _COLUMNS, width=2.6, height=2.2)
    for axis, name in zip(axes.flat, LISTED_FORMS, strict=False):
        points = curve(outcomes, name)
        for limit in LIMITS:
            axis.axhline(limit, color=GREY, linewidth=0.8, linestyle="--")
        sizes = [size for size, _ in points]
        values = [estimate.value for _, estimate in points]
        ends = [
            [estimate.value - estimate.low for _, estimate in points],
            [estimate.high - estimate.value for _, estimate in points],
        ]
        axis.errorbar(sizes, values, np.abs(ends), fmt="o-", color=BLUE, markersize=4, linewidth=1)
        axis.set_xscale("log")
        axis.set_ylim(-0.05, 1.05)
        axis.set_title(name.replace("_", " "), fontsize=9)
    for axis in axes.flat[len(LISTED_FORMS) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("size", fontsize=8)
    for axis in axes[:, 0]:
        axis.set_ylabel("right", fontsize=8)
    return figure
