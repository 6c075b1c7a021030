"""The verdict: is anything missing, which effect is it, and how sure is that answer.

The base is fitted within its tolerances first. If it is not adequate, candidates are screened, the
best few are fitted jointly with the base, and the one with the least BIC is named, provided that it
removes most of the excess, in no part of the data less than half of it. What the data cannot tell
from it is named beside it. A second effect must remove most of what the first leaves, in all or in
the part that the first explains worst.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Rival,
    alike,
    contains,
    down_to_noise,
    explains,
    fit_all,
    refined,
    rival,
    varied,
)
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.discrepancy.engine.screening import Screened, screen
from pymoo_hdte.discrepancy.engine.selection import with_second

STATUSES = ("adequate", "named", "class", "parameter", "unlisted")
EXPLAINED = ("named", "class", "parameter")
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
    chosen : Rival or None
    alternatives : tuple of Rival
        Other sets that were fitted.
    equivalent : tuple of Rival
        Those of them that explain the data too and that these cannot tell from the chosen one.
    degrees_of_freedom : int
    rules : Rules
        By which it was judged.
    """

    status: str
    base: Fit
    chosen: Rival | None
    alternatives: tuple[Rival, ...]
    equivalent: tuple[Rival, ...]
    degrees_of_freedom: int
    rules: Rules = RULES

    @property
    def accepted(self) -> Fit:
        """The fit that is believed after the verdict: without effects unless some are named."""
        chosen = self.chosen
        return chosen.fit if chosen is not None and self.status in EXPLAINED else self.base

    @property
    def leaves_more_than_noise(self) -> bool:
        """Whether the chosen effects do not explain the data down to the noise."""
        chosen = self.chosen
        freedom, rules = self.degrees_of_freedom, self.rules
        return chosen is not None and not down_to_noise(chosen.fit, freedom, rules)


def judge(data: Evidence, base: Fit, candidates: Sequence[Candidate]) -> Verdict:
    """Return the verdict on a fitted base, by the rules of its data."""
    rules = data.rules
    freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *data.out_of_tolerance(base.at_bounds)]
    screened = screen(data, base, candidates)
    excess = base.chi_square - freedom
    gain = screened[0].reduction
    if down_to_noise(base, freedom, rules) and gain < rules.single_effect_gain:
        return Verdict("adequate", base, None, (), (), freedom, rules)
    singles = _fit_best(data, base, screened, excess)
    if not explains(data, singles[0], base, freedom):
        singles[0] = _searched(data, base, singles[0], excess)
    chosen, rivals = with_second(data, base, singles, candidates)
    others = [rival for rival in rivals if rival is not chosen]
    chosen, others = _least_special(data, refined(data, chosen, excess), others, excess)
    if not explains(data, chosen, base, freedom):
        return Verdict("unlisted", base, chosen, tuple(others), (), freedom, rules)
    near = [alike(rival, chosen, freedom, rules, rules.refit_margin) for rival in others]
    others = [
        refined(data, rival, excess) if flag else rival
        for rival, flag in zip(others, near, strict=True)
    ]
    equivalent = tuple(
        rival
        for rival in others
        if alike(rival, chosen, freedom, rules) and explains(data, rival, base, freedom)
    )
    listed = [rival for rival in equivalent if rival.listed]
    if not chosen.listed and listed:
        others = [chosen if rival is listed[0] else rival for rival in others]
        equivalent = tuple(chosen if rival is listed[0] else rival for rival in equivalent)
        chosen = listed[0]
    status = _status(chosen, equivalent)
    return Verdict(status, base, chosen, tuple(others), equivalent, freedom, rules)


def _least_special(
    data: Evidence, chosen: Rival, others: list[Rival], excess: float
) -> tuple[Rival, list[Rival]]:
    """Return the chosen set, or a special case of it that is no worse fitted to the end; others.

    Fits of few steps stall now and then, and of two that do the one with more unknowns may lead.
    """
    fitted = [
        refined(data, one, excess) if one.names != chosen.names and contains(chosen, one) else one
        for one in others
    ]
    best = min([chosen, *(one for one in fitted if one not in others)], key=lambda one: one.bic)
    return best, [one for one in (chosen, *fitted) if one is not best]


def _status(chosen: Rival, equivalent: Sequence[Rival]) -> str:
    """Return the status of a set that explains what is wrong."""
    if not chosen.listed:
        return "unlisted"
    if equivalent:
        return "class"
    out = all(candidate.name == "parameter" for candidate in chosen.candidates)
    return "parameter" if out else "named"


def _searched(data: Evidence, base: Fit, single: Rival, excess: float) -> Rival:
    """Return the best of fits from all starts of a single effect, with slopes of their own.

    An inertia that is half as large again moves a resonance past lines: the way there is not
    downhill from everywhere.
    """
    found = [refined(data, single, excess)]
    (candidate,) = single.candidates
    if len(candidate.starts) > 1 and not candidate.linear:
        begins = [np.concatenate([base.values, start]) for start in candidate.starts]
        fits = [fit(data, single.candidates, begin) for begin in begins]
        found += [rival(fitted, excess) for fitted in fits]
    return min(found, key=lambda one: one.bic)


def _fit_best(
    data: Evidence, base: Fit, screened: Sequence[Screened], excess: float
) -> list[Rival]:
    """Fit the most promising candidates jointly with what stands; by rising BIC."""
    rules = data.rules
    least = rules.promising_share * screened[0].reduction
    promising = [one for one in screened if one.reduction >= least]
    chosen = varied(promising, rules.most_of_one_name)[: rules.most_fitted]
    return fit_all(data, base, chosen, excess)
