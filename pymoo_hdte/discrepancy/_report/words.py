"""Sentences of the reasons and limits of a verdict, beside each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pymoo_hdte._reports.html import number
from pymoo_hdte.discrepancy._answers.bench_faults import (
    COARSE,
    SATURATED,
    SPEED_WANDERS,
    BenchFault,
)
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_unit, labels_by_order
from pymoo_hdte.discrepancy._selection import reason as codes
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.reason import Reason
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.effects.sentence_blanks import listed
from pymoo_hdte.units import ARCSEC

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
    codes.EXPLAINS_TOO_LITTLE: lambda reason, label: (
        f"it explains {100.0 * dict(reason.numbers)['share']:.0f} % of the misfit, "
        "too little to name it alone"
    ),
    codes.RICHER_AT_BOUND: lambda reason, label: (
        f"{label(reason.effect)} fits better, but its {', '.join(reason.names)} ended at a bound"
    ),
    codes.RICHER_LEAVES_LESS: lambda reason, label: (
        f"{label(reason.effect)} together would leave "
        f"{100.0 * dict(reason.numbers)['share']:.0f} % of the residual"
    ),
    codes.MORE_MISSING: lambda reason, label: (
        "whether more is missing is open; outside the library it is with a probability of "
        f"{100.0 * dict(reason.numbers)['outside']:.0f} %"
    ),
    codes.AT_TOLERANCE: lambda reason, label: (
        f"{reason.effect} ended at the bound of its tolerance"
    ),
}


def _sensor_off(reason: Reason) -> str:
    place, _, kind = reason.effect.rpartition("_torque_")
    size, unit, shares = 1.0, base_unit(reason.effect), "the mean torques share"
    if kind == "gain":
        size, unit, shares = 100.0, "%", "torques, stiffness and inertias share"
    fitted, stated = (f"{number(size * value, 2)} {unit}" for _, value in reason.numbers)
    return (
        f"The fitted {kind} of the {place} torque sensor is off by {fitted} (you stated "
        f"+-{stated}): check the sensor; {shares} this error."
    )


LIMITS: dict[str, Callable[[Reason], str]] = {
    codes.SAME_READING: lambda reason: (
        "Both angles begin at the same reading in every record. If their counters were zeroed "
        "there, zeros differ from record to record, and with them the phases of all lines: state "
        "the zero of each record."
    ),
    codes.STANDS_OUT: lambda reason: (
        f"Record {reason.names[0]} alone has {100.0 * reason.numbers[0][1]:.0f} % of the misfit: "
        "either the missing effect shows only there, or its sensors or drive differed from the "
        "others. In that case leave it out."
    ),
    codes.NO_HELD_OUT: lambda reason: "No record was held out: the correction is not validated.",
    codes.NOT_SHOWN: lambda reason: "The held-out records do not show what is named.",
    codes.HELD_OUT_RATTLES: lambda reason: (
        "All held-out records rattle: the correction is not validated."
    ),
    codes.FLANKS_PART: lambda reason: (
        "Neither fitted nor predicted, because the load does not hold the tooth flanks "
        f"together: {', '.join(reason.names)}."
    ),
    codes.CLEARANCE_EVIDENT: lambda reason: (
        "Without load the motion does not repeat with the input, as when tooth flanks part and "
        "meet again: no hypothesis without a clearance is reported."
    ),
    codes.ONE_SPEED: lambda reason: (
        "All fitted records run at one speed: dry friction, friction that changes with speed "
        "and damping are indistinguishable."
    ),
    codes.ONE_LOAD: lambda reason: (
        "All fitted records carry one load: it remains open whether an error grows with the load."
    ),
    codes.ONE_WAY: lambda reason: (
        "All fitted records turn one way. Dry friction at the input and a zero error of the "
        "input torque sensor are separated only by the stated limit of that error, "
        f"{reason.numbers[0][1]:g} N.m."
    ),
    codes.ONE_TIME: lambda reason: (
        "All fitted records have the same time in the session: no drift can be seen."
    ),
    codes.NO_SWEEP: lambda reason: (
        "No torsion sweep was fitted. Unless the running records pass through zero torque, a "
        "clearance looks like a soft wind-up, and hysteresis like damping."
    ),
    codes.LIKE_A_GAIN: lambda reason: (
        "Power flows one way through the drive in all fitted records, so friction that grows "
        "with the load looks like a wrong gain of the input torque sensor: only its stated gain "
        f"error, {100.0 * reason.numbers[0][1]:g} %, separates them."
    ),
    codes.SENSOR_OFF: _sensor_off,
    codes.UNRESOLVED_LINES: lambda reason: (
        "The records do not resolve the nominal static error of order "
        f"{', '.join(reason.names[:-1])}."
    ),
    codes.LINES_ABOVE: lambda reason: (
        f"The nominal static error of order {', '.join(reason.names[:-1])} is not compared: lines "
        f"are compared up to order {dict(reason.numbers)['highest']:.3g}."
    ),
    codes.HARMONIC_ABOVE: lambda reason: (
        f"Order {2.0 * reason.numbers[0][1]:.4g}, the second harmonic of order "
        f"{reason.numbers[0][1]:.4g}, is not fitted: it lies above order "
        f"{dict(reason.numbers)['highest']:.3g}. The residual may be that harmonic"
        f"{', which may shift the values of the effect' if reason.effect else ''}."
    ),
}


def limit_sentence(limit: Reason) -> str:
    """Return a limit of the records as a sentence."""
    return LIMITS[limit.code](limit)


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


BENCH_FAULTS: dict[str, Callable[[BenchFault], str]] = {
    "loop_gain": lambda fault: (
        f"The speed loop is {100.0 * abs(fault.value):.2g} % "
        f"{'stronger' if fault.value > 0.0 else 'weaker'} than stated."
    ),
    "loop_lag": lambda fault: (
        f"The torque of the motor comes {1e6 * abs(fault.value):.3g} us "
        f"{'late' if fault.value > 0.0 else 'early'}."
    ),
    SPEED_WANDERS: lambda fault: "The set speed wanders.",
    SATURATED: lambda fault: (
        f"The sensor of the {_channel(fault)} saturates at {fault.value:.4g} {fault.unit}."
    ),
    COARSE: lambda fault: (
        f"The sensor of the {_channel(fault)} reads in steps of "
        f"{fault.value / (ARCSEC if fault.unit == 'rad' else 1.0):.2g} "
        f"{'arcsec' if fault.unit == 'rad' else fault.unit}."
    ),
}
"""Sentences of faults of a bench by their names."""


def _channel(fault: BenchFault) -> str:
    return fault.where[0].replace("_", " ")


def bench_in_words(nuisances: Sequence[Mapping[str, Any]]) -> str:
    """Return the nuisances of a verdict's document in one line; empty without any."""
    sentences = [nuisance["sentence"].rstrip(".") for nuisance in nuisances]
    parts = [sentence[:1].lower() + sentence[1:] for sentence in sentences]
    return f"The bench: {'; '.join(parts)}." if parts else ""


def in_a_sentence(reason: Reason, label: Label = str) -> str:
    """Return a reason in words, without a full stop.

    Parameters
    ----------
    reason : Reason
    label : callable, optional
        From the label of a set of effects to how it is written; as it stands without.
    """
    return _SENTENCES[reason.code](reason, label)


def caveats(verdict: Verdict, error_orders: Sequence[float] = ()) -> list[str]:
    """Return the reasons of a verdict in words.

    Parameters
    ----------
    verdict : Verdict
    error_orders : sequence of float
        Of a drive, the orders of its static error, by which its lines are called.
    """
    return [
        in_a_sentence(reason, lambda label: labels_by_order(label, error_orders))
        for reason in verdict.reasons
    ]


def sure_in_words(probability: float) -> str:
    """Return a probability in whole per cent; no model is right with 100 %."""
    return "more than 99 %" if probability > 0.99 else f"{int(100.0 * probability)} %"
