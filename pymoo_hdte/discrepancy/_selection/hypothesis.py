"""Hypotheses: sets of effects fitted jointly with the base, and the misfit that each explains.

An effect that explains only one part of the data must not count as the cause of the others, so that
the excess is compared by part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, JudgedEvidence, fit
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.screening import Screened


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of effects fitted jointly with the base, with its evidence.

    Attributes
    ----------
    fit : Fit
    bic : float
        Bayesian information criterion: chi-square + parameters x ln(residuals).
    explained : float
        Share of the base's excess chi-square that the set removes; at 1 only noise is left.
    removed : float
        Difference of the base's chi-square and that of the set.
    """

    fit: Fit
    bic: float
    explained: float
    removed: float = 0.0

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Effects and released base parameters of the set."""
        return self.fit.candidates

    @property
    def listed(self) -> bool:
        """Whether a verdict may name all candidates."""
        return all(candidate.listed for candidate in self.candidates)

    @property
    def exact(self) -> bool:
        """Whether the forms of all candidates are known exactly."""
        return all(candidate.exact for candidate in self.candidates)

    @property
    def released(self) -> tuple[Candidate, ...]:
        """Candidates that are base parameters released from their tolerance."""
        return tuple(candidate for candidate in self.candidates if candidate.releases is not None)

    @property
    def effects(self) -> tuple[Candidate, ...]:
        """Candidates that are effects, not base parameters."""
        return tuple(candidate for candidate in self.candidates if candidate.releases is None)

    @property
    def label(self) -> str:
        """Labels of all candidates, joined by plus signs."""
        return "+".join(candidate.label for candidate in self.candidates)

    @property
    def members(self) -> list[tuple[Candidate, ...]]:
        """The effects one by one; released base parameters form one member together."""
        members = [(candidate,) for candidate in self.effects]
        return members + ([self.released] if self.released else [])

    def values_of(self, effects: Sequence[Candidate]) -> NDArray[np.float64]:
        """Return the fitted values of the base and of some of its effects, in the order of both."""
        parts = [
            self.fit.values[place] for candidate, place in self.fit.places if candidate in effects
        ]
        return np.concatenate([self.fit.values[: self.fit.n_base], *parts])

    @cached_property
    def names(self) -> frozenset[tuple[str, str]]:
        """Name and port of each candidate, where a released value has those of its effect."""
        return frozenset(candidate.named_effect for candidate in self.candidates)


def label_of(effects: Sequence[Candidate]) -> frozenset[str]:
    """Return the labels of a set of effects, which identify it whatever their order."""
    return frozenset(candidate.label for candidate in effects)


def may_be_together(effects: Sequence[Candidate]) -> bool:
    """Tell whether a machine may have all these effects together, none of them twice."""
    twice = len(label_of(effects)) < len(effects)
    pairs = combinations(effects, 2)
    return not twice and all(effect.goes_with(partner) for effect, partner in pairs)


def hypothesis_of(fitted: Fit, of_base: float) -> Hypothesis:
    """Return a fit with its evidence, for a given excess chi-square of the base."""
    n_base = fitted.n_base
    unknowns = n_base + sum(candidate.unknowns for candidate in fitted.candidates)
    bic = fitted.chi_square + unknowns * np.log(len(fitted.residuals))
    gain = of_base + (len(fitted.residuals) - n_base) - fitted.chi_square
    share = gain / max(of_base, gain) if gain > 0.0 else 0.0
    return Hypothesis(fitted, float(bic), float(share), float(gain))


def adequate(degrees_of_freedom: int, rules: Rules) -> float:
    """Return the largest chi-square per degree of freedom of an adequate model; 1.15 for 1400."""
    return float(1.0 + rules.false_alarm_deviations * np.sqrt(2.0 / degrees_of_freedom))


def down_to_noise(fitted: Fit, degrees_of_freedom: int, rules: Rules) -> bool:
    """Tell whether the chi-square of a fit is that of noise, as of `adequate`."""
    return fitted.chi_square <= adequate(degrees_of_freedom, rules) * degrees_of_freedom


def contradicted_parts(data: JudgedEvidence, base: Fit, fitted: Fit) -> NDArray[np.bool_]:
    """Tell which parts of the data contradict both the base and a fit, shape (parts,).

    If there are several records, the worst of each part is left out: it may be at a resonance,
    where no form is exact.
    """
    before, after, rules = data.excess(base), data.excess(fitted), data.rules
    worst = after.worst
    before, after = before.without(worst), after.without(worst)
    contradicting = rules.contradicting_chi_square - 1.0
    plain = after.of_parts > contradicting * after.degrees_of_freedom.sum(axis=0)
    residual = after.of_parts > (1.0 - rules.explained_part_share) * before.of_parts
    return np.asarray(before.significant(rules) & plain & residual)


def bounded_unknowns(fitted: Fit) -> list[tuple[Candidate, dict[str, float]]]:
    """Return for each candidate of a fit its unknowns that ended at a bound, with their values.

    A level of zero does not count, since the effect then lacks this part. Neither does a corner
    that is as sharp as points can resolve.
    """
    bounded = []
    for candidate, place in fitted.places:
        values = {}
        rows = range(place.start, place.stop)
        for row, parameter in zip(rows, candidate.parameters, strict=True):
            side = fitted.bound_sides[row]
            none = parameter.linear and parameter.lower == 0.0 and side < 0.0
            if parameter.limited_at(side) and not none:
                values[parameter.name] = float(fitted.values[row])
        bounded.append((candidate, values))
    return bounded


def is_bounded(fitted: Fit) -> bool:
    """Tell whether any unknown of the candidates of a fit ended at a bound."""
    return any(bounded for _, bounded in bounded_unknowns(fitted))


def expected_values(fitted: Fit, rules: Rules) -> NDArray[np.float64]:
    """Return the expected values by a fit and its bounds, shape (n_parameters,).

    Intervals lie around these. A base parameter that no record determines ends anywhere between its
    bounds; its expectation is the middle. Correlated values, such as an inertia beyond the nominal
    one, move along.
    """
    n, variance = fitted.n_base, np.diag(fitted.covariance)
    layout = Layout(fitted.parameters)
    lower, upper = layout.array("lower"), layout.array("upper")
    uniform = (upper - lower) ** 2 / 12.0
    width = 2.0 * rules.certain_deviations * np.sqrt(variance)
    undetermined = width > rules.undetermined_share * (upper - lower)
    undetermined[n:] = False
    pull = np.where(undetermined, ((lower + upper) / 2.0 - fitted.values) / uniform, 0.0)
    moved = fitted.values + fitted.covariance @ pull
    return np.asarray(np.clip(moved, lower, upper))


def gains_enough(hypothesis: Hypothesis, base: Fit, rules: Rules) -> bool:
    """Tell whether a set of effects reduces the BIC of the base enough to be named."""
    unknowns = sum(candidate.unknowns for candidate in hypothesis.candidates)
    gain = base.chi_square - hypothesis.fit.chi_square
    return bool(gain - unknowns * np.log(len(base.residuals)) >= rules.bic_gain)


def explains(
    data: JudgedEvidence, hypothesis: Hypothesis, base: Fit, degrees_of_freedom: int
) -> bool:
    """Tell whether a set of effects explains the misfit of the base, in all parts of the data."""
    rules, limit = data.rules, adequate(degrees_of_freedom, data.rules)
    share = rules.exact_share if hypothesis.exact else rules.explained_share
    limit = max(limit, rules.exact_chi_square) if hypothesis.exact else limit
    if not gains_enough(hypothesis, base, rules):
        return False
    if hypothesis.fit.chi_square <= limit * degrees_of_freedom:
        return True
    return (
        hypothesis.explained >= share and not contradicted_parts(data, base, hypothesis.fit).any()
    )


def misfit_of(hypothesis: Hypothesis, degrees_of_freedom: int) -> float:
    """Return the chi-square per degree of freedom of a set, at least 1: the unit of gains."""
    return max(hypothesis.fit.chi_square / degrees_of_freedom, 1.0)


def indistinguishable(
    hypothesis: Hypothesis,
    chosen: Hypothesis,
    degrees_of_freedom: int,
    rules: Rules,
) -> bool:
    """Tell whether these data do not separate a hypothesis from the chosen one.

    The true form of an effect may differ from the listed one. Two sets therefore compete if one
    leaves no more beyond the other than such forms do, unless they differ only by effects of exact
    form or one is a special case of the other. If the chosen set leaves more than noise,
    differences of chi-square are compared with what it leaves. The evidence alone decides if an
    effect stands for several base parameters, or if the hypothesis has a form that only stands in
    for a listed one.
    """
    if hypothesis.names == chosen.names:
        return False
    misfit = misfit_of(chosen, degrees_of_freedom)
    close = near_by_evidence(hypothesis, chosen, degrees_of_freedom, rules)
    if len(hypothesis.candidates) != len(chosen.candidates):
        return close and _stands_for_parameters(hypothesis, chosen)
    residual = chosen.fit.chi_square - degrees_of_freedom
    if not (
        close
        or hypothesis.exact
        or chosen.exact
        or contains(hypothesis, chosen)
        or contains(chosen, hypothesis)
    ):
        increase = hypothesis.fit.chi_square - chosen.fit.chi_square
        pairs = differing(hypothesis.candidates, chosen.candidates)
        if any(member.only_as_form for member, _ in pairs):
            return False
        exact = all(member.exact and counterpart.exact for member, counterpart in pairs)
        close = not exact and increase < rules.form_accuracy**2 * (chosen.removed + residual)
    if (
        close
        or misfit <= adequate(degrees_of_freedom, rules)
        or (hypothesis.exact and chosen.exact)
    ):
        return close
    return hypothesis.fit.chi_square - degrees_of_freedom < rules.form_ratio * residual


def near_by_evidence(
    hypothesis: Hypothesis, chosen: Hypothesis, degrees_of_freedom: int, rules: Rules
) -> bool:
    """Tell whether the evidence does not separate a set from the chosen one."""
    misfit = misfit_of(chosen, degrees_of_freedom)
    return hypothesis.fit.evidence - chosen.fit.evidence < rules.evidence_distance * misfit


def _stands_for_parameters(hypothesis: Hypothesis, chosen: Hypothesis) -> bool:
    """Tell whether two sets have equally many members, but different effects.

    Other numbers of parameters beside the same effects are no other answer.
    """
    effects, replaced = label_of(hypothesis.effects), label_of(chosen.effects)
    return (
        bool(effects and replaced)
        and effects != replaced
        and len(hypothesis.members) == len(chosen.members)
    )


def leave_the_same(hypothesis: Hypothesis, chosen: Hypothesis, rules: Rules) -> bool:
    """Tell whether two sets leave so nearly the same that the same effect must be missing."""
    difference = abs(hypothesis.fit.chi_square - chosen.fit.chi_square)
    return difference <= rules.trial_gain * chosen.fit.chi_square


def contains(hypothesis: Hypothesis, special: Hypothesis) -> bool:
    """Tell whether a set contains another: it differs only by laws that contain the other's.

    Stribeck friction without its excess is Coulomb friction, so that it always explains as much.
    Beside a law that contains the other's a set may release further values.
    """
    released, special_released = label_of(hypothesis.released), label_of(special.released)
    if len(hypothesis.effects) != len(special.effects):
        return False
    pairs = differing(hypothesis.effects, special.effects)
    wider = all(law.port == case.port and law.holds(case) for law, case in pairs)
    return wider and (
        released == special_released or (bool(pairs) and released > special_released > set())
    )


def differing(
    members: Sequence[Candidate], counterparts: Sequence[Candidate]
) -> list[tuple[Candidate, Candidate]]:
    """Return pairs of the candidates by which two sets of one size differ, ordered by port."""
    shared = Counter(_places(members)) & Counter(_places(counterparts))
    unshared = (_beyond(candidates, shared) for candidates in (members, counterparts))
    by_port = (sorted(candidates, key=lambda candidate: candidate.port) for candidates in unshared)
    return list(zip(*by_port, strict=True))


def _places(candidates: Sequence[Candidate]) -> list[tuple[str, str]]:
    return [(candidate.name, candidate.port) for candidate in candidates]


def _beyond(candidates: Sequence[Candidate], shared: Counter[tuple[str, str]]) -> list[Candidate]:
    """Return the candidates beyond those that are shared; a set may hold a name twice."""
    remaining, beyond = Counter(shared), []
    for place, candidate in zip(_places(candidates), candidates, strict=True):
        if remaining[place]:
            remaining[place] -= 1
        else:
            beyond.append(candidate)
    return beyond


def fit_all(
    data: Evidence, base: Fit, chosen: Sequence[Screened], excess: float
) -> list[Hypothesis]:
    """Return the fits of each candidate jointly with those of the base, by rising BIC."""
    hypotheses = []
    for effect in chosen:
        fitted = fit(
            data, (*base.candidates, effect.candidate), np.append(base.values, effect.start)
        )
        hypotheses.append(hypothesis_of(fitted, excess))
    return sorted(hypotheses, key=lambda hypothesis: hypothesis.bic)
