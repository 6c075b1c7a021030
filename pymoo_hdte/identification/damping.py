"""Damping coefficients from no-load runs at constant speeds (Eqs. 26-28 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.identification.linear_fit import LinearFit, fit_line
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

INPUT_SPEEDS = np.arange(200.0, 2001.0, 200.0) * REVOLUTION_PER_MINUTE
"""Speeds of the runs for B_in and B_fc, rad/s."""

OUTPUT_SPEEDS = np.arange(2.0, 20.1, 2.0) * REVOLUTION_PER_MINUTE
"""Speeds of the runs for B_out, rad/s."""

FEWEST_SPEEDS = 3

SPEED_TOLERANCE = 0.01
"""Relative difference up to which speeds of two assemblies count as equal."""


@dataclass(frozen=True)
class NoLoadRun:
    """Mean no-load torque at several constant speeds (Section 3).

    Attributes
    ----------
    speed : ndarray, shape (n,)
        rad/s, increasing, of at least three values.
    torque : ndarray, shape (n,)
        N.m.

    Raises
    ------
    InvalidInput
        For too few speeds, speeds that do not increase, or a value that is not finite.

    Examples
    --------
    >>> run = NoLoadRun(np.array([10.0, 20.0, 30.0]), np.array([0.11, 0.12, 0.13]))
    >>> print(f"{bearing_damping(run).slope:.4f} N.m.s/rad")
    0.0010 N.m.s/rad
    """

    speed: NDArray[np.float64]
    torque: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "speed", finite_array("speed", self.speed, (None,)))
        shape = (len(self.speed),)
        object.__setattr__(self, "torque", finite_array("torque", self.torque, shape))
        if len(self.speed) < FEWEST_SPEEDS:
            allowed = f"at least {FEWEST_SPEEDS}, or the slope has no standard error"
            raise InvalidInput("number of speeds", len(self.speed), allowed)
        falls = np.flatnonzero(np.diff(self.speed) <= 0.0)
        if falls.size:
            where = int(falls[0]) + 1
            raise InvalidInput(f"speed[{where}]", float(self.speed[where]), "increasing speeds")


def bearing_damping(run: NoLoadRun) -> LinearFit:
    """Return B_in (Eq. 26) or B_out (Eq. 28): the slope of no-load torque over speed.

    The standard errors assume independent noise at each speed. Coulomb friction, preload and the
    sensor's zero go into the intercept.

    Parameters
    ----------
    run : NoLoadRun
        For B_in wave generator and flexible bearing only, for B_out output bearing and circular
        spline.

    Returns
    -------
    LinearFit
        Slope in N.m.s/rad, intercept in N.m.

    Examples
    --------
    >>> run = NoLoadRun(np.array([10.0, 20.0, 30.0]), np.array([0.11, 0.12, 0.13]))
    >>> print(f"{bearing_damping(run).slope:.4f} N.m.s/rad")
    0.0010 N.m.s/rad
    """
    return fit_line(run.speed, run.torque)


def mesh_damping(bearing: NoLoadRun, complete: NoLoadRun) -> LinearFit:
    """Return B_fc (Eq. 27): the slope of the torque that flexspline and mesh add.

    Both runs contribute noise. B_in from the same bearing run errs in the opposite direction: the
    two slopes sum to that of the complete assembly.

    Parameters
    ----------
    bearing : NoLoadRun
        Wave generator and flexible bearing only.
    complete : NoLoadRun
        The whole drive, at the same speeds within 1 %.

    Returns
    -------
    LinearFit
        Slope in N.m.s/rad, intercept in N.m.

    Raises
    ------
    InvalidInput
        If the speeds differ.

    Examples
    --------
    >>> speed = np.array([10.0, 20.0, 30.0])
    >>> bearing, complete = NoLoadRun(speed, 0.001 * speed), NoLoadRun(speed, 0.003 * speed)
    >>> print(f"{mesh_damping(bearing, complete).slope:.4f} N.m.s/rad")
    0.0020 N.m.s/rad
    """
    if len(complete.speed) != len(bearing.speed):
        allowed = f"{len(bearing.speed)}, as in the run of the bearing alone"
        raise InvalidInput("number of speeds of the complete drive", len(complete.speed), allowed)
    apart = np.abs(complete.speed - bearing.speed) > SPEED_TOLERANCE * np.abs(bearing.speed)
    if apart.any():
        where = int(np.argmax(apart))
        allowed = f"{bearing.speed[where]:g} rad/s within 1 %, as in the run of the bearing alone"
        raise InvalidInput(
            f"speed[{where}] of the complete drive", float(complete.speed[where]), allowed
        )
    speed = (bearing.speed + complete.speed) / 2.0
    return fit_line(speed, complete.torque - bearing.torque)
