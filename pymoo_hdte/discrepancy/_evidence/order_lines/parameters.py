"""Unknowns of a fit: base parameters within their tolerances, sensor errors, effect parameters.

Base parameters keep hard bounds: with a Gaussian prior they would move by many standard deviations
and hide an effect. The errors of torque sensors are unknown constants with a prior of their own.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from pymoo_hdte.discrepancy._records.believed import MECHANICAL, BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.known_values import (
    known_unit,
    known_values,
    known_words,
)
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.effects.unknowns import Parameter

READING = (
    "offset",
    "input_torque_gain",
    "input_torque_zero",
    "output_torque_gain",
    "output_torque_zero",
)
"""Constant of the transmission error (rad), gains (relative) and zeros (N.m) of torque sensors."""

_UNITS = {
    "stiffness": "N.m/rad",
    "damping": "N.m.s/rad",
    "input_inertia": "kg.m2",
    "input_damping": "N.m.s/rad",
    "output_damping": "N.m.s/rad",
    "load_inertia": "kg.m2",
    "error_amplitude": "rad",
    "error_phase": "rad",
    "offset": "rad",
    "locked_stiffness": "1",
    "input_torque_gain": "1",
    "input_torque_zero": "N.m",
    "output_torque_gain": "1",
    "output_torque_zero": "N.m",
    "loop_gain": "1",
    "loop_lag": "s",
}
"""SI units of the base parameters, by name; those of lines without their number."""
ACTING_AT = {"input_damping": "input", "output_damping": "output"}
"""Ports at which base parameters act as friction, as a law there does."""
_LOOP_GAIN = 0.1
"""Makers state the torque constant of a motor, which is part of both gains, to 10 %."""
_OF_LINES = ("error_amplitude", "error_phase")


def base_unit(name: str) -> str:
    """Return the SI unit of a base parameter; 1 for none."""
    if "." in name:
        return known_unit(name)
    return _UNITS[name.rstrip("0123456789").rstrip("_")]


def words_of(name: str, error_orders: Sequence[float]) -> str:
    """Return a base parameter in physical words: the line of an order, not its number.

    Examples
    --------
    >>> words_of("error_amplitude_1", (1.0, 2.0))
    'amplitude of order 2 of the static error'
    >>> words_of("coulomb_friction.input.level", ())
    'level of the coulomb friction at the input'
    """
    if "." in name:
        return known_words(name)
    kind, _, line = name.rpartition("_")
    if kind in _OF_LINES:
        part = kind.removeprefix("error_")
        return f"{part} of order {error_orders[int(line)]:.4g} of the static error"
    return name.replace("_", " ")


def name_by_order(name: str, error_orders: Sequence[float]) -> str:
    """Return the name of a base parameter, that of a line with its order instead of its number.

    Examples
    --------
    >>> name_by_order("error_amplitude_1", (1.0, 2.0)), name_by_order("load_inertia", (1.0,))
    ('error amplitude of order 2', 'load inertia')
    """
    kind, _, line = name.rpartition("_")
    if kind in _OF_LINES:
        name = f"{kind} of order {error_orders[int(line)]:.4g}"
    return name.replace("_", " ")


def labels_by_order(label: str, error_orders: Sequence[float]) -> str:
    """Return the label of a set of effects in words, lines of the static error by their order.

    Examples
    --------
    >>> labels_by_order("parameter:error_amplitude_1+eyring_drag:input", (1.0, 2.0))
    'error amplitude of order 2 (out of tolerance) and eyring drag (input)'
    """

    def named(line: re.Match[str]) -> str:
        return f"{name_by_order(line[1], error_orders)} (out of tolerance)"

    return in_words(re.sub(r"\bparameter:(error_(?:amplitude|phase)_\d+)", named, label))


def base_parameters(
    believed: BelievedDrive, rig: Rig, phases: Sequence[float], offset: float
) -> tuple[Parameter, ...]:
    """Return the unknowns of a drive without any further effect.

    Parameters
    ----------
    believed : BelievedDrive
    rig : Rig
    phases : sequence of float, length n_lines
        First guess of the phases of the static error, rad.
    offset : float
        First guess of the constant of the transmission error, rad.
    """
    parameters = [
        _bounded(name, getattr(believed, name), believed.tolerance_of(name)) for name in MECHANICAL
    ]
    for line, amplitude in enumerate(believed.error_amplitudes):
        length = _bounded(f"error_amplitude_{line}", amplitude, believed.error_tolerance)
        name, phase = f"error_phase_{line}", phases[line]
        # With a tenth of a radian the remaining error of Newton's method put the difference
        # quotient by the phase of a weak line off by 0.8 %.
        within, scale = (phase - 9.0, phase + 9.0), 1.0
        parameters += [length, Parameter(name, phase, *within, scale, phase_of=length.name)]
    for name, value in known_values(believed.effects).items():
        if name in believed.tolerances:
            parameters.append(_bounded(name, value, believed.tolerances[name]))
    parameters.append(Parameter("offset", offset, offset - 1.0, offset + 1.0, 1e-5))
    # Where the input was locked, a varying stiffness differs from its mean.
    locked = _bounded("locked_stiffness", 1.0, believed.tolerance_of("stiffness"))
    # The prior only determines it where no sweep does.
    parameters.append(replace(locked, prior=locked.scale))
    # The stated limit of a sensor error is taken as a standard deviation, since sensors exceed it.
    parameters += [_error(name, float(getattr(rig, name))) for name in READING[1:]]
    return (*parameters, *_of_loop(believed, rig))


def _of_loop(believed: BelievedDrive, rig: Rig) -> tuple[Parameter, Parameter]:
    """Return the unknowns of the speed loop, whose torque is never that of its gains exactly.

    A loop that lags by the time constant of the speed that it controls has a phase margin of 33
    degrees: the largest lag with which it is of use, taken as a standard deviation.
    """
    of_output = believed.output_inertia + believed.load_inertia
    driven = believed.input_inertia + of_output / believed.ratio**2
    lag = driven / rig.proportional if rig.proportional else 0.0
    # Ten deviations away there would be no loop, and an effect beside it would show in nothing.
    return _error("loop_gain", _LOOP_GAIN, 3.0), _error("loop_lag", lag, 3.0)


def _error(name: str, deviation: float, most: float = 10.0) -> Parameter:
    """Return an unknown of mean zero, up to ``most`` deviations away."""
    size = max(deviation, 1e-9)
    return Parameter(name, 0.0, -most * size, most * size, size, prior=size)


def _bounded(name: str, value: float, tolerance: float) -> Parameter:
    reach = max(tolerance * abs(value), 1e-12)
    return Parameter(name, value, value - reach, value + reach, reach)
