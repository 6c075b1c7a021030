"""Table 2, Figs. 4 and 5: error statistics of prototypes and the static error they give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from experiments.paper.static_error.statistics import (
    N_PROTOTYPES,
    N_REPEATS,
    NOISE_UM,
    OUTLIER_UM,
    PLANTED_CORRELATION,
    PLANTED_LOGNORMAL,
    PLANTED_PAIR,
    SYMBOLS,
    clean_campaign,
    detections,
    outlier_counts,
    power,
    prototypes,
    prototypes_needed,
    spoilt_readings,
)
from experiments.paper.static_error.tables import (
    common_sizes,
    component_picture,
    heat_maps,
    pooling_table,
    reading_table,
    sizes_table,
    statistic_table,
    total_picture,
)
from experiments.published_values import TABLE_2
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.statistics import at_least
from pymoo_hdte._runner.result import (
    WITHIN_PAPER,
    Cell,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    significant,
)
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.identification import (
    ErrorStatistics,
    detectable_correlation,
    error_statistics,
    largest_deviation,
)

SEED = 1
N_CAMPAIGNS = 200
CORRELATIONS = (0.3, 0.5, 0.7, 0.8, 0.9)

SETTING, PLANTED = paragraphs(
    "table2",
    n_prototypes=N_PROTOTYPES,
    n_repeats=N_REPEATS,
    noise_um=NOISE_UM,
    outlier_um=f"{OUTLIER_UM:g}",
    planted_correlation=PLANTED_CORRELATION,
    pair=" and ".join(PLANTED_PAIR),
    planted_lognormal=PLANTED_LOGNORMAL,
)


def run(context: Context) -> Result:
    """Measure virtual prototypes, test the printed statistics, and draw the static error."""
    rng = np.random.default_rng(SEED)
    clean = clean_campaign(rng)
    readings, planted = spoilt_readings(rng)
    spoilt = error_statistics(readings, SYMBOLS)
    drawn = prototypes()
    return Result(
        title="Table 2: error statistics, and the static error",
        command="python -m experiments table2",
        paragraphs=(SETTING, PLANTED),
        tables=(
            _statistics_table(clean),
            sizes_table(),
            pooling_table(N_CAMPAIGNS, rng),
            _outlier_table(readings, planted),
            _correlation_table(clean, rng),
            statistic_table(drawn),
            reading_table(drawn),
        ),
        pictures=(
            Picture(
                "correlations",
                "As Fig. 4: Pearson correlations of the errors, without and with the planted pair. "
                f"Framed: significant after Holm's adjustment, |r| above about "
                f"{detectable_correlation(N_PROTOTYPES, len(SYMBOLS)):.2f}.",
                heat_maps(clean, spoilt),
            ),
            component_picture(drawn),
            total_picture(drawn),
        ),
        first_page={WITHIN_PAPER: of_the_first_page()},
        notes=tuple(f"In the campaign with planted faults: {line}" for line in spoilt.advice()),
    )


def _statistics_table(statistics: ErrorStatistics) -> Table:
    sheet = {source.symbol: source for source in hs_20_100().error_sources}
    rows = []
    inside = 0
    for index, symbol in enumerate(SYMBOLS):
        paper, sample = TABLE_2[symbol], statistics.samples[index]
        mean_low, mean_high = sample.mean_interval()
        std_low, std_high = sample.std_interval()
        inside += mean_low <= paper.mean_um <= mean_high
        inside += std_low <= paper.std_um <= std_high
        tested: tuple[Cell, ...] = (
            statistics.shapiro_w[index],
            paper.shapiro_w,
            statistics.shapiro_p[index],
            paper.shapiro_p,
        )
        mean = (sample.mean, sample.mean_error, mean_low, mean_high, paper.mean_um)
        std = (sample.std, sample.std_error, std_low, std_high, paper.std_um)
        rows.append((sheet[symbol].component, symbol, *tested, *mean, *std))
    columns = [Column("component"), Column("error")]
    for name in ("W", "p"):
        columns += [Column("ours", "", 3, name), Column("paper", "", 3, name, paper=True)]
    for name in ("mean", "standard deviation"):
        columns += [
            Column("ours", "µm", 3, name),
            Column("standard error", "µm", 2, name),
            Column("95 % from", "µm", 3, name),
            Column("to", "µm", 3, name),
            Column("paper", "µm", 3, name, paper=True),
        ]
    normal = statistics.marginals.count("normal")
    findings = (
        Finding(
            at_least(inside, 2 * len(SYMBOLS), 0.95),
            f"{inside} of {2 * len(SYMBOLS)} printed means and standard deviations lie in our 95 % "
            "intervals, as they must: the prototypes were drawn from them.",
            check=True,
        ),
        Finding(
            normal == len(SYMBOLS),
            f"{normal} of {len(SYMBOLS)} errors pass for normal (Shapiro-Wilk over "
            f"{N_PROTOTYPES} prototypes, Holm's adjustment, 5 %).",
            check=True,
        ),
    )
    title = f"Table 2: {N_PROTOTYPES} virtual prototypes beside the printed statistics"
    return Table("errors", title, tuple(columns), tuple(rows), findings=findings)


def of_the_first_page() -> str:
    """Say how many values the printed tests belong to, and what the outlier rule removes."""
    low, high = common_sizes()
    return (
        f"W and p of all errors in Table 2 are those of {low} to {high} values, but only "
        f"{N_PROTOTYPES} prototypes were measured; none of {N_REPEATS} readings can lie beyond "
        f"{largest_deviation(N_REPEATS):.2f} standard deviations, so the 3-sigma rule of "
        "Section 2.1 removes nothing"
    )


def _outlier_table(readings: np.ndarray, planted: np.ndarray) -> Table:
    counts = outlier_counts(readings, planted)
    rows = tuple(
        (rule, count.found, count.planted, count.lost, count.good) for rule, count in counts.items()
    )
    pooled = counts["sigma pooled"]
    findings = (
        Finding(
            largest_deviation(N_REPEATS) > 3.0,
            f"The paper rejects outliers among {N_REPEATS} readings by the 3-sigma rule. No "
            f"reading of {N_REPEATS} can lie further than {largest_deviation(N_REPEATS):.2f} "
            f"standard deviations from their mean, or {(N_REPEATS - 1) ** 0.5:g} with n for n - 1 "
            "in the deviation: the rule as printed never rejects.",
            within_paper=True,
        ),
        Finding(
            pooled.found == pooled.planted
            and at_least(pooled.good - pooled.lost, pooled.good, 0.9973),
            f"With sigma pooled over the prototypes, {pooled.found} of {pooled.planted} planted "
            f"outliers are found and {pooled.lost} of {pooled.good} good readings are lost "
            "(0.27 % expected).",
            check=True,
        ),
    )
    columns = (
        Column("3-sigma rule with"),
        Column("found", group="planted outliers"),
        Column("of", group="planted outliers"),
        Column("lost", group="good readings"),
        Column("of", group="good readings"),
    )
    note = (
        "Samuelson's inequality: the deviations of the other n - 1 readings sum to minus that of "
        "the one, so that their squares sum to at least its square over n - 1. With the variance "
        "over n - 1, the one is (n - 1) / sqrt(n) standard deviations away at most."
    )
    return Table("outliers", "Rejection of outliers", columns, rows, note, findings)


def _correlation_table(clean: ErrorStatistics, rng: np.random.Generator) -> Table:
    rows = tuple((r, 100.0 * power(r, N_PROTOTYPES), prototypes_needed(r)) for r in CORRELATIONS)
    columns = (
        Column("true correlation", "", 2),
        Column(f"found by {N_PROTOTYPES} prototypes", "%", 2),
        Column("prototypes to find it in 90 %"),
    )
    findings = tuple(_correlation_findings(clean, rng))
    title = "What correlations a campaign can find"
    note = "Among 78 pairs at 5 %, Holm's adjustment; by Fisher's z."
    return Table("correlations", title, columns, rows, note, findings)


def _correlation_findings(clean: ErrorStatistics, rng: np.random.Generator) -> Iterator[Finding]:
    limit = detectable_correlation(N_PROTOTYPES, len(SYMBOLS))
    largest = np.abs(clean.correlation - np.eye(len(SYMBOLS))).max()
    yield Finding(
        power(0.5, N_PROTOTYPES) >= 0.9,
        f"The paper takes weak correlations for independence. With {N_PROTOTYPES} prototypes only "
        f"|r| above {limit:.2f} is significant among 78 pairs; independent errors alone reach "
        f"|r| = {largest:.2f} here. Independence is an assumption, not a result.",
        within_paper=True,
    )
    counts, alarms = detections(N_CAMPAIGNS, rng)
    yield Finding(
        at_least(counts, N_CAMPAIGNS, power(PLANTED_CORRELATION, N_PROTOTYPES))
        and at_least(N_CAMPAIGNS - alarms, N_CAMPAIGNS, 0.95),
        f"The planted correlation of {PLANTED_CORRELATION} is found in {counts} of {N_CAMPAIGNS} "
        f"campaigns, another pair in {alarms} ({significant(100 * alarms / N_CAMPAIGNS, 2)} %; 5 % "
        "are expected at most).",
        check=True,
    )
