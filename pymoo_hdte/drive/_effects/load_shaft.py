"""A shaft ahead of the load that twists: the bench's coupling, torque sensor and adapters."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class LoadShaft(DriveEffect):
    """The inertia of the load turns behind a shaft that twists, and not rigidly on the output.

    Below the resonance of the load on its shaft the drive feels a larger inertia, beyond it hardly
    any (Den Hartog, Mechanical Vibrations, 4th ed., 1956, on the vibration absorber). The torque
    sensor sits on the shaft and reads what the load takes.

    Attributes
    ----------
    compliance : float
        Twist over torque, rad/(N.m); 0 for a rigid shaft.
    time : float
        Damping of the shaft over its stiffness, s.

    Raises
    ------
    InvalidInput
        For a number that is negative or not finite.

    Examples
    --------
    A load of 0.1 kg.m2 on a shaft of 1e5 N.m/rad resonates at 1000 rad/s: at half of that it is
    felt as a third more.

    >>> from dataclasses import replace
    >>> model = preset("published")
    >>> model = replace(model, effects=(LoadInertia(0.1), LoadShaft(1e-5, 0.0)))
    >>> coefficients = model.coefficients(model.nominal[np.newaxis])
    >>> print(f"{coefficients.loose_inertia(np.array([500.0])).real.item():.4f} kg.m2")
    0.0333 kg.m2
    """

    name: ClassVar[str] = "load_shaft"
    port: ClassVar[str] = "load"
    compliance: float
    time: float

    def __post_init__(self) -> None:
        real_number("load_shaft.compliance", self.compliance, at_least=0.0)
        real_number("load_shaft.time", self.time, at_least=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the load behind the shaft."""
        shaft = (self.compliance, self.time) if self.compliance > 0.0 else None
        return replace(coefficients, shaft=shaft)


def _shafts(sizes: DriveSizes) -> list[Guess]:
    """Guess a shaft up to as soft as the drive itself, which hardly dampens or much."""
    if not (sizes.stiffness and sizes.inertia):
        return []
    softest = 1.0 / sizes.stiffness
    swing = math.sqrt(sizes.inertia * softest)
    unknowns = (
        unknown("compliance", 0.0, softest, 0.03 * softest),
        unknown("time", 1e-4 * swing, swing, 0.01 * swing),
    )
    starts = [(share * softest, 0.01 * swing) for share in (0.03, 0.15, 0.5)]
    return [Guess(unknowns, starts)]


register(
    Effect(
        LoadShaft.name,
        None,
        ("load",),
        {"compliance": "rad/(N.m)", "time": "time"},
        "The load turns behind a shaft that twists.",
        _shafts,
        change=LoadShaft,
        exact=True,
        nuisance_at=("load",),
    )
)
