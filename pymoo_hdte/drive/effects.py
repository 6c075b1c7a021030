"""Named effects that a drive model may have beside the printed Eq. (9).

An effect changes the coefficients of the equations of motion; every solver then follows. The three
that stand here are the candidates of the calibration: the printed equations with the printed values
respond to the static error as a rigid drive would. Further ones are in `port_effects` and
`sensor_effects`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive.port_effects import (
    LAWS,
    KinematicErrorLine,
    KinematicReaction,
    law_from_fields,
)
from pymoo_hdte.drive.sensor_effects import Eccentricity, ThermalDrift
from pymoo_hdte.drive.solve.coefficients import Coefficients
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.laws.stiffness import PeriodicStiffness

WAVE_GENERATOR_ORDER = 2.0
"""Order of what the two lobes of the wave generator do, in cycles per input turn."""


class Effect(Protocol):
    """Something Eq. (9) does not hold: what every effect of a drive model offers."""

    @property
    def name(self) -> str:
        """Name used in model files and verdicts."""
        ...

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with this effect added."""
        ...

    def to_dict(self) -> dict[str, object]:
        """Return the effect as the TOML-like table that `effect_from_fields` reads."""
        ...


Place = tuple[str, str, float | None]
"""Name, port and order of an effect."""


def place_of(effect: Effect) -> Place:
    """Return where an effect stands in a drive model, which takes one at each place."""
    law = getattr(effect, "law", effect)
    return effect.name, str(getattr(effect, "port", "")), getattr(law, "order", None)


@dataclass(frozen=True)
class LoadInertia:
    """Inertia rigidly on the output: loading motor, couplings, torque sensor or robot link.

    Attributes
    ----------
    name : str
        ``"load_inertia"``, in model files and verdicts.
    inertia : float
        J_L, kg.m2, added to J_out of Eq. (9).

    Raises
    ------
    InvalidInput
        If the inertia is negative or not finite.
    """

    name: ClassVar[str] = "load_inertia"
    inertia: float

    def __post_init__(self) -> None:
        real_number("load_inertia.inertia", self.inertia, at_least=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the inertia added to the output."""
        return replace(
            coefficients,
            output_inertia=coefficients.output_inertia + self.inertia,
            load_inertia=coefficients.load_inertia + self.inertia,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        return {"name": self.name, "inertia": {"value": self.inertia, "unit": "kg.m2"}}


@dataclass(frozen=True)
class DampingReference:
    """Mesh damping acts on the torsion at the output: c = factor N^2 B_fc.

    B_fc is identified as a torque per speed of the *input* shaft (Section 3); the same losses
    referred to the output carry a factor of the order of N^2. Without this effect c = B_fc, as
    Eq. (9) prints it.

    Attributes
    ----------
    name : str
        ``"damping_reference"``, in model files and verdicts.
    factor : float
        Multiple of N^2, dimensionless.

    Raises
    ------
    InvalidInput
        If the factor is not above 0 or not finite.
    """

    name: ClassVar[str] = "damping_reference"
    factor: float

    def __post_init__(self) -> None:
        real_number("damping_reference.factor", self.factor, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the damping referred to the output."""
        scale = self.factor * coefficients.ratio**2
        return replace(coefficients, damping=scale * coefficients.damping)

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        return {"name": self.name, "factor": self.factor}


@dataclass(frozen=True)
class MeshStiffnessVariation:
    """Stiffness that varies with the input angle, K (1 + depth cos(order theta_in + phase)).

    Under load it excites its order by itself and couples all orders that differ by it. Gu, Tong,
    Huang, Li (J. Vibroengineering 2021, article 21633) use and measure a time-varying stiffness.

    Attributes
    ----------
    name : str
        ``"mesh_stiffness_variation"``, in model files and verdicts.
    depth : float
        kappa, dimensionless, at least 0 and below 1.
    phase : float
        psi, rad.
    order : float
        Cycles per input turn; 2 is that of the wave generator's two lobes.

    Raises
    ------
    InvalidInput
        For a number that is not finite or out of range.
    """

    name: ClassVar[str] = "mesh_stiffness_variation"
    depth: float
    phase: float
    order: float = WAVE_GENERATOR_ORDER

    def __post_init__(self) -> None:
        real_number("mesh_stiffness_variation.depth", self.depth, at_least=0.0, below=1.0)
        real_number("mesh_stiffness_variation.phase", self.phase)
        real_number("mesh_stiffness_variation.order", self.order, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the varying stiffness; Hill's method knows order 2 only."""
        if self.order == WAVE_GENERATOR_ORDER:
            return replace(coefficients, stiffness_depth=self.depth, stiffness_phase=self.phase)
        law = PeriodicStiffness(self.order, self.phase, self.depth)
        return replace(coefficients, laws=(*coefficients.laws, ("mesh", law)))

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        order = {} if self.order == WAVE_GENERATOR_ORDER else {"order": self.order}
        phase = {"value": self.phase, "unit": "rad"}
        return {"name": self.name, "depth": self.depth, "phase": phase} | order


def effect_from_fields(table: Fields) -> Effect:
    """Build an effect from a table such as ``{ name = "damping_reference", factor = 8.7 }``.

    Raises
    ------
    InvalidInput
        For an unknown name, or a wrong, missing or superfluous field.
    """
    effect: Effect
    match name := table.choice("name", EFFECT_NAMES):
        case LoadInertia.name:
            effect = LoadInertia(table.quantity("inertia", "inertia"))
        case DampingReference.name:
            effect = DampingReference(table.number("factor"))
        case MeshStiffnessVariation.name:
            depth, phase = table.number("depth"), table.quantity("phase", "angle")
            order = table.number("order") if table.has("order") else WAVE_GENERATOR_ORDER
            effect = MeshStiffnessVariation(depth, phase, order)
        case KinematicErrorLine.name:
            amplitude, phase = (
                table.quantity("amplitude", "angle"),
                table.quantity("phase", "angle"),
            )
            effect = KinematicErrorLine(table.number("order"), amplitude, phase)
        case KinematicReaction.name:
            effect = KinematicReaction(table.number("share"))
        case Eccentricity.name:
            amplitude, phase = (
                table.quantity("amplitude", "angle"),
                table.quantity("phase", "angle"),
            )
            order = table.number("order") if table.has("order") else 1.0
            effect = Eccentricity(amplitude, phase, order)
        case ThermalDrift.name:
            rate = table.quantity("rate", "angle rate")
            time = table.quantity("time", "time") if table.has("time") else math.inf
            effect = ThermalDrift(rate, time)
        case _:
            effect = law_from_fields(name, table)
    table.finish()
    return effect


EFFECT_NAMES = (
    LoadInertia.name,
    DampingReference.name,
    MeshStiffnessVariation.name,
    KinematicErrorLine.name,
    KinematicReaction.name,
    Eccentricity.name,
    ThermalDrift.name,
    *LAWS,
)
"""Names of all effects."""
