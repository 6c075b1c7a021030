"""Table 6, Figs 14 and 15: five prototypes, predicted, and what must hold for the measured ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.runs import robust_problem
from experiments.paper.models import models_of
from experiments.paper.prototypes.consistency import (
    Prediction,
    best_case_table,
    bounds_table,
    consistency_table,
)
from experiments.paper.prototypes.figures import bars, records_figure
from experiments.paper.prototypes.printed_validation import HIGHEST, LOWEST, NUMBERS
from experiments.paper.prototypes.ranking import of_the_first_page, ranking_table
from experiments.paper.prototypes.records import Record, record
from experiments.published_values import TABLE_6
from experiments.runner.registry import Context
from experiments.runner.result import (
    Column,
    Finding,
    Picture,
    Result,
    Table,
    significant,
)
from experiments.runner.texts import paragraphs
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.drive.measurement import CUTOFF, SAMPLING_RATE
from pymoo_hdte.units import ARCSEC

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
