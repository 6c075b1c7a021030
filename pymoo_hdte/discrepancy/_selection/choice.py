"""Which of the sets that a search has found a verdict chooses.

The one of least BIC that explains the misfit, or a special case of it that does as well, without
small members that the data deny. Where none explains the misfit, the one effect that does so in
another form of its law than the library holds: the listed form may remove next to nothing of what
another form does, where the base imitates what most forms of the law share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import (
    explains_as_listed,
    explains_in_any_form,
    is_harmonic,
    strength_is_certain,
    uncertain,
)
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
    gains_enough,
    is_bounded,
    label_of,
    near_by_evidence,
)
from pymoo_hdte.discrepancy._selection.screening import Screened
from pymoo_hdte.discrepancy._selection.search import Search


def best_set(search: Search) -> Hypothesis:
    """Return the set of least BIC of those that explain the misfit, of all if none does.

    A set of several effects counts only if each of them is earned. What is fitted on the way, as
    the set without one of them, counts too.
    """
    found: list[Hypothesis] = []
    while found != search.found:
        found = search.found
        best = _least_that(
            search, lambda one: explains_in_any_form(search, one) and search.earned(one)
        ) or _least_that(search, search.earned)
    assert best is not None, "a single effect is earned"
    return best


def _least_that(search: Search, passes: Callable[[Hypothesis], bool]) -> Hypothesis | None:
    """Return the set of least BIC that passes, of all that are known once it has been judged."""
    passed: set[Hypothesis] = set()
    refused: set[Hypothesis] = set()
    while left := [one for one in search.found if one not in refused]:
        if left[0] in passed:
            return left[0]
        (passed if passes(left[0]) else refused).add(left[0])
    return None


def special_case(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the special case of a set that does as well as the forms of laws allow to tell.

    What it leaves beyond the set is then the model's own error, or the set ended at a bound: there
    lies a simpler law, or one that these data do not show. Dry friction that falls within less than
    the slowest speed is dry friction; one that falls by a hundredth may be, and is in its class.
    """
    error = search.data.rules.model_accuracy**2 * search.excess
    if is_bounded(best.fit):
        error = np.inf
    simpler = (
        search.finished(one)
        for one in search.found
        if one.names != best.names and contains(best, one)
    )
    good = (
        one
        for one in simpler
        if search.enough(one) and one.fit.chi_square - best.fit.chi_square <= error
    )
    return next(
        (one for one in good if explains_in_any_form(search, one) and search.earned(one)), best
    )


def confirmed(search: Search, chosen: Hypothesis) -> Hypothesis:
    """Return a set without small members that held-out records or their own intervals deny.

    What a member removes beside others that leave no more than noise, fitted and held-out records
    taken together, has to be more than noise gives, and its strength has to differ from nothing.
    """
    rules, smaller = search.data.rules, []
    doubted = uncertain(chosen.fit, rules)
    for member in chosen.members if len(chosen.members) > 1 else ():
        rest = search.without(chosen, member)
        if not search.enough(rest):
            continue
        vote = search.data.held_out_vote(rest.fit, chosen.fit)
        gain = rest.fit.chi_square - chosen.fit.chi_square
        denied = vote and gain + vote.before - vote.after < rules.single_effect_gain
        unsure = any(one in doubted for one in member)
        if denied or (unsure and explains_in_any_form(search, rest)):
            smaller.append(rest)
    return confirmed(search, min(smaller, key=lambda one: one.bic)) if smaller else chosen


def simpler_law(search: Search, chosen: Hypothesis) -> Hypothesis:
    """Return the special case of a set that leaves about as little, where neither explains enough.

    A law with more unknowns follows more of the form of any other law: that it leaves less of a
    misfit that is no noise does not show it.
    """
    most = search.data.rules.form_ratio * left_beyond_noise(search, chosen)
    special = (
        one
        for one in search.found
        if one.names != chosen.names
        and contains(chosen, one)
        and left_beyond_noise(search, one) < most
    )
    return next((one for one in special if search.earned(one)), chosen)


def left_beyond_noise(search: Search, one: Hypothesis) -> float:
    """Return the excess chi-square that a set leaves."""
    return one.fit.chi_square - search.degrees_of_freedom


def twins(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the sets of as many effects and values as the chosen one that no evidence tells apart.

    A law that contains the chosen one follows more of any form, and is none.
    """
    return [
        one
        for one in search.of_size(len(chosen.members))
        if one.names != chosen.names
        and len(one.candidates) == len(chosen.candidates)
        and bool(one.freed) == bool(chosen.freed)
        and near_by_evidence(one, chosen, search.degrees_of_freedom, search.data.rules)
        and not (contains(one, chosen) or contains(chosen, one))
        and search.earned(one)
    ]


def stands_out(search: Search, chosen: Hypothesis, together: Sequence[Hypothesis] = ()) -> bool:
    """Tell whether a set is certain as far as it goes, alone or ``together`` with its twins.

    It removes most of the misfit, and all other sets of its size leave plainly more: what is left
    may be the form of a law, or a further effect. Sets that say the same and more do not count as
    others; those that the screening left out are far behind.
    """
    rules = search.data.rules
    others = (
        one
        for one in search.of_size(len(chosen.members))
        if not one.names >= chosen.names and one not in together and not contains(one, chosen)
    )
    enough = chosen.explained >= rules.partial_share and gains_enough(chosen, search.base, rules)
    least = rules.form_ratio * left_beyond_noise(search, chosen)
    return enough and all(left_beyond_noise(search, one) >= least for one in others)


def replaced(search: Search, chosen: Hypothesis, others: Sequence[Candidate]) -> list[Hypothesis]:
    """Return sets that explain the misfit with another effect in the place of some members.

    What could follow the form of any law in a part of the data is no explanation unless it leaves
    plainly less than what it replaces, or noise: elsewhere the sets are left out.

    Parameters
    ----------
    search : Search
    chosen : Hypothesis
        The set that it found: if that leaves no more than noise, only its members are replaced.
    others : sequence of Candidate
        Which effects they may replace, they say.
    """
    rules = search.data.rules
    near = [one for size in (1, 2, 3) for one in search.of_size(size)[: rules.most_firsts]]
    found, tried = list[Hypothesis](), set[frozenset[str]]()
    for one in [chosen] if search.enough(chosen) else near:
        for other in others:
            kept = tuple(each for each in one.candidates if not other.replaces(each))
            effects, label = (*kept, other), label_of((*kept, other))
            if len(kept) == len(one.candidates) or label in tried:
                continue
            tried.add(label)
            values = one.values_of(kept)
            for start in other.starts:
                whole = search.fitted(effects, np.append(values, start), again=True)
            if left_beyond_noise(search, whole) <= left_beyond_noise(search, one):
                whole = search.finished(whole)
            less = rules.form_ratio * left_beyond_noise(search, whole)
            plainly = less <= left_beyond_noise(search, one) or search.enough(whole)
            if plainly and explains_as_listed(search, whole):
                found.append(whole)
            else:
                search.leave_out(whole)
    return found


def in_another_form(
    search: Search, chosen: Hypothesis, screened: Sequence[Screened]
) -> list[Hypothesis]:
    """Return what explains the misfit in another form, the best as listed first.

    Single effects, or else the chosen set.

    Parameters
    ----------
    search : Search
        In which no set explains the misfit.
    chosen : Hypothesis
        The set that comes nearest to it.
    screened : sequence of Screened
        All candidates beside its base; none if only the sets that it knows are compared.
    """
    if any(search.data.corrections(one) is None for one in search.candidates[:1]):
        return []
    effects = [one for one in screened if one.candidate.frees is None]
    for one in search.forms.hopeful_in_another(effects) if effects else ():
        search.alone(one)
    singles = [one for one in search.found if one.listed and _is_effect(one)]
    finished = [one if one is chosen else search.finished(one) for one in singles]
    found = [one for one in finished if _explains(search, one)]
    if not found and chosen.listed and _explains(search, chosen):
        found = [chosen]
    return sorted(found, key=lambda one: one.bic)


def _explains(search: Search, one: Hypothesis) -> bool:
    """Tell whether a set explains the misfit in another form, and is more than that form.

    A load on a soft sensor moves as further inertia would in some form, of which none is there: the
    strength of an effect of exact form has to be certain beside its corrections.
    """
    if not search.forms.explains_in_another(one):
        return False
    free, rules = search.forms.in_free_form(one.fit), search.data.rules
    places = zip(one.candidates, free.places, strict=True)
    return all(
        strength_is_certain(free, own, place, rules) for own, (_, place) in places if own.exact
    )


def _is_effect(one: Hypothesis) -> bool:
    """Tell whether a set is a single effect, and no base parameter."""
    return len(one.candidates) == 1 and one.candidates[0].frees is None


def in_one_law(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return single effects that explain in another form what a set has a curve and lines for.

    A clearance that varies once in some angle need not do so as a cosine: its harmonics are lines
    at its port, beside a play that does not vary.
    """
    found = []
    for wide in search.candidates:
        if wide.listed and wide.order is not None and _consists_of(chosen, wide, wide.order):
            one = search.finished(search.alone(Screened(wide, 0.0, wide.starts[0])))
            if _explains(search, one):
                found.append(one)
    return sorted(found, key=lambda one: one.bic)


def _consists_of(chosen: Hypothesis, wide: Candidate, order: float) -> bool:
    """Tell whether a set is a law or its special case and lines of harmonics at the same port."""
    curves = [one for one in chosen.candidates if one.name == wide.name or wide.holds(one)]
    lines = [one for one in chosen.candidates if one not in curves]
    return (
        len(curves) == 1
        and bool(lines)
        and all(one.port == wide.port for one in chosen.candidates)
        and all(one.order is not None and is_harmonic(one.order, order) for one in lines)
    )
