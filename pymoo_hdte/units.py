"""Units that input files may use, with factors to SI; inside the package everything is SI."""

import math

ARCSEC = math.pi / 648000.0
"""One arcsecond in radians."""

REVOLUTION_PER_MINUTE = math.pi / 30.0
"""One revolution per minute in radians per second."""

DEGREE = math.pi / 180.0
"""One degree in radians."""

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3},
    "angle": {"rad": 1.0, "deg": DEGREE, "arcsec": ARCSEC, "rev": 2.0 * math.pi},
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "speed": {
        "rad/s": 1.0,
        "deg/s": DEGREE,
        "r/min": REVOLUTION_PER_MINUTE,
        "rpm": REVOLUTION_PER_MINUTE,
    },
    "angle rate": {"rad/s": 1.0},
    "linear speed": {"m/s": 1.0, "mm/s": 1e-3},
    "acceleration": {"rad/s2": 1.0},
    "linear acceleration": {"m/s2": 1.0},
    "torque": {"N.m": 1.0, "N.mm": 1e-3, "mN.m": 1e-3},
    "force": {"N": 1.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "temperature": {"K": 1.0, "C": 1.0},
    "ratio": {"1": 1.0},
    "stiffness": {"N.m/rad": 1.0},
    "inertia": {"kg.m2": 1.0},
    "damping": {"N.m.s/rad": 1.0},
    "cubic stiffness": {"N.m/rad3": 1.0},
    "quadratic drag": {"N.m.s2/rad2": 1.0},
}
"""For each quantity the units it may be given in, with the factor to SI; the first is the SI unit.

``"1"`` is dimensionless. Zero is that of SI but for `ORIGINS`.
"""

ORIGINS = {"C": 273.15}
"""Value in SI at zero of a unit, where that is not 0: of degrees Celsius."""

_ENDINGS = {
    "_arcsec": UNITS["angle"]["arcsec"],
    "_rpm": UNITS["speed"]["r/min"],
    "_r_min": UNITS["speed"]["r/min"],
    "_um": UNITS["length"]["um"],
}
"""Factors to SI by the ending of the name of a field or column that is not in SI."""


def si_unit(quantity: str) -> str:
    """Return the SI unit of a quantity of `UNITS`: ``si_unit("inertia")`` is ``"kg.m2"``."""
    return next(iter(UNITS[quantity]))


def factor_of_name(name: str) -> float:
    """Return the factor to SI of a field or column whose name ends in its unit.

    ``factor_of_name("angle_noise_arcsec")`` is `ARCSEC`; it is 1 for ``"torque_Nm"``, ``"time_s"``
    and for names without a unit.
    """
    return next((size for ending, size in _ENDINGS.items() if name.endswith(ending)), 1.0)
