"""Figures of the blind campaigns: confusion matrix and reliability diagram."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from experiments.comparing.figures import BLUE, GREY, grid
from experiments.studies.blind.codes import ERROR
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.reliability import reliability
from experiments.studies.blind.rig.forms import LISTED, UNLISTED
from experiments.studies.blind.truth import PARAMETER
from pymoo_hdte.drive._effects import ENCODER_LINE

_TRUTHS = (*LISTED, "none", *UNLISTED)
_OF_NO_EFFECT = ("adequate", "unlisted", ERROR)
_APART = 0.06
"""Probabilities between which there is room for a number."""
_OF_ONE = ("none", "single", "unlisted")
"""Kinds that hide at most one effect, and no stress."""


def confusion_matrix(outcomes: Sequence[Outcome]) -> Figure:
    """Draw what is hidden against what is answered, for all cases that hide at most one effect."""
    drawn = [one for one in outcomes if one.case.kind in _OF_ONE]
    known = (*LISTED, PARAMETER, ENCODER_LINE)
    # The library holds effects that the bench never hides, as the new zero of a sensor.
    others = sorted({one.answer for one in drawn} - {*known, *_OF_NO_EFFECT})
    answers = (*known, *others, *_OF_NO_EFFECT)
    counts = np.zeros((len(_TRUTHS), len(answers)), dtype=int)
    for one in drawn:
        counts[_TRUTHS.index(one.case.truth), answers.index(one.answer)] += 1
    figure, axes = grid(1, 1, width=9.5, height=9.0)
    axis = axes.flat[0]
    axis.grid(False)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for row, column in np.argwhere(counts):
        colour = "white" if shares[row, column] > 0.5 else "black"
        axis.text(column, row, str(counts[row, column]), color=colour,
                  ha="center", va="center", fontsize=8)  # fmt: skip
    words = [[name.replace("_", " ") for name in names] for names in (answers, _TRUTHS)]
    axis.set_xticks(range(len(answers)), words[0], rotation=60, ha="right", fontsize=8)
    axis.set_yticks(range(len(_TRUTHS)), words[1], fontsize=8)
    axis.set_xlabel("answer")
    axis.set_ylabel("hidden")
    for place in (len(LISTED), len(LISTED) + 1):
        axis.axhline(place - 0.5, color=GREY, linewidth=1)
    axis.axvline(len(LISTED) - 0.5, color=GREY, linewidth=1)
    return figure


def reliability_diagram(outcomes: Sequence[Outcome]) -> Figure:
    """Draw the share of true statements over the probability that they were given."""
    points = reliability(outcomes)
    figure, axes = grid(1, 1, width=5.0, height=4.5)
    axis = axes.flat[0]
    axis.plot([0.0, 1.0], [0.0, 1.0], color=GREY, linewidth=0.8, linestyle="--")
    said = [point for point, _ in points]
    values = [one.value for _, one in points]
    ends = [
        [one.value - one.low for _, one in points],
        [one.high - one.value for _, one in points],
    ]
    if points:
        axis.errorbar(said, values, np.abs(ends), fmt="o", color=BLUE, markersize=4, linewidth=1)
    level, last = 0, -1.0
    for point, one in sorted(points, key=lambda each: each[0]):
        # A number that would meet the last one stands a line lower.
        level = level + 1 if point - last < _APART else 0
        last = point
        axis.annotate(str(one.n), (point, one.value), xytext=(4, -9 - 9 * level),
                      textcoords="offset points", fontsize=7)  # fmt: skip
    axis.set_xlabel("mean probability said")
    axis.set_ylabel("share true")
    return figure
