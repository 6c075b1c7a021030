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
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, label_of
from pymoo_hdte.discrepancy._selection.screening import (
    Screened,
    basis_of,
    beyond_parameters,
    reduced,
)
from pymoo_hdte.discrepancy._selection.search import Search


def leading_nuisances(
    search: Search, beside: Hypothesis | None = None, instead_of: Hypothesis | None = None
) -> Fit | None:
    """Return a fit with the nuisances that explain most of what a set leaves; None without any.

    The first has to do better than each effect that has been fitted in its place and, beside a set,
    than each that could be added to it, or worse by less than names an effect. Others join it as
    long as they do better than effects to first order. Gains count in units of what is left, as if
    that were noise (Birge, Physical Review 40, 1932), and each unknown costs its share of the BIC.

    Parameters
    ----------
    search : Search
    beside : Hypothesis, optional
        Set beside which it is searched for; by default there are no effects.
    instead_of : Hypothesis, optional
        Set that contains that one, and in whose place both would stand. By default what forms of
        laws explain is not asked of the bench; here such a form is the rival.
    """
    fitted = search.base if beside is None else beside.fit
    ranked = _ranked(search, beside, instead_of, [*search.nuisances, *search.screened])
    nuisances = [effect for effect in ranked if effect.candidate.nuisance]
    promising = [
        effect
        for effect in nuisances[: search.data.rules.most_seconds]
        if effect.reduction >= _cost(search, effect.candidate.unknowns)
        and _may_lead(search, effect, beside, instead_of)
    ]
    trials = [_with(search, fitted, effect) for effect in promising]
    if not trials:
        return None
    logarithm, misfit = np.log(len(fitted.residuals)), min(trial.misfit for trial in trials)
    best = min(
        trials,
        key=lambda trial: trial.chi_square / misfit + _unknowns(trial) * logarithm,
    )
    best = fit(search.data, best.candidates, best)
    nuisance = best.candidates[-1]
    misfit, gain = best.misfit, fitted.chi_square - best.chi_square
    if not _is_worth(search, best, fitted):
        return None
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
        if beside is None or _contains(rival, beside)
    ]
    # What the bench explains is no reason to name an effect that explains it no better.
    if lead < max(others, default=-np.inf) - search.data.rules.bic_gain:
        return None
    return _with_others(search, best)


def nuisances_beside(search: Search, hypothesis: Hypothesis) -> Fit | None:
    """Return a fit with nuisances that explain what a set of effects does not; None without any.

    They are searched for beside the set where it leaves more than noise. Where it does not, they
    are beside sets that it contains: what it has beyond these may stand for the bench.
    """
    if not search.enough(hypothesis):
        return leading_nuisances(search, hypothesis)
    for special in search.hypotheses:
        if _contains(hypothesis, special) and (
            of_bench := leading_nuisances(search, special, hypothesis)
        ):
            return of_bench
    return None


def _contains(general: Hypothesis, special: Hypothesis) -> bool:
    """Tell whether a set has all effects of another, or laws of which they are special cases."""
    if label_of(general.candidates) == label_of(special.candidates):
        return False
    return all(
        any(
            member is candidate or (member.port == candidate.port and member.holds(candidate))
            for member in general.candidates
        )
        for candidate in special.candidates
    )


def leading_group(search: Search) -> Fit | None:
    """Return a fit with nuisances that remove most of the misfit at once; None without such ones.

    To first order each leads all effects in its turn beside those before it, and no effect alone
    comes near all of them. So no effect has to be fitted to know that the bench is at work.
    """
    base, share = search.base, search.data.rules.explained_part_share
    group, removed = _leading_in_turn(search, base)
    excess = base.chi_square - (len(base.residuals) - len(base.values))
    rivals = [effect.reduction for effect in search.screened]
    if removed < share * excess or max(rivals, default=0.0) >= share * removed:
        return None
    together = _with(search, base, *group)
    return together if _is_worth(search, together, base) else None


def _with_others(search: Search, fitted: Fit) -> Fit:
    """Return a fit with all further nuisances that lead to first order, if they are worth it."""
    group, _ = _leading_in_turn(search, fitted)
    together = _with(search, fitted, *group) if group else fitted
    return together if group and _is_worth(search, together, fitted) else fitted


def _leading_in_turn(search: Search, fitted: Fit) -> tuple[list[Screened], float]:
    """Return nuisances that lead all effects to first order, and the chi-square that they remove.

    Each does so beside a fit and the nuisances before it.
    """
    directions, residual = beyond_parameters(fitted)
    logarithm, freedom = np.log(len(residual)), len(residual) - len(fitted.values)
    screened, group, begin = [*search.nuisances, *search.screened], list[Screened](), residual
    present = list(fitted.candidates)
    while open_effects := _that_go_with(present, screened):
        effects = [reduced(effect, directions, residual) for effect in open_effects]
        most = max(effect.reduction for effect in effects)
        misfit = max((float(residual @ residual) - most) / freedom, 1.0)
        gains = [
            effect.reduction / misfit - effect.candidate.unknowns * logarithm for effect in effects
        ]
        leading = effects[int(np.argmax(gains))]
        if not leading.candidate.nuisance or max(gains) < search.data.rules.bic_gain:
            break
        group.append(leading)
        present.append(leading.candidate)
        directions = basis_of(np.column_stack([directions, leading.signatures.T]))
        residual = begin - directions @ (directions.T @ begin)
    return group, float(begin @ begin - residual @ residual)


def _is_worth(search: Search, fitted: Fit, before: Fit) -> bool:
    """Tell whether the further candidates of a fit remove what their unknowns cost."""
    further = fitted.candidates[len(before.candidates) :]
    cost = sum(_cost(search, candidate.unknowns) for candidate in further)
    return before.chi_square - fitted.chi_square >= fitted.misfit * cost


def _that_go_with(candidates: Sequence[Candidate], screened: Sequence[Screened]) -> list[Screened]:
    return [
        effect
        for effect in screened
        if effect.candidate.releases is None
        and all(effect.candidate.goes_with(member) for member in candidates)
    ]


def _may_lead(
    search: Search, effect: Screened, beside: Hypothesis | None, instead_of: Hypothesis | None
) -> bool:
    """Tell whether a nuisance could do as well as the best single effect, or as a larger set.

    A prediction is nearly linear in most nuisances, so that half of it to first order is enough.
    """
    removed = 0.0
    if beside is not None and instead_of is not None:
        removed = beside.fit.chi_square - instead_of.fit.chi_square
    elif beside is None and search.hypotheses:
        removed = search.hypotheses[0].removed
    return effect.reduction >= search.data.rules.explained_part_share * removed


def _ranked(
    search: Search,
    beside: Hypothesis | None,
    instead_of: Hypothesis | None,
    screened: Sequence[Screened],
) -> list[Screened]:
    """Return screened candidates by what each could remove of what a set leaves in any form."""
    if beside is None:
        effects = list(screened)
    else:
        unexplained = None if instead_of else search.forms.unexplained(beside.fit)
        if unexplained is None:
            directions, residual = beyond_parameters(beside.fit)
        else:
            directions, residual = unexplained.directions, unexplained.residual
        open_effects = _that_go_with(beside.candidates, screened)
        effects = [reduced(effect, directions, residual) for effect in open_effects]
    return sorted(effects, key=lambda effect: -effect.reduction)


def _with(search: Search, fitted: Fit, *effects: Screened) -> Fit:
    """Return a fit with further candidates, just enough to rank it."""
    values = np.concatenate([fitted.values, *(effect.start for effect in effects)])
    candidates = (*fitted.candidates, *(effect.candidate for effect in effects))
    return fit(search.data, candidates, values, settled=search.data.rules.trial_gain)


def _cost(search: Search, unknowns: int) -> float:
    """Return the gain that so many unknowns need, in units of the noise."""
    return float(unknowns * np.log(len(search.base.residuals)) + search.data.rules.bic_gain)


def _unknowns(fitted: Fit) -> int:
    return fitted.n_base + sum(candidate.unknowns for candidate in fitted.candidates)
