"""Rates and medians with their intervals, held against what must be reached.

A target is missed only where an exact one-sided test at `LEVEL` rejects it (design section 8). Both
tests are binomial: the median is at least m if at least half of all cases are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, quantile_test

from experiments.blind import cases as required
from experiments.blind.data import Outcome

LEVEL = 0.01


@dataclass(frozen=True)
class Estimate:
    """A rate or a median of n cases with its exact 95 % interval."""

    value: float
    low: float
    high: float
    n: int


@dataclass(frozen=True)
class Judged:
    """A demand, what was measured, and whether the two contradict each other.

    Attributes
    ----------
    what, cases : str
    at_least : bool
        Whether more is better.
    required : float
    measured : Estimate
    p_value : float
        Of the demand being true.
    """

    what: str
    cases: str
    at_least: bool
    required: float
    measured: Estimate
    p_value: float

    @property
    def met(self) -> bool:
        """Whether no test rejects the demand."""
        return self.p_value >= LEVEL

    @property
    def verdict(self) -> str:
        """In words: met by the measured figure itself, by its interval only, missed, or not run."""
        if self.measured.n == 0:
            return "not run"
        beyond = self.measured.value - self.required
        if beyond == 0.0 or (beyond > 0.0) == self.at_least:
            return "met"
        return "within chance" if self.met else "missed"


def select(outcomes: Sequence[Outcome], kind: str, name: str | None = None) -> list[Outcome]:
    """Return the outcomes of a kind, and of one truth where it is given."""
    of_kind = [one for one in outcomes if one.case.kind == kind]
    return of_kind if name is None else [one for one in of_kind if one.case.truth == name]


def rate(flags: Sequence[bool]) -> Estimate:
    """Return the share of true flags; its interval is that of Clopper and Pearson."""
    n, hits = len(flags), sum(map(bool, flags))
    if n == 0:
        return Estimate(np.nan, 0.0, 1.0, 0)
    interval = binomtest(hits, n).proportion_ci(method="exact")
    return Estimate(hits / n, float(interval.low), float(interval.high), n)


def median(values: Sequence[float | None]) -> Estimate:
    """Return the median of the values that there are; its interval is between two of them.

    Ends are infinite where too few values leave one open.
    """
    known = np.array([value for value in values if value is not None])
    if not known.size:
        return Estimate(np.nan, -np.inf, np.inf, 0)
    interval = quantile_test(known).confidence_interval()
    low = interval.low if np.isfinite(interval.low) else -np.inf
    high = interval.high if np.isfinite(interval.high) else np.inf
    return Estimate(float(np.median(known)), float(low), float(high), len(known))


def judge_rate(
    what: str, cases: str, flags: Sequence[bool], required: float, at_least: bool = True
) -> Judged:
    """Hold a rate against what it must reach or must not exceed."""
    side = "less" if at_least else "greater"
    n = len(flags)
    p_value = binomtest(sum(map(bool, flags)), n, required, alternative=side).pvalue if n else 1.0
    return Judged(what, cases, at_least, required, rate(flags), float(p_value))


def judge_median(
    what: str, cases: str, values: Sequence[float | None], required: float, at_least: bool = True
) -> Judged:
    """Hold a median against what it must reach or must not exceed."""
    known = [value for value in values if value is not None]
    side = "less" if at_least else "greater"
    p_value = quantile_test(known, q=required, alternative=side).pvalue if known else 1.0
    return Judged(what, cases, at_least, required, median(known), float(p_value))


def demands(outcomes: Sequence[Outcome]) -> Iterator[Judged]:
    """Judge everything that must be reached but the time."""
    single, listed = select(outcomes, "single"), "one listed effect"
    clean, unlisted = select(outcomes, "none"), select(outcomes, "unlisted")
    yield judge_rate(
        "first name or class right", listed, [one.right for one in single], required.LEAST_RIGHT
    )
    for kind, words in (
        ("single", listed),
        ("pair", "two listed effects"),
        ("unlisted", "one unlisted effect"),
    ):
        yield judge_rate(
            "wrong name with confidence",
            words,
            [one.wrong_confident for one in select(outcomes, kind)],
            required.MOST_WRONG_CONFIDENT,
            at_least=False,
        )
    yield judge_rate(
        "alarm",
        "nothing hidden",
        [not one.right_answer for one in clean],
        required.MOST_ALARMS,
        at_least=False,
    )
    yield judge_rate(
        "noticed as unlisted",
        "one unlisted effect",
        [one.right_answer for one in unlisted],
        required.LEAST_NOTICED,
    )
    yield judge_rate(
        "both named",
        "two listed effects",
        [one.both for one in select(outcomes, "pair")],
        required.LEAST_BOTH,
    )
    yield judge_median(
        "F1 of the flagged cells, median", listed, [one.f1 for one in single], required.LEAST_F1
    )
    yield judge_median(
        "bias left in the base over bias before, median",
        listed,
        [one.bias_ratio for one in single],
        required.MOST_BIAS_LEFT,
        at_least=False,
    )
    for gap in ("transmission_error", "leading"):
        yield from _proof(gap, single)


def time_demand(outcomes: Sequence[Outcome]) -> Judged:
    """Judge the time of all parts together."""
    whole = [
        sum(one.seconds) if one.seconds else np.inf
        for one in outcomes
        if one.case.kind != "detection"
    ]
    return judge_median("time of a campaign, median, s", "all but detection limits", whole,
                        required.MOST_SECONDS, at_least=False)  # fmt: skip


_GAP_WORDS = {
    "transmission_error": "transmission error",
    "leading": "the channel that stands out most",
}


def _proof(gap: str, single: Sequence[Outcome]) -> Iterator[Judged]:
    where = f"one listed effect, {_GAP_WORDS[gap]}"
    shrunk = [one.shrinkage(gap) for one in single]
    multiple = required.FLOOR_MULTIPLE
    closed = [one.closed(gap, multiple) for one in single if one.open_before(gap, multiple)]
    yield judge_median("shrinkage of the held-out gap, median", where, shrunk,
                       required.LEAST_SHRINKAGE)  # fmt: skip
    yield judge_rate(f"held-out gap within {required.FLOOR_MULTIPLE:g} x the noise floor", where,
                     closed, required.LEAST_CLOSED)  # fmt: skip
