"""The verdict: whether an effect is missing, which one it is, and how certain the answer is.

The base is fitted within its tolerances first. If it is not adequate, candidates are screened, the
best few are fitted jointly with the base, and the one with the least BIC is named, provided that it
removes most of the excess, and at least half of it in each part of the data. Hypotheses that the
data cannot separate from it are named with it. A second effect must remove most of the first one's
residual, in total or in the part that the first explains worst.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pymoo_hdte.discrepancy.engine import probability
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.doubts import (
    NOT_PROVEN,
    bounded_unknowns,
    doubts_of,
    explains_in_any_form,
    left_by,
    other_forms,
    uncertain,
)
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, Vote
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    alike,
    contains,
    down_to_noise,
    gains_enough,
    label_of,
)
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.discrepancy.engine.screening import screen
from pymoo_hdte.discrepancy.engine.search import Search

STATUSES = ("adequate", "named", "class", "parameter", "unlisted", "partial")
EXPLAINED = ("named", "class", "parameter", "partial")
"""Statuses that say what is missing."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is missing.

    Attributes
    ----------
    status : str
        One of `STATUSES`.
    base : Fit
        Without any effect.
    chosen : Hypothesis or None
    alternatives : tuple of Hypothesis
        Other sets that were fitted.
    equivalent : tuple of Hypothesis
        Those of them that also explain the data and cannot be separated from the chosen one.
    degrees_of_freedom : int
    rules : Rules
        Thresholds of the verdict.
    doubts : tuple of str
        What forbids to name the chosen effects plainly; with ``"partial"`` they are certain as far
        as they go.
    shown_in_held_out : bool
        Whether the records kept out of the fit, if there are any, show what is chosen.
    probability : float or None
        That it is right: see `probability`. None where it names nothing, or nothing was compared.
    """

    status: str
    base: Fit
    chosen: Hypothesis | None
    alternatives: tuple[Hypothesis, ...]
    equivalent: tuple[Hypothesis, ...]
    degrees_of_freedom: int
    rules: Rules = RULES
    doubts: tuple[str, ...] = ()
    shown_in_held_out: bool = True
    probability: float | None = None

    @property
    def accepted(self) -> Fit:
        """The fit accepted by the verdict: without effects unless some are named."""
        chosen = self.chosen
        return chosen.fit if chosen is not None and self.status in EXPLAINED else self.base

    @property
    def leaves_more_than_noise(self) -> bool:
        """Whether the chosen effects do not explain the data down to the noise."""
        chosen = self.chosen
        degrees_of_freedom, rules = self.degrees_of_freedom, self.rules
        return chosen is not None and not down_to_noise(chosen.fit, degrees_of_freedom, rules)

    def after_vote(self, vote: Vote) -> Verdict:
        """Return it with the vote of held-out records: ``unlisted`` where they contradict it."""
        if not vote.counts(self.rules):
            return replace(self, shown_in_held_out=False)
        if vote.after < vote.before:
            return self
        doubts = (*self.doubts, NOT_PROVEN)
        return replace(self, status="unlisted", equivalent=(), doubts=doubts, probability=None)


def judge(
    data: Evidence,
    base: Fit,
    candidates: Sequence[Candidate],
    known: Sequence[Hypothesis] = (),
) -> Verdict:
    """Return the verdict on a fitted base, by the rules of its data.

    If sets are ``known`` from nearly the same data, only these are compared.
    """
    rules = data.rules
    degrees_of_freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *data.out_of_tolerance(base.at_bounds)]
    quiet = down_to_noise(base, degrees_of_freedom, rules)
    # Screening is slow, and known sets need none unless the base itself may be adequate.
    screened = screen(data, base, candidates) if quiet or not known else []
    gain = max((one.reduction for one in screened), default=0.0)
    if quiet and gain < rules.single_effect_gain:
        clean = probability.of_nothing(screened, len(base.residuals), rules)
        return Verdict("adequate", base, None, (), (), degrees_of_freedom, rules, probability=clean)
    if not screened and not known:
        return Verdict("unlisted", base, None, (), (), degrees_of_freedom, rules)
    search = Search(data, base, candidates)
    if known:
        search.resume(known)
    else:
        search.singles(screened)
        search.grow()
    chosen = _confirmed(search, _special_case(search, _best(search)))
    certain = explains_in_any_form(search, chosen)
    if not certain:
        chosen = _simpler_law(search, chosen)
    others = [one for one in search.found if one is not chosen]
    equivalent = [one for one in others if _is_rival(search, one, chosen)]
    if not chosen.listed and (listed := [one for one in equivalent if one.listed]):
        equivalent = [chosen, *(one for one in equivalent if one is not listed[0])]
        chosen, others = listed[0], [chosen, *(one for one in others if one is not listed[0])]
    vote = data.held_out_vote(base, chosen.fit)
    shown = vote is None or vote.counts(rules)
    doubts = doubts_of(search, chosen, vote if shown else None) + other_forms(search, chosen)
    if not certain and _stands_out(search, chosen):
        certain, left = True, left_by(chosen.fit.chi_square / degrees_of_freedom)
        doubts += [left] if left not in doubts else []
    if certain:
        # The rules of earning may pass over a set for which the evidence speaks: both are told.
        equivalent += probability.likelier(chosen, equivalent, search.found, degrees_of_freedom)
    status = _status(chosen, certain, equivalent, doubts)
    rivals = tuple(equivalent) if status == "class" else ()
    sure = probability.of_names(status, chosen, rivals, search.found, degrees_of_freedom, rules)
    return Verdict(
        status,
        base,
        chosen,
        tuple(others),
        rivals,
        degrees_of_freedom,
        rules,
        tuple(doubts),
        shown,
        sure,
    )


def _best(search: Search) -> Hypothesis:
    """Return the set of least BIC of those that explain the misfit, of all if none does.

    A set of several effects counts only if each of them is earned. What is fitted without one of
    them, or fitted further, counts too.
    """
    found: list[Hypothesis] = []
    while found != (now := search.found):
        found = now
        explaining = (
            one for one in found if explains_in_any_form(search, one) and search.earned(one)
        )
        best = next(explaining, None) or next(one for one in found if search.earned(one))
    return best


def _special_case(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the special case of a set that does as well as the forms of laws allow to tell.

    What it leaves beyond the set is then the model's own error, or the set ended at a bound: there
    lies a simpler law, or one that these data do not show. Dry friction that falls within less than
    the slowest speed is dry friction; one that falls by a hundredth may be, and is in its class.
    """
    error = search.data.rules.model_accuracy**2 * search.excess
    if any(bounded for _, bounded in bounded_unknowns(best.fit)):
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


def _confirmed(search: Search, chosen: Hypothesis) -> Hypothesis:
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
    return _confirmed(search, min(smaller, key=lambda one: one.bic)) if smaller else chosen


def _is_rival(search: Search, one: Hypothesis, chosen: Hypothesis) -> bool:
    """Tell whether a set explains the data as well as the chosen one by something else.

    A law that contains the chosen one and ends at its bound is the chosen one. Where its further
    unknowns are determined, the evidence has told; where they are not, it is a rival.
    """
    return (
        alike(one, chosen, search.degrees_of_freedom, search.data.rules)
        and not (contains(one, chosen) and any(bounded for _, bounded in bounded_unknowns(one.fit)))
        and explains_in_any_form(search, one)
        and search.earned(one)
    )


def _stands_out(search: Search, chosen: Hypothesis) -> bool:
    """Tell whether a set that leaves more than the noise is certain as far as it goes.

    It removes most of the misfit, and all other sets of its size leave plainly more: what is left
    may be the form of a law, or a further effect. Sets that say the same and more do not count as
    others; those that the screening left out are far behind.
    """
    rules = search.data.rules
    others = (
        one
        for one in search.found
        if len(one.members) == len(chosen.members)
        and one.names != chosen.names
        and not contains(one, chosen)
        and not label_of(one.candidates) > label_of(chosen.candidates)
    )
    enough = chosen.explained >= rules.partial_share and gains_enough(chosen, search.base, rules)
    least = rules.form_ratio * _left(search, chosen)
    return enough and all(_left(search, one) >= least for one in others)


def _simpler_law(search: Search, chosen: Hypothesis) -> Hypothesis:
    """Return the special case of a set that leaves about as little, where neither explains enough.

    A law with more unknowns follows more of the form of any other law: that it leaves less of a
    misfit that is no noise does not show it.
    """
    most = search.data.rules.form_ratio * _left(search, chosen)
    special = (
        one
        for one in search.found
        if one.names != chosen.names and contains(chosen, one) and _left(search, one) < most
    )
    return next((one for one in special if search.earned(one)), chosen)


def _left(search: Search, one: Hypothesis) -> float:
    """Return the excess chi-square that a set leaves."""
    return one.fit.chi_square - search.degrees_of_freedom


def _status(
    chosen: Hypothesis, certain: bool, equivalent: Sequence[Hypothesis], doubts: Sequence[str]
) -> str:
    """Return the status of the best set: what it may be called."""
    if not chosen.listed or not certain or NOT_PROVEN in doubts:
        return "unlisted"
    if equivalent:
        return "class"
    if doubts:
        return "partial"
    out = all(candidate.name == "parameter" for candidate in chosen.candidates)
    return "parameter" if out else "named"
