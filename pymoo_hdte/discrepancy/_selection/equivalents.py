"""What a search tells: its chosen set, and sets that explain the data as well by something else.

And whether data tell a law from its special case: a play that varies from one that does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import (
    explains_in_any_form,
    reasons_of,
    varies,
)
from pymoo_hdte.discrepancy._selection.choice import (
    best_set,
    confirmed,
    in_another_form,
    simpler_law,
    special_case,
    stands_out,
    twins,
)
from pymoo_hdte.discrepancy._selection.fitted_sets import may_be_together
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
    differing,
    is_bounded,
    label_of,
    leave_the_same,
    near_by_evidence,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.screening import Screened
from pymoo_hdte.discrepancy._selection.search import Search


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
        more = with_one_more(search, chosen) if certain else []
        told = [*more, chosen, *rivals(search, chosen)]
        chosen, equivalent = told[0], told[1:]
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


def rivals(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the sets that explain the data as well as the chosen one by something else.

    What contains one of them is a further one only where it comes near that, too.
    """
    found = [
        one
        for one in search.found
        if one is not chosen
        and _comes_near(search, one, chosen)
        and explains_in_any_form(search, one)
        and search.earned(one)
    ]
    return [
        one
        for one in found
        if all(
            _comes_near(search, one, special)
            for special in found
            if special.names != one.names and contains(one, special)
        )
    ]


def _comes_near(search: Search, one: Hypothesis, other: Hypothesis) -> bool:
    """Tell whether a set says something else than another that the data do not tell from it.

    A law that contains the other one and ends at its bound is the other one. Where its further
    unknowns are determined, the evidence has told; where they are not, it is a rival.
    """
    near = search.alike(one, other) or undecided(one, other, search.data.rules)
    near = near or _needs_fewer_values(search, one, other)
    return near and not (contains(one, other) and is_bounded(one.fit))


def _needs_fewer_values(search: Search, one: Hypothesis, other: Hypothesis) -> bool:
    """Tell whether a set explains, in another form and with fewer values free, what another does.

    Of two laws at one port the values beside one may stand for the form of the other: a soft
    wind-up with an error of the gears too large is nearly a play with a soft skin.
    """
    shared = label_of(one.effects) & label_of(other.effects)
    mine, theirs = (
        [each for each in those if each.label not in shared]
        for those in (one.effects, other.effects)
    )
    fewer = label_of(one.freed) < label_of(other.freed)
    if not fewer or not mine or len(mine) != len(theirs):
        return False
    same = all(any(each.beside(law) for law in theirs) for each in mine)
    further = one.fit.chi_square - other.fit.chi_square
    most = search.data.rules.form_share**2 * search.excess
    return same and further < most and search.forms.rest_is_noise(one.fit)


def with_one_more(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return what may be told before a set that leaves doubts: itself and one more effect.

    Such a set leaves no more than noise with all its laws as they are listed, and no doubts. A drag
    of any form holds a dry friction: where the drag alone needs sensors far from what is stated,
    either may be true. The best first, and those that no evidence tells from it.
    """
    rules, freedom = search.data.rules, search.degrees_of_freedom
    known, freed = label_of(chosen.candidates), label_of(chosen.freed)
    larger = [
        one
        for one in search.of_size(len(chosen.members) + 1)
        if label_of(one.candidates) > known
        and label_of(one.freed) == freed
        and one.listed
        and chosen.bic - one.bic >= rules.bic_gain
    ]
    # Where forms are not known, only what is listed was compared.
    any_form = search.forms.known(chosen.effects)
    if not (larger and any_form) or not reasons_of(search, chosen, None):
        return []
    found = [
        one
        for one in map(search.finished, larger)
        if search.enough(one)
        and confirmed(search, one) is one
        and not reasons_of(search, one, None)
    ]
    found.sort(key=lambda one: one.bic)
    return [one for one in found if near_by_evidence(one, found[0], freedom, rules)]


def distinct(chosen: Hypothesis, equivalent: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the sets that name other effects, each once: one order or another is one effect."""
    of_names = {one.names: one for one in reversed(equivalent) if one.names != chosen.names}
    return list(reversed(of_names.values()))


def undecided(one: Hypothesis, chosen: Hypothesis, rules: Rules) -> bool:
    """Tell whether a set and the chosen one are a law and its special case, and either may be true.

    A special case is not shown where its law may vary as much as it is strong: flanks that are held
    by a load show a play that varies as a line of the static error, which has a tolerance. And a
    law is not shown by a part of it so small that its special case in another form has it too.
    """
    if contains(one, chosen):
        pairs = differing(one.effects, chosen.effects)
        return any(
            _may_vary_as_much(one.fit, wide, chosen.fit, case, rules) for wide, case in pairs
        )
    if contains(chosen, one):
        pairs = differing(chosen.effects, one.effects)
        return any(_is_its_form(chosen.fit, wide, one.fit, case, rules) for wide, case in pairs)
    return False


def _may_vary_as_much(
    of_law: Fit, law: Candidate, of_case: Fit, case: Candidate, rules: Rules
) -> bool:
    """Tell whether a line that a law adds may be as strong as its special case, by its interval."""
    place, strength = _place(of_law, law), _strength(of_case, case)
    for line in law.lines:
        pair = place.start + line
        spread = np.linalg.eigvalsh(of_law.covariance[np.ix_(pair, pair)])[-1] ** 0.5
        largest = np.hypot(*of_law.values[pair]) + rules.certain_deviations * spread
        if largest >= strength:
            return True
    return False


def _is_its_form(of_law: Fit, law: Candidate, of_case: Fit, case: Candidate, rules: Rules) -> bool:
    """Tell whether what a law has beyond its special case is a small part of that.

    Of a law that varies as lines do: whether these may be nothing. What else the law is free in, as
    the width of a play where the input was locked, does not show that it varies.
    """
    place = _place(of_law, law)
    if law.lines:
        return not varies(law, of_law.values[place], of_law.covariance[place, place], rules)
    shared = {one.name for one in case.parameters}
    further = [
        abs(value)
        for one, value in zip(law.parameters, of_law.values[place], strict=True)
        if one.lower <= 0.0 and one.name not in shared
    ]
    most = rules.form_share * _strength(of_case, case)
    return bool(further) and max(further) <= most


def _place(fitted: Fit, candidate: Candidate) -> slice:
    """Return where the values of a candidate stand in a fit."""
    return next(place for one, place in fitted.places if one is candidate)


def _strength(fitted: Fit, candidate: Candidate) -> float:
    """Return the fitted strength of an effect, the first of its unknowns."""
    return abs(float(fitted.values[_place(fitted, candidate).start]))


def complete(search: Search, chosen: Hypothesis) -> None:
    """Fit the sets that may explain as much as a chosen one of several members by other laws.

    Single effects need none: the best were fitted in other forms and from other starts.
    """
    _with_other_parts(search, chosen)
    _with_other_laws(search, chosen)
    search.finish_near(len(chosen.members))


def _with_other_parts(search: Search, chosen: Hypothesis) -> None:
    """Fit the sets in which a part of a chosen one is another that comes near it by itself.

    Only the better one was extended: a screening beside the other would find the same further
    effects, and takes longest where a line beats with those of the error.
    """
    whole, rules = label_of(chosen.candidates), search.data.rules
    for part in [one for one in search.found if label_of(one.candidates) < whole]:
        kept = [each for each in chosen.candidates if each not in part.candidates]
        for other in search.of_size(len(part.members)):
            both = (*other.candidates, *kept)
            near = leave_the_same(other, part, rules) or search.alike(other, part)
            if other is not part and near and may_be_together(both):
                start = chosen.values_of(kept)[len(search.base.values) :]
                search.fitted(both, np.append(other.fit.values, start))


def _with_other_laws(search: Search, chosen: Hypothesis) -> None:
    """Fit sets with another law at the port of a member in all forms of it, from all starts.

    Beside other members only one form was tried, from one start: those that do most by themselves.
    A second spring beyond a torsion was named a soft wind-up, since only a cubic one was tried
    beside the drag. A drift was named a new zero, since its fit had ended where it settles at once.
    Only where another form can take most of what such a set leaves, or all but noise: not for
    machines whose laws have no known forms.
    """
    for other in _rivals_at_its_ports(search, chosen):
        if search.forms.rest_is_noise(other.fit) or search.leaves_forms(other):
            best = other
            for member, _ in differing(other.candidates, chosen.candidates):
                best = _from_all_starts(search, best, member)


def _rivals_at_its_ports(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the best set of each names that has other laws at the same ports, told from it so far.

    One that is not told from the chosen set is in its class already.
    """
    of_names: dict[frozenset[tuple[str, str]], Hypothesis] = {}
    for one in search.of_size(len(chosen.members)):
        if len(one.candidates) == len(chosen.candidates):
            of_names.setdefault(one.names, one)
    of_names.pop(chosen.names, None)
    return [
        one
        for one in of_names.values()
        if all(mine.beside(its) for mine, its in differing(one.candidates, chosen.candidates))
        and not search.alike(one, chosen)
    ]


def _from_all_starts(search: Search, one: Hypothesis, member: Candidate) -> Hypothesis:
    """Fit a set with each form of a member, from each start of it; return the best of them."""
    found, base = [one], one.fit.values[: one.fit.n_base]
    forms = [form for form in search.candidates if form.is_form_of(member)]
    for law in (member, *forms):
        effects = tuple(law if each is member else each for each in one.candidates)
        for start in law.starts if may_be_together(effects) else ():
            values = [
                start if each is member else one.fit.values[place] for each, place in one.fit.places
            ]
            begin = np.concatenate([base, *values])
            found.append(search.fitted(effects, begin, again=True, hopeless=search.hopeless))
    return min(found, key=lambda each: each.bic)
