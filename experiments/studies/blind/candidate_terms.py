"""A library of candidate laws for sparse regression, each a torque along a measured motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.effects.hysteresis import slip_along
from pymoo_hdte.units import ARCSEC

Values = NDArray[np.float64]

RATED_TORQUE = 40.0
"""Load at which mesh laws are scaled, N.m."""
WOUND = (0.1, 0.2, 0.4)
"""Where a soft wind-up ends, as shares of the torsion at rated torque."""
SLIPS = (0.03, 0.1, 0.3)
"""Where springs slip that make a hysteresis, as shares of the torsion at rated torque."""
CLEARANCES = (2.0 * ARCSEC, 4.0 * ARCSEC, 8.0 * ARCSEC)
"""Half-widths, rad."""
FADING = (5.0, 20.0, 80.0)
"""Speeds with which a Stribeck curve falls, rad/s."""
BREAKAWAYS = (0.5, 1.0, 2.0)
"""Dry friction of the output, N.m; at rest it does not enter linearly."""


@dataclass(frozen=True, eq=False)
class RecordMotion:
    """A record along its path, arrays of shape (n,), SI; nan where unknown.

    ``closed`` says that the path ends where it begins, as in a steady state.
    """

    closed: bool
    angle: Values
    speed: Values
    output_speed: Values
    output_acceleration: Values
    torsion: Values
    torsion_rate: Values
    mesh_torque: Values
    error_slope: Values


Law = Callable[[RecordMotion], Values]


@dataclass(frozen=True)
class Term:
    """A candidate law: the effect it indicates, where it acts, and its torque for a motion.

    ``positive`` says that its coefficient cannot be negative.
    """

    name: str
    port: str
    torque: Law
    positive: bool = False


def terms(believed: BelievedDrive, orders: Sequence[float]) -> list[Term]:
    """Return the library, with lines at these orders (cycles per input turn).

    Ports are "input", "output" and "mesh" of the drive, "load", "motor", and of the reading of the
    output angle "encoder" (a line) and "drift" (with time). Lines of the load are no effect of the
    workflow's list: they count as "unlisted".
    """
    slow = [1.0 / believed.ratio, 2.0 / believed.ratio]
    off_centre = [order for order in orders if np.any(np.isclose(order, slow))]
    extra = [order for order in orders if order not in (*believed.error_orders, *off_centre)]
    return [
        *_mesh_terms(RATED_TORQUE / believed.stiffness),
        *_friction_terms(slow),
        Term("load_inertia", "load", lambda m: m.output_acceleration, positive=True),
        Term("kinematic_reaction", "input", lambda m: m.mesh_torque * m.error_slope),
        Term("thermal_drift", "drift", _one),
        *_periodic("torque_ripple", "motor", [order for order in orders if order > slow[1]]),
        *_periodic("eccentricity", "encoder", off_centre),
        *_periodic("kinematic_error", "mesh", extra),
        *_periodic("unlisted", "load", orders),
    ]


def _mesh_terms(windup: float) -> list[Term]:
    shaped = [
        ("soft_windup", _missing_below_windup, [share * windup for share in WOUND]),
        ("hysteresis", _slipping_spring, [share * windup for share in SLIPS]),
        ("backlash", _missing_in_clearance, CLEARANCES),
    ]
    return [
        Term("hardening_stiffness", "mesh", lambda m: m.torsion**3, positive=True),
        Term("damping_reference", "mesh", lambda m: m.torsion_rate),
        *(
            Term(name, "mesh", partial(law, size=size), positive=True)
            for name, law, sizes in shaped
            for size in sizes
        ),
        *_periodic("mesh_stiffness_variation", "mesh", [2.0, 4.0], lambda m: m.torsion),
        # Beyond a clearance the spring lacks the same torque at any torsion.
        *_periodic("clearance_variation", "mesh", [1.0, 2.0], lambda m: np.sign(m.torsion)),
    ]


def _friction_terms(slow: Sequence[float]) -> list[Term]:
    return [
        Term("coulomb_friction", "input", _direction, positive=True),
        *(
            Term("coulomb_friction", "output", partial(_dry, breakaway=level), positive=True)
            for level in BREAKAWAYS
        ),
        Term("nonlinear_drag", "input", lambda m: m.speed * np.abs(m.speed), positive=True),
        Term("nonlinear_drag", "input", lambda m: m.speed**3, positive=True),
        *(
            Term("stribeck_friction", "input", partial(_falling, speed=speed), positive=True)
            for speed in FADING
        ),
        *_periodic("position_dependent_friction", "input", [1.0, 2.0, 4.0], _direction),
        *_periodic("position_dependent_friction", "output", slow, _direction),
    ]


def _one(motion: RecordMotion) -> Values:
    return np.ones_like(motion.angle)


def _direction(motion: RecordMotion) -> Values:
    return np.sign(motion.speed)


def _falling(motion: RecordMotion, speed: float) -> Values:
    return np.sign(motion.speed) * np.exp(-((motion.speed / speed) ** 2))


def _missing_below_windup(motion: RecordMotion, size: float) -> Values:
    return -np.tanh(motion.torsion / size)


def _missing_in_clearance(motion: RecordMotion, size: float) -> Values:
    return -np.clip(motion.torsion, -size, size)


def _slipping_spring(motion: RecordMotion, size: float) -> Values:
    """Return the stretch of a spring that slips there, once its initial state has no effect."""
    path = np.tile(motion.torsion, 2 if motion.closed else 1)
    return _stretch(path, size)[-len(motion.torsion) :]


def _dry(motion: RecordMotion, breakaway: float) -> Values:
    """Return the sign of the output's speed; at rest, the share of the load that friction holds."""
    if motion.closed:
        return np.sign(motion.output_speed)
    return -_stretch(motion.mesh_torque, breakaway) / breakaway


def _stretch(path: Values, slip: float) -> Values:
    return np.asarray(slip_along(path[None], np.array([slip]))[0][0, 0])


def _wave(
    motion: RecordMotion, order: float, wave: Callable[[Values], Values], factor: Law
) -> Values:
    return factor(motion) * wave(order * motion.angle)


def _periodic(name: str, port: str, orders: Sequence[float], factor: Law = _one) -> list[Term]:
    """Return cosine and sine of each order times a factor."""
    return [
        Term(name, port, partial(_wave, order=order, wave=wave, factor=factor))
        for order in orders
        for wave in (np.cos, np.sin)
    ]
