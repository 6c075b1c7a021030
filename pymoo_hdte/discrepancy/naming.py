"""The verdict: is anything missing, which effect is it, and how sure is that answer.

The base is fitted within its tolerances first. If it is not adequate, candidates are screened, the
best few are fitted jointly with the base, and the one with the least BIC is named, provided that it
removes most of the excess, in each part of the data that contradicts the base. What the data cannot
tell from it is named beside it. A second effect must remove most of what the first leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.data import Data
from pymoo_hdte.discrepancy.fit import Fit, fit
from pymoo_hdte.discrepancy.library import out_of_tolerance
from pymoo_hdte.discrepancy.rival import (
    EXACT_SHARE,
    SHARE,
    Rival,
    adequate,
    alike,
    excess_of,
    explains,
    rival,
)
from pymoo_hdte.discrepancy.screening import Screened, screen

STATUSES = ("adequate", "named", "class", "parameter", "unlisted")
EXPLAINED = ("named", "class", "parameter")
"""Statuses that say what is missing."""

SECOND_SHARE = 0.8
"""Least share of the excess left by a first effect of no exact form that a second one removes;
beside an exact one it is `SHARE`."""
SECOND_LEAST = 0.05
"""Least share of the base's excess in some part of the data that a second one removes at the port
of a first law of no exact form: less may be that form."""
GAIN = 25.0
"""Reduction of chi-square, to first order, by which some candidate makes a base inadequate though
its total looks well: one line of one channel is lost among a thousand features."""
GENEROUS = 5.0
"""Multiple of these distances within which a rival is fitted to the end before it is judged."""
FITTED = 5
"""Most candidates fitted in earnest after the screening."""
OF_ONE_NAME = 2
"""Most of them of one name: a law that holds another as a special case must not crowd it out."""
SECONDS = 3
"""Names of second effects fitted beside the first, and as many for the sweeps alone."""
EVALUATIONS = {1: 25, 2: 10}
"""Steps of a fit of one effect, and of a second one beside it."""
PROMISING = 0.2
"""Least reduction, as a share of the most promising candidate's, with which one is fitted."""


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
        Other sets that were fitted, by rising BIC.
    equivalent : tuple of Rival
        Those of them that the data cannot tell from the chosen one.
    degrees_of_freedom : int
    """

    status: str
    base: Fit
    chosen: Rival | None
    alternatives: tuple[Rival, ...]
    equivalent: tuple[Rival, ...]
    degrees_of_freedom: int


def judge(data: Data, base: Fit, candidates: Sequence[Candidate]) -> Verdict:
    """Return the verdict on a fitted base."""
    freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *out_of_tolerance(data.base, base.at_bounds)]
    screened = screen(data, base, candidates)
    excess = base.chi_square - freedom
    if base.chi_square <= adequate(freedom) * freedom and screened[0].reduction < GAIN:
        return Verdict("adequate", base, None, (), (), freedom)
    singles = _fit_best(data, base, screened, excess)
    if not explains(data, singles[0], base, freedom):
        singles[0] = _searched(data, base, singles[0], excess)
    chosen, rivals = _with_second(data, base, singles, candidates)
    others = [rival for rival in rivals if rival is not chosen]
    chosen = _refined(data, chosen, excess)
    if not explains(data, chosen, base, freedom):
        return Verdict("unlisted", base, chosen, tuple(others), (), freedom)
    near = [alike(rival, chosen, freedom, GENEROUS) for rival in others]
    others = [
        _refined(data, rival, excess) if flag else rival
        for rival, flag in zip(others, near, strict=True)
    ]
    equivalent = tuple(rival for rival in others if alike(rival, chosen, freedom))
    listed = [one for one in equivalent if one.listed and explains(data, one, base, freedom)]
    if not chosen.listed and listed:
        others = [chosen if rival is listed[0] else rival for rival in others]
        equivalent = tuple(chosen if rival is listed[0] else rival for rival in equivalent)
        chosen = listed[0]
    return Verdict(_status(chosen, equivalent), base, chosen, tuple(others), equivalent, freedom)


def _status(chosen: Rival, equivalent: Sequence[Rival]) -> str:
    """Return the status of a set that explains what is wrong."""
    if not chosen.listed:
        return "unlisted"
    if equivalent:
        return "class"
    out = all(candidate.name == "parameter" for candidate in chosen.candidates)
    return "parameter" if out else "named"


def _with_second(
    data: Data, base: Fit, singles: list[Rival], candidates: Sequence[Candidate]
) -> tuple[Rival, list[Rival]]:
    """Return the set to be named, and all that were fitted: a second effect has to be earned."""
    freedom = len(base.residuals) - len(base.values)
    excess = base.chi_square - freedom
    best = singles[0]
    if not _second_could_count(data, best, base, freedom):
        return best, singles
    pairs = _pairs(data, best, candidates, excess)
    if not pairs or pairs[0].bic >= best.bic:
        return best, [*singles, *pairs]
    pair = pairs[0]
    # The second alone may do: what the screening puts first is not always what fits best.
    second = pair.candidates[1]
    if second.frees is None and all(second.label != one.label for one in singles):
        start = np.concatenate([base.values, pair.fit.values[-len(second.parameters) :]])
        alone = rival(fit(data, (second,), start, EVALUATIONS[1], base.slopes), excess)
        singles = sorted([*singles, alone], key=lambda one: one.bic)
    if _second_earned(data, pair, singles, base, freedom):
        pairs += _exchanged(data, pair, singles, freedom, excess)
        rivals = sorted([*singles, *pairs], key=lambda one: one.bic)
        return next(one for one in rivals if len(one.candidates) == 2), rivals
    rivals = sorted([*singles, *pairs], key=lambda one: one.bic)
    simple = singles[0]
    alone_does = explains(data, simple, base, freedom)
    return (simple if alone_does or not explains(data, pair, base, freedom) else pair), rivals


def _exchanged(
    data: Data, pair: Rival, singles: Sequence[Rival], freedom: int, excess: float
) -> list[Rival]:
    """Return the pair with its first effect exchanged for those that do as well alone."""
    first, second = pair.candidates
    (best,) = (one for one in singles if one.candidates == (first,))
    found = []
    for other in singles:
        (candidate,) = other.candidates
        if alike(other, best, freedom) and candidate.frees is None and candidate.goes_with(second):
            start = np.append(other.fit.values, pair.fit.values[-len(second.parameters) :])
            effects = (candidate, second)
            fitted = fit(data, effects, start, EVALUATIONS[2], other.fit.slopes)
            found.append(rival(fitted, excess))
    return found


def _second_could_count(data: Data, single: Rival, base: Fit, freedom: int) -> bool:
    """Tell whether a second effect beside this one could be earned at all."""
    if single.fit.chi_square <= adequate(freedom) * freedom:
        return False
    return single.exact or bool(excess_of(data, single.fit).significant.any())


def _searched(data: Data, base: Fit, single: Rival, excess: float) -> Rival:
    """Return the best of fits from all starts of a single effect, with slopes of their own.

    An inertia that is half as large again moves a resonance past lines: the way there is not
    downhill from everywhere.
    """
    found = [_refined(data, single, excess)]
    (candidate,) = single.candidates
    if len(candidate.starts) > 1 and not candidate.linear:
        begins = [np.concatenate([base.values, start]) for start in candidate.starts]
        fits = [fit(data, single.candidates, begin) for begin in begins]
        found += [rival(fitted, excess) for fitted in fits]
    return min(found, key=lambda one: one.bic)


def _refined(data: Data, one: Rival, excess: float) -> Rival:
    """Fit a rival to the end, with slopes of its own."""
    return rival(fit(data, one.candidates, one.fit.values), excess)


def _fit_best(data: Data, base: Fit, screened: Sequence[Screened], excess: float) -> list[Rival]:
    """Fit the most promising candidates jointly with what stands; by rising BIC."""
    least = PROMISING * screened[0].reduction
    promising = [one for one in screened if one.reduction >= least]
    chosen = _varied(promising, OF_ONE_NAME)[:FITTED]
    return _fit_all(data, base, chosen, excess)


def _fit_all(data: Data, base: Fit, chosen: Sequence[Screened], excess: float) -> list[Rival]:
    found = []
    for one in chosen:
        start = np.concatenate([base.values, one.start])
        effects = (*base.candidates, one.candidate)
        fitted = fit(data, effects, start, EVALUATIONS[len(effects)], base.slopes)
        found.append(rival(fitted, excess))
    return sorted(found, key=lambda one: one.bic)


def _varied(screened: Sequence[Screened], most: int) -> list[Screened]:
    """Return the candidates without those behind ``most`` better ones of their name."""
    names = [one.candidate.name for one in screened]
    return [one for k, one in enumerate(screened) if names[:k].count(names[k]) < most]


def _pairs(
    data: Data, single: Rival, candidates: Sequence[Candidate], excess: float
) -> list[Rival]:
    """Return the best pairs that contain the best single effect.

    Seconds are taken from what would remove most of all that is left, and from what would remove
    most of what is left of the sweeps: either may drown in the other.
    """
    (first,) = single.candidates
    others = [one for one in candidates if one.frees is None and first.goes_with(one)]
    screened = screen(data, single.fit, others)
    by_sweep = sorted(screened, key=lambda one: -one.at_rest)
    chosen = _varied(screened, 1)[:SECONDS]
    speaking = [one for one in by_sweep if one.at_rest >= GAIN]
    chosen += [one for one in _varied(speaking, 1)[:SECONDS] if one not in chosen]
    return _fit_all(data, single.fit, chosen, excess)


def _second_earned(
    data: Data, pair: Rival, singles: Sequence[Rival], base: Fit, freedom: int
) -> bool:
    """Tell whether the second effect removes most of what the better of the two leaves alone.

    What a law of no exact form leaves may be its form: a second one at its port must also count
    beside the base's excess, and one at another port beside what is numerical.
    """
    labels = {candidate.label for candidate in pair.candidates}
    first = min(
        (single for single in singles if single.candidates[0].label in labels),
        key=lambda single: single.fit.chi_square,
    )
    left = first.fit.chi_square - freedom
    removed = first.fit.chi_square - pair.fit.chi_square
    if first.exact:
        return left > 0.0 and removed >= SHARE * left
    before, alone, both = (excess_of(data, one) for one in (base, first.fit, pair.fit))
    wrong = before.significant & alone.significant
    if not wrong.any():
        return False
    whole, rest = before.of_parts[wrong], alone.of_parts[wrong]
    gain = rest - both.of_parts[wrong]
    worst = int(np.argmax(rest / whole))
    most = removed >= SECOND_SHARE * left or gain[worst] >= SECOND_SHARE * rest[worst]
    one_port = len({candidate.port for candidate in pair.candidates}) == 1
    least = SECOND_LEAST if one_port else 1.0 - EXACT_SHARE
    return bool(most and np.any(gain >= least * whole))
