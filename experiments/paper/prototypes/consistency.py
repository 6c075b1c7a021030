"""Our predictions of the five prototypes against all that the paper prints of their measurement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.paper.prototypes.printed_validation import (
    HIGHEST,
    LOWEST,
    MAE,
    MAPE_PERCENT,
    MAX_ERROR,
    MEAN_ERROR,
    MEAN_ERROR_INTERVAL,
    NUMBERS,
    R2,
    RMSE,
    Assignment,
    bounds,
    least_lead_unrounded,
    mean_error_interval,
    nearest_assignment,
)
from experiments.published_values import TABLE_6, TABLE_8
from pymoo_hdte._runner.result import WITHIN_PAPER, Cell, Column, Finding, Table, significant
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.units import ARCSEC
from pymoo_hdte.validation import ValidationMetrics, validation_metrics

NEAR = 0.5
"""Arcsec; printed statistics hold for our predictions if a change of this size makes them hold."""

INTERVAL_DIGITS = 0.005
"""Arcsec; by which rounding of MAE and RMSE moves the ends of the interval of the mean error."""

MEASURES = (
    ("mean_error", "mean error", "arcsec", MEAN_ERROR),
    ("mae", "MAE", "arcsec", MAE),
    ("rmse", "RMSE", "arcsec", RMSE),
    ("mape_percent", "MAPE", "%", MAPE_PERCENT),
    ("max_error", "max error", "arcsec", MAX_ERROR),
    ("r2", "R2", "", R2),
)
"""Field of `ValidationMetrics`, heading, unit, the paper's value."""


BestCases = Mapping[tuple[str, bool], Assignment | None]
"""By name of the model, and whether the ranking is to hold."""


class Change(NamedTuple):
    """By how much five predictions are changed, in arcsec."""

    rms: float
    largest: float


@dataclass(frozen=True)
class Prediction:
    """DTE of the five prototypes by one model, in arcsec, shape (5,)."""

    name: str
    model: NDArray[np.float64]
    surrogate: NDArray[np.float64]

    @property
    def lead(self) -> float:
        """Prediction for the prototype that measured highest less that for the lowest."""
        return float(self.model[NUMBERS.index(HIGHEST)] - self.model[NUMBERS.index(LOWEST)])

    def change(self, ranked: bool) -> Change | None:
        """Return the least change (RMS) that makes the printed statistics (and ranking) hold."""
        nearest = nearest_assignment(self.model, to="predicted", ranked=ranked)
        if nearest is None:
            return None
        moved = nearest.predicted - self.model
        return Change(float(np.sqrt(np.mean(moved**2))), float(np.abs(moved).max()))

    def best_case(self, ranked: bool) -> Assignment | None:
        """Return the nearest values that the paper can have measured, with its predictions."""
        return nearest_assignment(self.model, to="measured", ranked=ranked)


def bounds_table() -> Table:
    """Tabulate what holds for every set of measured values with the printed statistics."""
    limits = bounds()
    rows = (
        ("std of the errors (over n)", limits.residual_std),
        ("smallest error that one prototype can have", limits.smallest_residual),
        ("largest error (printed)", MAX_ERROR),
        ("largest difference between two errors", limits.largest_difference),
        ("mean of the measured DTE, near", limits.measured_mean),
        ("std of the measured DTE (over n)", limits.measured_std),
        ("least range, highest minus lowest measured DTE", limits.least_range),
        ("std of the predictions (over n), at least", limits.predicted_std[0]),
        ("std of the predictions (over n), at most", limits.predicted_std[1]),
        (f"least lead of the prediction for No. {HIGHEST} over No. {LOWEST}", limits.least_lead),
        ("the same, with all statistics rounded the worst way", least_lead_unrounded()),
    )
    note = (
        "Errors are measured minus predicted, all positive. Standard deviations follow from RMSE, "
        "MAE and R2; the extremes from how far five values of given mean and standard deviation "
        f"can lie apart. As No. {HIGHEST} measured highest and No. {LOWEST} lowest, the measured "
        "range, less what two errors can differ by, must already be in the predictions."
    )
    columns = (Column("what must hold"), Column("value", "arcsec", 4))
    title = "What the printed statistics imply for the five prototypes"
    return Table("implied", title, columns, rows, note=note, findings=(_interval_finding(),))


def _interval_finding() -> Finding:
    """Whether the printed interval of the mean error is that of the printed MAE and RMSE."""
    ours = np.array(mean_error_interval())
    apart = float(np.abs(ours - MEAN_ERROR_INTERVAL).max())
    return Finding(
        apart <= INTERVAL_DIGITS,
        f"MAE, RMSE and n = {len(NUMBERS)} give a 95 % interval of the mean error of "
        f"{ours[0]:.3f} to {ours[1]:.3f} arcsec (Student's t); the paper prints "
        f"{MEAN_ERROR_INTERVAL[0]} to {MEAN_ERROR_INTERVAL[1]}.",
        within_paper=True,
    )


def consistency_table(predictions: Sequence[Prediction]) -> Table:
    """Tabulate how far our predictions are from any that the printed facts allow."""
    least = bounds().least_lead
    changes = {p.name: (p.change(ranked=False), p.change(ranked=True)) for p in predictions}
    rows = tuple((p.name, p.lead, least, *_change_cells(changes[p.name])) for p in predictions)
    columns = [
        Column("model"),
        Column("ours", "arcsec", 4, f"lead of No. {HIGHEST} over No. {LOWEST}"),
        Column("at least", "arcsec", 4, f"lead of No. {HIGHEST} over No. {LOWEST}"),
    ]
    for until in ("statistics hold", "ranking holds, too"):
        group = f"least change until {until}"
        columns += [Column("RMS", "arcsec", 3, group), Column("largest", "arcsec", 3, group)]
    title = "Do our predictions fit any measured values that the paper can have?"
    note = (
        "Residuals all of one sign, their mean, RMSE and largest value, MAPE and R2 as printed; "
        f"the ranking puts No. {LOWEST} lowest and No. {HIGHEST} highest. A change of 0 would mean "
        "that measured values exist with which our predictions give all of them. The least change "
        "is found numerically, from several starts; the lead is a necessary condition in closed "
        "form."
    )
    findings = tuple(_consistency_finding(p, *changes[p.name], least=least) for p in predictions)
    return Table("consistency", title, tuple(columns), rows, note=note, findings=findings)


def _change_cells(changes: Sequence[Change | None]) -> Iterator[Cell]:
    for change in changes:
        yield from (None, None) if change is None else change


def _consistency_finding(
    prediction: Prediction, statistics: Change | None, ranked: Change | None, *, least: float
) -> Finding:
    holds = ranked is not None and ranked.rms <= NEAR
    return Finding(
        holds,
        f"The model {prediction.name} predicts No. {HIGHEST} at "
        f"{significant(prediction.lead, 3)} arcsec relative to No. {LOWEST}, and the printed facts "
        f"need at least +{significant(least, 3)}. To make its predictions fit the printed "
        f"statistics takes {_change(statistics)}, to fit the ranking as well {_change(ranked)}: "
        + ("measured values exist that fit." if holds else "no measured values fit as they are."),
    )


def _change(change: Change | None) -> str:
    if change is None:
        return "a change that the search did not find"
    return (
        f"a change of {significant(change.rms, 2)} arcsec (RMS; {significant(change.largest, 2)} "
        "at most)"
    )


def best_case_table(predictions: Sequence[Prediction], best_cases: BestCases) -> Table:
    """Tabulate our metrics against the most favourable of the measured values that can be."""
    rows: list[tuple[Cell, ...]] = []
    for prediction in predictions:
        for ranked, text in ((False, "statistics"), (True, "statistics and ranking")):
            best = best_cases[prediction.name, ranked]
            if best is not None:
                metrics = validation_metrics(prediction.model, best.measured)
                rows.append((prediction.name, text, *_metric_cells(metrics)))
    low, high = MEAN_ERROR_INTERVAL
    printed = [value for *_, value in MEASURES]
    rows.append(("paper", "its own measurements", printed[0], low, high, *printed[1:]))
    columns = [Column("model"), Column("measured values nearest to ours with the printed")]
    for _, heading, unit, _ in MEASURES:
        columns.append(Column(heading, unit, 4))
    columns[3:3] = [Column(end, "arcsec", 4, "95 % interval") for end in ("lower", "upper")]
    note = (
        "Our predictions against the nearest values that the paper can have measured: of those "
        "with the printed statistics, the search found none that gives a smaller RMSE."
    )
    title = "The best that our predictions could do against the paper's measurements"
    return Table("best_case", title, tuple(columns), tuple(rows), note=note)


def _metric_cells(metrics: ValidationMetrics) -> Iterator[float]:
    yield metrics.mean_error
    yield from metrics.mean_error_interval
    for field, *_ in MEASURES[1:]:
        yield getattr(metrics, field)


@dataclass(frozen=True)
class Demand:
    """What the design must do, if the DTE gains ``slope`` arcsec an arcsec of theta_s.

    ``by_design`` is the lead of No. 4 over No. 5 at equal theta_s, in arcsec.
    """

    case: str
    slope: float
    by_design: float


def excess() -> float:
    """Return by how much theta_s of No. 5, the lowest measured, exceeds that of No. 4, arcsec."""
    return TABLE_6[LOWEST].theta_s_arcsec - TABLE_6[HIGHEST].theta_s_arcsec


def reach() -> float:
    """Return how far the mean DTE moves over the box, from corner to corner, arcsec."""
    best = min(row.mean_arcsec for row in TABLE_8.values())
    return 2.0 * (TABLE_8["initial"].mean_arcsec - best)


def demands() -> list[Demand]:
    """Return what the design must do under several slopes of the DTE over theta_s."""
    static = np.array([prototype.theta_s_arcsec for prototype in TABLE_6.values()])
    limits = bounds()
    slopes = {
        "the DTE does not depend on theta_s": 0.0,
        "theta_s alone makes the predictions scatter": limits.predicted_std[0] / static.std(),
        "the DTE is proportional to theta_s": (
            TABLE_8["initial"].mean_arcsec * ARCSEC / hs_20_100().nominal.static_error
        ),
    }
    return [
        Demand(case, float(slope), float(limits.least_lead + slope * excess()))
        for case, slope in slopes.items()
    ]


def ranking_table() -> Table:
    """Tabulate what the design must do beside what it does in Table 8."""
    rows = tuple((d.case, d.slope, d.by_design, reach()) for d in demands())
    columns = (
        Column("if"),
        Column("DTE per theta_s", "", 3),
        Column("needed", "arcsec", 3, f"lead of No. {HIGHEST} by its design"),
        Column("twice the gain in Table 8", "arcsec", 3, f"lead of No. {HIGHEST} by its design"),
    )
    note = (
        "The slope in the middle row is the least at which theta_s alone makes predictions scatter "
        "as the statistics say. The optimisation starts at the centre of the box, so that a "
        "response linear in the design moves by twice its gain from corner to corner. Section 5.3 "
        "speaks of the measured mean DTE; it is taken for the measured DTE of Section 4."
    )
    title = f"Can No. {HIGHEST} measure highest and No. {LOWEST} lowest?"
    return Table("ranking", title, columns, rows, note=note, findings=(_ranking_finding(),))


def _ranking_finding() -> Finding:
    needed = [demand.by_design for demand in demands()]
    fits = min(needed) <= reach()
    return Finding(
        fits,
        f"That No. {HIGHEST} measured highest and No. {LOWEST} lowest, on which the validation by "
        f"D_i rests, {'fits' if fits else 'contradicts'} the tables. By the printed statistics, "
        f"the prediction for No. {HIGHEST} leads that for No. {LOWEST} by "
        f"{significant(bounds().least_lead, 3)} arcsec or more. As theta_s is "
        f"{significant(excess(), 2)} arcsec larger on No. {LOWEST}, the designs must move the DTE "
        f"by {significant(min(needed), 3)} to {significant(max(needed), 3)} arcsec. Over the "
        f"whole box they move the mean by some {significant(reach(), 2)}, twice the gain in Table "
        "8.",
        within_paper=True,
        answers=True,
    )


def of_the_first_page() -> dict[str, str]:
    """Say what the validation by D_i asks of the predictions, if the tables contradict it."""
    if _ranking_finding().agrees:
        return {}
    gain = 100.0 * reach() / 2.0 / TABLE_8["initial"].mean_arcsec
    lead = significant(bounds().least_lead, 3)
    return {
        WITHIN_PAPER: f"by the paper's own statistics, the prediction for prototype No. {HIGHEST} "
        f"must be at least {lead} arcsec above that for No. {LOWEST}, although theta_s is "
        f"{significant(excess(), 2)} arcsec larger on No. {LOWEST} and the optimisation moves the "
        f"mean by {significant(gain, 2)} % only: the validation by D_i contradicts the tables"
    }
