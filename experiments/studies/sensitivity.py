"""Which tolerance to tighten: Sobol indices, and what halving each scatter would gain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.paper.choices import (
    BAND,
    MODEL,
    design_indices,
    falls_when_halved,
    scatter_indices,
    study_designs,
)
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, grid
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import Cell, Column, Finding, Picture, Result, Table, significant
from pymoo_hdte.drive import PARAMETERS, PRESETS
from pymoo_hdte.surrogate import SobolIndices

MATTERS_PERCENT = 1.0
"""A variable with less than this total share of both mean and variance has hardly any influence."""

SMALLEST_DRAWN = 1e-4
"""Percent; smaller falls stand at the left edge of the figure."""

DECIMALS = 6
NEXT_TO_NOTHING = "0 stands for less than a millionth of a percent."

(SETTING,) = paragraphs("sensitivity", band=f"{100 * BAND:g}")


@dataclass(frozen=True)
class Study:
    """The scatter of the DTE at one design of one model."""

    model: str
    design: str
    tolerance: float
    indices: SobolIndices
    std: float
    falls: list[float]

    @property
    def label(self) -> str:
        """Design and band in words."""
        return f"{self.design}, ±{100 * self.tolerance:g} %"


def run(context: Context) -> Result:
    """Compute the indices at the initial and the chosen designs of every preset."""
    studies = [study for model in PRESETS for study in _studies(model)]
    influences = {model: design_indices(robust_problem(model)) for model in PRESETS}
    return Result(
        title="Sensitivity: which parameter causes the scatter of the DTE",
        command="python -m experiments sensitivity",
        paragraphs=(SETTING,),
        answer=_money_note(MODEL, studies),
        models=models_of(*PRESETS),
        tables=(_indices_table(studies), _halving_table(studies), _influence_table(influences)),
        pictures=(
            Picture(
                "money",
                "Which tolerance deserves money: how much the standard deviation of the DTE falls "
                "if the scatter of one parameter is halved. Logarithmic axis; falls below "
                f"{SMALLEST_DRAWN:g} % stand at its left end.",
                _figure(studies),
            ),
        ),
        notes=tuple(_money_note(model, studies) for model in PRESETS if model != MODEL),
    )


def _studies(model: str) -> Iterator[Study]:
    problem = robust_problem(model)
    for name, design, tolerance in study_designs(problem):
        indices = scatter_indices(problem, design, tolerance)
        std, falls = falls_when_halved(problem, design, tolerance)
        yield Study(model, name, tolerance, indices, std, falls)


def _indices_table(studies: Sequence[Study]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for study in studies:
        rows.append((study.model, study.label, *_in_pairs(study.indices)))
    columns = [Column("model"), Column("design, band")]
    for name in PARAMETERS:
        columns += [Column(kind, "%", 3, name) for kind in ("first", "total")]
    title = "Sobol indices of the DTE over its scatter"
    return Table("indices", title, tuple(columns), tuple(rows), note=NEXT_TO_NOTHING)


def _in_pairs(indices: SobolIndices) -> list[float]:
    """Return first and total index of each variable in turn, in percent."""
    return (
        np.round(100.0 * np.column_stack([indices.first, indices.total]), DECIMALS).ravel().tolist()
    )


def _halving_table(studies: Sequence[Study]) -> Table:
    rows = tuple(
        (
            study.model,
            study.label,
            study.std,
            *np.round(study.falls, DECIMALS),
            PARAMETERS[int(np.argmax(study.falls))],
        )
        for study in studies
    )
    heading = "fall of the std if this scatter is halved"
    columns = (
        Column("model"),
        Column("design, band"),
        Column("std of the DTE", "arcsec", 4),
        *[Column(name, "%", 3, heading) for name in PARAMETERS],
        Column("deserves money"),
    )
    title = "What halving one parameter's scatter gains"
    note = (
        "A negative fall is a rise: the parameter's scatter also shifts what the others do on "
        "average. "
    ) + NEXT_TO_NOTHING
    return Table("halving", title, columns, rows, note=note)


def _money_note(model: str, studies: Sequence[Study]) -> str:
    falls = np.array([s.falls for s in studies if s.model == model and s.tolerance == BAND])
    theirs = falls[:, 1:].max(axis=0)
    best = int(np.argmax(theirs))
    return (
        f"On {model}, with bands of ±{100 * BAND:g} %, halving the scatter of theta_s lowers the "
        f"standard deviation of the DTE by {_range(falls[:, 0])} %; halving any one of the "
        f"tolerances of the design variables lowers it by at most {significant(theirs[best], 2)} % "
        f"({PARAMETERS[1 + best]})."
    )


def _range(values: np.ndarray) -> str:
    ends = [significant(float(value), 3) for value in (values.min(), values.max())]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def _influence_table(influences: dict[str, dict[str, SobolIndices]]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for model, moments in influences.items():
        for moment, indices in moments.items():
            spread = float(np.sqrt(indices.variance))
            rows.append((model, moment, indices.mean, spread, *_in_pairs(indices)))
    columns = [
        Column("model"),
        Column("moment of the DTE"),
        Column("average", "arcsec or arcsec2", 4, "over the design box"),
        Column("std", "arcsec or arcsec2", 3, "over the design box"),
    ]
    for name in PARAMETERS[1:]:
        columns += [Column(kind, "%", 3, name) for kind in ("first", "total")]
    return Table(
        "influence",
        "Which design variable decides mean and variance of the DTE over the ±25 % design box",
        tuple(columns),
        tuple(rows),
        note=NEXT_TO_NOTHING,
        findings=(_influence_finding(influences[MODEL]),),
    )


def _influence_finding(moments: dict[str, SobolIndices]) -> Finding:
    largest = np.max([indices.total for indices in moments.values()], axis=0)
    matter = 100.0 * largest >= MATTERS_PERCENT
    shares = [
        f"{name} {significant(100.0 * float(share), 2)} %"
        for name, share in zip(PARAMETERS[1:], largest, strict=True)
    ]
    idle = "" if matter.all() else " The optimal value of the others carries no information."
    return Finding(
        bool(matter.all()),
        f"On {MODEL}, {matter.sum()} of {len(matter)} design variables have a total share of at "
        f"least {MATTERS_PERCENT:g} % in mean or variance of the DTE over the design box (larger "
        f"of the two: {', '.join(shares)}).{idle}",
        check=True,
    )


def _figure(studies: Sequence[Study]) -> Figure:
    figure, axes = grid(1, len(PRESETS), width=4.2, height=3.8)
    for model, axis in zip(PRESETS, axes[0], strict=True):
        _panel(axis, [study for study in studies if study.model == model])
        axis.set_title(model, fontsize=10)
    labelled = axes[0, 0].get_legend_handles_labels()
    figure.legend(*labelled, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def _panel(axis: Axes, studies: Sequence[Study]) -> None:
    styles = zip((GREY, PINK, BLUE, GREEN, ORANGE), ("s", "D", "o", "^", "v"), strict=True)
    places = np.arange(len(PARAMETERS))[::-1]
    offsets = np.linspace(0.28, -0.28, len(studies))
    for study, (colour, marker), offset in zip(studies, styles, offsets, strict=True):
        falls = np.maximum(study.falls, SMALLEST_DRAWN)
        axis.plot(falls, places + offset, marker, color=colour, markersize=5, label=study.label)
    for edge in places[:-1] - 0.5:
        axis.axhline(edge, color="#E4E8EC", linewidth=0.8)
    axis.grid(visible=False, axis="y")
    axis.set_xscale("log")
    axis.set_xlim(SMALLEST_DRAWN / 1.5, 150.0)
    axis.set_yticks(places, PARAMETERS)
    axis.set_xlabel("fall of the std of the DTE [%]")
