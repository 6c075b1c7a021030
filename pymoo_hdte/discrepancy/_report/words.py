"""Sentences of the reasons of a verdict, beside each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pymoo_hdte.discrepancy._evidence.order_lines.parameters import labels_by_order
from pymoo_hdte.discrepancy._selection import reason as codes
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.reason import Reason
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.effects.sentence_blanks import listed

Label = Callable[[str], str]
"""From the label of a set of effects to how it is written."""

_SENTENCES: dict[str, Callable[[Reason, Label], str]] = {
    codes.AT_BOUND: lambda reason, label: (
        f"{', '.join(reason.names)} of {label(reason.effect)} ended at a bound"
    ),
    codes.ZERO_IN_INTERVAL: lambda reason, label: (
        f"the interval of {label(reason.effect)} contains zero"
    ),
    codes.FREED_AT_BOUND: lambda reason, label: (
        "a base parameter ended at ten times or a tenth of its nominal value"
    ),
    codes.SENSOR_AT_BOUND: lambda reason, label: (
        f"{reason.effect.replace('_', ' ')} ended far outside its stated limits"
    ),
    codes.STANDS_FOR_FORM: lambda reason, label: (
        f"values out of tolerance may stand for the residual of {label(reason.effect)}"
    ),
    codes.HARMONIC_OF_ANOTHER: lambda reason, label: (
        f"{label(reason.effect)} may be a harmonic of {label(*reason.names)}"
    ),
    codes.NOT_VALIDATED: lambda reason, label: (
        "the prediction error on the held-out records does not shrink as it should"
    ),
    codes.HELD_OUT_ERROR_GROWS: lambda reason, label: (
        f"the prediction error on held-out records grows: {listed(reason.names)}"
    ),
    codes.ABOVE_NOISE: lambda reason, label: (
        f"the unexplained residual is {dict(reason.numbers)['times_noise']:.3g} times the noise"
    ),
    codes.NEEDS_ANOTHER_FORM: lambda reason, label: (
        f"{label(reason.effect)} needs another form to explain the residual"
    ),
    codes.EXPLAINS_TOO_LITTLE: lambda reason, label: (
        f"it explains {100.0 * dict(reason.numbers)['share']:.0f} % of the misfit, "
        "too little to name it alone"
    ),
    codes.RICHER_AT_BOUND: lambda reason, label: (
        f"{label(reason.effect)} fits better, but its {', '.join(reason.names)} ended at a bound"
    ),
    codes.AT_TOLERANCE: lambda reason, label: (
        f"{reason.effect} ended at the bound of its tolerance"
    ),
}


def what_is_missing(candidates: Sequence[Candidate]) -> str:
    """Return the sentences of effects, values out of tolerance as one.

    Parameters
    ----------
    candidates : sequence of Candidate
    """
    released = [candidate.released for candidate in candidates if candidate.released]
    if len(released) < 2:
        return " ".join(candidate.sentence for candidate in candidates)
    effects = [candidate.sentence for candidate in candidates if not candidate.released]
    return " ".join([*effects, f"The {listed(released)} lie outside their tolerances."])


def in_a_sentence(reason: Reason, label: Label = str) -> str:
    """Return a reason in words, without a full stop.

    Parameters
    ----------
    reason : Reason
    label : callable, optional
        From the label of a set of effects to how it is written; as it stands without.
    """
    return _SENTENCES[reason.code](reason, label)


def doubts(verdict: Verdict, error_orders: Sequence[float] = ()) -> list[str]:
    """Return the reasons of a verdict in words.

    Parameters
    ----------
    verdict : Verdict
    error_orders : sequence of float
        Of a drive, the orders of its static error, by which its lines are called.
    """
    return [
        in_a_sentence(one, lambda label: labels_by_order(label, error_orders))
        for one in verdict.reasons
    ]
