"""What a fit may change: base parameters within their tolerances, sensor errors, effect parameters.

Base parameters keep hard bounds: with a Gaussian prior they would run many standard deviations and
hide an effect. The errors of torque sensors are unknown constants with a prior of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.believed import Believed, Rig

MECHANICAL = (
    "stiffness",
    "damping",
    "input_inertia",
    "input_damping",
    "output_damping",
    "load_inertia",
)
"""Fields of `Believed` that are fitted; J_out, 1/100 of the load's inertia, is not."""

READING = (
    "offset",
    "input_torque_gain",
    "input_torque_zero",
    "output_torque_gain",
    "output_torque_zero",
)
"""Constant of the transmission error (rad), gains (relative) and zeros (N.m) of torque sensors."""


@dataclass(frozen=True)
class Parameter:
    """One unknown.

    Attributes
    ----------
    name : str
    start, lower, upper : float
        SI.
    scale : float
        Its natural size, the unit of the search.
    prior : float
        Standard deviation around ``start``; infinite for a parameter with bounds only.
    """

    name: str
    start: float
    lower: float
    upper: float
    scale: float
    prior: float = np.inf


def base_parameters(
    believed: Believed, rig: Rig, phases: Sequence[float], offset: float
) -> tuple[Parameter, ...]:
    """Return the unknowns of a drive without any further effect.

    Parameters
    ----------
    believed : Believed
    rig : Rig
    phases : sequence of float, length n_lines
        First guess of the phases of the static error, rad.
    offset : float
        First guess of the constant of the transmission error, rad.
    """
    found = [_within(name, getattr(believed, name), believed.tolerance) for name in MECHANICAL]
    for line, amplitude in enumerate(believed.error_amplitudes):
        found.append(_within(f"error_amplitude_{line}", amplitude, believed.error_tolerance))
        phase = phases[line]
        found.append(Parameter(f"error_phase_{line}", phase, phase - 9.0, phase + 9.0, 0.1))
    found.append(Parameter("offset", offset, offset - 1.0, offset + 1.0, 1e-5))
    # A stiffness that varies with the input angle is not its mean where the input was locked.
    locked = _within("locked_stiffness", 1.0, believed.tolerance)
    # The prior only keeps it in place where no sweep speaks of it.
    found.append(replace(locked, prior=locked.scale))
    for name in READING[1:]:
        # What rigs are said to keep is taken for a standard deviation: sensors exceed it.
        size = max(float(getattr(rig, name)), 1e-9)
        found.append(Parameter(name, 0.0, -10.0 * size, 10.0 * size, size, prior=size))
    return tuple(found)


def _within(name: str, value: float, tolerance: float) -> Parameter:
    reach = max(tolerance * value, 1e-12)
    return Parameter(name, value, value - reach, value + reach, reach)


@dataclass(frozen=True)
class Layout:
    """Where each parameter stands in a vector of values, shape (..., n_parameters)."""

    parameters: tuple[Parameter, ...]

    def __len__(self) -> int:
        return len(self.parameters)

    def index(self, name: str) -> int:
        """Return the place of a parameter."""
        return [parameter.name for parameter in self.parameters].index(name)

    def array(self, attribute: str) -> NDArray[np.float64]:
        """Return one attribute of all parameters, shape (n_parameters,)."""
        return np.array([getattr(parameter, attribute) for parameter in self.parameters])
