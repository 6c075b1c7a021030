"""What a search tells: the set that it chooses, and those that may be told with it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pymoo_hdte.discrepancy.engine.choice import (
    best_set,
    confirmed,
    in_another_form,
    simpler_law,
    special_case,
    stands_out,
    twins,
)
from pymoo_hdte.discrepancy.engine.doubts import explains_in_any_form
from pymoo_hdte.discrepancy.engine.equivalents import rivals, with_one_more
from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis
from pymoo_hdte.discrepancy.engine.screening import Screened
from pymoo_hdte.discrepancy.engine.search import Search


class Answer(NamedTuple):
    """A chosen set, sets that may be told with it, and what is certain of them.

    ``certain`` is that it explains the data, ``foreign`` that another form of its law does, and
    ``in_part`` that it stands out although more is left.
    """

    chosen: Hypothesis
    equivalent: list[Hypothesis]
    certain: bool
    foreign: bool
    in_part: bool


def answer_of(search: Search, chosen: Hypothesis, screened: Sequence[Screened]) -> Answer:
    """Return what a search tells of its chosen set: itself, or what stands for it."""
    certain = explains_in_any_form(search, chosen)
    if not certain:
        chosen = simpler_law(search, chosen)
    foreign: list[Hypothesis] = []
    if not (certain and chosen.listed):
        foreign = in_another_form(search, chosen, screened)
        if not certain and explains_in_any_form(search, best_set(search)):
            # One of the effects that were fitted only now does so as it is listed.
            chosen, certain, foreign = chosen_of(search), True, []
    if foreign:
        equivalent = [*foreign[1:], *([chosen] if certain else [])]
        chosen, certain = foreign[0], True
    else:
        equivalent = rivals(search, chosen)
        if certain and (more := with_one_more(search, chosen)):
            equivalent = [*more[1:], chosen, *equivalent]
            chosen = more[0]
    together = [] if certain else twins(search, chosen)
    in_part = not certain and stands_out(search, chosen, together)
    equivalent += together if in_part else []
    if not chosen.listed and (listed := [one for one in equivalent if one.listed]):
        equivalent = [chosen, *(one for one in equivalent if one is not listed[0])]
        chosen = listed[0]
    return Answer(chosen, equivalent, certain, bool(foreign), in_part)


def chosen_of(search: Search) -> Hypothesis:
    """Return the best set, or its special case that does as well, without doubted members."""
    return confirmed(search, special_case(search, best_set(search)))
