"""Candidates that resist the motion of a shaft: friction of several kinds, and drag."""

from __future__ import annotations

from collections.abc import Sequence

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.drive import DriveEffect, LawAtPort
from pymoo_hdte.laws.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    StribeckFriction,
)
from pymoo_hdte.laws.unknowns import Values, harmonics_among, lines_of, unknown, wave, wave_starts

RATED_SPEED = 209.4
"""rad/s of the input; where the drag is scaled."""
TYPICAL_LEVEL = {"input": 0.01, "output": 1.0}
"""Dry friction of a shaft, N.m; like all torques here for a `torque_scale` of 1."""


def friction_candidates(
    ratio: float, orders: Sequence[float], torque_scale: float
) -> list[Candidate]:
    """Return the candidates for a drive of this ratio and size and features of these orders."""
    level = {port: torque_scale * typical for port, typical in TYPICAL_LEVEL.items()}
    return [
        _coulomb("input", level["input"]),
        _coulomb("output", level["output"]),
        _stribeck(level["input"]),
        _periodic("input", 1.0, 1.0, orders, level["input"]),
        _periodic("input", 2.0, 1.0, orders, level["input"]),
        _periodic("output", 1.0, ratio, orders, level["output"]),
        _drag(torque_scale),
    ]


def _coulomb(port: str, scale: float) -> Candidate:
    return Candidate(
        "coulomb_friction",
        port,
        (unknown("level", 0.0, 20 * scale, scale),),
        ((scale,),),
        lambda v: (LawAtPort("coulomb_friction", port, CoulombFriction(v[0])),),
        f"Dry friction at the {port}: a torque that does not depend on speed.",
    )


def _stribeck(scale: float) -> Candidate:
    return Candidate(
        "stribeck_friction",
        "input",
        (
            unknown("level", 0.0, 20 * scale, scale),
            unknown("excess", 0.0, 30 * scale, scale),
            unknown("fading", 1.0, 150.0, 20.0),
        ),
        tuple((scale, scale, fading) for fading in (8.0, 25.0, 70.0)),
        lambda v: (LawAtPort("stribeck_friction", "input", StribeckFriction(*v)),),
        "Dry friction at the input that falls with speed.",
    )


def _periodic(
    port: str, order: float, slower: float, orders: Sequence[float], scale: float
) -> Candidate:
    name = "position_dependent_friction"

    def build(v: Values) -> tuple[DriveEffect, ...]:
        varying = [
            LawAtPort(name, port, PeriodicFriction(multiple * order, phase, level))
            for multiple, level, phase in lines_of(v[:-1])
        ]
        return (*varying, LawAtPort("coulomb_friction", port, CoulombFriction(v[-1])))

    mean = unknown("mean", 0.0, 20 * scale, scale)
    parts = (*wave("level", 20 * scale, scale, harmonics_among(orders, order / slower, 2)), mean)
    return Candidate(
        name,
        port,
        parts,
        wave_starts(parts),
        build,
        f"Friction that varies {order:g} times in a turn of the {port}.",
        order / slower,
    )


def _drag(torque_scale: float) -> Candidate:
    coefficient = torque_scale * (0.02 / RATED_SPEED**2)
    return Candidate(
        "nonlinear_drag",
        "input",
        (unknown("coefficient", 0.0, 20 * coefficient, coefficient),),
        ((coefficient,),),
        lambda v: (LawAtPort("nonlinear_drag", "input", NonlinearDrag(v[0])),),
        "A drag at the input that grows faster than the speed.",
    )
