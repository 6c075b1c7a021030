"""Sets with which a chosen one has to be compared, and that the search among sets did not try."""

from __future__ import annotations

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitted_sets import Effects, may_be_together
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    differing,
    label_of,
    leave_the_same,
)
from pymoo_hdte.discrepancy.engine.search import Search


def complete(search: Search, chosen: Hypothesis) -> None:
    """Fit the sets that may explain as much as a chosen one by other laws."""
    if len(chosen.members) > 1:
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
    """Fit the best set with each other law at the port of a member in any form, from any start.

    Only the form and the start that do most by themselves were tried beside the others: a second
    spring as a cubic, beside a drag for which a spring that is stiffer beyond a corner leaves
    noise, as does a soft wind-up; and a drift that settles at once, where a new zero is nearly as
    good as one that settles within the session. Where what a set leaves is neither noise but for
    the forms of its laws, nor mostly forms, none would do.
    """
    of_names: dict[frozenset[tuple[str, str]], Hypothesis] = {}
    for other in search.of_size(len(chosen.members)):
        if len(other.candidates) == len(chosen.candidates):
            of_names.setdefault(other.names, other)
    of_names.pop(chosen.names, None)
    for other in of_names.values():
        pairs = differing(other.candidates, chosen.candidates)
        same_port = all(mine.beside(its) for mine, its in pairs)
        if not same_port or search.alike(other, chosen):
            continue
        if search.forms.rest_is_noise(other.fit) or search.leaves_forms(other):
            for mine, _ in pairs:
                _from_all_starts(search, other, mine)


def _from_all_starts(search: Search, one: Hypothesis, member: Candidate) -> None:
    """Fit a set with a member from each of its starts, and with each form that was not tried."""
    kept: Effects = tuple(each for each in one.candidates if each is not member)
    tried = [label_of(each.candidates) for each in search.found]
    forms = [form for form in search.candidates if form.is_form_of(member)]
    for law in [member] * (not member.linear) + forms:
        effects = (*kept, law)
        if law is not member and (label_of(effects) in tried or not may_be_together(effects)):
            continue
        for start in law.starts:
            values = np.append(one.values_of(kept), start)
            search.fitted(effects, values, again=True, hopeless=search.hopeless)
