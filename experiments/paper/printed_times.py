"""The paper's computing times held against each other; no time of ours is among them.

A run of Section 5.1 evaluates POPULATION x GENERATIONS designs, each by MONTE_CARLO evaluations of
the surrogate, one after another or in one batch. The batch that the paper timed has this size.
Table 7 prints the time of a whole run on, as far as is said, the same machine.
"""

from __future__ import annotations

from experiments.published_values import (
    BATCH_MODEL_SECONDS,
    BATCH_SIZE,
    BATCH_SURROGATE_SECONDS,
    GENERATIONS,
    MODEL_SECONDS,
    MONTE_CARLO,
    POPULATION,
    SPEED_UPS,
    SURROGATE_SECONDS,
    TABLE_7,
)
from experiments.runner.result import WITHIN_PAPER, Column, Finding, Table, significant

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
