"""Fig. 5, and which statistic of it gives the printed static error."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.optimize import brentq
from scipy.stats import chi2, gaussian_kde, norm, shapiro

from experiments.paper.static_error.statistics import (
    ANGLES,
    ASSUMED_ANGLE,
    N_PROTOTYPES,
    N_REPEATS,
    N_SAMPLES,
    NOISE_UM,
    READINGS,
    AngleRange,
    Values,
    angle_ranges,
    components,
    of_component,
    sample_statistics,
    tooth_order_error,
)
from experiments.published_values import TABLE_2, TABLE_6
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, YELLOW, grid
from pymoo_hdte._comparing.statistics import at_least
from pymoo_hdte._runner.result import Cell, Column, Finding, Picture, Table, significant
from pymoo_hdte.drive import StaticErrorSample, hs_20_100
from pymoo_hdte.identification import ErrorStatistics
from pymoo_hdte.units import ARCSEC

TITLES = ("independent prototypes", "with a planted correlation")


def heat_maps(*campaigns: ErrorStatistics) -> Figure:
    """Draw the correlation matrix of each campaign; significant pairs are framed."""
    figure = Figure(figsize=(6.2 * len(campaigns), 5.6), layout="constrained")
    axes = figure.subplots(1, len(campaigns), squeeze=False)[0]
    for axis, campaign, title in zip(axes, campaigns, TITLES, strict=True):
        image = axis.imshow(campaign.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        for (i, j), value in _entries(campaign):
            colour = "white" if abs(value) > 0.6 else "black"
            axis.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6.5, color=colour)
        for i, j in campaign.correlated_pairs:
            for x, y in ((i, j), (j, i)):
                frame = Rectangle((x - 0.5, y - 0.5), 1, 1, fill=False, linewidth=2.5)
                axis.add_patch(frame)
        ticks = range(len(campaign.symbols))
        axis.set_xticks(ticks, campaign.symbols, rotation=60, fontsize=8)
        axis.set_yticks(ticks, campaign.symbols, fontsize=8)
        axis.set_title(title, fontsize=10)
    figure.colorbar(image, ax=axes, shrink=0.8, label="Pearson's r")
    return figure


def _entries(campaign: ErrorStatistics) -> list[tuple[tuple[int, int], float]]:
    size = len(campaign.symbols)
    return [((i, j), campaign.correlation[i, j]) for i in range(size) for j in range(size)]


SMALLEST, LARGEST = 12, 2000
"""Sample sizes for which the calibration below holds."""


def shapiro_p(w: float, n: float) -> float:
    """Return the p-value of the statistic ``w`` of ``n`` values, 12 <= n <= 2000.

    ln(1 - W) is about normal, with mean and standard deviation fitted to simulations (Royston,
    Applied Statistics 44, 1995, algorithm AS R94); SciPy uses the same fit but takes data only.
    """
    x = np.log(n)
    mean = -1.5861 - 0.31082 * x - 0.083751 * x**2 + 0.0038915 * x**3
    std = np.exp(-0.4803 - 0.082676 * x + 0.0030302 * x**2)
    return float(norm.sf((np.log1p(-w) - mean) / std))


def possible_sizes(w: float, p: float, half_digit: float = 5e-4) -> tuple[int, int]:
    """Return the least and greatest sample size that a printed pair ``w``, ``p`` allows.

    Both are known to ``half_digit``; p falls with n at fixed W.
    """
    low, high = w - half_digit, w + half_digit
    sizes = [
        n
        for n in range(SMALLEST, LARGEST + 1)
        if shapiro_p(low, n) <= p + half_digit and shapiro_p(high, n) >= p - half_digit
    ]
    return sizes[0], sizes[-1]


def implied_size(w: float, p: float) -> float:
    """Return the sample size at which the statistic ``w`` has the p-value ``p``, no whole number.

    Raises
    ------
    ValueError
        If there is none between 12 and 2000.
    """
    return float(brentq(lambda n: shapiro_p(w, n) - p, SMALLEST, LARGEST))


def pooled_rejection_rate(noise: float, n_trials: int, rng: np.random.Generator) -> float:
    """Return how often the test at 5 % rejects 20 x 10 pooled readings of a normal error.

    ``noise`` is the standard deviation of a reading in those of the prototypes. Ten readings of one
    prototype are no independent values, so the rate is not 5 %.
    """
    prototypes = rng.standard_normal((n_trials, 20, 1))
    readings = prototypes + noise * rng.standard_normal((n_trials, 20, 10))
    return float(np.mean([shapiro(trial.ravel()).pvalue < 0.05 for trial in readings]))


N_READINGS = N_PROTOTYPES * N_REPEATS
NOISE_RATIOS = (0.1, 0.3, 1.0, 3.0)
"""Standard deviation of a reading over that of the prototypes."""


def _possible_sizes() -> dict[str, tuple[int, int]]:
    return {s: possible_sizes(row.shapiro_w, row.shapiro_p) for s, row in TABLE_2.items()}


def common_sizes() -> tuple[int, int]:
    """Return the least and the greatest sample size that fits all printed tests."""
    ranges = _possible_sizes().values()
    return max(start for start, _ in ranges), min(end for _, end in ranges)


def sizes_table() -> Table:
    """Tabulate the sample sizes at which the printed W has the printed p."""
    ranges = _possible_sizes()
    rows = tuple(
        (
            symbol,
            row.shapiro_w,
            row.shapiro_p,
            shapiro_p(row.shapiro_w, N_PROTOTYPES),
            shapiro_p(row.shapiro_w, N_READINGS),
            implied_size(row.shapiro_w, row.shapiro_p),
            *ranges[symbol],
        )
        for symbol, row in TABLE_2.items()
    )
    low, high = common_sizes()
    finding = Finding(
        low <= N_PROTOTYPES <= high,
        f"All 13 printed pairs of W and p belong to samples of {low} to {high} values; none "
        f"fits the {N_PROTOTYPES} prototypes, at which every p would exceed 0.99. The number of "
        f"readings, {N_PROTOTYPES} x {N_REPEATS} = {N_READINGS}, fits all.",
        answers=True,
        within_paper=True,
    )
    columns = (
        Column("error"),
        Column("W", "", 3, paper=True),
        Column("p", "", 3, paper=True),
        Column(f"n = {N_PROTOTYPES}", "", 3, "p that belongs to W at"),
        Column(f"n = {N_READINGS}", "", 3, "p that belongs to W at"),
        Column("solved for n", "", 4),
        Column("from", group="n that fits the printed digits"),
        Column("to", group="n that fits the printed digits"),
    )
    title = "Which sample size the printed tests belong to"
    note = "p from W by Royston's calibration (1995), the one that SciPy uses."
    return Table("sizes", title, columns, rows, note, (finding,))


def pooling_table(n_campaigns: int, rng: np.random.Generator) -> Table:
    """Tabulate how often normal errors are rejected if the values are pooled readings."""
    rates = {ratio: pooled_rejection_rate(ratio, n_campaigns, rng) for ratio in NOISE_RATIOS}
    rows = tuple((ratio, 100.0 * rate) for ratio, rate in rates.items())
    likely = NOISE_UM / float(np.mean([row.std_um for row in TABLE_2.values()]))
    ratio = min(NOISE_RATIOS, key=lambda tried: abs(tried - likely))
    finding = Finding(
        at_least(round(n_campaigns * (1.0 - rates[ratio])), n_campaigns, 0.95),
        f"If the {N_READINGS} values are {N_REPEATS} readings of {N_PROTOTYPES} prototypes, with a "
        f"noise of {ratio:g} of their scatter (about {NOISE_UM} µm), the test rejects "
        f"{100 * rates[ratio]:.0f} % of errors that are normal. All 13 pass in the paper, as "
        f"{N_READINGS} independent values would, or readings whose noise outweighs the prototypes.",
        within_paper=True,
    )
    columns = (
        Column("noise of a reading / std of the prototypes", "", 2),
        Column("rejected at 5 %", "%", 3),
    )
    title = f"Shapiro-Wilk on {N_READINGS} pooled readings of normal errors"
    return Table("pooling", title, columns, rows, f"{n_campaigns} campaigns each.", (finding,))


PRINTED = round(hs_20_100().nominal.static_error / ARCSEC, 3)
"""theta_s of Table 4, arcsec."""

WITHIN_PERCENT = 1.0
COLOURS = (BLUE, ORANGE, GREEN, PINK, YELLOW)
OUTPUT_TURN = "peak-to-peak, output turn"


def statistic_table(drawn: StaticErrorSample) -> Table:
    """Set the mean of every statistic at every pressure angle beside the printed theta_s."""
    reading = READINGS[0]
    means = {angle: sample_statistics(reading.sample(angle, drawn)) for angle in ANGLES}
    ranges = angle_ranges(reading, drawn, PRINTED)
    rows = []
    for name, values in means[ASSUMED_ANGLE].items():
        at_angles = [means[angle][name].mean() for angle in ANGLES]
        normality = shapiro(values).pvalue
        rows.append((name, *at_angles, values.std(ddof=1), normality, *_cells(ranges[name])))
    columns = (
        Column("statistic of theta_s"),
        *(Column(f"{angle:g}°", "arcsec", 4, "mean at pressure angle") for angle in ANGLES),
        Column("std", "arcsec", 3, f"at {ASSUMED_ANGLE:g}°"),
        Column("Shapiro-Wilk p", "", 2, f"at {ASSUMED_ANGLE:g}°"),
        *_angle_columns(),
    )
    title = f"Which statistic of theta_s is {PRINTED} arcsec, and at which pressure angle"
    note = (
        f"{N_SAMPLES} prototypes of Table 2, phases independent and uniform; factor "
        f"{reading.name}. The range of angles is what two samples of {N_SAMPLES} cannot tell "
        "apart. Order 404 is added as twice its amplitude, at most "
        f"{significant(tooth_order_error(drawn), 1)} arcsec above the exact peak-to-peak. The sum "
        "of the amplitudes is the largest |theta_s| that ever occurs."
    )
    findings = tuple(_statistic_findings(means[ASSUMED_ANGLE], ranges))
    return Table("statistics", title, columns, tuple(rows), note, findings)


def reading_table(drawn: StaticErrorSample) -> Table:
    """Show every statistic under the other readings of Eqs. (1) and (2)."""
    readings = READINGS[1:]
    statistics = {r: sample_statistics(r.sample(ASSUMED_ANGLE, drawn)) for r in readings}
    ranges = {r: angle_ranges(r, drawn, PRINTED) for r in readings}
    rows = tuple(
        (name, *(c for r in readings for c in (statistics[r][name].mean(), ranges[r][name].exact)))
        for name in statistics[readings[0]]
    )
    columns = [Column("statistic of theta_s")]
    for reading in readings:
        columns += [
            Column(f"mean at {ASSUMED_ANGLE:g}°", "arcsec", 4, reading.name),
            Column(f"angle for {PRINTED} arcsec", "deg", 3, reading.name),
        ]
    title = "The same under other readings of the factor and the phases"
    note = (
        "The text of Eq. (2) has lost its fraction. Eq. (1) has one phase for each class; with it, "
        "the errors of a class add up as numbers, otherwise as vectors."
    )
    return Table("readings", title, tuple(columns), rows, note, folded=True)


def component_picture(drawn: StaticErrorSample) -> Picture:
    """Show the errors of every component, and theta_s if there were no others."""
    names = components(drawn.sheet)
    figure, axes = grid(2, len(names), width=3.5, height=2.9)
    for name, (upper, lower) in zip(names, axes.T, strict=True):
        alone = of_component(drawn, name)
        members = [
            (source.symbol, drawn.magnitudes[:, index] * 1e6)
            for index, source in enumerate(drawn.sheet.error_sources)
            if source.component == name
        ]
        for (symbol, values), colour in zip(members, COLOURS, strict=False):
            _density(upper, values, colour, symbol)
        _density(lower, sample_statistics(alone)[OUTPUT_TURN], BLUE, "without order 404")
        upper.set_title(name, fontsize=10)
        upper.set_xlabel("error [µm]")
        lower.set_xlabel("theta_s of this component alone [arcsec]")
        for axis in (upper, lower):
            axis.set_ylim(bottom=0.0)
            axis.legend(fontsize=7, frameon=False)
    axes[0, 0].set_ylabel("density [1/µm]")
    axes[1, 0].set_ylabel("density [1/arcsec]")
    caption = (
        "As Fig. 5a-d, above: distribution of the errors of each component. Below: peak-to-peak of "
        "theta_s over an output turn if only this component had errors."
    )
    return Picture("components", caption, figure)


def total_picture(drawn: StaticErrorSample) -> Picture:
    """Show the distribution of theta_s under several statistics."""
    figure, axes = grid(1, 1, width=7.5, height=4.0)
    axis = axes[0, 0]
    statistics = sample_statistics(READINGS[0].sample(ASSUMED_ANGLE, drawn))
    shown = [name for name in statistics if name.startswith("peak-to-peak")]
    shown.append("sum of the order amplitudes, with order 404")
    for name, colour in zip(shown, COLOURS, strict=True):
        _density(axis, statistics[name], colour, f"{name}, mean {statistics[name].mean():.1f}")
    axis.axvline(PRINTED, color="black", linewidth=1, linestyle="--", label=f"Table 4: {PRINTED}")
    for number, prototype in TABLE_6.items():
        label = "prototypes 1-5 of Table 6" if number == 1 else None
        axis.plot(prototype.theta_s_arcsec, 0.0008, "k|", markersize=12, label=label)
    axis.set_xlabel("theta_s [arcsec]")
    axis.set_ylabel("density [1/arcsec]")
    axis.set_ylim(bottom=0.0)
    axis.legend(fontsize=8, frameon=False)
    caption = (
        f"As Fig. 5e: distribution of theta_s over {N_SAMPLES} prototypes, pressure angle "
        f"{ASSUMED_ANGLE:g}°, under five statistics."
    )
    return Picture("static_error", caption, figure)


def _statistic_findings(
    at_assumed: dict[str, Values], ranges: dict[str, AngleRange]
) -> Iterator[Finding]:
    means = {name: float(values.mean()) for name, values in at_assumed.items()}
    nearest = min(means, key=lambda name: abs(means[name] - PRINTED))
    compatible = [n for n, r in ranges.items() if _holds(r, ASSUMED_ANGLE)]
    yield Finding(
        abs(means[nearest] / PRINTED - 1.0) <= WITHIN_PERCENT / 100.0,
        f"At {ASSUMED_ANGLE:g}° the statistic nearest to the printed {PRINTED} arcsec is the "
        f"{nearest} with {means[nearest]:.2f}; {len(compatible)} of {len(ranges)} statistics agree "
        "within sampling error. One in twelve can do so by chance, so none is chosen here.",
    )
    exact = [f"{n} at {r.exact:.1f}°" for n, r in ranges.items() if r.exact is not None]
    yield Finding(
        any(_holds(ranges[OUTPUT_TURN], angle) for angle in ANGLES),
        "The peak-to-peak over an output turn, by which the paper defines its dynamic error, needs "
        f"a pressure angle of {ranges[OUTPUT_TURN].exact:.1f}°, far above that of gears. Exactly "
        f"{PRINTED} arcsec come from: {'; '.join(exact)}.",
    )
    measured = np.array([prototype.theta_s_arcsec for prototype in TABLE_6.values()])
    scatter = float(at_assumed[OUTPUT_TURN].std(ddof=1) / at_assumed[OUTPUT_TURN].mean())
    ratio = float(measured.std(ddof=1) / measured.mean()) / scatter
    p = float(chi2.cdf((len(measured) - 1) * ratio**2, len(measured) - 1))
    yield Finding(
        p >= 0.05,
        f"The five prototypes of Table 6 scatter by {100 * ratio * scatter:.0f} % of their mean "
        f"({measured.mean():.1f} arcsec), independent phases give {100 * scatter:.0f} %: so little "
        f"scatter among five has a probability of {significant(p, 2)}.",
        within_paper=True,
    )


def _holds(arc: AngleRange, angle: float) -> bool:
    return arc.low is not None and arc.high is not None and arc.low <= angle <= arc.high


def _cells(interval: AngleRange) -> tuple[Cell, ...]:
    return interval.exact, interval.low, interval.high


def _angle_columns() -> tuple[Column, ...]:
    group = f"pressure angle for {PRINTED} arcsec"
    return tuple(Column(name, "deg", 3, group) for name in ("exact", "95 % from", "to"))


def _density(axis: Axes, values: Values, colour: str, label: str) -> None:
    at = np.linspace(0.9 * values.min(), 1.05 * values.max(), 300)
    axis.plot(at, gaussian_kde(values)(at), color=colour, linewidth=1.6, label=label)
    axis.axvline(values.mean(), color=GREY, linewidth=0.6)
