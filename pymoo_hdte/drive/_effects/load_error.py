"""A line of the static transmission error whose amplitude grows with the load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, check_line
from pymoo_hdte.drive._effects.mesh_stiffness import WAVE_GENERATOR_ORDER
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, guess_of_lines
from pymoo_hdte.effects.unknowns import Family


@dataclass(frozen=True)
class LoadDependentError(DriveEffect):
    """A line of theta_s in proportion to the load T_L.

    It is amplitude (T_L / reference) sin(order theta_in + phase): parts that bend under the load
    shift what errs. So do two zones of engagement of unequal stiffness, at order 1: no record
    tells the two. A load in the other direction reverses its sign. The load is the torque beyond
    all inertias, so that the line does not follow a torque that fluctuates.

    Attributes
    ----------
    name : str
        ``"load_dependent_error"``, in model files and verdicts.
    order : float
        Cycles per input turn, above 0.
    amplitude, phase : float
        rad at the output under the reference load, and rad.
    reference : float
        Load at which the line has this amplitude, N.m at the output, above 0; in a verdict the
        largest of the records.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or an order or reference that is not above 0.

    Examples
    --------
    >>> line = LoadDependentError(order=1.0, amplitude=2e-5, phase=0.0, reference=40.0)
    >>> line.order, line.reference
    (1.0, 40.0)
    """

    name: ClassVar[str] = "load_dependent_error"
    order: float
    amplitude: float
    phase: float
    reference: float

    def __post_init__(self) -> None:
        check_line(self)
        real_number("load_dependent_error.reference", self.reference, above=0.0)

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the line, which solvers scale with their loads."""
        line = (self.order, complex(sine_phasor(self.amplitude, self.phase)) / self.reference)
        return replace(coefficients, load_errors=(*coefficients.load_errors, line))


def _lines(sizes: DriveSizes) -> list[Guess]:
    """Guess one line at each order that is seen, where records are taken under different loads.

    A believed line may grow as well. At the orders of the two lobes the wind-up under a varying
    stiffness is the same line, and `MeshStiffnessVariation` has it.
    """
    if not sizes.loads_differ:
        return []

    def line(order: float, amplitude: float, phase: float) -> LoadDependentError:
        # Lines are cosines, the static error is a sum of sines.
        return LoadDependentError(order, amplitude, phase + np.pi / 2.0, sizes.largest)

    return [
        guess_of_lines(Family((order,)), "amplitude", sizes.largest_error, sizes.error, line)
        for order in _orders(sizes.seen)
    ]


def _orders(seen: Sequence[float]) -> list[float]:
    """Return orders without the multiples of that of the wave generator."""
    lobes = np.array(seen) / WAVE_GENERATOR_ORDER
    return [
        order for order, turns in zip(seen, lobes, strict=True) if abs(turns - round(turns)) > 1e-6
    ]


register(
    Effect(
        LoadDependentError.name,
        None,
        ("mesh",),
        {"order": "", "amplitude": "angle", "phase": "angle", "reference": "torque"},
        "A line of the static error at order {order} that grows with the load.",
        _lines,
        change=LoadDependentError,
        exact=True,
        forms="harmonics_of_error",
        with_load=True,
    )
)
