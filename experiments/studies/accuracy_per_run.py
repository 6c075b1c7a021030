"""Accuracy for the cost: test error of several surrogates over their model runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure
from tqdm import tqdm

from experiments.comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, YELLOW, grid
from experiments.comparing.runs import robust_problem
from experiments.paper.table5 import N_TEST, TEST_SEED
from experiments.published_values import TABLE_5
from experiments.runner.result import Cell, Column, Finding, Table
from experiments.studies.rival_surrogates import FAMILIES, TENSOR, rivals
from pymoo_hdte.surrogate import accuracy, latin_hypercube

PAPER_ORDER = 3
PAPER_RUNS = 1024
ROUGHLY = 1.001
"""An RMSE within this factor of a target reaches it."""

STYLES = dict(
    zip(
        FAMILIES,
        (
            (BLUE, "o-"),
            (GREEN, "s-"),
            (PINK, "D--"),
            (GREY, "v--"),
            (ORANGE, "^--"),
            (YELLOW, "<--"),
        ),
        strict=True,
    )
)


@dataclass(frozen=True)
class Trial:
    """Test error in arcsec of one surrogate of one model."""

    model: str
    family: str
    order: int
    runs: int
    rmse: float
    max_error: float


def trials_of(models: Sequence[str]) -> Iterator[Trial]:
    """Build every surrogate of the models and test it on the first hypercube of Table 5."""
    for name in models:
        problem = robust_problem(name)
        box, model = problem.surrogate.box, problem.model
        points = latin_hypercube(box, N_TEST, TEST_SEED)
        actual = model.dte_arcsec(points)
        for rival in tqdm(
            rivals(model.dte_arcsec, box), desc=f"surrogates of {name}", delay=2.0, leave=False
        ):
            found = accuracy(rival.predict(points), actual)
            yield Trial(name, rival.family, rival.order, rival.runs, found.rmse, found.max_error)


def _models(trials: Sequence[Trial]) -> list[str]:
    return list(dict.fromkeys(trial.model for trial in trials))


def needed_table(trials: Sequence[Trial]) -> Table:
    """Tabulate the least model runs that reach the accuracy of the Chebyshev grid."""
    rows: list[tuple[Cell, ...]] = []
    for model in _models(trials):
        targets = _targets(model, trials)
        for family in STYLES:
            needed = [_least_runs(model, family, rmse, trials) for rmse in targets]
            rows.append((model, family, *needed))
    columns = (
        Column("model"),
        Column("surrogate"),
        Column(f"RMSE of the Chebyshev grid of {PAPER_RUNS}", group="least model runs to reach"),
        Column(
            f"the paper's RMSE, {TABLE_5[PAPER_ORDER].rmse_arcsec} arcsec",
            group="least model runs to reach",
        ),
    )
    note = "Among the orders tried, listed below. A dash: none of them reaches it."
    findings = tuple(_needed_finding(model, trials) for model in _models(trials))
    title = f"Are {PAPER_RUNS} runs needed?"
    return Table("needed", title, columns, tuple(rows), note=note, findings=findings)


def _targets(model: str, trials: Sequence[Trial]) -> tuple[float, float]:
    grids = (t for t in trials if (t.model, t.family) == (model, TENSOR))
    return next(t.rmse for t in grids if t.runs == PAPER_RUNS), TABLE_5[PAPER_ORDER].rmse_arcsec


def _least_runs(model: str, family: str, rmse: float, trials: Sequence[Trial]) -> int | None:
    reached = (
        t.runs
        for t in trials
        if (t.model, t.family) == (model, family) and t.rmse <= rmse * ROUGHLY
    )
    return min(reached, default=None)


def _needed_finding(model: str, trials: Sequence[Trial]) -> Finding:
    least = []
    for rmse in _targets(model, trials):
        runs = {family: _least_runs(model, family, rmse, trials) for family in STYLES}
        reached = {family: count for family, count in runs.items() if count is not None}
        best = min(reached, key=lambda family: reached[family], default=None)
        least.append(None if best is None else (reached[best], best))
    same, paper = least
    texts = [
        "none of the surrogates" if found is None else f"{found[0]} runs ({found[1]})"
        for found in (same, paper)
    ]
    fewer = any(found is not None and found[0] < PAPER_RUNS for found in least)
    return Finding(
        not fewer,
        f"On {model}, the accuracy of the Chebyshev grid of {PAPER_RUNS} runs is reached by "
        f"{texts[0]}, the RMSE that the paper prints for it by {texts[1]}; the paper spends "
        f"{PAPER_RUNS}.",
        answers=model == "calibrated",
    )


def trials_table(trials: Sequence[Trial]) -> Table:
    """Tabulate all test errors."""
    rows = tuple((t.model, t.family, t.order, t.runs, t.rmse, t.max_error) for t in trials)
    columns = (
        Column("model"),
        Column("surrogate"),
        Column("order or degree"),
        Column("model runs"),
        Column("RMSE", "arcsec", 3),
        Column("max error", "arcsec", 3),
    )
    title = f"Every surrogate tried, at {N_TEST} test points"
    return Table("surrogates", title, columns, rows, folded=True)


def error_over_runs(trials: Sequence[Trial]) -> Figure:
    """Draw the test error over the number of model runs, one panel a model."""
    figure, axes = grid(1, len(_models(trials)), width=5.2, height=4.0)
    for model, axis in zip(_models(trials), axes[0], strict=True):
        for family, (colour, style) in STYLES.items():
            chosen = [t for t in trials if (t.model, t.family) == (model, family)]
            runs, errors = [t.runs for t in chosen], [t.rmse for t in chosen]
            axis.loglog(runs, errors, style, color=colour, markersize=5, mfc="none", label=family)
        axis.axhline(TABLE_5[PAPER_ORDER].rmse_arcsec, color="black", linestyle=":", linewidth=1)
        axis.axvline(PAPER_RUNS, color="black", linestyle=":", linewidth=1)
        axis.yaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_major_formatter("{x:g}")
        axis.set_title(model, fontsize=10)
        axis.set_xlabel("model runs")
    axes[0, 0].set_ylabel("RMSE at the test points [arcsec]")
    labelled = axes[0, 0].get_legend_handles_labels()
    figure.legend(*labelled, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure
