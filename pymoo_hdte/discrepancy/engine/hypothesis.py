"""Sets of effects fitted jointly with the base: how much of the misfit each explains, and where.

An effect that explains one part of the data only must not pass for the cause of the others: see
`excess`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.excess import DEVIATIONS
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, count, fit
from pymoo_hdte.discrepancy.engine.screening import Screened
from pymoo_hdte.laws.effect import is_contained

SHARE = 0.9
"""Least share of the excess chi-square that named effects remove."""
PART_SHARE = 0.5
"""Least share of the excess of each part of the data that they remove."""
PLAIN = 9.0
"""Chi-square per degree of freedom from which a part of the data plainly contradicts a model: three
times the noise."""
EXACT = 1.3
"""Chi-square per degree of freedom that does for effects of an exact form: noise that a resonance
magnifies is no longer that of the linear covariance."""
EXACT_SHARE = 0.9999
"""Least share that effects of an exact form remove, if they do not explain down to the noise: of a
line ten thousand times the noise, the integrator's steps show."""
ALIKE = 2.0
"""Where no form fits to the noise, a rival that leaves less than this multiple of what the chosen
one leaves cannot be excluded: what is left is the form, not the noise."""
BIC_GAIN = 6.0
"""Least gain of BIC of a named effect."""
VERY_STRONG = 10.0
"""Distance of twice the logarithm of the evidence within which rivals cannot be told apart (Kass,
Raftery, J. Am. Stat. Assoc. 1995)."""


EVALUATIONS = {1: 25, 2: 10}
"""Steps of a fit of one effect, and of a second one beside it."""
REFINEMENT = 12
"""Steps of a fit that begins where one of these ended, with slopes of its own."""


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

    @cached_property
    def names(self) -> frozenset[tuple[str, str]]:
        """Name and port of each."""
        return frozenset((candidate.name, candidate.port) for candidate in self.candidates)


def rival(fitted: Fit, of_base: float) -> Rival:
    """Return a fit with its evidence, the base's excess chi-square being given."""
    n_base = len(fitted.values) - count(fitted.candidates)
    unknowns = n_base + sum(candidate.unknowns for candidate in fitted.candidates)
    bic = fitted.chi_square + unknowns * np.log(len(fitted.residuals))
    gain = of_base + (len(fitted.residuals) - n_base) - fitted.chi_square
    share = gain / max(of_base, gain) if gain > 0.0 else 0.0
    return Rival(fitted, float(bic), float(share))


def adequate(freedom: int) -> float:
    """Return chi-square per degree of freedom up to which a model is adequate; 1.15 for 1400."""
    return float(1.0 + DEVIATIONS * np.sqrt(2.0 / freedom))


def down_to_noise(fitted: Fit, freedom: int) -> bool:
    """Tell whether a fit is `adequate`."""
    return fitted.chi_square <= adequate(freedom) * freedom


def unexplained(data: Evidence, base: Fit, fitted: Fit) -> NDArray[np.bool_]:
    """Tell which parts of the data, of those that contradict the base, a fit plainly misses too.

    Shape (parts,), as `Excess` has them. Of several records the worst is left out: one condition
    may lie at a resonance, where no form is exact.
    """
    before, after = data.excess(base), data.excess(fitted)
    worst = after.worst
    before, after = before.without(worst), after.without(worst)
    plain = after.of_parts > (PLAIN - 1.0) * after.freedom.sum(axis=0)
    left = after.of_parts > (1.0 - PART_SHARE) * before.of_parts
    return np.asarray(before.significant & plain & left)


def explains(data: Evidence, one: Rival, base: Fit, freedom: int) -> bool:
    """Tell whether a set of effects removes what is wrong with the base, and wherever it is."""
    gain = base.chi_square - one.fit.chi_square
    unknowns = sum(candidate.unknowns for candidate in one.candidates)
    share = EXACT_SHARE if one.exact else SHARE
    limit = max(adequate(freedom), EXACT) if one.exact else adequate(freedom)
    if gain - unknowns * np.log(len(base.residuals)) < BIC_GAIN:
        return False
    if one.fit.chi_square <= limit * freedom:
        return True
    return one.share >= share and not unexplained(data, base, one.fit).any()


def alike(one: Rival, chosen: Rival, freedom: int, margin: float = 1.0) -> bool:
    """Tell whether the data cannot separate a rival with other effects from the chosen one.

    Where even the chosen form leaves more than noise, that remainder is the scale on which chi-
    squares differ: hidden and listed forms of one effect differ in kind.
    """
    if len(one.candidates) != len(chosen.candidates) or one.names == chosen.names:
        return False
    misfit = max(chosen.fit.chi_square / freedom, 1.0)
    near = one.fit.evidence - chosen.fit.evidence < margin * VERY_STRONG * misfit
    if near or misfit <= adequate(freedom) or (one.exact and chosen.exact):
        return near
    return one.fit.chi_square - freedom < margin * ALIKE * (chosen.fit.chi_square - freedom)


def contains(one: Rival, other: Rival) -> bool:
    """Tell whether a set differs from another only by laws that hold the other's as special cases.

    Stribeck's friction without its excess is Coulomb's: it always explains as much.
    """
    if len(one.candidates) != len(other.candidates):
        return False
    pairs = zip(
        *(sorted(each.candidates, key=lambda c: c.port) for each in (one, other)), strict=True
    )
    return all(
        wide.port == special.port
        and (wide.name == special.name or is_contained(special.name, wide.name))
        for wide, special in pairs
    )


def refined(data: Evidence, one: Rival, excess: float) -> Rival:
    """Fit a rival further from where it ended, with slopes of its own."""
    return rival(fit(data, one.candidates, one.fit.values, REFINEMENT), excess)


def fit_all(data: Evidence, base: Fit, chosen: Sequence[Screened], excess: float) -> list[Rival]:
    """Fit candidates, each jointly with what stands; by rising BIC."""
    found = []
    for one in chosen:
        start = np.concatenate([base.values, one.start])
        effects = (*base.candidates, one.candidate)
        fitted = fit(data, effects, start, EVALUATIONS[len(effects)], base.slopes)
        found.append(rival(fitted, excess))
    return sorted(found, key=lambda one: one.bic)


def varied(screened: Sequence[Screened], most: int) -> list[Screened]:
    """Return the candidates without those behind ``most`` better ones of their name."""
    names = [one.candidate.name for one in screened]
    return [one for k, one in enumerate(screened) if names[:k].count(names[k]) < most]
