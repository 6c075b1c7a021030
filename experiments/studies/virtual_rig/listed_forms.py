"""Hidden effects that the library also has, under the same name and in another form.

Sizes are our own choice within the usual range of strain wave gears of this size and their rigs;
``size`` scales the strength of an effect, 1 being typical. Each function returns the port and the
values of its fields (`laws.Side`, `laws.Mesh` or `sensors.OutputEncoder`), SI.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

Drawn = tuple[str, dict[str, float | tuple[float, ...]]]

RATED_TORQUE = 40.0
"""N.m at the output; where shares of the wind-up are taken."""
RATED_SPEED = 2000.0 * REVOLUTION_PER_MINUTE
"""rad/s at the input; where shares of the speed are taken."""
ROUNDING_SPEED = {"input": 0.2, "output": 0.002}
"""rad/s over which dry friction turns; a fifth of the slowest speed of the shared rigs."""


def uniform_phase(rng: np.random.Generator) -> float:
    """Draw a phase, rad."""
    return rng.uniform(0.0, 2.0 * math.pi)


def _windup(believed: BelievedDrive) -> float:
    return RATED_TORQUE / believed.stiffness


def hardening_stiffness(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a sinh, or a corner beyond which the mesh is stiffer; 4 to 12 % more torque at rated."""
    windup, share = _windup(believed), size * rng.uniform(0.04, 0.12)
    if rng.random() < 0.5:
        reach = brentq(lambda x: math.sinh(x) / x - 1.0 - share, 1e-6, 20.0)
        return "mesh", {"sinh_curvature": reach / windup}
    corner = rng.uniform(0.3, 0.6)
    return "mesh", {
        "stiff_share": share / (1.0 - corner),
        "stiff_corner": corner * windup,
        "corner_rounding": 0.05 * windup,
    }


def soft_windup(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw three pieces K1 < K2 < K3 as in catalogues; the third hardly stiffer."""
    windup, corner = _windup(believed), rng.uniform(0.1, 0.35)
    return "mesh", {
        "soft_share": min(size * rng.uniform(0.15, 0.4), 0.95),
        "soft_corner": corner * windup,
        "stiff_share": min(size, 1.0) * rng.uniform(0.0, 0.03),
        "stiff_corner": 0.8 * windup,
        "corner_rounding": 0.15 * corner * windup,
    }


def hysteresis(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw Maxwell slip: 4 to 8 elements of equal torque, 0.5 to 2.5 N.m together."""
    count = int(rng.integers(4, 9))
    limit = size * rng.uniform(0.5, 2.5) / count
    yields = _windup(believed) * np.exp(rng.uniform(math.log(0.02), math.log(0.4), count))
    stiffness = tuple(float(limit / torsion) for torsion in np.sort(yields))
    return "mesh", {"slip_stiffness": stiffness, "slip_limit": (limit,) * count}


def backlash(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a rounded dead zone of 2 to 8 arcsec half width."""
    half_width = size * rng.uniform(2.0, 8.0) * ARCSEC
    return "mesh", {"clearance": half_width, "clearance_rounding": 0.15 * half_width}


def clearance_variation(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a rounded dead zone whose width varies once or twice in an input turn.

    Both flanks move, or one does. A zone that moves as a whole is not drawn: wherever the load
    holds the flanks together it is backlash and a line of the static error, and nothing else.
    """
    port, parameters = backlash(believed, rng, size)
    variation = rng.uniform(0.5, 1.0)
    flanks: dict[str, float | tuple[float, ...]] = {"pulse": variation}
    if rng.random() < 0.5:
        flanks = {"pulse": variation / 2.0, "shift": variation / 2.0}
    order, phase = float(rng.integers(1, 3)), uniform_phase(rng)
    return port, parameters | flanks | {"clearance_order": order, "clearance_phase": phase}


def coulomb_friction(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw dry friction of one shaft; 0.008 to 0.03 N.m at the input, 0.5 to 2.5 at the output."""
    port, low, high = [("input", 0.008, 0.03), ("output", 0.5, 2.5)][rng.integers(2)]
    level = size * rng.uniform(low, high)
    return port, {"coulomb": level, "rounding_speed": ROUNDING_SPEED[port]}


def stribeck_friction(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw dry friction of the input that falls exponentially with speed."""
    return "input", {
        "coulomb": size * rng.uniform(0.005, 0.02),
        "stribeck": size * rng.uniform(0.01, 0.03),
        "stribeck_speed": rng.uniform(5.0, 40.0),
        "rounding_speed": ROUNDING_SPEED["input"],
    }


def position_dependent_friction(
    believed: BelievedDrive, rng: np.random.Generator, size: float
) -> Drawn:
    """Draw friction that varies once or twice in an input turn, or once in an output turn.

    Its mean keeps it positive: a negative friction would excite the rig by itself.
    """
    port, order, low, high = [
        ("input", 1.0, 0.005, 0.02),
        ("input", 2.0, 0.005, 0.02),
        ("output", 1.0, 0.4, 1.6),
    ][rng.integers(3)]
    level = size * rng.uniform(low, high)
    return port, {
        "coulomb": 1.2 * level,
        "periodic": level,
        "periodic_order": order,
        "periodic_phase": uniform_phase(rng),
        "periodic_second": uniform_phase(rng),
        "rounding_speed": ROUNDING_SPEED[port],
    }


def nonlinear_drag(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw drag of the input with power 1.7 or 3; 0.01 to 0.04 N.m at rated speed."""
    exponent = float(rng.choice([1.7, 3.0]))
    torque = size * rng.uniform(0.01, 0.04)
    return "input", {"drag": torque / RATED_SPEED**exponent, "drag_exponent": exponent}


def mesh_stiffness_variation(
    believed: BelievedDrive, rng: np.random.Generator, size: float
) -> Drawn:
    """Draw stiffness variation twice in an input turn, 1 to 5 %, its cosine clipped or not."""
    return "mesh", {
        "depth": min(size * rng.uniform(0.01, 0.05), 0.5),
        "depth_phase": uniform_phase(rng),
        "depth_second": uniform_phase(rng),
        "depth_clip": float(rng.choice([0.7, 1.0])),
    }


def kinematic_error(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a further line of 1 to 4 arcsec: order 3, 4, 5 or a whole order of the output."""
    fast = rng.random() < 0.5
    order = float(rng.integers(3, 6)) if fast else float(rng.integers(5, 61)) / believed.ratio
    return "mesh", {
        "kinematic": size * rng.uniform(1.0, 4.0) * ARCSEC,
        "kinematic_order": order,
        "kinematic_phase": uniform_phase(rng),
        "kinematic_second": uniform_phase(rng),
    }


def kinematic_reaction(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Return mesh torque times d theta_s / d theta_in on the input; ``size`` 1 is the physics."""
    return "input", {"reaction": size}


def eccentricity(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw an output encoder off centre by 2 to 8 arcsec."""
    return "sensor", {
        "eccentricity": size * rng.uniform(2.0, 8.0) * ARCSEC,
        "eccentricity_phase": uniform_phase(rng),
        "eccentricity_second": uniform_phase(rng),
    }


def torque_ripple(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a motor torque of 0.005 to 0.025 N.m at a whole order from 2 to 8."""
    return "input", {
        "ripple": size * rng.uniform(0.005, 0.025),
        "ripple_order": float(rng.integers(2, 9)),
        "ripple_phase": uniform_phase(rng),
        "ripple_second": uniform_phase(rng),
    }


def load_inertia(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw an inertia of 0.02 to 0.08 kg.m2 beyond the believed one."""
    return "output", {"extra_inertia": size * rng.uniform(0.02, 0.08)}


def damping_reference(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw mesh damping 3 to 10 times the believed one, 5 % more at rated speed."""
    return "mesh", {
        "damping_factor": 1.0 + size * rng.uniform(2.0, 9.0),
        "damping_growth": 0.05 / RATED_SPEED,
    }


def thermal_drift(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a reading of the output angle that drifts to 2 to 10 arcsec, with two time constants."""
    return "sensor", {
        "drift": size * rng.uniform(2.0, 10.0) * ARCSEC * float(rng.choice([-1.0, 1.0])),
        "drift_time": rng.uniform(300.0, 2000.0),
    }
