"""Units of what is read off a mechanism: N or N.m, m or rad, as its coordinates tell."""

from __future__ import annotations

from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.units import si_unit

_AT_A_SHAFT = {"force": "torque", "position": "angle", "speed": "speed"}
"""Names of the quantities at a shaft in `pymoo_hdte.units.UNITS`."""
_BASE = ("inertia", "stiffness", "damping")
"""Kinds of values with a unit of `UNITS` at a shaft; a zero has that of a force."""


def unit_of(mechanism: Mechanism, name: str, quantity: str = "force") -> str:
    """Return the unit of a force, position or speed at a coordinate or port.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Name of a coordinate or of a port.
    quantity : str
        ``"force"``, ``"position"`` or ``"speed"``.

    Returns
    -------
    str
        ``"SI"`` where the files tell of a coordinate neither that it is an angle nor that it is a
        length, where a port touches both kinds, and where an input has no known scale.
    """
    return unit_at(mechanism, name, si_unit(_AT_A_SHAFT[quantity]))


def unit_at(mechanism: Mechanism, name: str, unit: str) -> str:
    """Return the unit that a number of an effect has at a coordinate or port.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Name of a coordinate or of a port.
    unit : str
        Unit of the number at a shaft.

    Returns
    -------
    str
        The same at an angle; ``"N/m"`` for ``"N.m/rad"`` at a length; ``"SI"`` as `unit_of`, but
        for pure numbers and temperatures, which are the same everywhere.

    Examples
    --------
    >>> from pymoo_hdte.mechanism import BelievedValue, Mechanism
    >>> unit_at(Mechanism({"x": BelievedValue(2.0)}, angles=[]), "x", "N.m.s/rad")
    'N.s/m'
    """
    turning = _turning(mechanism, name)
    if turning is None:
        return unit if unit in ("1", "K") else "SI"
    return unit if turning else unit_at_length(unit)


def unit_of_number(mechanism: Mechanism, name: str, number: str, unit: str) -> str:
    """Return the unit of a number of an effect by its name: a phase is an angle everywhere.

    A ripple is ``cos(order * position + phase)``: over an angle its order is a pure number, the
    periods in a turn; over a length it is the phase per length, 2 pi over the period.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Name of a coordinate or of a port.
    number : str
        Such as ``"order"`` or ``"amplitude"``.
    unit : str
        Unit of the number at a shaft.

    Returns
    -------
    str
        As `unit_at` of a number that is neither a phase nor an order.

    Examples
    --------
    >>> from pymoo_hdte.mechanism import BelievedValue, Mechanism
    >>> unit_of_number(Mechanism({"x": BelievedValue(2.0)}, angles=[]), "x", "order", "1")
    'rad/m'
    """
    if number.endswith("phase"):
        return "rad"
    if number == "order":
        return {"rad": unit, "m": "rad/m"}.get(unit_of(mechanism, name, "position"), "SI")
    return unit_at(mechanism, name, unit)


def base_unit(mechanism: Mechanism, quantity: str) -> str:
    """Return the unit of a fitted value of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    quantity : str
        One of `Mechanism.quantities`, or ``"zero of bearing"``: a force that is added at a port.

    Returns
    -------
    str
        ``"SI"`` as `unit_of`, and for a gain: the unit of its signal is not known here.

    Examples
    --------
    >>> from pymoo_hdte.mechanism import BelievedValue, Mechanism
    >>> base_unit(Mechanism({"x": BelievedValue(2.0)}, angles=[]), "inertia of x")
    'kg'
    """
    kind, _, name = quantity.partition(" of ")
    if kind == "zero":
        return unit_of(mechanism, name)
    return unit_at(mechanism, name, si_unit(kind)) if kind in _BASE else "SI"


def unit_at_length(unit: str) -> str:
    """Return the unit at a length of what has a unit at a shaft: ``"N"`` for ``"N.m"``."""
    return unit.replace("kg.m2", "kg").replace("N.m", "N").replace("rad", "m")


def _turning(mechanism: Mechanism, name: str) -> bool | None:
    """Tell whether a coordinate or port turns; None where its forces or motion have no unit."""
    angles, lengths = mechanism.angles or (), mechanism.lengths or ()
    if any(not actuation.scaled for actuation in mechanism.inputs):
        return None
    moved = [name]
    if name in mechanism.port_names:
        port = mechanism.port(name)
        moved = [coordinate for coordinate, share in port.motion.items() if share] + [
            *port.followed
        ]
    if all(coordinate in angles for coordinate in moved):
        return True
    return False if all(coordinate in lengths for coordinate in moved) else None
