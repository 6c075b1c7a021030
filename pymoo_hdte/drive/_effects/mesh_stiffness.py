"""A mesh stiffness that varies with the input angle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, guess_of_lines
from pymoo_hdte.effects.stiffness import PeriodicStiffness

WAVE_GENERATOR_ORDER = 2.0
"""Order of the effects of the wave generator's two lobes, in cycles per input turn."""


@dataclass(frozen=True)
class MeshStiffnessVariation(DriveEffect):
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

    Examples
    --------
    >>> MeshStiffnessVariation(depth=0.03, phase=0.0).order
    2.0
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


def _varying(sizes: DriveSizes) -> list[Guess]:
    """Guess the order of the two lobes with two harmonics, up to a quarter of the stiffness."""

    def line(order: float, depth: float, phase: float) -> MeshStiffnessVariation:
        return MeshStiffnessVariation(depth, phase, order)

    return [guess_of_lines(sizes.family(WAVE_GENERATOR_ORDER, 3), "depth", 0.25, 0.02, line)]


register(
    Effect(
        MeshStiffnessVariation.name,
        None,
        ("mesh",),
        {"depth": "", "phase": "angle", "order": ""},
        "The stiffness varies {order} times in an input turn.",
        _varying,
        change=MeshStiffnessVariation,
        forms="harmonics_of_stiffness",
    )
)
