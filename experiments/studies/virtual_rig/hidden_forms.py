"""Hidden effects of blind campaigns, by name, each with plausible random parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pymoo_hdte.checks import one_of, real_number
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


def output_vibration(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a torque of 0.1 to 0.6 N.m on the output at 47 to 120 Hz, whatever the speed."""
    return "output", {
        "vibration": size * rng.uniform(0.1, 0.6),
        "vibration_frequency": 2.0 * math.pi * rng.uniform(47.0, 120.0),
    }


def compliant_sensor(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a torque sensor of 3e4 to 1e5 N.m/rad between drive and load: a third inertia."""
    return "output", {
        "sensor_stiffness": rng.uniform(3e4, 1e5) / size,
        "sensor_damping": rng.uniform(0.5, 2.0),
    }


def load_ripple(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw a load that varies by 1 to 5 % at a whole order of the output."""
    return "output", {
        "ripple": size * rng.uniform(0.01, 0.05),
        "ripple_order": float(rng.integers(3, 10)),
        "ripple_phase": uniform_phase(rng),
        "ripple_second": uniform_phase(rng),
    }


def speed_stiffening(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw stiffness that grows with speed, 5 to 15 % at rated."""
    return "mesh", {"stiffening": size * rng.uniform(0.05, 0.15) / RATED_SPEED}


def encoder_interpolation(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw an interpolation error of 1 to 4 arcsec with 20 to 60 periods in an output turn."""
    return "sensor", {
        "interpolation": size * rng.uniform(1.0, 4.0) * ARCSEC,
        "interpolation_lines": float(rng.integers(20, 61)),
        "interpolation_phase": uniform_phase(rng),
    }


def friction_bursts(believed: BelievedDrive, rng: np.random.Generator, size: float) -> Drawn:
    """Draw friction of the input that comes and goes within a tenth of a second."""
    return "input", {
        "burst": size * rng.uniform(0.01, 0.04),
        "burst_period": rng.uniform(0.3, 1.0),
        "burst_width": rng.uniform(0.05, 0.15),
        "rounding_speed": ROUNDING_SPEED["input"],
    }


_Draw = Callable[[BelievedDrive, np.random.Generator, float], Drawn]


def _by_name(*draws: _Draw) -> dict[str, _Draw]:
    return {draw.__name__: draw for draw in draws}


LISTED_FORMS = _by_name(
    hardening_stiffness,
    soft_windup,
    hysteresis,
    backlash,
    clearance_variation,
    coulomb_friction,
    stribeck_friction,
    position_dependent_friction,
    nonlinear_drag,
    mesh_stiffness_variation,
    kinematic_error,
    kinematic_reaction,
    eccentricity,
    torque_ripple,
    load_inertia,
    damping_reference,
    thermal_drift,
)
"""Effects that the library holds under the same name, in another form."""

UNLISTED_FORMS = _by_name(
    output_vibration,
    compliant_sensor,
    load_ripple,
    speed_stiffening,
    encoder_interpolation,
    friction_bursts,
)
"""Effects that the library does not hold."""

HIDDEN_FORMS = LISTED_FORMS | UNLISTED_FORMS


@dataclass(frozen=True)
class HiddenEffect:
    """One hidden effect.

    Attributes
    ----------
    name : str
        A key of `HIDDEN_FORMS`.
    port : str
        "input", "output", "mesh" or "sensor".
    parameters : dict
        Fields of `laws.Side` (input, output), `laws.Mesh` or
        `sensors.OutputEncoder` and their values, SI.
    """

    name: str
    port: str
    parameters: dict[str, float | tuple[float, ...]]


def draw_effect(
    name: str, believed: BelievedDrive, rng: np.random.Generator, size: float = 1.0
) -> HiddenEffect:
    """Draw one effect of `HIDDEN_FORMS`; ``size`` scales its strength, 1 being typical.

    Raises
    ------
    InvalidInput
        For an unknown name or a size that is not above 0.
    """
    one_of("name of a hidden effect", name, HIDDEN_FORMS)
    size = real_number("size", size, above=0.0)
    port, parameters = HIDDEN_FORMS[name](believed, rng, size)
    return HiddenEffect(name, port, parameters)
