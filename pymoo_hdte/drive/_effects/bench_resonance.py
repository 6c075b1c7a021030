"""A base of the output encoder that the load turns: the bench itself resonates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, Lines
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import unknown

_STARTS = (0.1, 0.2, 0.35, 0.6, 1.0)
"""Where resonances are tried, over the largest frequency of the analysed lines."""


@dataclass(frozen=True)
class BenchResonance(DriveEffect):
    """The torque of the output turns what holds its encoder, which shows as much less angle.

    By compliance / (1 + 2 i damping x - x^2) of the torque at x = frequency over that of the
    resonance: the receptance of one mode (Ewins, Modal Testing, 2nd ed., 2000). The drive does not
    feel it.

    Attributes
    ----------
    compliance : float
        rad/(N.m).
    frequency : float
        Of the resonance, rad/s.
    damping : float
        Share of the critical damping.

    Raises
    ------
    InvalidInput
        For a number that is not finite, a frequency or damping that is not above 0.

    Examples
    --------
    >>> mode = BenchResonance(compliance=1e-7, frequency=500.0, damping=0.03)
    >>> still, at_resonance = np.abs(mode.turned_back(np.array([0.0, 500.0])))
    >>> print(f"{at_resonance / still:.1f}")
    16.7
    """

    name: ClassVar[str] = "bench_resonance"
    port: ClassVar[str] = "sensor"
    compliance: float
    frequency: float
    damping: float

    def __post_init__(self) -> None:
        real_number("bench_resonance.compliance", self.compliance)
        real_number("bench_resonance.frequency", self.frequency, above=0.0)
        real_number("bench_resonance.damping", self.damping, above=0.0)

    def turned_back(self, frequency: Values) -> Lines:
        """Return how much less angle is read for a torque of the output, rad/(N.m).

        Parameters
        ----------
        frequency : ndarray, shape (...)
            rad/s; negative where the drive turns backward.

        Returns
        -------
        ndarray of complex, shape (...)
        """
        x = frequency / self.frequency
        return np.asarray(self.compliance / (1.0 + 2j * self.damping * x - x**2))


def _modes(sizes: DriveSizes) -> list[Guess]:
    """Guess a mode anywhere among the lines, much stiffer than the drive itself."""
    if not (sizes.stiffness and sizes.shown):
        return []
    highest = max(sizes.shown) * sizes.speed * sizes.slower
    softest = 1.0 / sizes.stiffness
    unknowns = (
        unknown("compliance", 0.0, softest, 3e-3 * softest),
        unknown("frequency", 0.02 * highest, 1.5 * highest, 0.3 * highest),
        unknown("damping", 1e-3, 0.5, 0.03),
    )
    starts = [(unknowns[0].start, share * highest, 0.05) for share in _STARTS]
    return [Guess(unknowns, starts)]


register(
    Effect(
        BenchResonance.name,
        None,
        ("sensor",),
        {"compliance": "rad/(N.m)", "frequency": "angle rate", "damping": ""},
        "What holds the output encoder resonates.",
        _modes,
        change=BenchResonance,
        exact=True,
        nuisance_at=("sensor",),
    )
)
