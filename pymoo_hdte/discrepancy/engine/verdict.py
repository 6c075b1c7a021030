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

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    alike,
    contains,
    down_to_noise,
    explains,
    fit_all,
    hypothesis_of,
    refined,
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
    chosen : Hypothesis or None
    alternatives : tuple of Hypothesis
        Other sets that were fitted.
    equivalent : tuple of Hypothesis
        Those of them that also explain the data and cannot be separated from the chosen one.
    degrees_of_freedom : int
    rules : Rules
        Thresholds of the verdict.
    """

    status: str
    base: Fit
    chosen: Hypothesis | None
    alternatives: tuple[Hypothesis, ...]
    equivalent: tuple[Hypothesis, ...]
    degrees_of_freedom: int
    rules: Rules = RULES

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


def judge(data: Evidence, base: Fit, candidates: Sequence[Candidate]) -> Verdict:
    """Return the verdict on a fitted base, by the rules of its data."""
    rules = data.rules
    degrees_of_freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *data.out_of_tolerance(base.at_bounds)]
    screened = screen(data, base, candidates)
    excess = base.chi_square - degrees_of_freedom
    gain = screened[0].reduction
    if down_to_noise(base, degrees_of_freedom, rules) and gain < rules.single_effect_gain:
        return Verdict("adequate", base, None, (), (), degrees_of_freedom, rules)
    singles = _fit_best(data, base, screened, excess)
    if not explains(data, singles[0], base, degrees_of_freedom):
        singles[0] = _searched(data, base, singles[0], excess)
    chosen, hypotheses = with_second(data, base, singles, candidates)
    others = [hypothesis for hypothesis in hypotheses if hypothesis is not chosen]
    chosen, others = _least_special(data, refined(data, chosen, excess), others, excess)
    if not explains(data, chosen, base, degrees_of_freedom):
        return Verdict("unlisted", base, chosen, tuple(others), (), degrees_of_freedom, rules)
    near = [
        alike(hypothesis, chosen, degrees_of_freedom, rules, rules.refit_margin)
        for hypothesis in others
    ]
    others = [
        refined(data, hypothesis, excess) if flag else hypothesis
        for hypothesis, flag in zip(others, near, strict=True)
    ]
    equivalent = tuple(
        hypothesis
        for hypothesis in others
        if alike(hypothesis, chosen, degrees_of_freedom, rules)
        and explains(data, hypothesis, base, degrees_of_freedom)
    )
    listed = [hypothesis for hypothesis in equivalent if hypothesis.listed]
    if not chosen.listed and listed:
        others = [chosen if hypothesis is listed[0] else hypothesis for hypothesis in others]
        equivalent = tuple(
            chosen if hypothesis is listed[0] else hypothesis for hypothesis in equivalent
        )
        chosen = listed[0]
    status = _status(chosen, equivalent)
    return Verdict(status, base, chosen, tuple(others), equivalent, degrees_of_freedom, rules)


def _least_special(
    data: Evidence, chosen: Hypothesis, others: list[Hypothesis], excess: float
) -> tuple[Hypothesis, list[Hypothesis]]:
    """Return the chosen set, or a special case that fits as well once converged; and the others.

    Fits with few steps sometimes stall, and of two such fits the one with more unknowns may lead.
    """
    fitted = [
        refined(data, one, excess) if one.names != chosen.names and contains(chosen, one) else one
        for one in others
    ]
    best = min([chosen, *(one for one in fitted if one not in others)], key=lambda one: one.bic)
    return best, [one for one in (chosen, *fitted) if one is not best]


def _status(chosen: Hypothesis, equivalent: Sequence[Hypothesis]) -> str:
    """Return the status of a set that explains the misfit."""
    if not chosen.listed:
        return "unlisted"
    if equivalent:
        return "class"
    out = all(candidate.name == "parameter" for candidate in chosen.candidates)
    return "parameter" if out else "named"


def _searched(data: Evidence, base: Fit, single: Hypothesis, excess: float) -> Hypothesis:
    """Return the best of fits from all starts of a single effect, with slopes of their own.

    An inertia that is larger by half moves a resonance past lines, so that chi-square does not
    decrease steadily on the way there.
    """
    found = [refined(data, single, excess)]
    (candidate,) = single.candidates
    if len(candidate.starts) > 1 and not candidate.linear:
        begins = [np.concatenate([base.values, start]) for start in candidate.starts]
        fits = [fit(data, single.candidates, begin) for begin in begins]
        found += [hypothesis_of(fitted, excess) for fitted in fits]
    return min(found, key=lambda one: one.bic)


def _fit_best(
    data: Evidence, base: Fit, screened: Sequence[Screened], excess: float
) -> list[Hypothesis]:
    """Fit the most promising candidates jointly with the given effects; by rising BIC."""
    rules = data.rules
    least = rules.promising_share * screened[0].reduction
    promising = [one for one in screened if one.reduction >= least]
    chosen = varied(promising, rules.most_of_one_name)[: rules.most_fitted]
    return fit_all(data, base, chosen, excess)
