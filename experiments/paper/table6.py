"""Table 6, Figs 14 and 15: five prototypes, predicted, and what must hold for the measured ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from experiments.paper.prototypes.consistency import (
    Prediction,
    best_case_table,
    bounds_table,
    consistency_table,
    of_the_first_page,
    ranking_table,
)
from experiments.paper.prototypes.printed_validation import (
    HIGHEST,
    LOWEST,
    NUMBERS,
    Assignment,
    bounds,
)
from experiments.published_values import TABLE_6
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREY, ORANGE, grid
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import (
    Column,
    Finding,
    Picture,
    Result,
    Table,
    significant,
)
from pymoo_hdte.drive import PRESETS, DriveModel, low_pass, measured_dte, simulate_drive
from pymoo_hdte.drive.measurement import CUTOFF, SAMPLING_RATE
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True)
class Record:
    """One record at 1 kHz, a little longer than an output turn.

    Attributes
    ----------
    output_angle : ndarray, shape (n_times,)
        Nominal output angle, 0 where the turn begins, in degrees.
    raw, filtered : ndarray, shape (n_times,)
        Transmission error before and after the low pass, arcsec, without its mean.
    steady, integrated, sampled, measured : float
        DTE in arcsec: of the steady state, of the integrated motion, after sampling, and after
        sampling and filtering.
    ratio : float
    """

    output_angle: NDArray[np.float64]
    raw: NDArray[np.float64]
    filtered: NDArray[np.float64]
    steady: float
    integrated: float
    sampled: float
    measured: float
    ratio: float


def record(model: DriveModel, parameters: NDArray[np.float64]) -> Record:
    """Run a prototype, parameters (5,) in SI units, from rest and record one output turn."""
    run = simulate_drive(model, parameters)
    times = np.arange(run.time[0], run.time[-1], 1.0 / SAMPLING_RATE)
    error = CubicSpline(run.time, run.transmission_error)(times)
    angle = CubicSpline(run.time, run.input_angle)(times)
    offset = error.mean()
    turn = (angle >= 0.0) & (angle <= 2.0 * np.pi * run.ratio)
    return Record(
        output_angle=np.degrees(angle / run.ratio),
        raw=(error - offset) / ARCSEC,
        filtered=(low_pass(error) - offset) / ARCSEC,
        steady=float(model.dte_arcsec(parameters[None])[0]),
        integrated=run.dte_arcsec(),
        sampled=float(np.ptp(error[turn])) / ARCSEC,
        measured=measured_dte(angle, angle / run.ratio - error, run.ratio) / ARCSEC,
        ratio=run.ratio,
    )


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


RECORDED = (1, 2)
"""Prototypes whose records Fig. 14 shows."""

PICTURED = "calibrated"

(SETTING,) = paragraphs("table6")


def run(context: Context) -> Result:
    """Predict the prototypes, confront them with the printed statistics, record two of them."""
    predictions = [_prediction(name) for name in PRESETS]
    best_cases = {
        (p.name, ranked): p.best_case(ranked) for p in predictions for ranked in (False, True)
    }
    records = {
        (name, number): record(robust_problem(name).model, _parameters()[NUMBERS.index(number)])
        for name in PRESETS
        for number in RECORDED
    }
    allowed = {p.name: best_cases[p.name, True] for p in predictions}
    return Result(
        title="Table 6: five prototypes, predicted and measured",
        command="python -m experiments table6",
        paragraphs=(SETTING,),
        models=models_of(*PRESETS),
        first_page=of_the_first_page(),
        tables=(
            bounds_table(),
            ranking_table(),
            _predictions_table(predictions),
            consistency_table(predictions),
            best_case_table(predictions, best_cases),
            _records_table(records),
        ),
        pictures=(
            Picture(
                "records",
                f"As Fig. 14: simulated transmission error of prototypes No. 1 and 2 ({PICTURED}) "
                "over the whole output turn, and over the first three of its input turns.",
                records_figure({number: records[PICTURED, number] for number in RECORDED}),
            ),
            Picture(
                "bars",
                "As Fig. 15: predicted DTE of the five prototypes. Diamonds: those measured values "
                "with the paper's printed statistics and ranking that are nearest to the "
                "prediction; they are a best case, not measurements.",
                bars({p.name: p.model for p in predictions}, allowed),
            ),
        ),
    )


def _parameters() -> NDArray[np.float64]:
    return np.array([[p.theta_s_arcsec * ARCSEC, *p.design] for p in TABLE_6.values()])


def _prediction(name: str) -> Prediction:
    problem = robust_problem(name)
    parameters = _parameters()
    return Prediction(name, problem.model.dte_arcsec(parameters), problem.surrogate(parameters))


def _predictions_table(predictions: list[Prediction]) -> Table:
    rows = []
    for index, (number, prototype) in enumerate(TABLE_6.items()):
        pairs = ((p.model[index], p.surrogate[index]) for p in predictions)
        rows.append((number, prototype.theta_s_arcsec, *[dte for pair in pairs for dte in pair]))
    columns = [Column("prototype"), Column("theta_s", "arcsec", 5, paper=True)]
    for prediction in predictions:
        columns += [Column(by, "arcsec", 4, prediction.name) for by in ("model", "surrogate")]
    title = "Predicted DTE of the five prototypes"
    findings = tuple(_ranking_finding(prediction) for prediction in predictions)
    return Table("predictions", title, tuple(columns), tuple(rows), findings=findings)


def _ranking_finding(prediction: Prediction) -> Finding:
    lowest, highest = (
        NUMBERS[int(extreme)] for extreme in (prediction.model.argmin(), prediction.model.argmax())
    )
    return Finding(
        (lowest, highest) == (LOWEST, HIGHEST),
        f"The model {prediction.name} predicts the lowest DTE for prototype No. {lowest} and "
        f"the highest for No. {highest}; the paper measured the lowest on No. {LOWEST} and the "
        f"highest on No. {HIGHEST}.",
        answers=prediction.name == "calibrated",
    )


def _records_table(records: dict[tuple[str, int], Record]) -> Table:
    rows = tuple(
        (name, number, r.steady, r.integrated, r.sampled, r.measured, *_losses(r))
        for (name, number), r in records.items()
    )
    columns = (
        Column("model"),
        Column("prototype"),
        Column("steady state", "arcsec", 5, "DTE"),
        Column("integrated from rest", "arcsec", 5, "DTE"),
        Column(f"sampled at {SAMPLING_RATE:g} Hz", "arcsec", 5, "DTE"),
        Column(f"after the {CUTOFF:g} Hz low pass", "arcsec", 5, "DTE"),
        Column("sampling", "%", 2, "taken away by"),
        Column("filter", "%", 3, "taken away by"),
    )
    worst = max(abs(r.steady / r.integrated - 1.0) for r in records.values())
    losses = [_losses(r)[1] for r in records.values()]
    finding = Finding(
        worst <= 0.01,
        f"Integration from rest and steady state differ by at most {significant(100 * worst, 2)} %;"
        f" the filter takes away {significant(min(losses), 2)} to {significant(max(losses), 2)} % "
        "of the DTE.",
        check=True,
    )
    title = "Simulated records through the measurement chain"
    return Table("records", title, columns, rows, findings=(finding,))


def _losses(found: Record) -> tuple[float, float]:
    """Return what sampling and then filtering take away, in percent."""
    by_sampling = 100.0 * (1.0 - found.sampled / found.integrated)
    return by_sampling, 100.0 * (1.0 - found.measured / found.sampled)
