"""Tables 3 and 4, Figs. 9 and 10: stiffness and damping identified from records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.paper.bench.campaign import (
    COEFFICIENTS,
    N_PROTOTYPES,
    N_REPEATS,
    NOMINAL_STIFFNESS,
    TORSION,
    Records,
    draw_campaign,
    slope_error_per_noise,
    summaries,
)
from experiments.paper.later_prototypes import later_prototypes_table, of_the_first_page
from experiments.published_values import TABLE_3
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, ORANGE, PINK, grid
from pymoo_hdte._comparing.statistics import at_least, rate_p
from pymoo_hdte._runner.result import (
    Cell,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    significant,
)
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.identification import LinearFit, Series, hysteresis_width, lost_energy, stiffness
from pymoo_hdte.identification.damping import INPUT_SPEEDS, OUTPUT_SPEEDS
from pymoo_hdte.identification.prototypes import RunKey
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

BRANCHES = {
    "a1": ("forward loading", BLUE),
    "a2": ("forward unloading", ORANGE),
    "a3": ("reverse loading", GREEN),
    "a4": ("reverse unloading", PINK),
}


def torsion_loop(records: Records, key: RunKey) -> Figure:
    """Draw one loop, branch by branch, and what is left of it without the line of a1."""
    loop = records.loops[key]
    fit = stiffness(loop)
    residual = loop.torque - fit.intercept - fit.slope * loop.torsion
    figure, (axes,) = grid(1, 2, width=5.4, height=4.2)
    for name, samples in loop.branches.items():
        meaning, colour = BRANCHES[name]
        torsion = loop.torsion[samples] / ARCSEC
        for axis, torque in zip(axes, (loop.torque, residual), strict=True):
            label = f"{name}, {meaning}"
            axis.plot(torsion, torque[samples], ".", color=colour, markersize=3, label=label)
    ends = np.array([0.0, loop.torsion.max()])
    line = f"K = {fit.slope:.0f} ± {fit.slope_error:.0f} N.m/rad"
    axes[0].plot(ends / ARCSEC, fit.intercept + fit.slope * ends, "k-", linewidth=1, label=line)
    axes[0].set_ylabel("torque [N.m]")
    axes[1].set_ylabel("torque less the line of a1 [N.m]")
    axes[0].legend(fontsize=8, frameon=False)
    for axis in axes:
        axis.set_xlabel("torsion [arcsec]")
    return figure


def damping_lines(
    records: Records, fits: dict[str, dict[RunKey, LinearFit]], key: RunKey
) -> Figure:
    """Draw the runs of one prototype with the fitted lines."""
    bearing, complete, output = records.bearing[key], records.complete[key], records.output[key]
    figure, (axes,) = grid(1, 2, width=5.4, height=4.0)
    difference = complete.torque - bearing.torque
    _line(axes[0], bearing.speed, bearing.torque, fits["B_in"][key], BLUE, "B_in")
    _line(axes[0], bearing.speed, difference, fits["B_fc"][key], ORANGE, "B_fc")
    _line(axes[1], output.speed, output.torque, fits["B_out"][key], GREEN, "B_out")
    axes[0].set_xlabel("input speed [r/min]")
    axes[1].set_xlabel("output speed [r/min]")
    for axis in axes:
        axis.set_ylabel("no-load torque [mN.m]")
        axis.legend(fontsize=8, frameon=False, loc="upper left")
    return figure


def _line(
    axis: Axes, speed: np.ndarray, torque: np.ndarray, fit: LinearFit, colour: str, name: str
) -> None:
    at = speed / REVOLUTION_PER_MINUTE
    label = f"{name} = ({1e4 * fit.slope:.3f} ± {1e4 * fit.slope_error:.3f})e-4 N.m.s/rad"
    axis.plot(at, 1e3 * torque, "o", color=colour, markersize=5, mfc="none")
    line = 1e3 * (fit.intercept + fit.slope * speed)
    axis.plot(at, line, color=colour, linewidth=1.4, label=label)


SEED = 1
N_CAMPAIGNS = 200
SHOWN = (1, 1)
"""Prototype and repeat in the figures."""

SCALES = {"K": (1.0, "N.m/rad"), **dict.fromkeys(TABLE_3, (1e4, "1e-4 N.m.s/rad"))}
FRICTIONS = (0.0, 0.5, 1.5, 3.0)
"""Hysteretic torques of the drive on the torsion bench, N.m."""

SENSOR_SHARE = 1e-3
"""What a good torque sensor resolves, as a share of its range."""

SETTING, MEANING = paragraphs("table3", n_prototypes=N_PROTOTYPES, n_repeats=N_REPEATS)


def run(context: Context) -> Result:
    """Identify one virtual campaign, and judge the intervals on many."""
    rng = np.random.default_rng(SEED)
    records, _ = draw_campaign(rng)
    fits = records.fits()
    summaries_of = summaries(fits)
    return Result(
        title="Tables 3 and 4: identified stiffness and damping",
        command="python -m experiments table3",
        paragraphs=(SETTING, MEANING),
        first_page=of_the_first_page(),
        tables=(
            _coefficient_table(summaries_of),
            _nominal_table(summaries_of),
            _coverage_table(rng),
            _friction_table(rng),
            _resolution_table(),
            later_prototypes_table(),
        ),
        pictures=(
            Picture(
                "loop",
                "As Fig. 9: torque over torsion of one prototype with the branches that were "
                "found, and the same without the line of a1, which shows the hysteresis.",
                torsion_loop(records, SHOWN),
            ),
            Picture(
                "damping",
                "As Fig. 10: no-load torque over speed of one prototype, with the fitted lines and "
                "standard errors.",
                damping_lines(records, fits, SHOWN),
            ),
        ),
    )


def _coefficient_table(found: Mapping[str, Series]) -> Table:
    rows = []
    inside = []
    for name, series in found.items():
        scale, unit = SCALES[name]
        between, paper = series.between, TABLE_3.get(name)
        mean = paper.mean if paper else NOMINAL_STIFFNESS
        intervals = (between.mean_interval(), between.std_interval())
        for value, (low, high) in zip((mean, paper and paper.std), intervals, strict=True):
            if value is not None:
                inside.append(low <= value <= high)
        cells: list[Cell] = [name, unit]
        for value, interval, printed in zip(
            (between.mean, between.std), intervals, (mean, paper and paper.std), strict=True
        ):
            cells += [scale * value, *(scale * end for end in interval)]
            cells.append(None if printed is None else scale * printed)
        cells += [between.cv_percent, paper.cv_percent if paper else None]
        rows.append((*cells, scale * series.repeatability))
    columns = [Column("coefficient"), Column("unit")]
    for group in ("mean", "standard deviation over prototypes"):
        columns += [Column(part, "", 4, group) for part in ("ours", "95 % from", "to")]
        columns.append(Column("paper", "", 4, group, paper=True))
    columns += [Column("ours", "%", 3, "CV"), Column("paper", "%", 3, "CV", paper=True)]
    columns.append(Column("std of repeats", "", 2))
    finding = Finding(
        at_least(sum(inside), len(inside), 0.95),
        f"{sum(inside)} of {len(inside)} printed means and standard deviations lie in our 95 % "
        "intervals; the prototypes were drawn from them.",
        check=True,
    )
    title = f"Table 3: {N_PROTOTYPES} virtual prototypes beside the printed statistics"
    note = "The paper's mean of K stands in Table 4; it prints no standard deviation of K."
    return Table("coefficients", title, tuple(columns), tuple(rows), note, (finding,))


def _nominal_table(series: Mapping[str, Series]) -> Table:
    nominal = hs_20_100().nominal
    printed = {
        "theta_s": (nominal.static_error / ARCSEC, "arcsec", "from Eqs. (1) and (2), see table2"),
        "K": (nominal.stiffness, "N.m/rad", "torsion loop, a1"),
        "J_in": (nominal.input_inertia, "kg.m2", "CAD, not identified"),
        "B_in": (nominal.input_damping, "N.m.s/rad", "no-load runs"),
        "B_fc": (nominal.mesh_damping, "N.m.s/rad", "no-load runs"),
        "J_out": (nominal.output_inertia, "kg.m2", "CAD, not identified"),
        "B_out": (nominal.output_damping, "N.m.s/rad", "no-load runs"),
    }
    rows = []
    for name, (value, unit, source) in printed.items():
        ours = series[name].between if name in series else None
        cells = (ours.mean, ours.mean_error) if ours else (None, None)
        rows.append((name, unit, *cells, value, source))
    columns = (
        Column("parameter"),
        Column("unit"),
        Column("ours", "", 4),
        Column("standard error", "", 2),
        Column("paper", "", 5, paper=True),
        Column("source"),
    )
    return Table("nominal", "Table 4: nominal values", columns, tuple(rows))


def _coverage_table(rng: np.random.Generator) -> Table:
    kinds = ("one record", "mean of the series", "std of the series")
    covered = dict.fromkeys(((kind, name) for kind in kinds for name in COEFFICIENTS), 0)
    for _ in range(N_CAMPAIGNS):
        records, truth = draw_campaign(rng)
        fits = records.fits()
        for name, series in summaries(fits).items():
            trials = (
                (fits[name][SHOWN].slope_interval(), truth.first[name]),
                (series.between.mean_interval(), truth.mean[name]),
                (series.between.std_interval(), truth.std[name]),
            )
            for kind, ((low, high), true) in zip(kinds, trials, strict=True):
                covered[kind, name] += low <= true <= high
    rows = tuple(
        (name, kind, n, N_CAMPAIGNS, 100.0 * n / N_CAMPAIGNS, rate_p(n, N_CAMPAIGNS, 0.95))
        for (kind, name), n in covered.items()
    )
    counts = list(covered.values())
    rejected = sum(not at_least(count, N_CAMPAIGNS, 0.95) for count in counts)
    finding = Finding(
        rejected == 0,
        f"On {N_CAMPAIGNS} virtual campaigns the 95 % intervals cover the truth in "
        f"{100 * min(counts) / N_CAMPAIGNS:.1f} to {100 * max(counts) / N_CAMPAIGNS:.1f} %; a "
        f"one-sided exact binomial test at 1 % rejects {rejected} of the {len(counts)}.",
        check=True,
        answers=True,
    )
    columns = (
        Column("coefficient"),
        Column("interval of"),
        Column("covered"),
        Column("campaigns"),
        Column("coverage", "%", 3),
        Column("p of so few", "", 2),
    )
    title = "Coverage of the 95 % intervals"
    return Table("coverage", title, columns, rows, findings=(finding,))


def _friction_table(rng: np.random.Generator) -> Table:
    rows = []
    for friction in FRICTIONS:
        bench = replace(TORSION, friction_torque=friction)
        loop = bench.record(NOMINAL_STIFFNESS, rng)
        bias = bench.loading_stiffness(NOMINAL_STIFFNESS) / NOMINAL_STIFFNESS - 1.0
        width = 2.0 * friction / NOMINAL_STIFFNESS / ARCSEC
        rows.append(
            (
                friction,
                100.0 * round(bias, 6),
                hysteresis_width(loop) / ARCSEC,
                width,
                1e3 * lost_energy(loop),
            )
        )
    columns = (
        Column("hysteretic torque", "N.m", 2),
        Column("K of a1 above the spring's", "%", 2),
        Column("from the record", "arcsec", 3, "hysteresis width"),
        Column("2 T_f / K", "arcsec", 3, "hysteresis width"),
        Column("lost in a loop", "mJ", 3),
    )
    note = (
        "Friction turns over the first arcseconds of a1 and steepens its line: the slope of a1 is "
        "not the stiffness of the spring alone."
    )
    return Table("friction", "What hysteresis does to the loop", columns, tuple(rows), note)


def _resolution_table() -> Table:
    rated = hs_20_100().load_torque
    rows = []
    for name, paper in TABLE_3.items():
        speeds = OUTPUT_SPEEDS if name == "B_out" else INPUT_SPEEDS
        load = rated if name == "B_out" else rated / hs_20_100().ratio
        noise = paper.std * N_REPEATS**0.5 / slope_error_per_noise(name)
        rows.append((name, 1e3 * paper.mean * np.ptp(speeds), 1e3 * noise, 100.0 * noise / load))
    share = rows[-1][-1] / 100.0
    enough = share >= SENSOR_SHARE
    meaning = "which is enough" if enough else "so B_out needs one of its own"
    finding = Finding(
        enough,
        f"B_out raises the torque by {significant(rows[-1][1], 2)} mN.m from 2 to 20 r/min. The "
        f"scatter that Table 3 prints leaves no more than {significant(rows[-1][2], 2)} mN.m of "
        f"noise, {significant(1e6 * share, 2)} millionths of the rated {rated:g} N.m: a sensor for "
        f"the rated torque resolves about {1e6 * SENSOR_SHARE:g} millionths, {meaning}.",
        answers=True,
    )
    columns = (
        Column("coefficient"),
        Column("torque over the speed range", "mN.m", 3),
        Column("noise that the printed std allows", "mN.m", 3),
        Column("share of the rated torque there", "%", 2),
    )
    note = (
        "The printed standard deviation holds the scatter of the prototypes and the noise of the "
        f"mean of {N_REPEATS} runs; the noise alone cannot exceed it."
    )
    title = "The torque noise that Table 3 allows"
    return Table("resolution", title, columns, tuple(rows), note, (finding,))
