"""Units of what is read off a mechanism: N or N.m, m or rad, as its coordinates tell."""

from __future__ import annotations

from pymoo_hdte.discrepancy.mechanism.proof import MeasuredGap
from pymoo_hdte.mechanism import Mechanism
from pymoo_hdte.units import si_unit

_TURNING = {"force": "torque", "position": "angle", "speed": "speed"}
_SLIDING = {"force": "force", "position": "length", "speed": "linear speed"}
"""Names of these quantities in `pymoo_hdte.units.UNITS`."""


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
        return si_unit(_TURNING[quantity])
    return "SI" if any(turning) else si_unit(_SLIDING[quantity])


def unit_of_gap(mechanism: Mechanism, gap: MeasuredGap) -> str:
    """Return the unit of a gap: of the position of a coordinate, or of a force."""
    return unit_of(mechanism, gap.quantity, "position" if gap.kind == "simulation" else "force")
