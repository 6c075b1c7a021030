"""Every effect that can be named at the ports of a mechanism, in sizes that its records suggest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.mechanism.evidence import MeasuredData
from pymoo_hdte.discrepancy.mechanism.periodic_candidates import LARGEST, of_reading, periodic
from pymoo_hdte.laws.effect import place_of
from pymoo_hdte.laws.friction import CoulombFriction, NonlinearDrag, StribeckFriction
from pymoo_hdte.laws.hysteresis import MaxwellSlip
from pymoo_hdte.laws.linear import ConstantForce, DirectionalFriction, LinearDamper, LinearSpring
from pymoo_hdte.laws.stiffness import DeadZone, HardeningStiffness, SoftWindup
from pymoo_hdte.laws.unknowns import unknown
from pymoo_hdte.mechanism import LawAt, Port

CONTAINED = {
    "coulomb_friction": ("stribeck_friction", "hysteresis", "position_dependent_friction"),
}
"""Laws that are this one where some of their parameters are nothing: as good, they say no more."""
_BACKWARDS = 0.01
"""Least share of the way in the rarer direction that makes two directions."""


def mechanism_candidates(
    data: MeasuredData, forces: Mapping[str, float], orders: Mapping[str, Sequence[float]]
) -> list[Candidate]:
    """Return all candidates.

    Parameters
    ----------
    data : MeasuredData
    forces : mapping of str to float
        By port, size of a force that may be missing there, N or N.m.
    orders : mapping of str to sequence of float
        By port, orders at which something varies with its position, per unit of it.
    """
    found: list[Candidate] = []
    for port in data.mechanism.ports:
        here = [one.ports[port.name] for one in data.spectra]
        travel = max(float(np.ptp(one.position)) for one in here) / 2.0
        if travel == 0.0:
            allowed = "one that changes in some record"
            raise InvalidInput(f"motion of port {port.name}", 0.0, allowed)
        force = forces[port.name]
        speed = max(float(np.abs(one.speed).max()) for one in here)
        seen = orders.get(port.name, ())
        if port.read:
            found += of_reading(port.name, seen, force)
            continue
        found += _linear(port, force, travel, speed)
        both = turns_back(data, port.name)
        found += _dry(port.name, force, speed)
        if both:
            found += _one_sided(port.name, force, speed)
        found += periodic(port.name, seen, force)
        for read in data.mechanism.ports:
            # What a force sensor shows may be a torque that acts on the motion.
            if read.read and dict(read.motion) == dict(port.motion):
                found += periodic(port.name, orders.get(read.name, ()), force)[:1]
        found += _elastic(port.name, force, travel, port.stiffness.value, both)
    known = {place_of(one) for one in data.known}
    return [one for one in found if not one.places & known]


def _linear(port: Port, force: float, travel: float, speed: float) -> list[Candidate]:
    """Return a spring and a damper where none is believed to stand."""
    found = []
    for name, law, believed, size, words in (
        ("linear_stiffness", LinearSpring, port.stiffness, travel, "a spring"),
        ("viscous_friction", LinearDamper, port.damping, speed, "a friction that grows with speed"),
    ):
        if believed.value == 0.0:
            typical = force / size
            found.append(
                Candidate(
                    name,
                    port.name,
                    (unknown("coefficient", 0.0, LARGEST * typical, typical),),
                    ((typical,),),
                    lambda v, name=name, law=law: _at(name, port.name, law(v[0])),  # type: ignore[misc]
                    f"There is {words} at the {port.name} where none is believed.",
                )
            )
    return found


def _at(name: str, port: str, law: Any) -> tuple[Any, ...]:
    return (LawAt(name, port, law),)


def turns_back(data: MeasuredData, port: str) -> bool:
    """Tell whether a port moves in both directions, in one record or another."""
    speeds = np.concatenate([one.ports[port].speed for one in data.spectra])
    forward, backward = np.sum(np.maximum(speeds, 0.0)), np.sum(np.maximum(-speeds, 0.0))
    # Noise of a record at rest changes its sign now and then.
    return bool(min(forward, backward) > _BACKWARDS * (forward + backward))


def _dry(port: str, force: float, speed: float) -> list[Candidate]:
    """Return frictions that are the same in both directions."""
    most, drag = LARGEST * force, force / speed**2
    level = unknown("level", 0.0, most, force)
    fading = tuple(share * speed for share in (0.02, 0.06, 0.2))
    return [
        Candidate(
            "coulomb_friction",
            port,
            (level,),
            ((force,),),
            lambda v: _at("coulomb_friction", port, CoulombFriction(v[0])),
            f"Dry friction at the {port}: a force that does not depend on speed.",
        ),
        Candidate(
            "stribeck_friction",
            port,
            (
                level,
                unknown("excess", 0.0, most, 0.3 * force),
                unknown("fading", 0.005 * speed, speed, 0.1 * speed),
            ),
            tuple((force, 0.3 * force, one) for one in fading),
            lambda v: _at("stribeck_friction", port, StribeckFriction(*v)),
            f"Dry friction at the {port} that falls with speed.",
        ),
        Candidate(
            "nonlinear_drag",
            port,
            (unknown("coefficient", 0.0, 20.0 * drag, drag),),
            ((drag,),),
            lambda v: _at("nonlinear_drag", port, NonlinearDrag(v[0])),
            f"A drag at the {port} that grows faster than the speed.",
        ),
    ]


def _one_sided(port: str, force: float, speed: float) -> list[Candidate]:
    """Return forces that two directions tell from friction that is the same in both."""
    most, slope = LARGEST * force, force / speed
    level = unknown("level", -most, most, force)
    viscous = unknown("viscous", -LARGEST * slope, LARGEST * slope, slope)
    return [
        Candidate(
            "direction_dependent_friction",
            port,
            (level, viscous),
            ((force, 0.0), (0.0, slope), (force, -slope)),
            lambda v: _at("direction_dependent_friction", port, DirectionalFriction(*v)),
            f"Friction at the {port} that is not the same in both directions.",
        ),
        Candidate(
            "force_offset",
            port,
            (unknown("force", -most, most, force),),
            ((force,),),
            lambda v: _at("force_offset", port, ConstantForce(v[0])),
            f"A constant force at the {port}: gravity, or a bias.",
        ),
    ]


def _elastic(
    port: str, force: float, travel: float, stiffness: float, both: bool
) -> list[Candidate]:
    most, cubic = LARGEST * force, force / travel**3
    slip = unknown("torsion", 0.003 * travel, 2.0 * travel, 0.1 * travel)
    found = [
        Candidate(
            "hysteresis",
            port,
            (unknown("force", 0.0, most, force), slip, unknown("spread", 0.3, 4.0, 1.5)),
            tuple((force, share * travel, 1.5) for share in (0.03, 0.1, 0.4)),
            lambda v: _at("hysteresis", port, MaxwellSlip(*v)),
            f"The force at the {port} lags behind the motion: springs that slip.",
        )
    ]
    # Without a reversal, springs that slip are dry friction.
    found = found if both else []
    if stiffness == 0.0:
        return found
    windup = unknown("torsion", 1e-3 * travel, travel, 0.2 * travel)
    sharp = unknown("sharpness", 1.0, 20.0, 3.0)
    return [
        *found,
        Candidate(
            "hardening_stiffness",
            port,
            (unknown("coefficient", 0.0, 20.0 * cubic, cubic),),
            ((cubic,),),
            lambda v: _at("hardening_stiffness", port, HardeningStiffness(v[0])),
            f"The {port} grows stiffer with its deflection.",
        ),
        Candidate(
            "soft_windup",
            port,
            (unknown("softening", 0.0, 0.95, 0.2), windup, sharp),
            tuple((0.2, share * travel, 3.0) for share in (0.05, 0.15, 0.4)),
            lambda v: _at("soft_windup", port, SoftWindup(*v)),
            f"The {port} is softer near its rest position.",
        ),
        Candidate(
            "backlash",
            port,
            (unknown("half_width", 0.0, 0.5 * travel, 0.05 * travel),),
            ((0.02 * travel,), (0.1 * travel,)),
            lambda v: _at("backlash", port, DeadZone(v[0])),
            f"There is play at the {port}.",
        ),
    ]
