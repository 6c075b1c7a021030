"""Nuisances of a bench: whether one of them explains a misfit better than any effect does.

They are searched for as effects are, by signature first and then by a fit, alone and beside effects
that have been fitted. One that leads becomes a part of the base, and everything is judged anew: so
no hypothesis has it or lacks it, and none is preferred for it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._selection.screening import (
    Screened,
    basis_of,
    beyond_parameters,
    reduced,
)
from pymoo_hdte.discrepancy._selection.search import Search


def leading_nuisances(search: Search, beside: Hypothesis | None = None) -> Fit | None:
    """Return a fit with the nuisances that explain most of what a set leaves; None without any.

    The first has to do better than each effect that has been fitted in its place and, beside a set,
    than each that could be added to it. Others join it as long as they do better than effects to
    first order. Gains count in units of what is left, as if that were noise (Birge, Physical Review
    40, 1932), and each unknown costs its share of the BIC.

    Parameters
    ----------
    search : Search
    beside : Hypothesis, optional
        Set beside which it is searched for; by default there are no effects.
    """
    fitted = search.base if beside is None else beside.fit
    ranked = _ranked(search, beside, [*search.nuisances, *search.screened])
    nuisances = [effect for effect in ranked if effect.candidate.nuisance]
    promising = [
        effect
        for effect in nuisances[: search.data.rules.most_seconds]
        if effect.reduction >= _cost(search, effect.candidate.unknowns)
        and _may_lead(search, effect, beside)
    ]
    trials = [_with(search, fitted, effect) for effect in promising]
    if not trials:
        return None
    best = min(trials, key=lambda trial: trial.chi_square)
    nuisance = best.candidates[-1]
    misfit, gain = best.misfit, fitted.chi_square - best.chi_square
    if gain < misfit * _cost(search, nuisance.unknowns):
        return None
    logarithm = np.log(len(fitted.residuals))
    lead = gain / misfit - nuisance.unknowns * logarithm
    others = [
        effect.reduction / misfit - effect.candidate.unknowns * logarithm
        for effect in (ranked if beside is not None else [])
        if not effect.candidate.nuisance and effect.candidate.releases is None
    ]
    others += [
        (fitted.chi_square - rival.fit.chi_square) / misfit
        - (_unknowns(rival.fit) - _unknowns(fitted)) * logarithm
        for rival in search.hypotheses
        if beside is None or set(rival.candidates) > set(beside.candidates)
    ]
    if lead < max(others, default=-np.inf):
        return None
    return _with_others(search, best, [*search.nuisances, *search.screened])


def leading_group(search: Search) -> Fit | None:
    """Return a fit with nuisances that remove most of the misfit at once; None without such ones.

    To first order each leads all effects in its turn beside those before it, and no effect alone
    comes near all of them. So no effect has to be fitted to know that the bench is at work.
    """
    rules, base = search.data.rules, search.base
    directions, residual = beyond_parameters(base)
    logarithm, freedom = np.log(len(residual)), len(residual) - len(base.values)
    screened, group, begin = [*search.nuisances, *search.screened], list[Screened](), residual
    while open_effects := _that_go_with([effect.candidate for effect in group], screened):
        effects = [reduced(effect, directions, residual) for effect in open_effects]
        most = max(effect.reduction for effect in effects)
        misfit = max((float(residual @ residual) - most) / freedom, 1.0)
        gains = [
            effect.reduction / misfit - effect.candidate.unknowns * logarithm for effect in effects
        ]
        leading = effects[int(np.argmax(gains))]
        if not leading.candidate.nuisance or max(gains) < rules.bic_gain:
            break
        group.append(leading)
        directions = basis_of(np.column_stack([directions, leading.signatures.T]))
        residual = begin - directions @ (directions.T @ begin)
    removed = float(begin @ begin - residual @ residual)
    excess = base.chi_square - freedom
    rivals = [effect.reduction for effect in search.screened]
    share = rules.explained_part_share
    if not group or removed < share * excess or max(rivals, default=0.0) >= share * removed:
        return None
    candidates = tuple(effect.candidate for effect in group)
    values = np.concatenate([base.values, *(effect.start for effect in group)])
    together = fit(search.data, candidates, values, settled=rules.trial_gain)
    cost = sum(_cost(search, candidate.unknowns) for candidate in candidates)
    return together if base.chi_square - together.chi_square >= together.misfit * cost else None


def _with_others(search: Search, fitted: Fit, screened: Sequence[Screened]) -> Fit:
    """Return a fit with all further nuisances that lead, one after the other, to first order."""
    logarithm = np.log(len(fitted.residuals))
    while open_effects := _that_go_with(fitted.candidates, screened):
        directions, residual = beyond_parameters(fitted)
        effects = [reduced(effect, directions, residual) for effect in open_effects]
        most = max(effect.reduction for effect in effects)
        freedom = len(fitted.residuals) - len(fitted.values)
        misfit = max((fitted.chi_square - most) / freedom, 1.0)
        gains = [
            effect.reduction / misfit - effect.candidate.unknowns * logarithm for effect in effects
        ]
        leading = effects[int(np.argmax(gains))]
        if not leading.candidate.nuisance or max(gains) < search.data.rules.bic_gain:
            break
        trial = _with(search, fitted, leading)
        gain = fitted.chi_square - trial.chi_square
        if gain < trial.misfit * _cost(search, leading.candidate.unknowns):
            break
        fitted = trial
    return fitted


def _that_go_with(candidates: Sequence[Candidate], screened: Sequence[Screened]) -> list[Screened]:
    return [
        effect
        for effect in screened
        if effect.candidate.releases is None
        and all(effect.candidate.goes_with(member) for member in candidates)
    ]


def _may_lead(search: Search, effect: Screened, beside: Hypothesis | None) -> bool:
    """Tell whether a nuisance could do as well as the best single effect.

    A prediction is nearly linear in most nuisances, so that half of it to first order is enough.
    """
    if beside is not None or not search.hypotheses:
        return True
    share = search.data.rules.explained_part_share
    return effect.reduction >= share * search.hypotheses[0].removed


def _ranked(
    search: Search, beside: Hypothesis | None, screened: Sequence[Screened]
) -> list[Screened]:
    """Return screened candidates by what each could remove of what a set leaves in any form."""
    if beside is None:
        effects = list(screened)
    else:
        unexplained = search.forms.unexplained(beside.fit)
        if unexplained is None:
            directions, residual = beyond_parameters(beside.fit)
        else:
            directions, residual = unexplained.directions, unexplained.residual
        open_effects = _that_go_with(beside.candidates, screened)
        effects = [reduced(effect, directions, residual) for effect in open_effects]
    return sorted(effects, key=lambda effect: -effect.reduction)


def _with(search: Search, fitted: Fit, effect: Screened) -> Fit:
    """Return a fit with one more candidate, just enough to rank it."""
    values = np.append(fitted.values, effect.start)
    settled = search.data.rules.trial_gain
    return fit(search.data, (*fitted.candidates, effect.candidate), values, settled=settled)


def _cost(search: Search, unknowns: int) -> float:
    """Return the gain that so many unknowns need, in units of the noise."""
    return float(unknowns * np.log(len(search.base.residuals)) + search.data.rules.bic_gain)


def _unknowns(fitted: Fit) -> int:
    return fitted.n_base + sum(candidate.unknowns for candidate in fitted.candidates)
