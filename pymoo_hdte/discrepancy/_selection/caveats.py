"""Reasons why a set of effects cannot be named without qualification."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    expected_values,
)
from pymoo_hdte.discrepancy._selection.rules import Rules


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
