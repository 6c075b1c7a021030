"""Candidates: every effect the workflow can name, with its unknowns, their ranges and its words.

A candidate turns a vector of values into effects of the drive model; the laws themselves stand in
`pymoo_hdte.drive`. Amplitude and phase of a line are searched as its cosine and sine parts, in
which the prediction is close to linear.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy.believed import Believed
from pymoo_hdte.discrepancy.parameters import Parameter
from pymoo_hdte.drive import (
    DampingReference,
    Eccentricity,
    Effect,
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadInertia,
    MeshStiffnessVariation,
    ThermalDrift,
)
from pymoo_hdte.drive.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    PeriodicTorque,
    StribeckFriction,
)
from pymoo_hdte.drive.hysteresis import MaxwellSlip
from pymoo_hdte.drive.mesh_laws import CubicStiffness, DeadZone, PeriodicClearance, SoftWindup
from pymoo_hdte.units import ARCSEC

RATED_TORQUE = 40.0
"""N.m; where strengths of mesh laws are scaled."""

Values = Sequence[float]


@dataclass(frozen=True)
class Candidate:
    """One effect at one port, perhaps at one order.

    Attributes
    ----------
    name, port : str
    parameters : tuple of Parameter
        Its unknowns; ``start`` is a typical strength.
    starts : tuple of tuple of float
        Where the joint fit begins, and the directions that the screening tries.
    build : callable
        From values to the effect.
    sentence : str
        What it is, for the report.
    order : float or None
        Cycles per input turn, where the candidate has one.
    """

    name: str
    port: str
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    build: Callable[[Values], Effect]
    sentence: str
    order: float | None = None

    @property
    def label(self) -> str:
        """Name, port and order in one word."""
        order = "" if self.order is None else f"@{self.order:.4g}"
        return f"{self.name}:{self.port}{order}"


def _one(name: str, lower: float, upper: float, typical: float) -> Parameter:
    return Parameter(name, typical, lower, upper, abs(typical))


def _line(name: str, largest: float, typical: float) -> tuple[Parameter, Parameter]:
    """Return the two parts of a line ``amplitude cos(order angle + phase)``."""
    cosine = Parameter(f"{name}_cosine", typical, -largest, largest, typical)
    return cosine, Parameter(f"{name}_sine", 0.0, -largest, largest, typical)


def polar(cosine: float, sine: float) -> tuple[float, float]:
    """Return amplitude and phase of cosine cos(x) - sine sin(x) = amplitude cos(x + phase)."""
    return float(np.hypot(cosine, sine)), float(np.arctan2(sine, cosine))


def candidates(believed: Believed, orders: Sequence[float]) -> list[Candidate]:
    """Return all candidates for a drive.

    Parameters
    ----------
    believed : Believed
    orders : sequence of float
        Orders at which something was seen, for effects whose order is not known beforehand.
    """
    windup = RATED_TORQUE / believed.stiffness
    found = [*_mesh(believed, windup), *_friction(believed), *_others(believed)]
    for order in sorted(orders):
        if not any(abs(order - known) < 1e-6 for known in believed.error_orders):
            found.append(_kinematic_line(order))
        found.append(_torque_ripple(order))
    return found


def _mesh(believed: Believed, windup: float) -> list[Candidate]:
    stiffness = believed.stiffness
    cubic = 0.1 * stiffness / windup**2
    hardening = Candidate(
        "hardening_stiffness",
        "mesh",
        (_one("coefficient", 0.0, 6.0 * cubic, cubic),),
        ((cubic,),),
        lambda v: LawAtPort("hardening_stiffness", "mesh", CubicStiffness(v[0])),
        "The drive grows stiffer under torque.",
    )
    soft = Candidate(
        "soft_windup",
        "mesh",
        (_one("softening", 0.0, 0.9, 0.2), _one("torsion", 5e-6, windup, 0.2 * windup)),
        tuple((0.2, share * windup) for share in (0.05, 0.15, 0.4)),
        lambda v: LawAtPort("soft_windup", "mesh", SoftWindup(v[0], v[1])),
        "The drive is softer near zero torque.",
    )
    backlash = Candidate(
        "backlash",
        "mesh",
        (_one("half_width", 0.0, 40 * ARCSEC, 4 * ARCSEC),),
        ((3 * ARCSEC,), (8 * ARCSEC,)),
        lambda v: LawAtPort("backlash", "mesh", DeadZone(v[0])),
        "There is play between the teeth.",
    )
    hysteresis = Candidate(
        "hysteresis",
        "mesh",
        (_one("force", 0.0, 10.0, 1.0), _one("torsion", 0.01 * windup, 2 * windup, 0.2 * windup)),
        tuple((1.0, share * windup) for share in (0.1, 0.3, 0.8)),
        lambda v: LawAtPort("hysteresis", "mesh", MaxwellSlip(v[0], v[1])),
        "The torsion lags behind the torque: dry friction inside the mesh.",
    )
    varying = Candidate(
        "mesh_stiffness_variation",
        "mesh",
        _line("depth", 0.4, 0.02),
        ((0.02, 0.0), (0.0, 0.02)),
        lambda v: MeshStiffnessVariation(*polar(v[0], v[1])),
        "The stiffness varies twice in an input turn.",
    )
    return [hardening, soft, backlash, hysteresis, varying, *_clearances()]


def _clearances() -> list[Candidate]:
    def at(order: float) -> Candidate:
        def build(v: Values) -> Effect:
            width, phase = polar(v[0], v[1])
            return LawAtPort("clearance_variation", "mesh", PeriodicClearance(order, phase, width))

        size = 5 * ARCSEC
        return Candidate(
            "clearance_variation",
            "mesh",
            _line("half_width", 40 * ARCSEC, size),
            tuple((size * np.cos(turn), size * np.sin(turn)) for turn in np.arange(4) * np.pi / 2),
            build,
            f"The play between the teeth varies, order {order:g} of the input.",
            order,
        )

    return [at(1.0), at(2.0)]


def _friction(believed: Believed) -> list[Candidate]:
    found = []
    for port, scale in (("input", 0.01), ("output", 1.0)):
        where = f"at the {port}"
        found.append(
            Candidate(
                "coulomb_friction",
                port,
                (_one("level", 0.0, 20 * scale, scale),),
                ((scale,),),
                lambda v, port=port: LawAtPort(  # type: ignore[misc]
                    "coulomb_friction", port, CoulombFriction(v[0])
                ),
                f"Dry friction {where}: a torque that does not depend on speed.",
            )
        )
    found.append(
        Candidate(
            "stribeck_friction",
            "input",
            (
                _one("level", 0.0, 0.2, 0.01),
                _one("excess", 0.0, 0.3, 0.01),
                _one("fading", 1.0, 150.0, 20.0),
            ),
            ((0.01, 0.01, 8.0), (0.01, 0.01, 25.0), (0.01, 0.01, 70.0)),
            lambda v: LawAtPort("stribeck_friction", "input", StribeckFriction(*v)),
            "Dry friction at the input that falls with speed.",
        )
    )
    ports = (("input", 1.0, 0.01), ("input", 2.0, 0.01), ("output", 1.0, 1.0))
    return [*found, *(_periodic_friction(*port, believed.ratio) for port in ports), _drag()]


def _drag() -> Candidate:
    coefficient = 0.02 / 209.4**2
    return Candidate(
        "nonlinear_drag",
        "input",
        (_one("coefficient", 0.0, 20 * coefficient, coefficient),),
        ((coefficient,),),
        lambda v: LawAtPort("nonlinear_drag", "input", NonlinearDrag(v[0])),
        "A drag at the input that grows faster than the speed.",
    )


def _periodic_friction(port: str, order: float, scale: float, ratio: float) -> Candidate:
    def build(v: Values) -> Effect:
        level, phase = polar(v[0], v[1])
        law = PeriodicFriction(order, phase, level)
        return LawAtPort("position_dependent_friction", port, law)

    return Candidate(
        "position_dependent_friction",
        port,
        _line("level", 20 * scale, scale),
        ((scale, 0.0), (0.0, scale)),
        build,
        f"Friction that varies {order:g} times in a turn of the {port}.",
        order if port == "input" else order / ratio,
    )


def _kinematic_line(order: float) -> Candidate:
    size = 2 * ARCSEC

    def build(v: Values) -> Effect:
        amplitude, phase = polar(v[0], v[1])
        return KinematicErrorLine(order, amplitude, phase + np.pi / 2.0)

    return Candidate(
        "kinematic_error",
        "mesh",
        _line("amplitude", 60 * ARCSEC, size),
        ((size, 0.0), (0.0, size)),
        build,
        f"A line of the static error at order {order:.4g} that the model does not hold.",
        order,
    )


def _torque_ripple(order: float) -> Candidate:
    def build(v: Values) -> Effect:
        amplitude, phase = polar(v[0], v[1])
        return LawAtPort("torque_ripple", "input", PeriodicTorque(order, phase, amplitude))

    return Candidate(
        "torque_ripple",
        "input",
        _line("amplitude", 0.5, 0.01),
        ((0.01, 0.0), (0.0, 0.01)),
        build,
        f"A ripple of the motor torque at order {order:.4g}.",
        order,
    )


def _others(believed: Believed) -> list[Candidate]:
    inertia = max(believed.load_inertia, 10.0 * believed.output_inertia)
    eccentric = 3 * ARCSEC

    def off_centre(v: Values) -> Effect:
        return Eccentricity(*polar(v[0], v[1]))

    return [
        Candidate(
            "kinematic_reaction",
            "input",
            (_one("share", -3.0, 3.0, 1.0),),
            ((1.0,),),
            lambda v: KinematicReaction(v[0]),
            "The mesh torque acts back on the input through the slope of the static error.",
        ),
        Candidate(
            "load_inertia",
            "output",
            (_one("inertia", 0.0, 10 * inertia, 0.3 * inertia),),
            ((0.3 * inertia,), (1.0 * inertia,)),
            lambda v: LoadInertia(v[0]),
            "There is more inertia on the output than believed.",
        ),
        Candidate(
            "damping_reference",
            "mesh",
            (_one("factor", 0.02, 50.0, 2.0),),
            ((3.0,), (0.4,), (8.0,)),
            lambda v: DampingReference(v[0] / believed.ratio**2),
            "The damping of the torsion is referred to another shaft than believed.",
        ),
        Candidate(
            "eccentricity",
            "sensor",
            _line("amplitude", 100 * ARCSEC, eccentric),
            ((eccentric, 0.0), (0.0, eccentric)),
            off_centre,
            "The output encoder sits off centre.",
            1.0 / believed.ratio,
        ),
        Candidate(
            "thermal_drift",
            "sensor",
            (_one("rate", -1e-6, 1e-6, 1e-9),),
            ((1e-9,),),
            lambda v: ThermalDrift(v[0]),
            "The reading of the output angle drifts with time.",
        ),
    ]
