"""What came out of the blind campaigns, in a sentence."""

from __future__ import annotations

from experiments.comparing.statistics import Estimate, rate
from experiments.runner.result import significant
from experiments.studies.blind.runs import Counts


def in_one_sentence(counts: Counts) -> str:
    """Say how many unqualified answers were wrong, and how much was found."""
    words = found(counts)
    return f"{words[0].upper()}{words[1:]}."


def of_the_first_page(counts: Counts) -> str:
    """Say the same as part of a longer sentence."""
    return f"a workflow that says what a drive model lacks beside measurements: {found(counts)}"


def found(counts: Counts, *, intervals: bool = True) -> str:
    """Say it beginning in lower case, with exact 95 % intervals on request."""
    wrong, single, both = (
        rate(counts.plain_wrong, counts.plain),
        rate(counts.single_right, counts.single),
        rate(counts.pair_both, counts.pair),
    )
    ends = [f" ({in_percent(one)})" if intervals else "" for one in (wrong, single, both)]
    return (
        f"in blind tests against an independent simulator, {counts.plain_wrong} of {counts.plain} "
        f"unqualified answers were wrong{ends[0]}; {counts.single_right} of {counts.single} single "
        f"effects{ends[1]} and {100.0 * both.value:.0f} % of pairs{ends[2]} were identified"
    )


def in_percent(one: Estimate) -> str:
    """Write an interval in per cent, with three digits."""
    low, high = (significant(100.0 * end, 3) for end in (one.low, one.high))
    return f"{low} to {high} %"
