"""Every effect that can be named at the ports of a mechanism, in sizes that its records suggest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.candidate import (
    Candidate,
    Values,
    polar,
    unknown,
    wave,
    wave_starts,
)
from pymoo_hdte.discrepancy.parameters import Parameter
from pymoo_hdte.drive.effects import place_of
from pymoo_hdte.drive.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    PeriodicTorque,
    StribeckFriction,
)
from pymoo_hdte.drive.hysteresis import MaxwellSlip
from pymoo_hdte.drive.mesh_laws import DeadZone, HardeningStiffness, SoftWindup
from pymoo_hdte.measured.data import MeasuredData
from pymoo_hdte.mechanism import LawAt, Port
from pymoo_hdte.mechanism.laws import (
    ConstantForce,
    DirectionalFriction,
    LinearDamper,
    LinearSpring,
)

Parts = tuple[Parameter, ...]

CONTAINED = {
    "coulomb_friction": ("stribeck_friction", "hysteresis", "position_dependent_friction"),
}
"""Laws that are this one where some of their parameters are nothing: as good, they say no more."""
_BACKWARDS = 0.01
"""Least share of the way in the rarer direction that makes two directions."""
_LARGEST = 5.0
"""Largest force of an effect, in units of the largest that the inputs or springs have."""


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
            found += _of_reading(port.name, seen, force)
            continue
        found += _linear(port, force, travel, speed)
        both = turns_back(data, port.name)
        found += _dry(port.name, force, speed, both)
        found += _periodic(port.name, seen, force)
        for read in data.mechanism.ports:
            # What a force sensor shows may be a torque that acts on the motion.
            if read.read and dict(read.motion) == dict(port.motion):
                found += _periodic(port.name, orders.get(read.name, ()), force)[:1]
        found += _elastic(port.name, force, travel, port.stiffness.value, both)
    known = {place_of(one) for one in data.known}  # type: ignore[arg-type]
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
                    (unknown("coefficient", 0.0, _LARGEST * typical, typical),),
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


def _dry(port: str, force: float, speed: float, both: bool) -> list[Candidate]:
    most, drag = _LARGEST * force, force / speed**2
    level = unknown("level", 0.0, most, force)
    signed = unknown("level", -most, most, force)
    fading = tuple(share * speed for share in (0.02, 0.06, 0.2))
    symmetric = [
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
    if not both:
        return symmetric
    return [
        *symmetric,
        Candidate(
            "direction_dependent_friction",
            port,
            (signed, unknown("viscous", -most / speed, most / speed, force / speed)),
            ((force, 0.0), (0.0, force / speed), (force, -force / speed)),
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


def _waves(name: str, orders: Sequence[float], largest: float, typical: float) -> Parts:
    """Return cosine and sine parts of lines at several orders, which are one effect."""
    return tuple(
        part for order in orders for part in wave(f"order_{order:g}_{name}", largest, typical)
    )


def _lines(kind: Any, name: str, port: str, orders: Sequence[float]) -> Any:
    def build(v: Values) -> tuple[Any, ...]:
        parts = np.reshape(v, (-1, 2))
        return tuple(
            LawAt(name, port, kind(order, phase, amplitude))
            for order, (amplitude, phase) in zip(
                orders, (polar(*one) for one in parts), strict=True
            )
        )

    return build


def _periodic(port: str, orders: Sequence[float], force: float) -> list[Candidate]:
    if not orders:
        return []
    most, form, words = _LARGEST * force, _listed(orders, "+"), _listed(orders, ", ")
    ripple = _waves("amplitude", orders, most, force)
    friction = _waves("level", orders, most, force)
    mean = unknown("mean", 0.0, most, force)
    varying = _lines(PeriodicFriction, "position_dependent_friction", port, orders)
    return [
        Candidate(
            "torque_ripple",
            port,
            ripple,
            wave_starts(ripple),
            _lines(PeriodicTorque, "torque_ripple", port, orders),
            f"A force at the {port} that varies with its position, orders {words}, and acts on the "
            "motion.",
            form=form,
        ),
        Candidate(
            "position_dependent_friction",
            port,
            (*friction, mean),
            wave_starts((*friction, mean)),
            lambda v: (*varying(v[:-1]), *_at("coulomb_friction", port, CoulombFriction(v[-1]))),
            f"Friction that varies with the position of the {port}, orders {words}.",
            form=form,
        ),
    ]


def _of_reading(port: str, orders: Sequence[float], force: float) -> list[Candidate]:
    if not orders:
        return []
    form, words = _listed(orders, "+"), _listed(orders, ", ")
    parts = _waves("amplitude", orders, _LARGEST * force, force)
    return [
        Candidate(
            "kinematic_error",
            port,
            parts,
            wave_starts(parts),
            _lines(PeriodicTorque, "kinematic_error", port, orders),
            f"The reading of {port} varies with the position, orders {words}, and has one "
            "amplitude at all speeds run: it is kinematic, and no torque that moves inertias.",
            form=form,
        )
    ]


def _listed(orders: Sequence[float], between: str) -> str:
    return between.join(f"{order:g}" for order in orders)


def _elastic(
    port: str, force: float, travel: float, stiffness: float, both: bool
) -> list[Candidate]:
    most, cubic = _LARGEST * force, force / travel**3
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
