"""Dry friction of the output whose contacts bend before they slip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pymoo_hdte.checks import real_number
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.guess import Guess, Sizes
from pymoo_hdte.effects.hysteresis import MaxwellSlip, springs


@dataclass(frozen=True)
class PreslidingFriction(CoulombFriction):
    """T = level sign(speed) where the port turns on and on.

    Where it moves to and fro by little, as the output does while the load is swept with the input
    locked, its contacts bend before they slip: `MaxwellSlip` with the same sum of slip forces.
    Bristles of Dahl's and LuGre's friction do so too.

    Attributes
    ----------
    level : float
        N.m.
    torsion : float
        Torsion beyond which all contacts slip, rad.
    spread : float
        Spread of their slip torsions, dimensionless: see `MaxwellSlip`.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or a torsion or spread that is not above 0.
    """

    torsion: float
    spread: float = 1.0

    def __post_init__(self) -> None:
        real_number("presliding_friction.level", self.level)
        real_number("presliding_friction.torsion", self.torsion, above=0.0)
        real_number("presliding_friction.spread", self.spread, above=0.0)

    @property
    def before_slip(self) -> MaxwellSlip:
        """The contacts as springs that slip."""
        return MaxwellSlip(self.level, self.torsion, self.spread)


def _bending(sizes: Sizes) -> Sequence[Guess]:
    """Guess contacts of the output of a drive, if a sweep shows how they bend.

    Not beside others: in the sweep alone they follow what the form of another law leaves there.
    """
    replaced = ("coulomb_friction", "hysteresis")
    return [Guess(*springs("level", sizes), instead_of=replaced)] if sizes.swept else []


register(
    Effect(
        "presliding_friction",
        PreslidingFriction,
        ("output",),
        {"level": "torque", "torsion": "angle", "spread": ""},
        "Dry friction at the {port} whose contacts bend before they slip, so that a load turns the "
        "{port} by some arcseconds that return.",
        _bending,
        contains=("coulomb_friction",),
        forms="curve_of_speed",
        form_of="coulomb_friction",
    )
)
