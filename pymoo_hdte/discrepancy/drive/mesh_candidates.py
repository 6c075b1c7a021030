"""Candidates at the mesh: curves of the stiffness, clearances, hysteresis, varying stiffness."""

from __future__ import annotations

from collections.abc import Sequence

from pymoo_hdte.discrepancy.campaign.believed import Believed
from pymoo_hdte.discrepancy.campaign.campaign import RATED_TORQUE
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.drive import DriveEffect, LawAtPort, MeshStiffnessVariation
from pymoo_hdte.laws.hysteresis import MaxwellSlip
from pymoo_hdte.laws.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup
from pymoo_hdte.laws.unknowns import (
    Values,
    harmonics_among,
    lines_of,
    polar,
    unknown,
    wave,
    wave_starts,
)
from pymoo_hdte.units import ARCSEC

TYPICAL_FORCE = 1.0
"""Dry friction inside the mesh, N.m at a `torque_scale` of 1."""
WIDEST = 40 * ARCSEC
"""Largest half width of a clearance."""
VARYING_MOST = 15 * ARCSEC
"""Largest variation of it in a turn."""


def mesh_candidates(
    believed: Believed, orders: Sequence[float], torque_scale: float
) -> list[Candidate]:
    """Return the candidates at the mesh of a drive of this size, for features of these orders."""
    windup = torque_scale * RATED_TORQUE / believed.stiffness
    cubic = 0.1 * believed.stiffness / windup**2
    hardening = Candidate(
        "hardening_stiffness",
        "mesh",
        (unknown("coefficient", 0.0, 6.0 * cubic, cubic),),
        ((cubic,),),
        lambda v: (LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(v[0])),),
        "The drive grows stiffer under torque.",
    )
    corner = Candidate(
        "hardening_stiffness",
        "mesh",
        (
            unknown("stiffening", 0.0, 0.9, 0.2),
            unknown("torsion", 0.05 * windup, windup, 0.4 * windup),
            unknown("sharpness", 1.0, 20.0, 3.0),
        ),
        tuple((0.2, share * windup, 3.0) for share in (0.25, 0.5)),
        lambda v: (LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(0.0, *v)),),
        "The drive grows stiffer beyond a torque.",
        form="corner",
    )
    soft = Candidate(
        "soft_windup",
        "mesh",
        (
            unknown("softening", 0.0, 0.9, 0.2),
            unknown("torsion", 5e-6, windup, 0.2 * windup),
            unknown("sharpness", 1.0, 20.0, 3.0),
        ),
        tuple((0.2, share * windup, 3.0) for share in (0.05, 0.15, 0.4)),
        lambda v: (LawAtPort("soft_windup", "mesh", SoftWindup(*v)),),
        "The drive is softer near zero torque.",
    )
    backlash = Candidate(
        "backlash",
        "mesh",
        (unknown("half_width", 0.0, WIDEST, 4 * ARCSEC),),
        ((3 * ARCSEC,), (8 * ARCSEC,)),
        lambda v: (LawAtPort("backlash", "mesh", DeadZone(v[0])),),
        "There is play between the teeth.",
    )
    force = torque_scale * TYPICAL_FORCE
    slip = unknown("torsion", 0.01 * windup, 2 * windup, 0.2 * windup)
    hysteresis = Candidate(
        "hysteresis",
        "mesh",
        (unknown("force", 0.0, 10 * force, force), slip, unknown("spread", 0.3, 4.0, 1.5)),
        tuple((force, share * windup, 1.5) for share in (0.1, 0.3, 0.8)),
        lambda v: (LawAtPort("hysteresis", "mesh", MaxwellSlip(*v)),),
        "The torsion lags behind the torque: dry friction inside the mesh.",
    )
    return [
        hardening,
        corner,
        soft,
        backlash,
        hysteresis,
        _varying(orders),
        _clearance(1.0),
        _clearance(2.0),
    ]


def _varying(orders: Sequence[float]) -> Candidate:
    parts = wave("depth", 0.25, 0.02, harmonics_among(orders, 2.0, 3))
    return Candidate(
        "mesh_stiffness_variation",
        "mesh",
        parts,
        wave_starts(parts),
        lambda v: tuple(
            MeshStiffnessVariation(depth, phase, 2.0 * multiple)
            for multiple, depth, phase in lines_of(v)
        ),
        "The stiffness varies twice in an input turn.",
    )


def _clearance(order: float) -> Candidate:
    def build(v: Values) -> tuple[DriveEffect, ...]:
        variation, phase = polar(v[0], v[1])
        law = PeriodicClearance(order, phase, v[2] + variation, variation, locked=v[3])
        return (LawAtPort("clearance_variation", "mesh", law),)

    size = 4 * ARCSEC
    # A play that would fall below nothing stays there, and no search finds its way out of that.
    narrowest = unknown("narrowest", 0.0, WIDEST, size)
    locked = unknown("locked", 0.0, 2 * WIDEST, size)
    return Candidate(
        "clearance_variation",
        "mesh",
        (*wave("variation", VARYING_MOST, size), narrowest, locked),
        tuple(
            (size * cosine, size * sine, size, size * at_rest)
            for cosine, sine, at_rest in ((1, 0, 1), (0, 1, 1), (0, 0, 1), (0, 0, 2))
        ),
        build,
        f"The play between the teeth varies, order {order:g} of the input.",
        order,
    )
