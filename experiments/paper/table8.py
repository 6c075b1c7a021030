"""Tables 8 and 9 and Fig. 19: the designs that three preferences choose, and their scatter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from experiments.comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, grid
from experiments.paper.choices import (
    BAND,
    INITIAL,
    MODEL,
    TRUE_FRONT,
    Choice,
    dte_at,
    initial_choices,
    paper_choices,
    preferred_choices,
)
from experiments.paper.design_tables import deviation_table, dominated, influence_note, optima_table
from experiments.paper.models import FITTED, models_of
from experiments.paper.printed_times import of_the_first_page, times_table
from experiments.published_values import REEVALUATION_LIMITS, TABLE_8
from experiments.runner.registry import Context
from experiments.runner.result import (
    OF_MODELS,
    Cell,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    signed_percent,
    significant,
)
from experiments.runner.texts import paragraphs

N_SAMPLES = 100_000
SAMPLE_SEED = 2
ALIKE_PERCENT = 1.0
"""Moments within this of the paper's count as agreeing: less than any gain that Table 8 claims."""

(SETTING,) = paragraphs("table8", band=f"{100 * BAND:g}", alike_percent=f"{ALIKE_PERCENT:g}")


def run(context: Context) -> Result:
    """Choose, tabulate and re-evaluate the designs."""
    initial, preferred = initial_choices(), preferred_choices(context.campaign)
    ours = [choice for choice in preferred if choice.source != TRUE_FRONT]
    samples = {choice: dte_at(choice, N_SAMPLES, SAMPLE_SEED) for choice in (*initial, *ours)}
    return Result(
        title="Tables 8 and 9: the designs that three preferences choose",
        command="python -m experiments table8",
        paragraphs=(SETTING,),
        models=models_of(MODEL),
        tables=(
            _moments_table(initial, preferred),
            optima_table(preferred),
            _reevaluation_table(ours, samples),
            deviation_table(ours[0]),
            times_table(),
        ),
        pictures=(
            Picture(
                "densities",
                f"As Fig. 19: density of the DTE ({N_SAMPLES:,} samples on the surrogate) of the "
                "initial design and of the designs chosen from AMP-MOPSO's archive.",
                _densities(samples),
            ),
        ),
        notes=(influence_note(ours[1]),),
        first_page={**of_the_first_page(), OF_MODELS: dominated(MODEL)},
    )


def _moments_table(initial: Sequence[Choice], preferred: Sequence[Choice]) -> Table:
    theirs = paper_choices()
    rows = [tuple(_moment_cells(choice, initial)) for choice in (*initial, *theirs, *preferred)]
    columns = [Column("design"), Column("chosen from, or band")]
    for name in ("mean", "standard deviation"):
        columns += [
            Column("ours", "arcsec", 5, name),
            Column("paper", "arcsec", 5, name, paper=True),
            Column("from ±35 %", "%", 3, f"reduction of the {name}"),
            Column("from ±5 %", "%", 3, f"reduction of the {name}"),
            Column("paper", "%", 3, f"reduction of the {name}", paper=True),
        ]
    wide, narrow = initial
    ours = [choice for choice in preferred if choice.source != TRUE_FRONT]
    findings = (
        _moment_finding("At the paper's own designs", (narrow, *theirs), fitted=MODEL in FITTED),
        _moment_finding("At the designs chosen here", ours),
        _band_finding(wide, narrow, ours),
    )
    title = "Table 8: mean and standard deviation of the DTE"
    return Table("preferences", title, tuple(columns), tuple(rows), findings=findings)


def _moment_cells(choice: Choice, initial: Sequence[Choice]) -> Iterator[Cell]:
    yield from (choice.name, choice.source)
    paper = TABLE_8[choice.preference]
    for field in ("mean_arcsec", "std_arcsec"):
        value = getattr(choice.moments, field)
        yield from (value, getattr(paper, field))
        if choice in initial:
            yield from (None, None, None)
            continue
        for start in initial:
            yield _reduction(getattr(start.moments, field), value)
        yield _published_reduction(choice.preference, field)


def _reduction(before: float, after: float) -> float:
    return 100.0 * (before - after) / before


def _published_reduction(preference: str, field: str) -> float:
    return _reduction(getattr(TABLE_8[INITIAL], field), getattr(TABLE_8[preference], field))


def _moment_finding(where: str, choices: Sequence[Choice], *, fitted: bool = False) -> Finding:
    """Whether means and standard deviations are those of the paper."""
    ours = np.array([choice.moments for choice in choices])
    paper = np.array([TABLE_8[choice.preference] for choice in choices])
    means, stds = (100.0 * (ours - paper) / paper).T
    names = ", ".join(choice.name for choice in choices)
    return Finding(
        bool(max(np.abs(means).max(), np.abs(stds).max()) <= ALIKE_PERCENT),
        f"{where}, means differ from the paper's by {signed_percent(means)} and standard "
        f"deviations by {signed_percent(stds)} ({names}).",
        fitted=fitted,
        answers=not fitted,
    )


def _band_finding(wide: Choice, narrow: Choice, chosen: Sequence[Choice]) -> Finding:
    """Whether the reduction of scatter comes from optimising, as the paper has it."""
    robust = next(c for c in chosen if c.preference == "robustness_first")
    from_wide = _reduction(wide.moments.std_arcsec, robust.moments.std_arcsec)
    from_narrow = _reduction(narrow.moments.std_arcsec, robust.moments.std_arcsec)
    paper = _published_reduction("robustness_first", "std_arcsec")
    return Finding(
        from_narrow > 0.75 * from_wide,
        f"Robustness first reduces the standard deviation by {significant(from_wide, 3)} % from "
        f"the initial design at ±35 % but by {significant(from_narrow, 3)} % from the same design "
        f"at ±5 %; the paper prints {significant(paper, 3)} % and does not "
        "separate the two.",
    )


def _reevaluation_table(
    choices: Sequence[Choice], samples: dict[Choice, NDArray[np.float64]]
) -> Table:
    rows = []
    for choice in choices:
        values = samples[choice]
        mean, std = values.mean(), values.std(ddof=1)
        error = 100.0 * (mean - choice.moments.mean_arcsec) / choice.moments.mean_arcsec
        half_width = 1.96 * std / np.sqrt(len(values))
        deviation = std - choice.moments.std_arcsec
        rows.append((choice.name, float(mean), error, deviation, half_width))
    worst = np.abs([row[2:] for row in rows]).max(axis=0)
    limits = tuple(REEVALUATION_LIMITS.values())
    finding = Finding(
        bool(worst[0] < limits[0] and worst[1] < limits[1] and worst[2] < 1.5 * limits[2]),
        f"Sampled anew, means move by at most {significant(worst[0], 2)} %, standard deviations by "
        f"{significant(worst[1], 2)} arcsec, and the mean is known to "
        f"±{significant(worst[2], 2)} arcsec; the paper has below {limits[0]} %, below "
        f"{limits[1]} arcsec and about ±{limits[2]} arcsec.",
    )
    columns = (
        Column("design"),
        Column("mean, sampled", "arcsec", 5),
        Column("error of the mean", "%", 2),
        Column("deviation of the std", "arcsec", 2),
        Column("95 % half width of the mean", "arcsec", 2),
    )
    title = f"Re-evaluation with {N_SAMPLES:,} samples of the surrogate"
    return Table("reevaluation", title, columns, tuple(rows), findings=(finding,))


def _densities(samples: dict[Choice, NDArray[np.float64]]) -> Figure:
    figure, axes = grid(1, 1, width=7.5, height=4.2)
    axis = axes[0, 0]
    everything = np.concatenate(list(samples.values()))
    dte = np.linspace(everything.min(), everything.max(), 300)
    styles = zip((GREY, PINK, BLUE, GREEN, ORANGE), ("--", ":", "-", "-", "-"), strict=True)
    for (choice, values), (colour, line) in zip(samples.items(), styles, strict=True):
        density = gaussian_kde(values)(dte)
        axis.plot(dte, density, line, color=colour, linewidth=1.8, label=choice.label)
    axis.set_xlabel("DTE [arcsec]")
    axis.set_ylabel("probability density [1/arcsec]")
    axis.legend(fontsize=8, frameon=False)
    return figure
