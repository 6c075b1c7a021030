"""The verdict: is anything missing, which effect is it, and how sure is that answer.

The base is fitted within its tolerances first. If it is not adequate, candidates are screened, the
best few are fitted jointly with the base, and the one with the least BIC is named, provided that it
removes most of the excess. What the data cannot tell from it is named beside it. A second effect
must remove most of what the first leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.data import Data
from pymoo_hdte.discrepancy.fit import Fit, fit
from pymoo_hdte.discrepancy.library import out_of_tolerance
from pymoo_hdte.discrepancy.objective import count
from pymoo_hdte.discrepancy.screening import Screened, screen

STATUSES = ("adequate", "named", "class", "parameter", "unlisted")
EXPLAINED = ("named", "class", "parameter")
"""Statuses that say what is missing."""

_DEVIATIONS = 4.0
"""Standard deviations of chi-square up to which a base is adequate."""
SHARE = 0.9
"""Least share of the excess chi-square that named effects remove."""
EXACT = 1.3
"""Chi-square per degree of freedom that does for effects of an exact form: noise that a resonance
magnifies is no longer that of the linear covariance."""
EXACT_SHARE = 0.9999
"""Least share that effects of an exact form remove, if they do not explain down to the noise: of a
line ten thousand times the noise, the integrator's steps show."""
SECOND_SHARE = 0.8
"""Least share of the excess left by a first effect of no exact form that a second one removes;
beside an exact one it is `SHARE`."""
SECOND_LEAST = 0.02
"""Least share of the whole excess that a second one removes beside a law of no exact form."""
GAIN = 25.0
"""Reduction of chi-square, to first order, by which some candidate makes a base inadequate though
its total looks well: one line of one channel is lost among a thousand features."""
ALIKE = 2.0
"""Where no form fits to the noise, a rival that leaves less than this multiple of what the chosen
one leaves cannot be excluded: what is left is the form, not the noise."""
BIC_GAIN = 6.0
"""Least gain of BIC of a named effect."""
VERY_STRONG = 10.0
"""Distance of twice the logarithm of the evidence within which rivals cannot be told apart (Kass,
Raftery, J. Am. Stat. Assoc. 1995)."""
GENEROUS = 5.0
"""Multiple of these distances within which a rival is fitted to the end before it is judged."""
FITTED = 5
"""Most candidates fitted in earnest after the screening."""
OF_ONE_NAME = 2
"""Most of them of one name: a law that holds another as a special case must not crowd it out."""
EVALUATIONS = {1: 25, 2: 10}
"""Steps of a fit of one effect, and of a second one beside it."""
PROMISING = 0.2
"""Least reduction, as a share of the most promising candidate's, with which one is fitted."""


@dataclass(frozen=True, eq=False)
class Rival:
    """A set of effects fitted jointly with the base, with its evidence.

    Attributes
    ----------
    fit : Fit
    bic : float
        Chi-square + parameters x ln(residuals).
    share : float
        Of the base's excess chi-square that it removes; 1 leaves nothing but noise.
    """

    fit: Fit
    bic: float
    share: float

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The effects."""
        return self.fit.candidates

    @property
    def listed(self) -> bool:
        """Whether a verdict may name all of them."""
        return all(candidate.listed for candidate in self.candidates)

    @property
    def exact(self) -> bool:
        """Whether the forms of all of them leave nothing open."""
        return all(candidate.exact for candidate in self.candidates)

    @property
    def label(self) -> str:
        """Their labels in one word."""
        return "+".join(candidate.label for candidate in self.candidates)


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


def adequate(freedom: int) -> float:
    """Return chi-square per degree of freedom up to which a model is adequate; 1.15 for 1400."""
    return float(1.0 + _DEVIATIONS * np.sqrt(2.0 / freedom))


def judge(data: Data, base: Fit, candidates: Sequence[Candidate]) -> Verdict:
    """Return the verdict on a fitted base."""
    freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *out_of_tolerance(data.base, base.at_bounds)]
    screened = screen(data, base, candidates)
    excess = base.chi_square - freedom
    if base.chi_square <= adequate(freedom) * freedom and screened[0].reduction < GAIN:
        return Verdict("adequate", base, None, (), (), freedom)
    singles = _fit_best(data, base, screened, excess)
    if not _explains(singles[0], base, freedom):
        singles[0] = _searched(data, base, singles[0], excess)
    rivals = list(singles)
    if _second_could_count(singles[0], freedom):
        pairs = _pairs(data, singles[0], candidates, excess)
        rivals = sorted([*singles, *pairs], key=lambda rival: rival.bic)
    chosen = rivals[0]
    if len(chosen.candidates) == 2 and not _second_earned(chosen, singles, base, freedom):
        alone = _explains(singles[0], base, freedom) or not _explains(chosen, base, freedom)
        chosen = singles[0] if alone else chosen
    others = [rival for rival in rivals if rival is not chosen]
    chosen = _refined(data, chosen, excess)
    if not _explains(chosen, base, freedom):
        return Verdict("unlisted", base, chosen, tuple(others), (), freedom)
    near = [_alike(rival, chosen, freedom, GENEROUS) for rival in others]
    others = [
        _refined(data, rival, excess) if flag else rival
        for rival, flag in zip(others, near, strict=True)
    ]
    equivalent = tuple(rival for rival in others if _alike(rival, chosen, freedom))
    listed = [r for r in equivalent if r.listed and _explains(r, base, freedom)]
    if not chosen.listed and listed:
        others = [chosen if rival is listed[0] else rival for rival in others]
        equivalent = tuple(chosen if rival is listed[0] else rival for rival in equivalent)
        chosen = listed[0]
    if not chosen.listed:
        status = "unlisted"
    elif equivalent:
        status = "class"
    else:
        out = all(candidate.name == "parameter" for candidate in chosen.candidates)
        status = "parameter" if out else "named"
    return Verdict(status, base, chosen, tuple(others), equivalent, freedom)


def _second_could_count(single: Rival, freedom: int) -> bool:
    """Tell whether a second effect beside this one could be earned at all."""
    if single.fit.chi_square <= adequate(freedom) * freedom:
        return False
    return single.exact or single.share <= 1.0 - SECOND_LEAST


def _explains(rival: Rival, base: Fit, freedom: int) -> bool:
    """Tell whether a set of effects removes what is wrong with the base."""
    residuals = len(base.residuals)
    gain = base.chi_square - rival.fit.chi_square
    penalty = sum(candidate.unknowns for candidate in rival.candidates) * np.log(residuals)
    share = EXACT_SHARE if rival.exact else SHARE
    limit = max(adequate(freedom), EXACT) if rival.exact else adequate(freedom)
    enough = rival.fit.chi_square <= limit * freedom or rival.share >= share
    return bool(gain - penalty >= BIC_GAIN and enough)


def _alike(rival: Rival, chosen: Rival, freedom: int, margin: float = 1.0) -> bool:
    """Tell whether the data cannot separate a rival with other effects from the chosen one.

    Where even the chosen form leaves more than noise, that remainder is the scale on which chi-
    squares differ: hidden and listed forms of one effect differ in kind.
    """
    if len(rival.candidates) != len(chosen.candidates):
        return False
    if _named(rival) == _named(chosen):
        return False
    misfit = max(chosen.fit.chi_square / freedom, 1.0)
    near = rival.fit.evidence - chosen.fit.evidence < margin * VERY_STRONG * misfit
    if near or misfit <= adequate(freedom) or (rival.exact and chosen.exact):
        return near
    return rival.fit.chi_square - freedom < margin * ALIKE * (chosen.fit.chi_square - freedom)


def _searched(data: Data, base: Fit, rival: Rival, excess: float) -> Rival:
    """Return the best of fits from all starts of a single effect, with slopes of their own.

    An inertia that is half as large again moves a resonance past lines: the way there is not
    downhill from everywhere.
    """
    found = [_refined(data, rival, excess)]
    (candidate,) = rival.candidates
    if len(candidate.starts) > 1 and not candidate.linear:
        begins = [np.concatenate([base.values, start]) for start in candidate.starts]
        fits = [fit(data, rival.candidates, begin) for begin in begins]
        found += [_rival(fitted, excess) for fitted in fits]
    return min(found, key=lambda one: one.bic)


def _named(rival: Rival) -> set[tuple[str, str]]:
    return {(candidate.name, candidate.port) for candidate in rival.candidates}


def _refined(data: Data, rival: Rival, excess: float) -> Rival:
    """Fit a rival to the end, with slopes of its own."""
    return _rival(fit(data, rival.candidates, rival.fit.values), excess)


def _fit_best(data: Data, base: Fit, screened: Sequence[Screened], excess: float) -> list[Rival]:
    """Fit the most promising candidates jointly with what stands; by rising BIC."""
    found = []
    least = PROMISING * screened[0].reduction
    for one in _varied([one for one in screened if one.reduction >= least])[:FITTED]:
        start = np.concatenate([base.values, one.start])
        effects = (*base.candidates, one.candidate)
        fitted = fit(data, effects, start, EVALUATIONS[len(effects)], base.slopes)
        found.append(_rival(fitted, excess))
    return sorted(found, key=lambda rival: rival.bic)


def _varied(screened: Sequence[Screened]) -> list[Screened]:
    """Return the candidates without those behind `OF_ONE_NAME` better ones of their name."""
    names = [one.candidate.name for one in screened]
    return [one for k, one in enumerate(screened) if names[:k].count(names[k]) < OF_ONE_NAME]


def _rival(fitted: Fit, excess: float) -> Rival:
    n_base = len(fitted.values) - count(fitted.candidates)
    unknowns = n_base + sum(candidate.unknowns for candidate in fitted.candidates)
    bic = fitted.chi_square + unknowns * np.log(len(fitted.residuals))
    gain = excess + (len(fitted.residuals) - n_base) - fitted.chi_square
    share = gain / max(excess, gain)
    return Rival(fitted, float(bic), float(share))


def _pairs(
    data: Data, single: Rival, candidates: Sequence[Candidate], excess: float
) -> list[Rival]:
    """Return the best pairs that contain the best single effect."""
    (first,) = single.candidates
    others = [one for one in candidates if not first.places & one.places and one.frees is None]
    return _fit_best(data, single.fit, screen(data, single.fit, others)[:2], excess)


def _second_earned(pair: Rival, singles: Sequence[Rival], base: Fit, freedom: int) -> bool:
    """Tell whether the second effect removes most of what the better of the two leaves alone.

    What a law of no exact form leaves may be its form: there it must also count beside the whole.
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
    counts = removed >= SECOND_LEAST * (base.chi_square - freedom)
    return left > 0.0 and removed >= SECOND_SHARE * left and counts
