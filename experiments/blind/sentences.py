"""What came out of the blind campaigns, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.blind.outcome import Outcome
from experiments.blind.scoring import MOST_IN_CLASS
from experiments.blind.targets import select


def in_one_sentence(outcomes: Sequence[Outcome]) -> str:
    """Say how many plain answers were wrong, and how much was found."""
    if not outcomes:
        return "No case was run."
    plain, wrong = _plain_answers(outcomes)
    return (
        f"Of {len(outcomes)} campaigns {plain} had an answer without reservation, {wrong} of them "
        "wrong; "
        f"{_found(outcomes)}."
    )


def of_the_first_page(outcomes: Sequence[Outcome]) -> str:
    """Say the same as part of a longer sentence."""
    plain, wrong = _plain_answers(outcomes)
    return (
        "a workflow that says what a drive model lacks beside measurements: on simulated campaigns "
        f"that it had not seen, {wrong} of {plain} answers without reservation were wrong, and "
        f"{_found(outcomes)}"
    )


def _plain_answers(outcomes: Sequence[Outcome]) -> tuple[int, int]:
    """Return how many answers were confident, and how many of these were wrong."""
    return sum(one.confident for one in outcomes), sum(one.wrong_confident for one in outcomes)


def _found(outcomes: Sequence[Outcome]) -> str:
    """Say how many single effects, and both effects of how many pairs, were found."""
    shares = []
    for kind, what in (("single", "single effects"), ("pair", "pairs")):
        of_kind = select(outcomes, kind)
        shares.append(f"{sum(one.right_answer for one in of_kind)} of {len(of_kind)} {what}")
    how = f"or stood in a list of at most {MOST_IN_CLASS} candidates"
    return f"{shares[0]}, and both effects in {shares[1]}, were named {how}"
