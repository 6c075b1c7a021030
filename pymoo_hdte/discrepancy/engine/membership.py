"""Whether a member of a set of effects is earned: what the set explains less without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.candidate import Candidate, Layout
from pymoo_hdte.discrepancy.engine.excess import Excess
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit
from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis, down_to_noise
from pymoo_hdte.discrepancy.engine.rules import Rules


def is_earned(
    data: Evidence,
    base: Fit,
    one: Hypothesis,
    rest: Hypothesis,
    member: Sequence[Candidate],
) -> bool:
    """Tell whether a set explains most of what is left without one of its members.

    Beside laws of exact form whatever leads from a misfit down to the noise is earned, if it is
    most of what they leave.
    What a law without exact form leaves may be an error of its form: unless the whole set
    explains the data down to the noise, a member must also be large relative to the base's
    excess at the port of another, and relative to the model's own error elsewhere.
    """
    rules, degrees_of_freedom = data.rules, len(base.residuals) - len(base.values)
    if down_to_noise(rest.fit, degrees_of_freedom, rules):
        return False
    left = rest.fit.chi_square - degrees_of_freedom
    removed = rest.fit.chi_square - one.fit.chi_square
    if rest.exact:
        to_noise = down_to_noise(one.fit, degrees_of_freedom, rules)
        share = rules.explained_part_share if to_noise else rules.explained_share
        return left > 0.0 and removed >= share * left
    per_degree = rest.fit.chi_square / degrees_of_freedom
    if per_degree > rules.contradicting_chi_square and down_to_noise(
        one.fit, degrees_of_freedom, rules
    ):
        return True
    before, alone, both = (data.excess(each) for each in (base, rest.fit, one.fit))
    parts = ill_explained(before, alone, rules)
    if not parts:
        return False
    same_port = any(a.beside(b) for a in member for b in rest.candidates)
    least = rules.second_form_share if same_port else data.remainder
    for part in (slice(None), parts[0]):
        whole, residual, after = (np.sum(each.of_parts[part]) for each in (before, alone, both))
        if residual - after >= max(rules.second_share * residual, least * whole):
            return True
    return False


def ill_explained(before: Excess, after: Excess, rules: Rules) -> list[int]:
    """Return the parts of the data that contradict both a base and a fit, the worst first.

    The worst one, and all others that the fit explains by no more than half.
    """
    wrong = np.flatnonzero(before.significant(rules) & after.significant(rules))
    residual = after.of_parts[wrong] / before.of_parts[wrong]
    ranked = wrong[np.argsort(-residual)].tolist()
    return ranked[: max(1, int(np.sum(residual > 1.0 - rules.explained_part_share)))]


def beyond_stated(fitted: Fit, rules: Rules) -> NDArray[np.float64]:
    """Return the chi-square by which zeros and gains of sensors are far beyond what is stated.

    Of each parameter, shape (n_parameters,); zero where it is near or nothing is stated.
    """
    away = from_stated(fitted)
    return np.where(np.abs(away) > rules.false_alarm_deviations, away**2, 0.0)


def from_stated(fitted: Fit) -> NDArray[np.float64]:
    """Return how far parameters are from what is stated of them, in units of its deviation.

    Shape (n_parameters,); zero where nothing is stated.
    """
    stated = Layout(fitted.parameters)
    return np.asarray((fitted.values - stated.array("start")) / stated.array("prior"))
