"""Table 5 and Fig. 11: how well surrogates of order 2, 3 and 4 predict the drive model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.comparison.figures import BLUE, grid, reference_line
from experiments.comparison.runs import robust_problem
from experiments.paper.models import models_of
from experiments.published_values import TABLE_5
from experiments.runner.registry import Context
from experiments.runner.result import Cell, Column, Finding, Picture, Result, Table, significant
from pymoo_hdte.surrogate import Accuracy, ChebyshevSurrogate, accuracy, latin_hypercube

MODELS = ("calibrated", "resonant")
N_TEST = 500
TEST_SEED = 1
ALIKE = 1.25
"""Two errors within this factor of each other count as agreeing."""

MEASURES = (
    ("mae", "mae_arcsec", "MAE", "arcsec"),
    ("rmse", "rmse_arcsec", "RMSE", "arcsec"),
    ("mape_percent", "mape_percent", "MAPE", "%"),
    ("max_error", "max_error_arcsec", "max error", "arcsec"),
    ("r2", "r2", "R2", ""),
)
"""Field of `Accuracy`, field of the paper's Table 5, heading, unit."""

SETTING = (
    f"Each surrogate is fitted at its (k + 1)^5 Chebyshev nodes over the whole uncertain box and "
    f"tested at {N_TEST} Latin-hypercube points that none of them has seen."
)


@dataclass(frozen=True)
class Trial:
    """Predictions of one surrogate at the test points, in arcsec."""

    model: str
    order: int
    predicted: NDArray[np.float64]
    actual: NDArray[np.float64]

    @property
    def accuracy(self) -> Accuracy:
        """Error measures of Table 5."""
        return accuracy(self.predicted, self.actual)


def run(context: Context) -> Result:
    """Fit and test the three orders on both drive models."""
    progress = tqdm(total=len(MODELS) * len(TABLE_5), desc="table5", unit="surrogate", delay=2.0)
    with progress:
        trials = list(_trials(progress))
    return Result(
        title="Table 5: accuracy of the Chebyshev surrogate",
        command="python -m experiments table5",
        paragraphs=(SETTING,),
        models=models_of(*MODELS),
        tables=(_table(trials),),
        pictures=(
            Picture(
                "parity",
                "As Fig. 11: DTE predicted by the surrogate over the drive model's, at the test "
                "points.",
                _parity(trials),
            ),
        ),
    )


def _trials(progress: tqdm) -> Iterator[Trial]:
    for name in MODELS:
        problem = robust_problem(name)
        box = problem.surrogate.box
        points = latin_hypercube(box, N_TEST, TEST_SEED)
        actual = problem.model.dte_arcsec(points)
        for order in TABLE_5:
            surrogate = ChebyshevSurrogate.fit(problem.model.dte_arcsec, box, order)
            yield Trial(name, order, surrogate(points), actual)
            progress.update()


def _table(trials: list[Trial]) -> Table:
    rows = [tuple(_cells(trial)) for trial in trials]
    columns = [Column("model"), Column("k"), Column("model runs for the fit")]
    for _, _, heading, unit in MEASURES:
        digits = 5 if heading == "R2" else 4
        columns.append(Column("ours", unit, digits, heading))
        columns.append(Column("paper", unit, 4, heading, paper=True))
    title = f"Errors at {N_TEST} test points"
    findings = tuple(_findings(trials))
    return Table("accuracy", title, tuple(columns), tuple(rows), findings=findings)


def _cells(trial: Trial) -> Iterator[Cell]:
    yield from (trial.model, trial.order, (trial.order + 1) ** 5)
    for ours, paper, _, _ in MEASURES:
        yield getattr(trial.accuracy, ours)
        yield getattr(TABLE_5[trial.order], paper)


def _findings(trials: list[Trial]) -> Iterator[Finding]:
    orders = ", ".join(map(str, TABLE_5))
    paper = [row.rmse_arcsec for row in TABLE_5.values()]
    paper_best = min(TABLE_5, key=lambda k: TABLE_5[k].rmse_arcsec)
    for model in MODELS:
        ours = {t.order: t.accuracy.rmse for t in trials if t.model == model}
        ratios = [theirs / rmse for theirs, rmse in zip(paper, ours.values(), strict=True)]
        yield Finding(
            all(1 / ALIKE <= ratio <= ALIKE for ratio in ratios),
            f"On {model}, the RMSE at k = {orders} is {_list(ours.values())} arcsec against "
            f"{', '.join(map(str, paper))} in the paper.",
            answers=model == MODELS[0],
        )
        best = min(ours, key=ours.__getitem__)
        yield Finding(
            best == paper_best,
            f"On {model}, the most accurate order of the three is k = {best}; the paper finds "
            f"k = {paper_best} and takes the rise beyond it for overfitting.",
            answers=model == MODELS[0],
        )


def _list(values: Iterable[float]) -> str:
    return ", ".join(significant(value, 3) for value in values)


def _parity(trials: list[Trial]) -> Figure:
    figure, axes = grid(len(MODELS), len(TABLE_5), width=3.4, height=3.4)
    for trial, axis in zip(trials, axes.flat, strict=True):
        reference_line(axis, trial.actual, trial.predicted)
        axis.plot(trial.actual, trial.predicted, "o", color=BLUE, markersize=2.5, alpha=0.6)
        axis.set_aspect("equal", adjustable="datalim")
        measured = trial.accuracy
        axis.set_title(f"{trial.model}, k = {trial.order}", fontsize=10)
        label = f"RMSE {significant(measured.rmse, 3)} arcsec\nR2 {significant(measured.r2, 5)}"
        axis.text(0.04, 0.96, label, transform=axis.transAxes, va="top", fontsize=8)
        axis.set_xlabel("DTE, drive model [arcsec]")
        axis.set_ylabel("DTE, surrogate [arcsec]")
    return figure
