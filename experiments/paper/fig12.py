"""Fig. 12: how the DTE of the nominal design is distributed, and what part theta_s has in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde, norm, skew

from experiments.paper.choices import scatter_indices
from experiments.paper.scatter import dte_samples
from experiments.published_values import TABLE_8, Moments
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, grid
from pymoo_hdte._comparing.models import FITTED, models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import Column, Finding, Picture, Result, Table, significant
from pymoo_hdte.drive import PRESETS

PAPER = TABLE_8["initial"]
BANDS = {0.35: "±35 %", 0.05: "±5 %", 0.0: "theta_s alone"}
"""What each half-width of the bands of K, J_in, B_in and B_fc is called."""

STYLES = {0.35: (BLUE, "-"), 0.05: (ORANGE, "--"), 0.0: (GREEN, ":")}
N_SAMPLES = 20_000
SEED = 3
ALIKE_PERCENT = 1.0
"""Differences that count as agreeing, as for Table 8."""

(SETTING,) = paragraphs("fig12", n_samples=f"{N_SAMPLES:,}")


@dataclass(frozen=True)
class Distribution:
    """DTE of one model's nominal design under one band, in arcsec."""

    model: str
    band: float
    moments: Moments
    theta_s_share: float
    samples: NDArray[np.float64]

    @property
    def alike(self) -> bool:
        """Whether mean and standard deviation are the paper's."""
        ratios = np.divide(self.moments, PAPER)
        return bool(np.all(np.abs(ratios - 1.0) <= ALIKE_PERCENT / 100.0))


def run(context: Context) -> Result:
    """Tabulate and draw the distributions."""
    distributions = [_distribution(model, band) for model in PRESETS for band in BANDS]
    return Result(
        title="Fig. 12: distribution of the DTE at the nominal design",
        command="python -m experiments fig12",
        paragraphs=(SETTING,),
        models=models_of(*PRESETS),
        tables=(_table(distributions),),
        pictures=(
            Picture(
                "distribution",
                "As Fig. 12: DTE of the nominal design. Histogram and blue curve: ±35 %; the grey "
                "line is the normal curve with the mean and the standard deviation that the paper "
                "prints.",
                _figure(distributions),
            ),
        ),
    )


def _distribution(model: str, band: float) -> Distribution:
    problem = robust_problem(model)
    indices = scatter_indices(problem, problem.nominal, band)
    return Distribution(
        model,
        band,
        Moments(indices.mean, float(np.sqrt(indices.variance))),
        float(indices.first[indices.names.index("theta_s")]),
        dte_samples(problem, problem.nominal, band, N_SAMPLES, SEED),
    )


def _table(distributions: Sequence[Distribution]) -> Table:
    rows = tuple(
        (
            entry.model,
            BANDS[entry.band],
            *entry.moments,
            *np.percentile(entry.samples, (2.5, 97.5)),
            float(skew(entry.samples)),
            100.0 * entry.theta_s_share,
        )
        for entry in distributions
    )
    paper = ("paper", "±35 %, as we read it", *PAPER, None, None, None, None)
    columns = (
        Column("model"),
        Column("K, J_in, B_in, B_fc"),
        Column("mean", "arcsec", 5),
        Column("std", "arcsec", 5),
        Column("2.5 %", "arcsec", 4, "percentile"),
        Column("97.5 %", "arcsec", 4, "percentile"),
        Column("skewness", "", 2),
        Column("variance due to theta_s alone", "%", 4),
    )
    title = "DTE at the nominal design"
    findings = tuple(_findings(distributions))
    return Table("distribution", title, columns, (*rows, paper), findings=findings)


def _findings(distributions: Sequence[Distribution]) -> Iterator[Finding]:
    for model in PRESETS:
        wide, narrow, _ = (entry for entry in distributions if entry.model == model)
        shown, moments = (
            f"{significant(e.moments.mean_arcsec, 4)} ± {significant(e.moments.std_arcsec, 4)} "
            f"arcsec with {BANDS[e.band]}"
            for e in (wide, narrow)
        )
        fitted = ", to which the model was fitted" if model in FITTED else ""
        yield Finding(
            wide.alike,
            f"On {model} the DTE of the nominal design (mean ± std) is {shown}; the paper prints "
            f"{PAPER.mean_arcsec} ± {PAPER.std_arcsec} arcsec. It is {moments}{fitted}.",
            answers=model == "calibrated",
        )


def _figure(distributions: Sequence[Distribution]) -> Figure:
    figure, axes = grid(1, len(PRESETS), width=4.2, height=3.6)
    for model, axis in zip(PRESETS, axes[0], strict=True):
        _panel(axis, [entry for entry in distributions if entry.model == model])
        axis.set_title(model, fontsize=10)
    axes[0, 0].set_ylabel("probability density [1/arcsec]")
    return figure


def _panel(axis: Axes, distributions: Sequence[Distribution]) -> None:
    wide = distributions[0]
    lowest, highest = np.percentile(wide.samples, (0.05, 99.95))
    lowest = min(lowest, PAPER.mean_arcsec - 3.0 * PAPER.std_arcsec)
    highest = max(highest, PAPER.mean_arcsec + 3.0 * PAPER.std_arcsec)
    dte = np.linspace(lowest, highest, 300)
    axis.plot(dte, norm.pdf(dte, *PAPER), color=GREY, linewidth=4, label="paper")
    axis.hist(wide.samples, bins=60, range=(lowest, highest), density=True, color=BLUE, alpha=0.25)
    for entry in distributions:
        colour, line = STYLES[entry.band]
        density = gaussian_kde(entry.samples)(dte)
        axis.plot(dte, density, line, color=colour, linewidth=1.8, label=BANDS[entry.band])
    axis.set_xlabel("DTE [arcsec]")
    axis.legend(fontsize=8, frameon=False)
