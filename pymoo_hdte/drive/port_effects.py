"""Named effects that are a law at a port, or an addition to the kinematics.

===============================  =============  ====================
name                             port           law
===============================  =============  ====================
``hardening_stiffness``          mesh           `HardeningStiffness`
``soft_windup``                  mesh           `SoftWindup`
``backlash``                     mesh           `DeadZone`
``clearance_variation``          mesh           `PeriodicClearance`
``hysteresis``                   mesh           `MaxwellSlip`
``coulomb_friction``             input, output  `CoulombFriction`
``stribeck_friction``            input, output  `StribeckFriction`
``position_dependent_friction``  input, output  `PeriodicFriction`
``nonlinear_drag``               input, output  `NonlinearDrag`
``torque_ripple``                input          `PeriodicTorque`
===============================  =============  ====================

`KinematicErrorLine` adds an order to theta_s, `KinematicReaction` the torque that Eq. (9) lacks.
"""

from __future__ import annotations

from dataclasses import MISSING, asdict, dataclass, fields, replace
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.drive.solve.order_spectrum import sine_phasor
from pymoo_hdte.io.fields import UNITS, Fields
from pymoo_hdte.laws.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    PeriodicTorque,
    StribeckFriction,
)
from pymoo_hdte.laws.hysteresis import MaxwellSlip
from pymoo_hdte.laws.law import Law
from pymoo_hdte.laws.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup

FRICTION_PORTS = ("input", "output")

LAWS: dict[str, tuple[type, tuple[str, ...], dict[str, str]]] = {
    "hardening_stiffness": (
        HardeningStiffness,
        ("mesh",),
        {"coefficient": "cubic stiffness", "stiffening": "", "torsion": "angle", "sharpness": ""},
    ),
    "soft_windup": (
        SoftWindup,
        ("mesh",),
        {"softening": "", "torsion": "angle", "sharpness": ""},
    ),
    "backlash": (DeadZone, ("mesh",), {"half_width": "angle"}),
    "clearance_variation": (
        PeriodicClearance,
        ("mesh",),
        {"order": "", "phase": "angle", "half_width": "angle", "variation": "angle"},
    ),
    "hysteresis": (MaxwellSlip, ("mesh",), {"force": "torque", "torsion": "angle", "spread": ""}),
    "coulomb_friction": (CoulombFriction, FRICTION_PORTS, {"level": "torque"}),
    "stribeck_friction": (
        StribeckFriction,
        FRICTION_PORTS,
        {"level": "torque", "excess": "torque", "fading": "speed"},
    ),
    "position_dependent_friction": (
        PeriodicFriction,
        FRICTION_PORTS,
        {"order": "", "phase": "angle", "level": "torque"},
    ),
    "nonlinear_drag": (NonlinearDrag, FRICTION_PORTS, {"coefficient": "quadratic drag"}),
    "torque_ripple": (
        PeriodicTorque,
        ("input",),
        {"order": "", "phase": "angle", "amplitude": "torque"},
    ),
}
"""For each name its law, the ports it may stand at, and its fields with their quantity (in SI;
an empty one is dimensionless)."""


@dataclass(frozen=True)
class LawAtPort:
    """A law at a port: friction, drag, clearance, hysteresis or another of `port_effects.LAWS`.

    Attributes
    ----------
    name : str
        Of the effect, in model files and verdicts, e.g. ``"coulomb_friction"``.
    port : str
        ``"input"``, ``"output"`` or ``"mesh"``, where the law may stand.
    law : Law
        Of the type that belongs to the name; its numbers are in SI.

    Raises
    ------
    InvalidInput
        For an unknown name, a port where such a law does not stand, or a law of another type.
    """

    name: str
    port: str
    law: Law

    def __post_init__(self) -> None:
        one_of("effect.name", self.name, tuple(LAWS))
        kind, ports, _ = LAWS[self.name]
        one_of(f"{self.name}.port", self.port, ports)
        if not isinstance(self.law, kind):
            raise InvalidInput(f"{self.name}.law", self.law, f"a {kind.__name__}")

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the law at its port."""
        return replace(coefficients, laws=(*coefficients.laws, (self.port, self.law)))

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        kind, _, quantities = LAWS[self.name]
        values, defaults = asdict(self.law), _defaults(kind)  # type: ignore[call-overload]
        return {"name": self.name, "port": self.port} | {
            field: with_unit(values[field], quantity)
            for field, quantity in quantities.items()
            if field not in defaults or values[field] != defaults[field]
        }


def with_unit(value: float, quantity: str) -> object:
    """Return a value in SI with its unit, as model files have it."""
    return {"value": value, "unit": next(iter(UNITS[quantity]))} if quantity else value


def law_from_fields(name: str, table: Fields) -> LawAtPort:
    """Read a law of `LAWS` from the rest of its table."""
    kind, ports, quantities = LAWS[name]
    port = table.choice("port", ports)
    values = {
        field: table.quantity(field, quantity) if quantity else table.number(field)
        for field, quantity in quantities.items()
        if field not in _defaults(kind) or table.has(field)
    }
    return LawAtPort(name, port, kind(**values))


def _defaults(kind: type) -> dict[str, float]:
    """Return the fields of a law that a file may leave out, with their values."""
    return {one.name: one.default for one in fields(kind) if one.default is not MISSING}


@dataclass(frozen=True)
class KinematicErrorLine:
    """A further order of theta_s: amplitude sin(order theta_in + phase).

    It does not scale with theta_s, which is a property of the orders of Eq. (1).

    Attributes
    ----------
    name : str
        ``"kinematic_error"``, in model files and verdicts.
    order : float
        Cycles per input turn, above 0.
    amplitude, phase : float
        rad at the output, and rad.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or an order that is not above 0.
    """

    name: ClassVar[str] = "kinematic_error"
    order: float
    amplitude: float
    phase: float

    def __post_init__(self) -> None:
        real_number("kinematic_error.order", self.order, above=0.0)
        real_number("kinematic_error.amplitude", self.amplitude)
        real_number("kinematic_error.phase", self.phase)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the order added."""
        phasor = sine_phasor(self.amplitude, self.phase)
        column = np.full((len(coefficients.stiffness), 1), phasor)
        return replace(
            coefficients,
            error_orders=np.append(coefficients.error_orders, self.order),
            error_phasors=np.hstack([coefficients.error_phasors, column]),
        )

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        return {
            "name": self.name,
            "order": self.order,
            "amplitude": with_unit(self.amplitude, "angle"),
            "phase": with_unit(self.phase, "angle"),
        }


@dataclass(frozen=True)
class KinematicReaction:
    """The mesh torque acts back on the input through the slope of theta_s.

    Eq. (9) leaves out this term of Lagrange's equation.

    Attributes
    ----------
    name : str
        ``"kinematic_reaction"``, in model files and verdicts.
    share : float
        Of the reaction that is there, dimensionless: 1 by virtual work.

    Raises
    ------
    InvalidInput
        If the share is not finite.
    """

    name: ClassVar[str] = "kinematic_reaction"
    share: float = 1.0

    def __post_init__(self) -> None:
        real_number("kinematic_reaction.share", self.share)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the reaction."""
        return replace(coefficients, reaction=self.share)

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        return {"name": self.name, "share": self.share}
