"""A second effect beside the first: searched where the residual is largest, named if it pays off.

The residual of one part of the data may be hidden by that of another, and the residual of a law
without exact form may be an error of its form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.excess import Excess
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import (
    Hypothesis,
    alike,
    down_to_noise,
    explains,
    fit_all,
    hypothesis_of,
    refined,
    varied,
)
from pymoo_hdte.discrepancy.engine.rules import Rules
from pymoo_hdte.discrepancy.engine.screening import Screened, screen


def with_second(
    data: Evidence, base: Fit, singles: list[Hypothesis], candidates: Sequence[Candidate]
) -> tuple[Hypothesis, list[Hypothesis]]:
    """Return the set to be named, with a second effect only if justified, and all fitted sets."""
    degrees_of_freedom = len(base.residuals) - len(base.values)
    excess = base.chi_square - degrees_of_freedom
    best = singles[0]
    if not _second_could_count(data, best, degrees_of_freedom):
        return best, singles
    # Slopes with the first effect included, which approximate those of pairs.
    best = refined(data, best, excess)
    singles = [best, *singles[1:]]
    pairs = _pairs(data, base, best, candidates, excess)
    for place, pair in enumerate(pairs):
        if pair.bic >= best.bic:
            break
        if _promising(data, pair, best, degrees_of_freedom):
            pairs[place] = pair = refined(data, pair, excess)
        if not _second_earned(data, pair, singles, base, degrees_of_freedom):
            continue
        singles = _with_second_alone(data, base, pair, singles, excess)
        if _second_earned(data, pair, singles, base, degrees_of_freedom):
            found = [pair, *_exchanged(data, pair, singles, degrees_of_freedom, excess)]
            hypotheses = sorted([*singles, *pairs, *found[1:]], key=lambda one: one.bic)
            return min(found, key=lambda one: one.bic), hypotheses
    hypotheses = sorted([*singles, *pairs], key=lambda one: one.bic)
    if explains(data, singles[0], base, degrees_of_freedom):
        return singles[0], hypotheses
    does = [pair for pair in pairs if explains(data, pair, base, degrees_of_freedom)]
    return (does[0] if does else singles[0]), hypotheses


def _second_could_count(data: Evidence, single: Hypothesis, degrees_of_freedom: int) -> bool:
    """Tell whether a second effect beside this one could be justified at all."""
    if down_to_noise(single.fit, degrees_of_freedom, data.rules):
        return False
    return single.exact or bool(data.excess(single.fit).significant(data.rules).any())


def _promising(
    data: Evidence, pair: Hypothesis, single: Hypothesis, degrees_of_freedom: int
) -> bool:
    """Tell whether a second effect removes so much that its fit is worth finishing."""
    residual = single.fit.chi_square - degrees_of_freedom
    removed = single.fit.chi_square - pair.fit.chi_square
    return removed >= data.rules.explained_part_share * residual


def _with_second_alone(
    data: Evidence, base: Fit, pair: Hypothesis, singles: list[Hypothesis], excess: float
) -> list[Hypothesis]:
    """Return single effects including the second one of a pair, which may suffice alone.

    The candidate that the screening ranks first does not always fit best.
    """
    second = pair.candidates[1]
    if any(one.candidates == (second,) for one in singles):
        return singles
    start = np.concatenate([base.values, pair.fit.values[-len(second.parameters) :]])
    fitted = fit(data, (second,), start, data.rules.fit_evaluations, base.slopes)
    alone = hypothesis_of(fitted, excess)
    return sorted([*singles, alone], key=lambda one: one.bic)


def _exchanged(
    data: Evidence,
    pair: Hypothesis,
    singles: Sequence[Hypothesis],
    degrees_of_freedom: int,
    excess: float,
) -> list[Hypothesis]:
    """Return pairs with the first effect replaced by those that fit as well alone."""
    first, second = pair.candidates
    (best,) = (one for one in singles if one.candidates == (first,))
    rules, found = data.rules, []
    for other in singles:
        (candidate,) = other.candidates
        fits = candidate.frees is None and candidate.goes_with(second)
        if fits and alike(other, best, degrees_of_freedom, rules):
            start = np.append(other.fit.values, pair.fit.values[-len(second.parameters) :])
            effects = (candidate, second)
            fitted = fit(data, effects, start, rules.pair_evaluations, other.fit.slopes)
            found.append(hypothesis_of(fitted, excess))
    return found


def _pairs(
    data: Evidence, base: Fit, single: Hypothesis, candidates: Sequence[Candidate], excess: float
) -> list[Hypothesis]:
    """Return the best pairs that contain the best single effect.

    Second effects are those that would remove most of the whole residual, and most of the residual
    in the parts of the data that the first explains badly: either may hide the other.
    """
    (first,) = single.candidates
    others = [one for one in candidates if one.frees is None and first.goes_with(one)]
    before, after = (data.excess(one) for one in (base, single.fit))
    ill = [] if single.exact else _ill_explained(before, after, data.rules)
    whole, rest = before.of_parts, after.of_parts
    if not single.exact:
        shares = [rest.sum() / whole.sum(), *rest[ill] / whole[ill]]
        others = [one for one in others if max(shares) >= _least(data, first, one)]
    screened = screen(data, single.fit, others)
    residual = single.fit.chi_square - (base.chi_square - excess)
    chosen = _hopeful(screened, [one.reduction for one in screened], residual, data.rules)
    for part in ill:
        reductions = [one.by_part[part] for one in screened]
        of_part = _hopeful(screened, reductions, float(rest[part]), data.rules)
        chosen += [one for one in of_part if one not in chosen]
    return fit_all(data, single.fit, chosen, excess)


def _least(data: Evidence, first: Candidate, second: Candidate) -> float:
    """Return the least share of the base's excess that a second effect removes."""
    return data.rules.second_form_share if first.port == second.port else data.remainder


def _hopeful(
    screened: Sequence[Screened], reductions: Sequence[float], residual: float, rules: Rules
) -> list[Screened]:
    """Return the best candidates, to first order, if they remove enough of the residual."""
    order = np.argsort([-reduction for reduction in reductions], kind="stable")
    enough = [screened[k] for k in order if reductions[k] >= rules.second_hope_share * residual]
    return varied(enough, 1)[: rules.most_seconds]


def _ill_explained(before: Excess, after: Excess, rules: Rules) -> list[int]:
    """Return the parts of the data that contradict both a base and a fit, the worst first.

    The worst one, and all others that the fit explains by no more than half.
    """
    wrong = np.flatnonzero(before.significant(rules) & after.significant(rules))
    residual = after.of_parts[wrong] / before.of_parts[wrong]
    ranked = wrong[np.argsort(-residual)].tolist()
    return ranked[: max(1, int(np.sum(residual > 1.0 - rules.explained_part_share)))]


def _second_earned(
    data: Evidence,
    pair: Hypothesis,
    singles: Sequence[Hypothesis],
    base: Fit,
    degrees_of_freedom: int,
) -> bool:
    """Tell whether the second effect removes most of the residual of the better one alone.

    The residual of a law without exact form may be an error of its form: a second effect at its
    port must also be large relative to the base's excess, and one at another port relative to the
    numerical error.
    """
    rules, labels = data.rules, {candidate.label for candidate in pair.candidates}
    first = min(
        (single for single in singles if single.candidates[0].label in labels),
        key=lambda single: single.fit.chi_square,
    )
    if first.exact:
        residual = first.fit.chi_square - degrees_of_freedom
        removed = first.fit.chi_square - pair.fit.chi_square
        return residual > 0.0 and removed >= rules.explained_share * residual
    before, alone, both = (data.excess(one) for one in (base, first.fit, pair.fit))
    parts = _ill_explained(before, alone, rules)
    if not parts:
        return False
    least = _least(data, *pair.candidates)
    for part in (slice(None), parts[0]):
        whole, residual, rest = (np.sum(one.of_parts[part]) for one in (before, alone, both))
        if residual - rest >= max(rules.second_share * residual, least * whole):
            return True
    return False
