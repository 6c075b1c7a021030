"""Parts of the static error that Eq. (9) omits: further lines, and its reaction on the input."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, check_line
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, Sizes, guess_of_lines
from pymoo_hdte.effects.law import PortState, Response
from pymoo_hdte.effects.ripple import PeriodicTorque, torque_line
from pymoo_hdte.effects.unknowns import Family, unknown


@dataclass(frozen=True)
class KinematicErrorLine(DriveEffect):
    """A further order of theta_s: amplitude sin(order theta_in + phase).

    It does not scale with theta_s, which is a property of the orders of the static error, Eq. (1).

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

    Examples
    --------
    >>> from dataclasses import replace
    >>> model = preset("calibrated")
    >>> wrong = replace(model, effects=(*model.effects, KinematicErrorLine(3.0, 2e-5, 0.0)))
    >>> rows = model.nominal[np.newaxis]
    >>> print(f"{(wrong.dte_arcsec(rows) - model.dte_arcsec(rows))[0]:.1f} arcsec more")
    1.0 arcsec more
    """

    name: ClassVar[str] = "kinematic_error"
    order: float
    amplitude: float
    phase: float

    def __post_init__(self) -> None:
        check_line(self)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the order added."""
        phasor = sine_phasor(self.amplitude, self.phase)
        column = np.full((len(coefficients.stiffness), 1), phasor)
        return replace(
            coefficients,
            error_orders=np.append(coefficients.error_orders, self.order),
            error_phasors=np.hstack([coefficients.error_phasors, column]),
        )


@dataclass(frozen=True)
class KinematicTorsion(PeriodicTorque):
    """The torque K amplitude cos(order angle + phase) of an error in rad, added to the torsion.

    It acts at a port between the encoders of input and output, and is no driving torque there.
    """

    drives: ClassVar[bool] = False

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents."""
        return Response(state.stiffness * self.amplitude * self.cosine(state))

    @property
    def driving(self) -> complex:
        """Zero: the error is an angle, not a force."""
        return 0.0


def _lines(sizes: Any) -> list[Guess]:
    """Guess lines at seen orders: of a drive's static error, of a torsion, or of a reading."""
    if isinstance(sizes, Sizes) and sizes.between:
        return _of_torsion(sizes)
    return _of_reading(sizes) if sizes.read else _of_drive(sizes)


def _of_drive(sizes: DriveSizes) -> list[Guess]:
    def line(order: float, amplitude: float, phase: float) -> KinematicErrorLine:
        # Lines are cosines, the static error is a sum of sines.
        return KinematicErrorLine(order, amplitude, phase + np.pi / 2.0)

    return [
        guess_of_lines(family, "amplitude", sizes.largest_error, sizes.error, line)
        for family in sizes.further().lines
    ]


def _of_reading(sizes: Sizes) -> list[Guess]:
    sentence = (
        "The reading of {port} varies with the position, orders {order}, and has one amplitude "
        "at all speeds run: it is kinematic, and no {force} that moves inertias."
    )
    return [
        guess_of_lines(
            family,
            "amplitude",
            sizes.largest,
            sizes.residual,
            torque_line,
            form=family.form,
            sentence=sentence,
            quantities={"amplitude": "torque"},
        )
        for family in sizes.lines
    ]


def _of_torsion(sizes: Sizes) -> list[Guess]:
    """Guess each expected order by itself, and all seen ones together."""
    largest, typical = sizes.largest / sizes.stiffness, sizes.residual / sizes.stiffness
    sentence = "The {port} errs with its angle, order {order} per turn, whatever the {force}."

    def line(order: float, amplitude: float, phase: float) -> KinematicTorsion:
        return KinematicTorsion(order, phase, amplitude)

    return [
        guess_of_lines(
            family, "amplitude", largest, typical, line, form=family.form, sentence=sentence
        )
        for family in (*(Family((order,)) for order in sizes.expected), *sizes.lines)
    ]


register(
    Effect(
        KinematicErrorLine.name,
        PeriodicTorque,
        ("mesh",),
        {"order": "", "amplitude": "angle", "phase": "angle"},
        "A line of the static error at order {order} that the model lacks.",
        _lines,
        change=KinematicErrorLine,
        exact=True,
        of_reading=True,
        forms="harmonics_of_error",
        twin="eccentricity",
        with_load=True,
    )
)


@dataclass(frozen=True)
class KinematicReaction(DriveEffect):
    """The mesh torque acts back on the input through the slope of theta_s.

    The equations of motion, Eq. (9), leave out this term of Lagrange's equation.

    Attributes
    ----------
    name : str
        ``"kinematic_reaction"``, in model files and verdicts.
    share : float
        Share of the full reaction, dimensionless: 1 by virtual work.

    Raises
    ------
    InvalidInput
        If the share is not finite.

    Examples
    --------
    >>> KinematicReaction(share=0.5)
    KinematicReaction(share=0.5)
    """

    name: ClassVar[str] = "kinematic_reaction"
    share: float = 1.0

    def __post_init__(self) -> None:
        real_number("kinematic_reaction.share", self.share)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the reaction."""
        return replace(coefficients, reaction=self.share)


def _reaction(sizes: DriveSizes) -> list[Guess]:
    """Guess a share near that of virtual work."""
    return [Guess((unknown("share", -3.0, 3.0, 1.0),))]


register(
    Effect(
        KinematicReaction.name,
        None,
        ("input",),
        {"share": ""},
        "The mesh torque acts back on the input through the slope of the static error.",
        _reaction,
        change=KinematicReaction,
        # A generator that turns under a load may answer with a lag.
        forms="lagging_reaction",
    )
)
