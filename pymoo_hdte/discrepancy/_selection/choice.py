"""How a verdict chooses among the sets that a search has fitted.

It chooses the set of least BIC that explains the misfit, or a special case of it that does as well,
without small members that the data deny. If no set explains the misfit, it chooses the one of least
BIC among those whose members are significant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import (
    explains_as_listed,
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
from pymoo_hdte.discrepancy._selection.search import Search


def best_set(search: Search) -> Hypothesis:
    """Return the set of least BIC that explains the misfit, or of least BIC if none does.

    A set of several effects counts only if each member is significant. Sets that are fitted in the
    course of this, such as those without one member, count too.
    """
    hypotheses: list[Hypothesis] = []
    while hypotheses != search.hypotheses:
        hypotheses = search.hypotheses
        best = _least_that(
            search,
            lambda hypothesis: (
                explains_as_listed(search, hypothesis) and search.is_significant(hypothesis)
            ),
        ) or _least_that(search, search.is_significant)
    assert best is not None, "a single effect is always significant"
    return best


def _least_that(search: Search, passes: Callable[[Hypothesis], bool]) -> Hypothesis | None:
    """Return the set of least BIC that passes, among all that are known after its test."""
    passed: set[Hypothesis] = set()
    refused: set[Hypothesis] = set()
    while open_sets := [
        hypothesis for hypothesis in search.hypotheses if hypothesis not in refused
    ]:
        if open_sets[0] in passed:
            return open_sets[0]
        (passed if passes(open_sets[0]) else refused).add(open_sets[0])
    return None


def special_case(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the special case of a set that does as well, if there is one; otherwise the set.

    The special case leaves no more than the model's own error beyond the set, or the set ended at a
    bound. There the law is its special case, or these data do not show what it adds. Dry friction
    that falls within less than the slowest speed is plain dry friction.
    """
    error = search.data.rules.model_accuracy**2 * search.excess
    if is_bounded(best.fit):
        error = np.inf
    simpler = (
        search.finished(hypothesis)
        for hypothesis in search.hypotheses
        if hypothesis.names != best.names and contains(best, hypothesis)
    )
    good = (
        hypothesis
        for hypothesis in simpler
        if search.enough(hypothesis) and hypothesis.fit.chi_square - best.fit.chi_square <= error
    )
    return next(
        (
            hypothesis
            for hypothesis in good
            if explains_as_listed(search, hypothesis) and search.is_significant(hypothesis)
        ),
        best,
    )


def confirmed(search: Search, chosen: Hypothesis) -> Hypothesis:
    """Return a set without small members that held-out records or their own intervals deny.

    This concerns members beside others that leave only noise. On fitted and held-out records
    together such a member has to remove more than noise gives, and its strength must not be zero.
    """
    rules, smaller = search.data.rules, []
    doubted = uncertain(chosen.fit, rules)
    for member in chosen.members if len(chosen.members) > 1 else ():
        reduced = search.without(chosen, member)
        if not search.enough(reduced):
            continue
        held_out = search.data.held_out_test(reduced.fit, chosen.fit)
        gain = reduced.fit.chi_square - chosen.fit.chi_square
        denied = held_out and gain + held_out.before - held_out.after < rules.single_effect_gain
        unsure = any(candidate in doubted for candidate in member)
        if denied or (unsure and explains_as_listed(search, reduced)):
            smaller.append(reduced)
    return (
        confirmed(search, min(smaller, key=lambda hypothesis: hypothesis.bic))
        if smaller
        else chosen
    )


def simpler_law(search: Search, chosen: Hypothesis) -> Hypothesis:
    """Return the special case of a set that leaves about as little, if neither explains enough.

    A law with more unknowns also follows more of the form of any other law. That it leaves less of
    a misfit that is not noise does not show that it is there.
    """
    limit = search.data.rules.form_ratio * left_beyond_noise(search, chosen)
    special = (
        hypothesis
        for hypothesis in search.hypotheses
        if hypothesis.names != chosen.names
        and contains(chosen, hypothesis)
        and left_beyond_noise(search, hypothesis) < limit
    )
    return next((hypothesis for hypothesis in special if search.is_significant(hypothesis)), chosen)


def left_beyond_noise(search: Search, hypothesis: Hypothesis) -> float:
    """Return the excess chi-square that a set leaves."""
    return hypothesis.fit.chi_square - search.degrees_of_freedom


def competing_by_evidence(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the sets of as many effects and values that evidence cannot separate from the chosen.

    A law that contains the chosen one is left out, since it follows more of any form.
    """
    return [
        hypothesis
        for hypothesis in search.of_size(len(chosen.members))
        if hypothesis.names != chosen.names
        and len(hypothesis.candidates) == len(chosen.candidates)
        and bool(hypothesis.released) == bool(chosen.released)
        and near_by_evidence(hypothesis, chosen, search.degrees_of_freedom, search.data.rules)
        and not (contains(hypothesis, chosen) or contains(chosen, hypothesis))
        and search.is_significant(hypothesis)
    ]


def stands_out(search: Search, chosen: Hypothesis, together: Sequence[Hypothesis] = ()) -> bool:
    """Tell whether a set is certain as far as it goes, alone or ``together`` with competing sets.

    It removes most of the misfit, and all other sets of its size leave clearly more. What remains
    may be the form of a law or a further effect. Sets that contain its effects do not count as
    others, and those that the screening left out are far behind.
    """
    rules = search.data.rules
    competing = (
        hypothesis
        for hypothesis in search.of_size(len(chosen.members))
        if not hypothesis.names >= chosen.names
        and hypothesis not in together
        and not contains(hypothesis, chosen)
    )
    enough = chosen.explained >= rules.partial_share and gains_enough(chosen, search.base, rules)
    least = rules.form_ratio * left_beyond_noise(search, chosen)
    return enough and all(
        left_beyond_noise(search, hypothesis) >= least for hypothesis in competing
    )


def replaced(
    search: Search, chosen: Hypothesis, replacements: Sequence[Candidate]
) -> list[Hypothesis]:
    """Return sets that explain the misfit with another effect in the place of some members.

    A replacement that could follow the form of any law has to leave clearly less than the effects
    that it replaces, or only noise. Sets in which it does not are left out of all comparisons.

    Parameters
    ----------
    search : Search
    chosen : Hypothesis
        Chosen set; if it leaves only noise, only its members are replaced.
    replacements : sequence of Candidate
        Effects that may replace others, by `Candidate.replaces`.
    """
    rules = search.data.rules
    leading = [
        hypothesis for size in (1, 2, 3) for hypothesis in search.of_size(size)[: rules.most_firsts]
    ]
    explaining, tried = list[Hypothesis](), set[frozenset[str]]()
    for hypothesis in [chosen] if search.enough(chosen) else leading:
        for replacement in replacements:
            remaining = tuple(
                candidate
                for candidate in hypothesis.candidates
                if not replacement.replaces(candidate)
            )
            effects, label = (*remaining, replacement), label_of((*remaining, replacement))
            if len(remaining) == len(hypothesis.candidates) or label in tried:
                continue
            tried.add(label)
            values = hypothesis.values_of(remaining)
            for start in replacement.starts:
                trial = search.fitted(effects, np.append(values, start), again=True)
            if left_beyond_noise(search, trial) <= left_beyond_noise(search, hypothesis):
                trial = search.finished(trial)
            less = rules.form_ratio * left_beyond_noise(search, trial)
            plainly = less <= left_beyond_noise(search, hypothesis) or search.enough(trial)
            if plainly and explains_as_listed(search, trial):
                explaining.append(trial)
            else:
                search.leave_out(trial)
    return explaining
