"""The verdict: whether an effect is missing, which one it is, and how certain the answer is.

The base is fitted within its tolerances first. If it is not adequate, candidates are screened, the
best few are fitted jointly with the base, and the one with the least BIC is named, provided that it
removes most of the excess, and at least half of it in each part of the data. Hypotheses that the
data cannot separate from it are named with it. A second effect must remove most of the first one's
residual, in total or in the part that the first explains worst.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from pymoo_hdte.discrepancy.engine import probability
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, Vote
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    alike,
    contains,
    down_to_noise,
    explains,
    gains_enough,
)
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.discrepancy.engine.screening import screen
from pymoo_hdte.discrepancy.engine.search import Search

NOT_PROVEN = "the error on the records kept out of the fit does not shrink"
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
        if not search.enough(search.found[0]):
            search.grow()
    chosen = _special_case(search, _best(search))
    others = [one for one in search.found if one is not chosen]
    equivalent = [one for one in others if _is_rival(search, one, chosen)]
    if not chosen.listed and (listed := [one for one in equivalent if one.listed]):
        equivalent = [chosen, *(one for one in equivalent if one is not listed[0])]
        chosen, others = listed[0], [chosen, *(one for one in others if one is not listed[0])]
    vote = data.held_out_vote(base, chosen.fit)
    shown = vote is None or vote.counts(rules)
    doubts = doubts_of(search, chosen, vote if shown else None)
    certain = _explains(search, chosen)
    if not certain and _stands_out(search, chosen):
        certain, left = True, _left_by(chosen.fit.chi_square / degrees_of_freedom)
        doubts += [left] if left not in doubts else []
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

    A set of several effects counts only if each of them is earned.
    """
    found = search.found
    explaining = (one for one in found if _explains(search, one) and search.earned(one))
    best = next(explaining, None)
    if best is not None:
        return best
    return next(one for one in found if search.earned(one))


def _special_case(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the special case of a set that does as well, if the set itself ended at a bound.

    At the bound of a law lies a simpler one, or one that these data do not show: dry friction that
    falls within less than the slowest speed is dry friction.
    """
    if not any(bounded for _, bounded in bounded_unknowns(best.fit)):
        return best
    simpler = (
        one
        for one in search.found
        if one.names != best.names and contains(best, one) and search.enough(one)
    )
    return next((one for one in simpler if _explains(search, one) and search.earned(one)), best)


def _explains(search: Search, one: Hypothesis) -> bool:
    return explains(search.data, one, search.base, search.degrees_of_freedom)


def _is_rival(search: Search, one: Hypothesis, chosen: Hypothesis) -> bool:
    """Tell whether a set explains the data as well as the chosen one by something else.

    A law that contains the chosen one and ends at its bound is the chosen one. Where its further
    unknowns are determined, the evidence has told; where they are not, it is a rival.
    """
    return (
        alike(one, chosen, search.degrees_of_freedom, search.data.rules)
        and not (contains(one, chosen) and any(bounded for _, bounded in bounded_unknowns(one.fit)))
        and _explains(search, one)
        and search.earned(one)
    )


def doubts_of(search: Search, chosen: Hypothesis, vote: Vote | None) -> list[str]:
    """Return what forbids to name a set plainly, in words; nothing if it may be named."""
    found, fitted = [], chosen.fit
    for (candidate, bounded), (_, place) in zip(
        bounded_unknowns(fitted), fitted.places, strict=True
    ):
        if bounded:
            found.append(f"{', '.join(bounded)} of {candidate.label} ended at a bound")
        elif not strength_is_certain(fitted, candidate, place, search.data.rules):
            found.append(f"the interval of {candidate.label} contains nothing")
    if any(one.frees in fitted.at_bounds for one in chosen.candidates):
        found.append("a base parameter ended at ten times or a tenth of what is believed")
    curves = [one.label for one in chosen.candidates if not one.exact]
    freed = any(one.frees is not None for one in chosen.candidates)
    if curves and freed and not search.enough(chosen):
        found.append(f"values out of tolerance may stand for what {curves[0]} leaves")
    if vote is not None and vote.after >= vote.before:
        found.append(NOT_PROVEN)
    per_degree = fitted.chi_square / search.degrees_of_freedom
    if per_degree > search.data.rules.contradicting_chi_square:
        found.append(_left_by(per_degree))
    return found


def _left_by(per_degree: float) -> str:
    """Say what a chi-square per degree of freedom means."""
    return f"what is left is {np.sqrt(per_degree):.3g} times the noise"


def bounded_unknowns(fitted: Fit) -> list[tuple[Candidate, list[str]]]:
    """Return for each candidate of a fit which of its unknowns ended at a bound.

    A level that ended at zero is a part that the effect does not have.
    """
    found = []
    for candidate, place in fitted.places:
        names = []
        for side, parameter in zip(fitted.bound_sides[place], candidate.parameters, strict=True):
            none = parameter.linear and parameter.lower == 0.0 and side < 0.0
            if side != 0.0 and not none:
                names.append(parameter.name)
        found.append((candidate, names))
    return found


def strength_is_certain(fitted: Fit, candidate: Candidate, place: slice, rules: Rules) -> bool:
    """Tell whether the strength of an effect differs from nothing, by its own interval.

    Strengths are the unknowns that may be zero, lines with both their parts; one of them is enough:
    friction that falls with speed may have no level. Shapes, which are not zero, do not count.
    """
    if not candidate.parameters:
        return True
    limit = chi2.isf(2.0 * norm.sf(rules.certain_deviations), 2)
    for row, parameter in enumerate(candidate.parameters, place.start):
        if parameter.name.endswith("_cosine"):
            pair = np.array([row, row + 1])
            block = fitted.covariance[np.ix_(pair, pair)]
            if fitted.values[pair] @ np.linalg.solve(block, fitted.values[pair]) > limit:
                return True
        elif parameter.lower <= 0.0 and not parameter.name.endswith("_sine"):
            deviation = np.sqrt(fitted.covariance[row, row])
            if abs(fitted.values[row]) > rules.certain_deviations * deviation:
                return True
    return all(parameter.lower > 0.0 for parameter in candidate.parameters)


def _stands_out(search: Search, chosen: Hypothesis) -> bool:
    """Tell whether a set that leaves more than the noise is certain as far as it goes.

    It removes most of the misfit, and all other sets of its size leave plainly more: what is left
    may be the form of a law, or a further effect.
    """
    rules, degrees_of_freedom = search.data.rules, search.degrees_of_freedom
    left = chosen.fit.chi_square - degrees_of_freedom
    others = (
        one
        for one in search.found
        if len(one.members) == len(chosen.members)
        and one.names != chosen.names
        and not contains(one, chosen)
    )
    enough = chosen.explained >= rules.partial_share and gains_enough(chosen, search.base, rules)
    return enough and all(
        one.fit.chi_square - degrees_of_freedom >= rules.form_ratio * left for one in others
    )


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
