"""The probability that a verdict is right, from the evidence of all compared sets and experience.

The evidence tells how much better a set explains the data than the other compared sets. It cannot
tell how often the truth is in none of them, or was reached by no fit. That share was counted for
each status on campaigns with a known truth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, misfit_of
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.screening import Screened


def of_names(
    status: str,
    chosen: Hypothesis,
    equivalent: Sequence[Hypothesis],
    compared: Sequence[Hypothesis],
    degrees_of_freedom: int,
    rules: Rules,
) -> float | None:
    """Return the probability that all names of a verdict, or of a set of its class, are true.

    Each set counts by its evidence, in units of the misfit of the chosen one. A set that contains
    all names of another supports them.

    Parameters
    ----------
    status : str
    chosen : Hypothesis
    equivalent : sequence of Hypothesis
        Other sets of its class.
    compared : sequence of Hypothesis
        All compared sets.
    degrees_of_freedom : int
    rules : Rules

    Returns
    -------
    float or None
        Probability; None for a status that names nothing.
    """
    experience = experience_of(rules).get(status)
    if experience is None:
        return None
    return experience * _share((chosen, *equivalent), compared, degrees_of_freedom)


def experience_of(rules: Rules) -> dict[str, float]:
    """Return the share of verdicts that were right, for each status that names something."""
    return {
        "named": rules.named_right,
        "parameter": rules.named_right,
        "class": rules.class_right,
        "partial": rules.partial_right,
    }


def likelier(
    chosen: Hypothesis,
    equivalent: Sequence[Hypothesis],
    compared: Sequence[Hypothesis],
    degrees_of_freedom: int,
) -> list[Hypothesis]:
    """Return the sets of more evidence than the chosen one, if its class has less than half of it.

    An unqualified name must be more probable than not. Sets that contain the names of the class
    support them and do not count. Parameters are those of `of_names`.
    """
    named = chosen, *equivalent
    if _share(named, compared, degrees_of_freedom) >= 0.5:
        return []
    others = (hypothesis for hypothesis in compared if not _supports(hypothesis, named))
    return [hypothesis for hypothesis in others if hypothesis.fit.evidence < chosen.fit.evidence]


def _share(
    named: Sequence[Hypothesis], compared: Sequence[Hypothesis], degrees_of_freedom: int
) -> float:
    """Return the share of the evidence that supports a class, whose first set is the chosen one."""
    misfit = misfit_of(named[0], degrees_of_freedom)
    evidence = np.array([hypothesis.fit.evidence for hypothesis in compared])
    weights = np.exp(-(evidence - evidence.min()) / (2.0 * misfit))
    supporting = [_supports(hypothesis, named) for hypothesis in compared]
    return float(weights[supporting].sum() / weights.sum())


def _supports(hypothesis: Hypothesis, named: Sequence[Hypothesis]) -> bool:
    return any(claim.names <= hypothesis.names for claim in named)


def of_nothing(screened: Sequence[Screened], n_residuals: int, rules: Rules) -> float:
    """Return the probability that nothing is missing, against all screened candidates.

    Each counts by the BIC that it would have to first order. Beforehand all of them together are as
    probable as that nothing is missing.
    """
    if not screened:
        return rules.adequate_right
    gains = np.array([effect.reduction for effect in screened])
    unknowns = np.array([effect.candidate.unknowns for effect in screened])
    odds = np.exp((gains - unknowns * np.log(n_residuals)) / 2.0).mean()
    return rules.adequate_right / float(1.0 + odds)
