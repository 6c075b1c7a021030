"""Rates and medians with their intervals, held against what must be reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.runs import Counts
from pymoo_hdte._comparing.statistics import Estimate, median, rate
from pymoo_hdte._runner.result import Cell, Column, Table

# What must be reached, as rates.
MOST_WRONG = {
    "single": 10 / 1000,
    "pair": 4 / 400,
    "triple": 1 / 100,
    "unlisted": 2 / 200,
    "stressed": 4 / 400,
}
"""Confident wrong answers among the cases of each kind."""
MOST_WRONG_OF_PLAIN = 0.01
"""Share of the unqualified answers that are wrong."""
LEAST_RIGHT = 0.97
"""Share of singles whose first name or class is right."""
LEAST_BOTH = 0.80
"""Share of pairs of which both effects are named, or are in a small class."""
LEAST_TWO_OF_THREE = 0.60
MOST_ALARMS = 6 / 300
"""Share of false alarms where nothing is hidden, with misstated noise and faulty rows too."""
MOST_BIAS_LEFT = 0.1
"""Bias of the base parameters after the revision over that before it."""
COVERED = (0.92, 0.97)
"""Share of true values in the 95 % intervals of named effects."""
LEAST_F1 = 0.9
"""F1 score of the flagged cells; as in the campaign before this one."""
LEAST_SHRINKAGE = 0.85
"""Median shrinkage of the gap on the held-out records; as before."""
FLOOR_MULTIPLE = 1.5
"""Multiple of the noise floor within which a gap has closed."""
LEAST_CLOSED = 0.70
MOST_SECONDS = 5.5
"""Median time of a case on one core: half of the 9 to 13 s of the workflow before."""
WRONG = "wrong name with confidence"
RIGHT = "first name or class right"
BOTH = "both named, or in a class of at most three"
TWO = "two named"
ALARM = "alarm"
ALARM_STRESSES = ("noise", "outliers")
KINDS = {
    "none": "nothing",
    "single": "one listed effect",
    "pair": "two listed effects",
    "triple": "three listed effects",
    "unlisted": "one unlisted effect",
    "stressed": "one or nothing, under stress",
}
NOTHING_STRESSED = "nothing, with misstated noise or faulty rows"

NOT_RUN = "Not run"


@dataclass(frozen=True)
class Judged:
    """A demand and what was measured.

    Attributes
    ----------
    what, cases : str
    required : float
    measured : Estimate
    at_least : bool
        Whether more is better.
    """

    what: str
    cases: str
    required: float
    measured: Estimate
    at_least: bool = True

    @property
    def verdict(self) -> str:
        """One of `SCORE_STATES`, or `NOT_RUN`."""
        if self.measured.n == 0:
            return NOT_RUN
        return self.measured.state(self.required, at_least=self.at_least)


def select(outcomes: Sequence[Outcome], kind: str, name: str | None = None) -> list[Outcome]:
    """Return the outcomes of a kind, and of one truth where it is given."""
    of_kind = [outcome for outcome in outcomes if outcome.case.kind == kind]
    return (
        of_kind if name is None else [outcome for outcome in of_kind if outcome.case.truth == name]
    )


def share(flags: Sequence[bool]) -> Estimate:
    """Return the share of true flags."""
    return rate(sum(map(bool, flags)), len(flags))


def demands(outcomes: Sequence[Outcome]) -> Iterator[Judged]:
    """Judge everything that must be reached but the time."""
    single, listed = select(outcomes, "single"), KINDS["single"]
    for kind, most in MOST_WRONG.items():
        wrong = share([outcome.wrong_confident for outcome in select(outcomes, kind)])
        yield Judged(WRONG, KINDS[kind], most, wrong, at_least=False)
    yield Judged(RIGHT, listed, LEAST_RIGHT, share([outcome.right for outcome in single]))
    both = share([outcome.all_named for outcome in select(outcomes, "pair")])
    yield Judged(BOTH, KINDS["pair"], LEAST_BOTH, both)
    two = share([outcome.two_named for outcome in select(outcomes, "triple")])
    yield Judged(TWO, KINDS["triple"], LEAST_TWO_OF_THREE, two)
    for words, chosen in (
        (KINDS["none"], select(outcomes, "none")),
        (NOTHING_STRESSED, nothing_stressed(outcomes)),
    ):
        alarms = share([outcome.status != "adequate" for outcome in chosen])
        yield Judged(ALARM, words, MOST_ALARMS, alarms, at_least=False)
    bias = median([outcome.bias_ratio for outcome in single])
    what = "bias left in the base over bias before, median"
    yield Judged(what, listed, MOST_BIAS_LEFT, bias, at_least=False)
    yield from _covered(share([flag for outcome in outcomes for flag in outcome.covered]))
    f1 = median([outcome.f1 for outcome in single])
    yield Judged("F1 of the flagged cells, median", listed, LEAST_F1, f1)
    for error in ("transmission_error", "leading"):
        yield from _validation(error, single)


def pooled_demands(counts: Counts) -> Iterator[Judged]:
    """Judge what is counted over several runs."""
    wrong = rate(counts.plain_wrong, counts.plain)
    yield Judged("wrong", "unqualified answers", MOST_WRONG_OF_PLAIN, wrong, at_least=False)
    yield Judged(RIGHT, KINDS["single"], LEAST_RIGHT, rate(counts.single_right, counts.single))
    yield Judged(BOTH, KINDS["pair"], LEAST_BOTH, rate(counts.pair_both, counts.pair))
    two = rate(counts.triple_two, counts.triple)
    yield Judged(TWO, KINDS["triple"], LEAST_TWO_OF_THREE, two)
    alarms = rate(counts.clean_alarms, counts.clean)
    yield Judged(ALARM, KINDS["none"], MOST_ALARMS, alarms, at_least=False)
    yield from _covered(rate(counts.interval_holds, counts.interval))


def _covered(measured: Estimate) -> Iterator[Judged]:
    what = "95 % intervals that hold the true value"
    for end, at_least in zip(COVERED, (True, False), strict=True):
        yield Judged(what, "what is named", end, measured, at_least)


def nothing_stressed(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Return the outcomes in which only what is stated of noise or rows is wrong."""
    return [
        outcome
        for outcome in select(outcomes, "stressed")
        if outcome.nothing_hidden and outcome.case.stress in ALARM_STRESSES
    ]


def time_demand(outcomes: Sequence[Outcome]) -> Judged:
    """Judge the time of all parts together."""
    whole = median([sum(outcome.seconds) if outcome.seconds else np.inf for outcome in outcomes])
    return Judged("time of a campaign, median, s", "all kinds", MOST_SECONDS, whole, at_least=False)


_GAP_WORDS = {
    "transmission_error": "transmission error",
    "leading": "the channel that stands out most",
}


def _validation(error: str, single: Sequence[Outcome]) -> Iterator[Judged]:
    where, multiple = f"one listed effect, {_GAP_WORDS[error]}", FLOOR_MULTIPLE
    shrunk = median([outcome.shrinkage(error) for outcome in single])
    yield Judged("shrinkage of the held-out gap, median", where, LEAST_SHRINKAGE, shrunk)
    closed = [
        outcome.closed(error, multiple)
        for outcome in single
        if outcome.open_before(error, multiple)
    ]
    what = f"held-out gap within {multiple:g} x the noise floor"
    yield Judged(what, where, LEAST_CLOSED, share(closed))


EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Of the groups of probabilities; the last holds its upper end."""


def reliability(outcomes: Sequence[Outcome]) -> list[tuple[float, Estimate]]:
    """Return the mean probability said in each group, and the share of what was true."""
    judged = []
    for _, _, chosen in _groups(outcomes):
        if chosen:
            said = float(np.mean([outcome.probability for outcome in chosen]))
            judged.append((said, share([outcome.true_statement for outcome in chosen])))
    return judged


def reliability_table(outcomes: Sequence[Outcome]) -> Table:
    """Return the groups of said probabilities beside what was true."""
    rows: list[tuple[Cell, ...]] = []
    for low, high, chosen in _groups(outcomes):
        said = float(np.mean([outcome.probability for outcome in chosen])) if chosen else None
        true = share([outcome.true_statement for outcome in chosen])
        value = true.value if chosen else None
        rows.append((f"{low:g} to {high:g}", len(chosen), said, value, true.low, true.high))
    columns = (
        Column("probability said"),
        Column("answers"),
        Column("mean", "", 3, "said"),
        Column("share", "", 3, "true"),
        Column("low", "", 3, "true"),
        Column("high", "", 3, "true"),
    )
    silent = sum(outcome.probability is None for outcome in outcomes)
    note = (
        "A statement is true if every name in it is hidden, if a class of at most three holds what "
        "is hidden, if nothing is hidden where the model is called adequate, and if no list holds "
        "what is hidden where it is called unlisted. Intervals are Clopper and Pearson's. "
        f"Without probability: {silent} of {len(outcomes)} answers."
    )
    return Table("reliability", "What is said with a probability", columns, tuple(rows), note=note)


def _groups(outcomes: Sequence[Outcome]) -> list[tuple[float, float, list[Outcome]]]:
    said = [outcome for outcome in outcomes if outcome.probability is not None]
    values = np.array([judgement.probability for judgement in said], dtype=float)
    places = np.searchsorted(np.array(EDGES), values, side="right") - 1
    places = np.minimum(places, len(EDGES) - 2)
    return [
        (
            low,
            high,
            [judgement for judgement, place in zip(said, places, strict=True) if place == number],
        )
        for number, (low, high) in enumerate(pairwise(EDGES))
    ]
