"""Hypotheses: sets of effects fitted jointly with the base, and the misfit that each explains.

An effect that explains only one part of the data must not count as the cause of the others, so that
the excess is compared by part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, fit
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

    @cached_property
    def names(self) -> frozenset[tuple[str, str]]:
        """Name and port of each candidate, where a released value has those of its effect."""
        return frozenset(candidate.named_effect for candidate in self.candidates)


def label_of(effects: Sequence[Candidate]) -> frozenset[str]:
    """Return the labels of a set of effects, which identify it whatever their order."""
    return frozenset(candidate.label for candidate in effects)


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
