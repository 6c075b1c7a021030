"""Sets with which a chosen one has to be compared, and that the search among sets did not try."""

from __future__ import annotations

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitted_sets import may_be_together
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    differing,
    label_of,
    leave_the_same,
)
from pymoo_hdte.discrepancy.engine.search import Search


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
