"""Units of what is read off a mechanism: N or N.m, m or rad, as its coordinates tell."""

from __future__ import annotations

from pymoo_hdte.mechanism import Mechanism

_TURNING = {"force": "N.m", "position": "rad", "speed": "rad/s"}
_SLIDING = {"force": "N", "position": "m", "speed": "m/s"}


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
    if mechanism.angles is None or any(not one.scaled for one in mechanism.inputs):
        return "SI"
    moved = [name]
    if name in mechanism.port_names:
        port = mechanism.port(name)
        moved = [one for one, share in port.motion.items() if share] + [*port.followed]
    turning = [one in mechanism.angles for one in moved]
    if all(turning):
        return _TURNING[quantity]
    return "SI" if any(turning) else _SLIDING[quantity]
