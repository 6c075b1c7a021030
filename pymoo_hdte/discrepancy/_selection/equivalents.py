"""The chosen set of a search, and the sets that explain the data equally well by other effects.

It also decides whether data separate a law from its special case, such as a play that varies from
one that does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import (
    explains_as_listed,
    reasons_of,
    varies,
)
from pymoo_hdte.discrepancy._selection.choice import (
    best_set,
    competing_by_evidence,
    confirmed,
    simpler_law,
    special_case,
    stands_out,
)
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
    differing,
    is_bounded,
    label_of,
    leave_the_same,
    may_be_together,
    near_by_evidence,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.search import Search


class Answer(NamedTuple):
    """A chosen set, the sets equivalent to it, and what is certain of them.

    ``certain`` says that it explains the data, and ``in_part`` that it stands out although more is
    left.
    """

    chosen: Hypothesis
    equivalent: list[Hypothesis]
    certain: bool
    in_part: bool


def answer_of(search: Search, chosen: Hypothesis) -> Answer:
    """Return the answer of a search: its chosen set, or the set that replaces it."""
    certain = explains_as_listed(search, chosen)
    if not certain:
        chosen = simpler_law(search, chosen)
    if not certain and explains_as_listed(search, best_set(search)):
        # An effect that was fitted only now explains the misfit.
        chosen, certain = chosen_of(search), True
    extended = with_one_more(search, chosen) if certain else []
    reported = [*extended, chosen, *competing_sets(search, chosen)]
    chosen, equivalent = reported[0], reported[1:]
    together = [] if certain else competing_by_evidence(search, chosen)
    in_part = not certain and stands_out(search, chosen, together)
    equivalent += together if in_part else []
    listed = [hypothesis for hypothesis in equivalent if hypothesis.listed]
    if not chosen.listed and listed:
        others = [hypothesis for hypothesis in equivalent if hypothesis is not listed[0]]
        chosen, equivalent = listed[0], [chosen, *others]
    return Answer(chosen, equivalent, certain, in_part)


def chosen_of(search: Search) -> Hypothesis:
    """Return the best set, or a special case that does as well, without uncertain members."""
    return confirmed(search, special_case(search, best_set(search)))


def competing_sets(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the sets that explain the data as well as the chosen one by something else.

    A set that contains another of them counts only if it comes close to that one as well.
    """
    competing = [
        hypothesis
        for hypothesis in search.hypotheses
        if hypothesis is not chosen
        and _competes(search, hypothesis, chosen)
        and explains_as_listed(search, hypothesis)
        and search.is_significant(hypothesis)
    ]
    return [
        hypothesis
        for hypothesis in competing
        if all(
            _competes(search, hypothesis, special)
            for special in competing
            if special.names != hypothesis.names and contains(hypothesis, special)
        )
    ]


def _competes(search: Search, hypothesis: Hypothesis, chosen: Hypothesis) -> bool:
    """Tell whether a set competes with the chosen one: the data do not separate them.

    A more general law whose extra parameter sits at its bound reduces to the special case and does
    not compete. If the extra parameter is well determined, the evidence decides.
    """
    competes = search.indistinguishable(hypothesis, chosen) or undecided(
        hypothesis, chosen, search.data.rules
    )
    return competes and not (contains(hypothesis, chosen) and is_bounded(hypothesis.fit))


def with_one_more(search: Search, chosen: Hypothesis) -> list[Hypothesis]:
    """Return sets to prefer to a chosen one with caveats: its effects and one more.

    Such a set leaves only noise in the listed forms of its laws and has no caveats. A drag of any
    form can imitate dry friction: if the drag alone needs sensors far from what is stated, either
    may be true. The best set comes first, with those that the evidence does not separate from it.
    """
    rules, freedom = search.data.rules, search.degrees_of_freedom
    labels, released = label_of(chosen.candidates), label_of(chosen.released)
    larger = [
        hypothesis
        for hypothesis in search.of_size(len(chosen.members) + 1)
        if label_of(hypothesis.candidates) > labels
        and label_of(hypothesis.released) == released
        and hypothesis.listed
        and chosen.bic - hypothesis.bic >= rules.bic_gain
    ]
    # Beside effects only their listed forms were compared.
    if not larger or chosen.effects or not reasons_of(search, chosen, None):
        return []
    extended = [
        hypothesis
        for hypothesis in map(search.finished, larger)
        if search.enough(hypothesis)
        and confirmed(search, hypothesis) is hypothesis
        and not reasons_of(search, hypothesis, None)
    ]
    extended.sort(key=lambda hypothesis: hypothesis.bic)
    return [
        hypothesis
        for hypothesis in extended
        if near_by_evidence(hypothesis, extended[0], freedom, rules)
    ]


def distinct(chosen: Hypothesis, equivalent: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the sets that name other effects, one for each names; orders are not told apart."""
    others = [hypothesis for hypothesis in equivalent if hypothesis.names != chosen.names]
    of_names = {hypothesis.names: hypothesis for hypothesis in reversed(others)}
    return list(reversed(of_names.values()))


def undecided(hypothesis: Hypothesis, chosen: Hypothesis, rules: Rules) -> bool:
    """Tell whether two sets are a law and its special case, and either may be true.

    The special case is not shown if the law may vary as much as it is strong. Flanks that a load
    holds together show a varying play as a line of the static error, which has a tolerance. The
    law is not shown if what it adds is so small that its special case in another form has it too.
    """
    if contains(hypothesis, chosen):
        pairs = differing(hypothesis.effects, chosen.effects)
        return any(
            _may_vary_as_much(hypothesis.fit, law, chosen.fit, case, rules) for law, case in pairs
        )
    if contains(chosen, hypothesis):
        pairs = differing(chosen.effects, hypothesis.effects)
        return any(
            _is_its_form(chosen.fit, law, hypothesis.fit, case, rules) for law, case in pairs
        )
    return False


def _may_vary_as_much(
    of_law: Fit, law: Candidate, of_case: Fit, case: Candidate, rules: Rules
) -> bool:
    """Tell whether the interval of a line that a law adds reaches the strength of its special case.

    ``of_law`` and ``of_case`` are the fits of both.
    """
    place, strength = _place(of_law, law), _strength(of_case, case)
    for line in law.lines:
        pair = place.start + line
        spread = np.linalg.eigvalsh(of_law.covariance[np.ix_(pair, pair)])[-1] ** 0.5
        largest = np.hypot(*of_law.values[pair]) + rules.certain_deviations * spread
        if largest >= strength:
            return True
    return False


def _is_its_form(of_law: Fit, law: Candidate, of_case: Fit, case: Candidate, rules: Rules) -> bool:
    """Tell whether what a law adds to its special case is a small part of it.

    For a law with lines: whether all lines may be zero. Its other unknowns, such as the width of a
    play where the input was locked, do not show that it varies.
    """
    place = _place(of_law, law)
    if law.lines:
        return not varies(law, of_law.values[place], of_law.covariance[place, place], rules)
    shared = {parameter.name for parameter in case.parameters}
    additions = [
        abs(value)
        for parameter, value in zip(law.parameters, of_law.values[place], strict=True)
        if parameter.lower <= 0.0 and parameter.name not in shared
    ]
    limit = rules.form_share * _strength(of_case, case)
    return bool(additions) and max(additions) <= limit


def _place(fitted: Fit, candidate: Candidate) -> slice:
    """Return the place of a candidate's values in a fit."""
    return next(place for member, place in fitted.places if member is candidate)


def _strength(fitted: Fit, candidate: Candidate) -> float:
    """Return the fitted strength of an effect, which is its first unknown."""
    return abs(float(fitted.values[_place(fitted, candidate).start]))


def complete(search: Search, chosen: Hypothesis) -> None:
    """Fit the sets that may explain as much as a chosen one of several members by other laws.

    Single effects need no such fits: the best were fitted in other forms and from other starts.
    """
    _with_other_parts(search, chosen)
    search.finish_near(len(chosen.members))


def _with_other_parts(search: Search, chosen: Hypothesis) -> None:
    """Fit the chosen set with a part of it replaced by a set that does nearly as well by itself.

    The search extended only the better of the two. A screening beside the other would find the same
    further effects, and takes longest if a line beats with those of the error.
    """
    whole, rules = label_of(chosen.candidates), search.data.rules
    for part in [
        hypothesis for hypothesis in search.hypotheses if label_of(hypothesis.candidates) < whole
    ]:
        remaining = [
            candidate for candidate in chosen.candidates if candidate not in part.candidates
        ]
        for substitute in search.of_size(len(part.members)):
            effects = (*substitute.candidates, *remaining)
            close = leave_the_same(substitute, part, rules) or search.indistinguishable(
                substitute, part
            )
            if substitute is not part and close and may_be_together(effects):
                start = chosen.values_of(remaining)[len(search.base.values) :]
                search.fitted(effects, np.append(substitute.fit.values, start))
