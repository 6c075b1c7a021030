"""More inertia on the output, and mesh damping that is referred to another shaft.

Together with `mesh_stiffness` these are the candidates of the calibration: the printed equations
with the printed values respond to the static error as a rigid drive would.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class LoadInertia(DriveEffect):
    """Inertia rigidly on the output: loading motor, couplings, torque sensor or robot link.

    Attributes
    ----------
    name : str
        ``"load_inertia"``, in model files and verdicts.
    inertia : float
        J_L, kg.m2, added to J_out of the equations of motion, Eq. (9).

    Raises
    ------
    InvalidInput
        If the inertia is negative or not finite.

    Examples
    --------
    >>> from dataclasses import replace
    >>> model = preset("published")
    >>> heavy = replace(model, effects=(*model.effects, LoadInertia(0.45)))
    >>> rows = model.nominal[np.newaxis]
    >>> bool(heavy.dte_arcsec(rows)[0] > model.dte_arcsec(rows)[0])
    True
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

    def joined(self, other: LoadInertia) -> LoadInertia:
        """Return both inertias as one.

        Parameters
        ----------
        other : LoadInertia
        """
        return LoadInertia(self.inertia + other.inertia)


@dataclass(frozen=True)
class CoupledInertia(DriveEffect):
    """Inertia on the output behind a viscous clutch or damper, which brings it to speed.

    Attributes
    ----------
    name : str
        ``"coupled_inertia"``, in model files; verdicts call it a form of ``"load_inertia"``.
    inertia : float
        kg.m2.
    time : float
        After which it has come to speed, s: the inertia over the damping of the clutch.

    Raises
    ------
    InvalidInput
        If the inertia is negative, the time not above 0, or one of them not finite.

    Examples
    --------
    >>> CoupledInertia(inertia=0.05, time=5e-4).inertia
    0.05
    """

    name: ClassVar[str] = "coupled_inertia"
    inertia: float
    time: float

    def __post_init__(self) -> None:
        real_number("coupled_inertia.inertia", self.inertia, at_least=0.0)
        real_number("coupled_inertia.time", self.time, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the inertia in its clutch."""
        coupled = (*coefficients.coupled, (self.inertia, self.time))
        return replace(coefficients, coupled=coupled)


_IN_A_CLUTCH = "There is more inertia on the {port} than stated, behind a clutch or damper."


def _inertia(sizes: DriveSizes) -> list[Guess]:
    """Guess up to ten times the inertia of the load, rigidly there or in a clutch.

    An inertia larger by half moves a resonance past lines, so that fits start on both sides of it,
    and in steps of 2.5 up to where the load hardly moves any more. The range of a clutch's time is
    set by hand: vibrations of the drive see a rigid inertia at its lower end, and at its upper end
    one that rests.
    """
    size = sizes.inertia
    added = unknown("inertia", 0.0, 10.0 * size, 0.3 * size)
    rigid = Guess((added,), [(share * size,) for share in (0.15, 0.4, 1.0, 2.5, 6.0)])
    if size == 0.0:
        return [rigid]
    # The inverse angular frequency of that inertia on the believed spring.
    swing = math.sqrt(size / sizes.stiffness)
    time = unknown("time", 0.02 * swing, 20.0 * swing, swing)
    starts = [(share * size, late * swing) for share in (0.4, 1.5) for late in (0.2, 1.0)]
    coupled = Guess(
        (added, time),
        starts,
        lambda values: (CoupledInertia(*values),),
        form="coupled",
        sentence=_IN_A_CLUTCH,
    )
    return [rigid, coupled]


register(
    Effect(
        CoupledInertia.name,
        None,
        ("output",),
        {"inertia": "inertia", "time": "time"},
        _IN_A_CLUTCH,
        change=CoupledInertia,
        exact=True,
    )
)


register(
    Effect(
        LoadInertia.name,
        None,
        ("output",),
        {"inertia": "inertia"},
        "There is more inertia on the {port} than stated.",
        _inertia,
        change=LoadInertia,
        of_fit={"time": "time"},
        exact=True,
        forms="hanging_load",
        covers="load_inertia",
    )
)


@dataclass(frozen=True)
class DampingReference(DriveEffect):
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

    Examples
    --------
    >>> model = preset("calibrated")
    >>> [effect.factor for effect in model.effects if isinstance(effect, DampingReference)]
    [4.011]
    """

    name: ClassVar[str] = "damping_reference"
    factor: float

    def __post_init__(self) -> None:
        real_number("damping_reference.factor", self.factor, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the damping referred to the output."""
        scale = self.factor * coefficients.ratio**2
        return replace(coefficients, damping=scale * coefficients.damping)

    def on_sheet(self, ratio: float) -> DampingReference:
        """Return the factor in front of B_fc.

        Parameters
        ----------
        ratio : float
            Transmission ratio N, dimensionless.
        """
        return DampingReference(self.factor * ratio**2)

    def joined(self, other: DampingReference) -> DampingReference:
        """Return the product of both factors.

        Parameters
        ----------
        other : DampingReference
        """
        return DampingReference(self.factor * other.factor)


def _damping(sizes: DriveSizes) -> list[Guess]:
    """Guess a factor of the believed damping: a few times more or less."""
    squared = sizes.ratio**2

    def build(values: Sequence[float]) -> tuple[DriveEffect, ...]:
        return (DampingReference(values[0] / squared),)

    return [Guess((unknown("factor", 0.02, 50.0, 2.0),), [(3.0,), (0.4,), (8.0,)], build)]


register(
    Effect(
        DampingReference.name,
        None,
        ("mesh",),
        {"factor": ""},
        "The damping of the torsion is referred to another shaft than stated.",
        _damping,
        change=DampingReference,
        forms="growing_damping",
        covers="damping",
    )
)
