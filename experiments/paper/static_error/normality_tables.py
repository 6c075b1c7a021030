"""Which sample size the printed Shapiro-Wilk tests belong to, and whether it may be readings."""

from __future__ import annotations

import numpy as np

from experiments.comparing.rates import at_least
from experiments.paper.static_error.normality import (
    implied_size,
    pooled_rejection_rate,
    possible_sizes,
    shapiro_p,
)
from experiments.paper.static_error.sources import N_PROTOTYPES, N_REPEATS, NOISE_UM
from experiments.published_values import TABLE_2
from experiments.runner.result import Column, Finding, Table

N_READINGS = N_PROTOTYPES * N_REPEATS
NOISE_RATIOS = (0.1, 0.3, 1.0, 3.0)
"""Standard deviation of a reading over that of the prototypes."""


def _possible_sizes() -> dict[str, tuple[int, int]]:
    return {s: possible_sizes(row.shapiro_w, row.shapiro_p) for s, row in TABLE_2.items()}


def common_sizes() -> tuple[int, int]:
    """Return the least and the greatest sample size that fits all printed tests."""
    ranges = _possible_sizes().values()
    return max(first for first, _ in ranges), min(last for _, last in ranges)


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
