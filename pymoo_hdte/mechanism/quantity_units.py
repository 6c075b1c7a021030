"""Units of what is read off a mechanism: N or N.m, m or rad, as its coordinates tell."""

from __future__ import annotations

from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.units import si_unit

_TURNING = {"force": "torque", "position": "angle", "speed": "speed"}
_SLIDING = {"force": "force", "position": "length", "speed": "linear speed"}
"""Names of these quantities in `pymoo_hdte.units.UNITS`."""
_BASE = ("inertia", "stiffness", "damping")
"""Kinds of believed values that have such units; a gain has one of its signal."""


def unit_of(mechanism: Mechanism, name: str, quantity: str = "force") -> str:
    """Return the unit of a force, position or speed at a coordinate or port.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Of a coordinate, or of a port.
    quantity : str
        ``"force"``, ``"position"`` or ``"speed"``.

    Returns
    -------
    str
        ``"SI"`` where the files do not tell which coordinates are angles, or a port touches some
        that are and some that are not.
    """
    turning = _turning(mechanism, name)
    if turning is None:
        return "SI"
    return si_unit((_TURNING if turning else _SLIDING)[quantity])


def unit_at(mechanism: Mechanism, name: str, unit: str) -> str:
    """Return the unit that a number of an effect has at a coordinate or port.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Of a coordinate, or of a port.
    unit : str
        What it is at a shaft: ``"N.m/rad"`` is ``"N/m"`` where the motion is a length.
    """
    turning = _turning(mechanism, name)
    if turning is None:
        return unit if unit in ("1", "K") else "SI"
    return unit if turning else _of_a_length(unit)


def unit_of_number(mechanism: Mechanism, name: str, number: str, unit: str) -> str:
    """Return the unit of a number of an effect by its name: a phase is an angle everywhere.

    A ripple is ``cos(order * position + phase)``: over an angle its order is a pure number, the
    periods in a turn; over a length it is the phase per length, 2 pi over the period.
    """
    if number.endswith("phase"):
        return "rad"
    if number == "order" and unit_of(mechanism, name, "position") != "rad":
        return "rad/m" if unit_of(mechanism, name, "position") == "m" else "SI"
    return unit_at(mechanism, name, unit)


def base_unit(mechanism: Mechanism, quantity: str) -> str:
    """Return the unit of a believed value, such as ``"damping of bearing"``."""
    kind, _, name = quantity.partition(" of ")
    return unit_at(mechanism, name, si_unit(kind)) if kind in _BASE else "SI"


def _of_a_length(unit: str) -> str:
    return unit.replace("kg.m2", "kg").replace("N.m", "N").replace("rad", "m")


def _turning(mechanism: Mechanism, name: str) -> bool | None:
    """Tell whether a coordinate or port turns; None where its forces or motion have no unit."""
    angles, lengths = mechanism.angles or (), mechanism.lengths or ()
    if any(not one.scaled for one in mechanism.inputs):
        return None
    moved = [name]
    if name in mechanism.port_names:
        port = mechanism.port(name)
        moved = [one for one, share in port.motion.items() if share] + [*port.followed]
    if all(one in angles for one in moved):
        return True
    return False if all(one in lengths for one in moved) else None
