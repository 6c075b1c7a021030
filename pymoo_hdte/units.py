"""Units that input files may use, with factors to SI; inside the package everything is SI."""

import math
import unicodedata
from collections.abc import Collection
from difflib import get_close_matches

ARCSEC = math.pi / 648000.0
"""One arcsecond in radians."""

REVOLUTION_PER_MINUTE = math.pi / 30.0
"""One revolution per minute in radians per second."""

DEGREE = math.pi / 180.0
"""One degree in radians."""

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3},
    "angle": {
        "rad": 1.0,
        "deg": DEGREE,
        "arcmin": 60.0 * ARCSEC,
        "arcsec": ARCSEC,
        "rev": 2.0 * math.pi,
    },
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
    "torque": {"N.m": 1.0, "N.cm": 1e-2, "N.mm": 1e-3, "mN.m": 1e-3},
    "force": {"N": 1.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "temperature": {"K": 1.0, "C": 1.0},
    "ratio": {"1": 1.0},
    "share": {"1": 1.0, "%": 0.01},
    "stiffness": {"N.m/rad": 1.0, "N.m/arcmin": 1.0 / (60.0 * ARCSEC)},
    "inertia": {"kg.m2": 1.0, "kg.cm2": 1e-4},
    "damping": {"N.m.s/rad": 1.0},
    "cubic stiffness": {"N.m/rad3": 1.0},
    "quadratic drag": {"N.m.s2/rad2": 1.0},
}
"""For each quantity the units it may be given in, with the factor to SI; the first is the SI unit.

``"1"`` is dimensionless. Zero is that of SI but for `ORIGINS`.
"""

ORIGINS = {"C": 273.15}
"""Value in SI at zero of a unit, where that is not 0: of degrees Celsius."""

_SPELLINGS = {
    "s": ("sec", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "rad": ("radian", "radians"),
    "deg": ("°", "º", "degree", "degrees", "Grad"),
    "arcmin": ("'", "\u2032", "arc min", "arc-min", "arcminutes"),
    "arcsec": ("\u2033", '"', "''", "arc second", "arcseconds"),
    "rev": ("turn", "turns", "revolution", "revolutions", "U"),
    "deg/s": ("°/s", "º/s", "dps"),
    "rpm": ("1/min", "min-1", "U/min", "rev/min", "upm"),
    "rad/s2": ("rad/s^2", "rad/s²"),
    "m/s2": ("m/s^2", "m/s²"),
    "N.m": ("Nm", "N m", "N*m", "N-m", "Newton meter", "newton metre"),
    "N.cm": ("Ncm", "N cm", "cNm", "cN.m"),
    "N.mm": ("Nmm", "N mm", "N*mm"),
    "mN.m": ("mNm", "mN m", "mN*m"),
    "um": ("\u03bcm", "micron", "microns"),
    "C": ("°C", "ºC", "degC", "celsius"),
    "A": ("ampere", "amperes", "amps"),
    "V": ("volt", "volts"),
    "K": ("kelvin",),
    "N": ("newton", "newtons"),
    "N.m/rad": ("Nm/rad",),
    "N.m/arcmin": ("Nm/arcmin", "Nm/'", "N.m/'"),
    "kg.m2": ("kgm2", "kg.m^2", "kg m2", "kgm²", "kg.m²"),
    "kg.cm2": ("kgcm2", "kg.cm^2", "kg cm2", "kgcm²", "kg.cm²"),
    "counts": ("count", "counts", "cts", "inc", "increments", "ticks"),
    "1": ("-", "none"),
}
"""How people write a unit besides the spelling of `UNITS`; upper and lower case count."""

FOREIGN = {
    "lbf.ft": ("N.m", 1.3558179483314004, ("ft.lbf", "lb.ft", "ft.lb", "lb-ft", "ft-lb", "ftlb")),
    "lbf.in": ("N.m", 0.1129848290276167, ("in.lbf", "lb.in", "in.lb", "lb-in", "in-lb", "inlb")),
    "ozf.in": ("N.m", 0.007061551814226044, ("oz.in", "oz-in", "ozin", "in.oz")),
    "kgf.m": ("N.m", 9.80665, ("kg.m", "kgm", "kgfm")),
    "kgf.cm": ("N.m", 0.0980665, ("kg.cm", "kgcm", "kgfcm")),
    "kN.m": ("N.m", 1e3, ("kNm", "kN m")),
    "uN.m": ("N.m", 1e-6, ("uNm", "\u03bcNm", "\u03bcN.m")),
    "mrad": ("rad", 1e-3, ()),
    "urad": ("rad", 1e-6, ("\u03bcrad",)),
    "mdeg": ("deg", 1e-3, ()),
    "gon": ("deg", 0.9, ()),
    "us": ("s", 1e-6, ("\u03bcs",)),
    "ns": ("s", 1e-9, ()),
    "min": ("s", 60.0, ()),
    "h": ("s", 3600.0, ()),
    "cm": ("m", 1e-2, ()),
    "in": ("mm", 25.4, ("inch",)),
    "rps": ("rpm", 60.0, ("rev/s", "1/s", "U/s")),
    "kN": ("N", 1e3, ()),
    "lbf": ("N", 4.4482216152605, ("lb",)),
    "kgf": ("N", 9.80665, ()),
}
"""Units that a ``scale`` brings in: one of `UNITS`, the factor to it, and other spellings."""


def _plain(unit: str) -> str:
    """Return a spelling in compatible characters, with one kind of mu and of product."""
    text = unicodedata.normalize("NFC", unit.strip().strip("[]() "))
    for written, meant in (("\u00b5", "\u03bc"), ("\u00b7", "."), ("\u22c5", "."), ("\u2219", ".")):
        text = text.replace(written, meant)
    return text


_KNOWN = {
    _plain(written): unit for unit, others in _SPELLINGS.items() for written in (unit, *others)
} | {unit: unit for units in UNITS.values() for unit in units}
_BROUGHT_IN = {
    _plain(written): unit for unit, (_, _, others) in FOREIGN.items() for written in (unit, *others)
}


def usual_spelling(unit: str) -> str:
    """Return the spelling of `UNITS` for a unit as people write it, or the text as it stands.

    Examples
    --------
    >>> [usual_spelling(unit) for unit in ("mNm", "N·m", "°", "µm", "furlong")]
    ['mN.m', 'N.m', 'deg', 'um', 'furlong']
    """
    return _KNOWN.get(_plain(unit), unit)


def suggestion(unit: str, units: Collection[str]) -> str:
    """Return what may be meant by a unit that is not allowed, as the end of a sentence.

    Parameters
    ----------
    unit : str
    units : collection of str
        Units that are allowed.

    Examples
    --------
    >>> suggestion("lbf.ft", ["N.m", "mN.m"])
    '; for lbf.ft write unit = "N.m" and scale = 1.35582'
    >>> suggestion("nm", ["N.m", "mN.m"])
    "; is it 'N.m'?"
    """
    foreign = _BROUGHT_IN.get(_plain(unit)) or _BROUGHT_IN.get(_plain(unit).replace(" ", "."))
    if foreign is not None and FOREIGN[foreign][0] in units:
        known, factor, _ = FOREIGN[foreign]
        return f'; for {unit} write unit = "{known}" and scale = {factor:.6g}'
    folded = {written.casefold(): meant for written, meant in _KNOWN.items() if meant in units}
    similar = get_close_matches(_plain(unit).casefold(), folded, 1)
    return f"; is it {folded[similar[0]]!r}?" if similar else ""


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
