"""A line of the static error that is there from a time of the session on only.

A drive that was taken off and mounted again sits otherwise on its shafts: within a series of
measurements the static error repeats, from one series to the next its lines may change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, check_line
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, guess_of_lines
from pymoo_hdte.effects.unknowns import Family


@dataclass(frozen=True)
class ChangedStaticError(DriveEffect):
    """A line that is added to theta_s from a time on: amplitude sin(order theta_in + phase).

    It is the difference between the static errors of two series of measurements, between which the
    drive was mounted anew. A model without a session is the drive of the last series.

    Attributes
    ----------
    name : str
        ``"changed_static_error"``, in model files and verdicts.
    order : float
        Cycles per input turn, above 0.
    amplitude, phase : float
        rad at the output, and rad.
    after : float
        Time of the session, s.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or an order that is not above 0.

    Examples
    --------
    >>> ChangedStaticError(order=2.0, amplitude=2e-5, phase=0.0, after=1800.0).after
    1800.0
    """

    name: ClassVar[str] = "changed_static_error"
    order: float
    amplitude: float
    phase: float
    after: float

    def __post_init__(self) -> None:
        check_line(self)
        real_number("changed_static_error.after", self.after)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the line, which solvers have in later records only."""
        line = (self.after, self.order, complex(sine_phasor(self.amplitude, self.phase)))
        return replace(coefficients, late_errors=(*coefficients.late_errors, line))


def _lines(sizes: DriveSizes) -> list[Guess]:
    """Guess a change between any two series of those believed lines that the base leaves.

    They change together, as all come from how the drive is mounted.
    """
    orders = tuple(order for order in sizes.seen if sizes.believes(order))
    return [_changed(sizes, orders, after) for after in sizes.series if orders]


def _changed(sizes: DriveSizes, orders: tuple[float, ...], after: float) -> Guess:
    def line(order: float, amplitude: float, phase: float) -> ChangedStaticError:
        # Lines are cosines, the static error is a sum of sines.
        return ChangedStaticError(order, amplitude, phase + np.pi / 2.0, after)

    guess = guess_of_lines(
        Family(orders, harmonic=False),
        "amplitude",
        sizes.largest_error,
        sizes.error,
        line,
        form=f"{after:.0f} s",
        sentence="The static error changed between two series of measurements, "
        f"{after:.0f} s into the session, at the orders {{order}}.",
    )
    return replace(guess, among=len(sizes.series))


register(
    Effect(
        ChangedStaticError.name,
        None,
        ("mesh",),
        {"order": "", "amplitude": "angle", "phase": "angle", "after": "time"},
        "The static error changed between two series of measurements, at order {order}.",
        _lines,
        change=ChangedStaticError,
        exact=True,
    )
)
