"""Candidates that are lines of the angle: kinematic errors, torque ripple, errors of the encoder.

All of them are exact: a line is a line, and what it leaves is something else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy.campaign.believed import Believed
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.drive import DriveEffect, Eccentricity, KinematicErrorLine, LawAtPort
from pymoo_hdte.drive.effects import ENCODER_LINE
from pymoo_hdte.laws.friction import PeriodicTorque
from pymoo_hdte.laws.unknowns import Values, harmonics_among, lines_of, wave, wave_starts
from pymoo_hdte.units import ARCSEC

LARGEST_ERROR = 100 * ARCSEC
TYPICAL_ERROR = 2 * ARCSEC
LARGEST_RIPPLE = 0.5
TYPICAL_RIPPLE = 0.01
"""N.m of the motor, both for a `torque_scale` of 1."""


def line_candidates(
    believed: Believed, orders: Sequence[float], seen: Sequence[float], torque_scale: float
) -> list[Candidate]:
    """Return candidates for lines.

    Parameters
    ----------
    believed : Believed
    orders : sequence of float
        All orders of the features: harmonics beyond them would be guesses.
    seen : sequence of float
        Orders at which something was seen.
    torque_scale : float
        See the module of this name.
    """
    ratio = believed.ratio
    found = [_encoder("eccentricity", 1.0, ratio, orders)]
    # A line believed to be nothing is missing where it is something.
    lines = zip(believed.error_orders, believed.error_amplitudes, strict=True)
    believed_lines = [order for order, amplitude in lines if amplitude > 0.0]
    for order in sorted(seen):
        if not _holds(believed_lines, order):
            further = [o for o in orders if not _holds(believed_lines, o)]
            found.append(_kinematic_line(order, further))
            turns = order * ratio
            if turns > 1.5 and abs(turns - round(turns)) < 1e-6:
                found.append(_encoder(ENCODER_LINE, float(round(turns)), ratio, orders))
        found.append(_torque_ripple(order, orders, torque_scale))
    return found


def _holds(orders: Sequence[float], order: float) -> bool:
    return any(abs(order - one) < 1e-6 for one in orders)


def _kinematic_line(order: float, orders: Sequence[float]) -> Candidate:
    def build(v: Values) -> tuple[DriveEffect, ...]:
        return tuple(
            KinematicErrorLine(multiple * order, amplitude, phase + np.pi / 2.0)
            for multiple, amplitude, phase in lines_of(v)
        )

    parts = wave("amplitude", LARGEST_ERROR, TYPICAL_ERROR, harmonics_among(orders, order, 2))
    return Candidate(
        "kinematic_error",
        "mesh",
        parts,
        wave_starts(parts),
        build,
        f"A line of the static error at order {order:.4g} that the model does not hold.",
        order,
        exact=True,
    )


def _torque_ripple(order: float, orders: Sequence[float], torque_scale: float) -> Candidate:
    def build(v: Values) -> tuple[DriveEffect, ...]:
        return tuple(
            LawAtPort("torque_ripple", "input", PeriodicTorque(multiple * order, phase, amplitude))
            for multiple, amplitude, phase in lines_of(v)
        )

    largest, typical = torque_scale * LARGEST_RIPPLE, torque_scale * TYPICAL_RIPPLE
    parts = wave("amplitude", largest, typical, harmonics_among(orders, order, 2))
    return Candidate(
        "torque_ripple",
        "input",
        parts,
        wave_starts(parts),
        build,
        f"A ripple of the motor torque at order {order:.4g}.",
        order,
        exact=True,
    )


def _encoder(name: str, turns: float, ratio: float, orders: Sequence[float]) -> Candidate:
    def build(v: Values) -> tuple[DriveEffect, ...]:
        return tuple(
            Eccentricity(amplitude, phase, multiple * turns)
            for multiple, amplitude, phase in lines_of(v)
        )

    parts = wave(
        "amplitude", LARGEST_ERROR, TYPICAL_ERROR, harmonics_among(orders, turns / ratio, 2)
    )
    sentence = (
        "The output encoder sits off centre."
        if turns == 1.0
        else f"The output encoder errs {turns:g} times in its turn."
    )
    return Candidate(
        name,
        "sensor",
        parts,
        wave_starts(parts),
        build,
        sentence,
        turns / ratio,
        exact=True,
        listed=name != ENCODER_LINE,
    )
