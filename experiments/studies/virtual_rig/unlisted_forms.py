"""Hidden effects that the library does not have: an analysis must report a missing effect.

Sizes and return values are as in `listed_forms`.
"""

from __future__ import annotations

import math

import numpy as np

from experiments.studies.virtual_rig.listed_forms import (
    RATED_SPEED,
    ROUNDING_SPEED,
    Drawn,
    uniform_phase,
)
from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.units import ARCSEC


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
