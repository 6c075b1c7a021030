"""Tables 8 and 9 and Fig. 19: the designs that three preferences choose, and their scatter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from experiments.paper.choices import (
    BAND,
    INITIAL,
    MODEL,
    TRUE_FRONT,
    Choice,
    design_indices,
    dominating_shares,
    dte_at,
    initial_choices,
    paper_choices,
    preferred_choices,
)
from experiments.published_values import (
    BATCH_MODEL_SECONDS,
    BATCH_SIZE,
    BATCH_SURROGATE_SECONDS,
    DESIGN_BOX,
    GENERATIONS,
    MODEL_SECONDS,
    MONTE_CARLO,
    POPULATION,
    REEVALUATION_LIMITS,
    SPEED_UPS,
    SURROGATE_SECONDS,
    TABLE_6,
    TABLE_8,
    TABLE_9,
)
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, grid
from pymoo_hdte._comparing.models import FITTED, models_of
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import (
    OF_MODELS,
    WITHIN_PAPER,
    Cell,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    signed_percent,
    significant,
)
from pymoo_hdte.decision import deviation_degree, tolerance_band
from pymoo_hdte.drive import hs_20_100

DESIGNS = POPULATION * GENERATIONS
"""Designs that a run evaluates."""
HALF_DIGIT, BATCH_HALF_DIGIT = 0.5e-6, 0.5e-4
"""By which the printed times of the surrogate may be rounded, seconds."""


def run_seconds(batch: float = BATCH_SURROGATE_SECONDS) -> float:
    """Return how long the surrogate takes in a run, if so many seconds for one design."""
    return DESIGNS * batch * MONTE_CARLO / BATCH_SIZE


def least_run_seconds() -> float:
    """Return the same, if the printed times are rounded in the least favourable way."""
    single = (SURROGATE_SECONDS - HALF_DIGIT) * BATCH_SIZE
    return run_seconds(min(single, BATCH_SURROGATE_SECONDS - BATCH_HALF_DIGIT))


def longest_run() -> float:
    """Return the longest time of a run in Table 7, seconds."""
    return max(row.seconds for row in TABLE_7.values())


def times_table() -> Table:
    """Tabulate what the printed times give for a run, beside those of Table 7."""
    rows = (
        ("a run, by the time of one evaluation", run_seconds(SURROGATE_SECONDS * BATCH_SIZE)),
        (f"a run, by the time of {BATCH_SIZE:,} evaluations", run_seconds()),
        ("a run, with the times rounded the worst way", least_run_seconds()),
        *((f"a run of {name}, as Table 7 prints it", row.seconds) for name, row in TABLE_7.items()),
    )
    columns = (Column("time of"), Column("time", "s", 4))
    note = (
        f"{POPULATION} x {GENERATIONS} designs, {MONTE_CARLO:,} evaluations of the surrogate for "
        "each. Only batches larger than the one that was timed, with less time for each "
        "evaluation, could make both true."
    )
    title = "How long the surrogate takes in a run, by the printed times"
    return Table("printed_times", title, columns, rows, note=note, findings=(*_findings(),))


def _findings() -> tuple[Finding, Finding]:
    ratios = (
        MODEL_SECONDS / SURROGATE_SECONDS,
        BATCH_MODEL_SECONDS / BATCH_SURROGATE_SECONDS,
    )
    fits = all(round(ratio) == printed for ratio, printed in zip(ratios, SPEED_UPS, strict=True))
    return (
        Finding(
            least_run_seconds() <= longest_run(),
            f"{DESIGNS:,} designs at {BATCH_SURROGATE_SECONDS:.4f} s take "
            f"{significant(run_seconds(), 2)} s, and {significant(least_run_seconds(), 2)} s if "
            f"the times are rounded the worst way; the longest whole run of Table 7 takes "
            f"{longest_run()} s.",
            within_paper=True,
        ),
        Finding(
            fits,
            f"The printed times have the ratios {ratios[0]:,.0f} and {ratios[1]:,.0f}; the paper "
            f"prints {SPEED_UPS[0]:,} and {SPEED_UPS[1]:,}.",
            within_paper=True,
        ),
    )


def of_the_first_page() -> dict[str, str]:
    """Say that the evaluations of a run outlast the runs of Table 7, if they do."""
    if least_run_seconds() <= longest_run():
        return {}
    return {
        WITHIN_PAPER: f"a run's {DESIGNS:,} evaluations, at the printed "
        f"{BATCH_SURROGATE_SECONDS:.4f} s for {BATCH_SIZE:,} samples, take "
        f"{significant(run_seconds(), 2)} s, longer than any whole run of Table 7 (at most "
        f"{longest_run()} s)"
    }


VARIABLES = (
    ("K", "1e4 N.m/rad", 1e4),
    ("J_in", "1e-4 kg.m2", 1e-4),
    ("B_in", "1e-4 N.m.s/rad", 1e-4),
    ("B_fc", "1e-4 N.m.s/rad", 1e-4),
)
"""Name, unit of the tables, and that unit in SI."""

DESIGN_PERCENT = 10.0
HARDLY_ANY = 1e-4
"""A share of designs of which a random search with the paper's 10,000 evaluations finds one."""
PRINTED_DIGIT = 0.0005
"""Half of the last digit with which the paper prints D_i."""
SWEEP = 6
"""Values of the variable of least influence, ends of its box included."""


def optima_table(preferred: Sequence[Choice]) -> Table:
    """Table 9: optimal designs with their bands, ours and the paper's."""
    rows = [(choice.name, choice.source, *_with_bands(choice.design)) for choice in preferred]
    rows += [
        (name.replace("_", " "), "paper", *_with_bands(design)) for name, design in TABLE_9.items()
    ]
    columns = [Column("design"), Column("chosen from")]
    for name, unit, _ in VARIABLES:
        group = f"{name} [{unit}]"
        columns += [Column(part, "", 4, group) for part in ("optimum", "lower", "upper")]
    title = f"Table 9: optimal designs with their ±{100 * BAND:g} % bands"
    finding = _optima_finding([c for c in preferred if c.source != TRUE_FRONT])
    findings = (finding, box_finding(), *(_dominance_finding(model) for model in FITTED))
    return Table("optima", title, tuple(columns), tuple(rows), findings=findings)


def deviation_table(optimum: Choice) -> Table:
    """D_i of the five prototypes against the paper's accuracy-first optimum and against ours."""
    measured = np.array([prototype.design for prototype in TABLE_6.values()])
    published = np.array([prototype.deviation_degree for prototype in TABLE_6.values()])
    to_paper = deviation_degree(measured, TABLE_9["accuracy_first"])
    to_ours = deviation_degree(measured, optimum.design)
    rows = tuple(zip(TABLE_6, to_paper, published, to_ours, strict=True))
    columns = (
        Column("prototype"),
        Column("to the paper's optimum", digits=3),
        Column("as printed", digits=3, paper=True),
        Column("to our optimum", digits=3),
    )
    printed = np.abs(to_paper - published) <= PRINTED_DIGIT
    finding = Finding(
        bool(printed.all()),
        f"Against the paper's optimum, D_i comes out to the printed digit for {printed.sum()} "
        f"of {len(printed)} prototypes.",
        within_paper=True,
    )
    title = "Deviation degree D_i of the prototypes"
    note = _order_note(to_ours, published, optimum)
    return Table("deviation", title, columns, rows, note, (finding,))


def _order_note(
    to_ours: NDArray[np.float64], published: NDArray[np.float64], optimum: Choice
) -> str:
    """Say which prototypes are nearest and farthest, and how little that depends on the model."""
    numbers = list(TABLE_6)
    ours, theirs = ((numbers[d.argmin()], numbers[d.argmax()]) for d in (to_ours, published))
    name, share, swept = _idle_sweep(optimum)
    measured = np.array([prototype.design for prototype in TABLE_6.values()])
    degrees = np.array([deviation_degree(measured, design) for design in swept])
    nearest, farthest = (
        ", ".join(str(numbers[place]) for place in places)
        for places in (degrees.argmin(axis=1), degrees.argmax(axis=1))
    )
    return (
        f"Against our accuracy-first optimum the nearest prototype is No. {ours[0]} and the "
        f"farthest No. {ours[1]}; the paper has No. {theirs[0]}, which it measures with the lowest "
        f"DTE, and No. {theirs[1]}, with the highest. This counts for no agreement: D_i weighs "
        f"{name}, whose total share in mean and variance of the DTE is "
        f"{significant(100.0 * share, 1)} % at most, like the others. With {name} of the optimum "
        f"at {len(swept)} even steps over its box, the nearest is No. {nearest} and the farthest "
        f"No. {farthest}."
    )


def _idle_sweep(optimum: Choice) -> tuple[str, float, NDArray[np.float64]]:
    """Return the variable of least influence, its total share, and the optimum with it swept."""
    problem = robust_problem(MODEL)
    shares = np.max([indices.total for indices in design_indices(problem).values()], axis=0)
    axis = int(np.argmin(shares))
    swept = np.tile(optimum.design, (SWEEP, 1))
    swept[:, axis] = np.linspace(problem.xl[axis], problem.xu[axis], SWEEP)
    return VARIABLES[axis][0], float(shares[axis]), swept


def influence_note(centre: Choice) -> str:
    """Say how much each variable alone moves the mean over its box, from the design ``centre``."""
    problem = robust_problem(MODEL)
    parts = []
    for axis, (name, _, _) in enumerate(VARIABLES):
        swept = np.tile(centre.design, (101, 1))
        swept[:, axis] = np.linspace(problem.xl[axis], problem.xu[axis], 101)
        mean, std = np.ptp(problem.evaluate(swept), axis=0)
        parts.append(f"{name} {significant(mean, 2)} and {significant(std, 2)}")
    return (
        f"Range of mean and standard deviation in arcsec when one variable of the design '"
        f"{centre.label}' runs over its whole box: {', '.join(parts)}. The optimal value of a "
        "variable that moves next to nothing carries no information."
    )


def _with_bands(design: Sequence[float]) -> Iterator[Cell]:
    lower, upper = tolerance_band(np.array(design), BAND)
    for (_, _, unit), value, low, high in zip(VARIABLES, design, lower, upper, strict=True):
        yield from (value / unit, low / unit, high / unit)


def _optima_finding(choices: Sequence[Choice]) -> Finding:
    """Whether the optimal designs are those of the paper."""
    ours = np.array([choice.design for choice in choices])
    paper = np.array([TABLE_9[choice.preference] for choice in choices])
    percent = 100.0 * (ours - paper) / paper
    shifts = [
        f"{name} by {signed_percent(column)}"
        for (name, _, _), column in zip(VARIABLES, percent.T, strict=True)
    ]
    names = ", ".join(choice.name for choice in choices)
    return Finding(
        bool(np.abs(percent).max() <= DESIGN_PERCENT),
        f"The optima differ from the paper's in {', '.join(shifts)} ({names}).",
    )


def box_finding() -> Finding:
    """Whether the paper's optima lie in its own box, to the digits that it prints."""
    nominal = np.array(_nominal_design())
    printed = np.array(list(TABLE_9.values()))
    beyond = np.abs(printed / nominal - 1.0) - DESIGN_BOX
    half_digit = np.array([0.5e-3 * unit for _, _, unit in VARIABLES]) / nominal
    at_bound = [
        f"{variable} of {name.replace('_', ' ')}"
        for name, row in zip(TABLE_9, np.abs(beyond) <= half_digit, strict=True)
        for (variable, _, _), is_at in zip(VARIABLES, row, strict=True)
        if is_at
    ]
    inside = beyond <= half_digit
    return Finding(
        bool(inside.all()),
        f"{inside.sum()} of {inside.size} values of the paper's optima lie in its box of "
        f"±{100 * DESIGN_BOX:g} % to the printed digit; at a bound: "
        f"{', '.join(at_bound) or 'none'}.",
        within_paper=True,
    )


def _nominal_design() -> tuple[float, float, float, float]:
    nominal = hs_20_100().nominal
    return nominal.stiffness, nominal.input_inertia, nominal.input_damping, nominal.mesh_damping


def dominated(model: str) -> str:
    """Say which share of random designs dominates the paper's optima, for the first page."""
    shares = [significant(100.0 * share, 2) for share in sorted(dominating_shares(model).values())]
    return (
        f"on the model {model}, {shares[0]} to {shares[-1]} % of random designs are better in both "
        "mean and deviation than any given optimum of the paper: the paper optimised another "
        "model, or a surrogate of runs with errors"
    )


def _dominance_finding(model: str) -> Finding:
    """Whether the paper's optima are optimal on a model, as they are on the paper's own."""
    shares = dominating_shares(model)
    listed = ", ".join(f"{significant(100.0 * s, 2)} % ({name})" for name, s in shares.items())
    return Finding(
        max(shares.values()) <= HARDLY_ANY,
        f"On {model}, the share of random designs in the box that have both a smaller mean and a "
        f"smaller standard deviation than the paper's optimum is {listed}. The larger the share, "
        "the less can the paper's optimiser have worked on this model: a better design found here "
        "is then evidence against the model as well.",
    )


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
