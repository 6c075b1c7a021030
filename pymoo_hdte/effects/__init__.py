"""Effects: laws of force over motion at the ports of any machine, each with its sentence."""

from pymoo_hdte.effects import (
    bouc_wen,
    friction,
    gravity,
    hysteresis,
    linear,
    load_friction,
    load_sharing,
    ripple,
    shear_thinning,
    stiffness,
    temperature_friction,
)
from pymoo_hdte.effects.effect import Effect, effect_named, known_effects, register, registered
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.law import Aperiodic, Periodic, PortState, Response
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import unknown

__all__ = [
    "Aperiodic",
    "Effect",
    "Formula",
    "Guess",
    "Lumped",
    "Periodic",
    "PortState",
    "Response",
    "Sizes",
    "bouc_wen",
    "effect_named",
    "friction",
    "gravity",
    "hysteresis",
    "known_effects",
    "linear",
    "load_friction",
    "load_sharing",
    "register",
    "registered",
    "ripple",
    "shear_thinning",
    "stiffness",
    "temperature_friction",
    "unknown",
]
