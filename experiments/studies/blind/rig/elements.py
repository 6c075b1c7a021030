"""Kinds of elements that a machine may have beside its linear parts, as numbers for compiled code.

An element is a row (kind, p0 ... p6) of SI values. `torques` says what each kind does; here stands
what its values mean. Waves are those of `shapes.wave`, decays those of `shapes.decay`, signs those
of `shapes.rounded_sign`. Places are 0 at the input and 1 at the output.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

WIDTH = 8
"""Numbers of an element: its kind and up to seven values."""

# Torque over the torsion, added to the spring's.
CUBIC = 1  # coefficient, N.m/rad3
SINH = 2  # stiffness, N.m/rad; curvature, 1/rad
OVERLOAD = 3  # stiffness of the second spring; torsion where it engages; rounding, rad
SOFT_ROOT = 4  # lost stiffness; torsion where it is wound up, rad
SOFT_PIECES = 5  # the same
SOFT_EXPONENTIAL = 6  # the same
SOFT_ARCTANGENT = 7  # the same
# Torque of the torsion with memory.
SLIP = 10  # stiffness; torque at which it slips, N.m
BOUC_WEN = 11  # torque, N.m; torsion of yield, rad; exponent; share of unloading (beta)
CREEP = 12  # share of the torsion that creeps; its time, s
# The gap, and factors on stiffness and damping.
PLAY = 20  # half-width; variation, rad; order; phase; contact; share of the mean gap's shift; wave
STIFFNESS_WAVE = 21  # depth; order; phase; wave
COMPLIANCE_WAVE = 22  # depth; order; phase
STIFFNESS_OF_SPEED = 23  # growth per rad/s of the input
DAMPING = 24  # further damping, N.m.s/rad; growth per rad/s of the input; growth per torsion rate
# The static error and its reaction on the input.
ERROR_WAVE = 30  # amplitude, rad; order; phase; wave
REACTION = 31  # share; 1 if the spring alone reacts; time by which it lags, s
# Friction; the last value is the place.
DRY = 40  # level, N.m; rounding speed; sign
STRIBECK = 41  # level; excess; speed; decay; rounding speed
BRISTLES = 42  # level; excess; speed; deflection at which they slip, rad; decay
UNEVEN = 43  # mean level; amplitude; order; phase; wave; rounding speed
DRAG = 44  # torque at a speed, N.m; that speed; exponent
SHEAR_DRAG = 45  # torque at rated speed; speed of shear, rad/s; rated speed
LOAD_FRICTION = 46  # share; torque below which it is rounded, N.m; exponent
MESH_FRICTION = 47  # share of the mean mesh torque; time of the mean, s
BURSTS = 48  # level; period; width, s
WARMING = 49  # level; time, s; share that it loses
# Torques of motor and load.
RIPPLE = 60  # amplitude, N.m; order; phase; wave
VIBRATION = 61  # amplitude, N.m; frequency, rad/s; phase
LOAD_RIPPLE = 62  # share of the load; cycles per output turn; phase; wave
# Of the bench; where a place is, it is the last value.
GRAVITY = 63  # torque of the load, N.m; phase
WANDER = 64  # share of the set speed; frequency, rad/s; phase; gains P and I of the loop
COUPLING = 65  # torque, N.m; cycles per turn of its shaft; phase

INPUT, OUTPUT = 0.0, 1.0


def element(kind: int, *values: float) -> tuple[float, ...]:
    """Return an element of a kind with its values; further ones are zero."""
    row = (float(kind), *map(float, values))
    return row + (0.0,) * (WIDTH - len(row))


def table(elements: tuple[tuple[float, ...], ...]) -> Values:
    """Return elements as an array of shape (n, `WIDTH`)."""
    return np.array(elements, dtype=float).reshape(-1, WIDTH)
