"""Laws of force over motion, for the ports of any machine, each with its effect."""

from pymoo_hdte.laws import friction, hysteresis, linear, stiffness
from pymoo_hdte.laws.effect import Effect, effect_named, effects, register, registered
from pymoo_hdte.laws.guess import Guess, Sizes
from pymoo_hdte.laws.law import Aperiodic, Periodic, PortState, Response
from pymoo_hdte.laws.unknowns import unknown

__all__ = [
    "Aperiodic",
    "Effect",
    "Guess",
    "Periodic",
    "PortState",
    "Response",
    "Sizes",
    "effect_named",
    "effects",
    "friction",
    "hysteresis",
    "linear",
    "register",
    "registered",
    "stiffness",
    "unknown",
]
