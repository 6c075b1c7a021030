"""How probable it is that a verdict is right: evidence over all compared sets, and experience.

The evidence tells how much better a set explains the data than the others that were compared. It
cannot tell how often the truth is in none of them, or no fit reached it: that share was counted on
campaigns with a known truth, for each status.
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
    """Return the probability that all names of a verdict, or one of its class, are true.

    Each set counts by its evidence, in units of what even the chosen one leaves. A set that
    contains all names of another says that they are true, too.

    Parameters
    ----------
    status : str
    chosen : Hypothesis
    equivalent : sequence of Hypothesis
        Others of its class.
    found : sequence of Hypothesis
        All compared sets.
    degrees_of_freedom : int
    rules : Rules

    Returns
    -------
    float or None
        None for a status that names nothing.
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
    """Return sets that make names improbable: all of more evidence, if these have less than half.

    Of a plain name it must be more probable than not that it is true. Sets that contain the chosen
    names, or those of an equivalent one, speak for them and do not count.

    Parameters as of `of_names`.
    """
    named = chosen, *equivalent
    if _share(named, compared, degrees_of_freedom) >= 0.5:
        return []
    others = (hypothesis for hypothesis in compared if not _says(hypothesis, named))
    return [hypothesis for hypothesis in others if hypothesis.fit.evidence < chosen.fit.evidence]


def _share(
    named: Sequence[Hypothesis], compared: Sequence[Hypothesis], degrees_of_freedom: int
) -> float:
    """Return the share of the evidence of all compared sets for a class, the chosen set first."""
    misfit = misfit_of(named[0], degrees_of_freedom)
    evidence = np.array([hypothesis.fit.evidence for hypothesis in compared])
    weights = np.exp(-(evidence - evidence.min()) / (2.0 * misfit))
    says = [_says(hypothesis, named) for hypothesis in compared]
    return float(weights[says].sum() / weights.sum())


def _says(hypothesis: Hypothesis, named: Sequence[Hypothesis]) -> bool:
    return any(claim.names <= hypothesis.names for claim in named)


def of_nothing(screened: Sequence[Screened], n_residuals: int, rules: Rules) -> float:
    """Return the probability that nothing is missing, against every candidate that was screened.

    Each counts by the BIC that it would have to first order; all of them together were as likely
    beforehand as nothing.
    """
    if not screened:
        return rules.adequate_right
    gains = np.array([effect.reduction for effect in screened])
    unknowns = np.array([effect.candidate.unknowns for effect in screened])
    odds = np.exp((gains - unknowns * np.log(n_residuals)) / 2.0).mean()
    return rules.adequate_right / float(1.0 + odds)
