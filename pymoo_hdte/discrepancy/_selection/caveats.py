"""Reasons why a set of effects cannot be named without qualification."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitted_sets import beyond_stated
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    bounded_unknowns,
    expected_values,
    explains,
)
from pymoo_hdte.discrepancy._selection.reason import (
    ABOVE_NOISE,
    AT_BOUND,
    FREED_AT_BOUND,
    HARMONIC_OF_ANOTHER,
    NOT_VALIDATED,
    SENSOR_AT_BOUND,
    STANDS_FOR_FORM,
    ZERO_IN_INTERVAL,
    Reason,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.search import Search


def reasons_of(search: Search, chosen: Hypothesis, held_out: HeldOutTest | None) -> list[Reason]:
    """Return why a set cannot be named without qualification; nothing if it can."""
    reasons, fitted = [], chosen.fit
    unsure = uncertain(fitted, search.data.rules)
    for candidate, bounded in bounded_unknowns(fitted):
        if bounded:
            reasons.append(Reason.of(AT_BOUND, candidate.label, bounded))
        elif candidate in unsure:
            reasons += holds_zero([candidate])
    if released := _released_at_bounds(chosen):
        reasons.append(Reason.of(FREED_AT_BOUND, numbers=released))
    for name in _contradicted(chosen.fit, search.data.rules):
        reasons.append(Reason(SENSOR_AT_BOUND, name))
    curves = [candidate.label for candidate in chosen.candidates if not candidate.exact]
    if not search.enough(chosen):
        if curves and chosen.released:
            reasons.append(Reason(STANDS_FOR_FORM, curves[0]))
        reasons += _harmonics_of_another(chosen.candidates)
    if held_out is not None and held_out.denies(search.data.rules, fitted.misfit):
        reasons.append(Reason(NOT_VALIDATED))
    per_degree = fitted.chi_square / search.degrees_of_freedom
    if per_degree > search.data.rules.contradicting_chi_square:
        reasons.append(above_noise(per_degree))
    return reasons


def explains_as_listed(search: Search, hypothesis: Hypothesis) -> bool:
    """Tell whether a set explains the misfit in the listed forms of its laws."""
    return explains(search.data, hypothesis, search.base, search.degrees_of_freedom)


def _harmonics_of_another(candidates: Sequence[Candidate]) -> list[Reason]:
    """Return which effects may be mere harmonics of another effect's form.

    A clearance that varies once in some angle need not do so as a cosine; its harmonics look like
    an error of their order. Effects that fit down to the noise as listed leave no such choice.
    """
    return [
        Reason.of(HARMONIC_OF_ANOTHER, higher.label, {lower.label: higher.order / lower.order})
        for lower, higher in permutations(candidates, 2)
        if not lower.exact and lower.port == higher.port and lower.name != higher.name
        if lower.order is not None and higher.order is not None
        if is_harmonic(higher.order, lower.order)
    ]


def is_harmonic(higher: float, order: float) -> bool:
    """Tell whether an order is a multiple of a lower one."""
    return higher > order and bool(np.isclose(higher % order, 0.0))


def above_noise(per_degree: float) -> Reason:
    """Return that more than noise is left, for a chi-square per degree of freedom."""
    return Reason.of(ABOVE_NOISE, numbers={"times_noise": np.sqrt(per_degree)})


def _released_at_bounds(chosen: Hypothesis) -> dict[str, float]:
    """Return the base values that a set releases and that ended at a bound."""
    fitted = chosen.fit
    released = {candidate.releases for candidate in chosen.candidates} & set(fitted.at_bounds)
    # Parameters of effects follow those of the base, and may have the same names.
    named = reversed([*zip(fitted.parameters, fitted.values, strict=True)])
    return {
        parameter.name: float(value) for parameter, value in named if parameter.name in released
    }


def _contradicted(fitted: Fit, rules: Rules) -> list[str]:
    """Return the zeros and gains of sensors that ended at a bound far beyond what is stated.

    They then absorb what the effects leave, so that the effects are not certain.
    """
    excess = beyond_stated(fitted, rules)
    return [
        parameter.name
        for parameter, side, beyond in zip(
            fitted.parameters, fitted.bound_sides, excess, strict=True
        )
        if side != 0.0 and beyond
    ]


def uncertain(
    fitted: Fit, rules: Rules, covariance: NDArray[np.float64] | None = None
) -> list[Candidate]:
    """Return the candidates of a fit whose strength may be zero.

    ``covariance``, shape (n_parameters, n_parameters), is that of the fit unless a report states
    another one.
    """
    return [
        candidate
        for candidate, place in fitted.places
        if not strength_is_certain(fitted, candidate, place, rules, covariance)
    ]


def holds_zero(candidates: Sequence[Candidate]) -> list[Reason]:
    """Return that the intervals of candidates contain zero."""
    return [Reason(ZERO_IN_INTERVAL, candidate.label) for candidate in candidates]


def strength_is_certain(
    fitted: Fit,
    candidate: Candidate,
    place: slice,
    rules: Rules,
    covariance: NDArray[np.float64] | None = None,
) -> bool:
    """Tell whether the strength of an effect differs from zero by more than the noise.

    Strengths are the unknowns that may be zero; a line counts with both its parts. One strength
    suffices: friction that falls with speed may have no level. Shapes do not count.
    """
    if not candidate.parameters:
        return True
    values = expected_values(fitted, rules)
    covariance = fitted.covariance if covariance is None else covariance
    if varies(candidate, values[place], covariance[place, place], rules):
        return True
    for row, parameter in enumerate(candidate.parameters, place.start):
        if parameter.lower <= 0.0 and not parameter.line:
            deviation = np.sqrt(covariance[row, row])
            if abs(values[row]) > rules.certain_deviations * deviation:
                return True
    return all(parameter.lower > 0.0 for parameter in candidate.parameters)


def varies(
    law: Candidate, values: NDArray[np.float64], covariance: NDArray[np.float64], rules: Rules
) -> bool:
    """Tell whether any line of a law differs from zero, by values (k,) and covariance (k, k)."""
    limit = chi2.isf(2.0 * norm.sf(rules.certain_deviations), 2)
    return any(
        values[pair] @ np.linalg.solve(covariance[np.ix_(pair, pair)], values[pair]) > limit
        for pair in law.lines
    )
