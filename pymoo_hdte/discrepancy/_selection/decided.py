"""The verdict of a decision: the sets that it names, fitted to the data that a report is of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decision import Decision
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy._selection.growth import Weighed
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, hypothesis_of, label_of
from pymoo_hdte.discrepancy._selection.reason import MORE_MISSING, Reason
from pymoo_hdte.discrepancy._selection.verdict import Verdict


def verdict_of(
    data: Evidence, decision: Decision, sets: Sequence[Weighed], base: Fit | None = None
) -> Verdict:
    """Return the verdict that a decision is.

    Parameters
    ----------
    data : Evidence
        To which its sets are fitted, as predictions for held-out records must not come from fits of
        them. Nuisances of the sets are unknowns of its base, in their order, after all others.
    decision : Decision
    sets : sequence of Weighed
        Those that it compared, the likeliest first.
    base : Fit, optional
        Of these data without effects, if it is known.
    """
    base = fit(data) if base is None else base
    freedom = len(base.residuals) - len(base.values)
    excess = max(base.chi_square - freedom, 1.0)
    known = dict[frozenset[str], Hypothesis]()

    def fitted_as(fitted: Fit, members: Sequence[Candidate], steps: int | None) -> Hypothesis:
        label = label_of(members)
        if label not in known:
            known[label] = hypothesis_of(_fitted(data, fitted, members, steps), excess)
        return known[label]

    naming = [weighed for weighed in sets if weighed.explanation.names]
    wanted = [names for names in decision.members if names]
    if not wanted and decision.status == "unlisted":
        wanted = [weighed.explanation.names for weighed in naming[:1]]
    said = []
    for names in wanted:
        # Only what is sure of a set may be named in part.
        fits = [item.fit for item in naming if item.explanation.names == names]
        fits += [item.fit for item in naming if item.explanation.names > names]
        members = [member for member in _effects(fits[0]) if member.named_effect in names]
        said.append(fitted_as(fits[0], members, None))
    for item in naming:
        fitted_as(item.fit, _effects(item.fit), 0)
    more = Reason.of(MORE_MISSING, numbers={"outside": decision.outside})
    return Verdict(
        base,
        said[0] if said else None,
        decision.status != "unlisted",
        tuple(other for other in known.values() if not said or other is not said[0]),
        tuple(said[1:]),
        freedom,
        data.rules,
        (more,) if decision.status == "partial" else (),
        probability=decision.probability,
        outside=decision.outside if decision.possible else 1.0,
    )


def _effects(fitted: Fit) -> list[Candidate]:
    """Return the members of a set that are of the machine, and not of its bench."""
    return [member for member in fitted.candidates if not member.nuisance]


def _fitted(data: Evidence, fitted: Fit, members: Sequence[Candidate], steps: int | None) -> Fit:
    """Return members of a set as fitted to these data, from where the set was."""
    begin = [fitted.values[: fitted.n_base]]
    begin.append(np.array([parameter.start for parameter in data.base[fitted.n_base :]]))
    begin += [fitted.values[place] for member, place in fitted.places if member in members]
    return fit(data, members, np.concatenate(begin), steps)
