"""Effects by name: which law each is, and which numbers describe it, in SI.

Those of `port_effects.LAWS`, at any port of a mechanism, and

================================  =====================  ===========================================
name                              law                    numbers
================================  =====================  ===========================================
``force_offset``                  `ConstantForce`        ``force``
``direction_dependent_friction``  `DirectionalFriction`  ``level``, ``viscous``
``linear_stiffness``              `LinearSpring`         ``coefficient``
``viscous_friction``              `LinearDamper`         ``coefficient``
``kinematic_error``               `PeriodicTorque`       ``order``, ``phase``, ``amplitude``; it is
                                                         in the reading of a force sensor
================================  =====================  ===========================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.drive.port_effects import LAWS
from pymoo_hdte.laws.friction import PeriodicTorque
from pymoo_hdte.laws.law import Law
from pymoo_hdte.laws.linear import ConstantForce, DirectionalFriction, LinearDamper, LinearSpring
from pymoo_hdte.mechanism.mechanism import LawAt

EFFECTS: dict[str, tuple[type, tuple[str, ...]]] = {
    **{name: (kind, tuple(quantities)) for name, (kind, _, quantities) in LAWS.items()},
    "force_offset": (ConstantForce, ("force",)),
    "direction_dependent_friction": (DirectionalFriction, ("level", "viscous")),
    "linear_stiffness": (LinearSpring, ("coefficient",)),
    "viscous_friction": (LinearDamper, ("coefficient",)),
    "kinematic_error": (PeriodicTorque, ("order", "phase", "amplitude")),
}
"""For each name its law and the fields of it that are numbers."""

OF_READINGS = ("kinematic_error",)
"""Effects that nothing but the reading of a force sensor shows."""


def law_from_values(name: str, values: Mapping[str, float]) -> Law:
    """Return the law of an effect.

    Parameters
    ----------
    name : str
        Of `EFFECTS`.
    values : mapping of str to float
        Its numbers in SI; those for which the law has a default may be absent.

    Raises
    ------
    InvalidInput
        With the field ``name.number``: for an unknown name or number, or a number that is missing
        or that the law does not take.
    """
    kind, names = EFFECTS[one_of("effect.name", name, EFFECTS)]
    for one in values:
        one_of(f"number of {name}", one, names)
    for field in fields(kind):
        if field.name in names and field.name not in values and field.default is MISSING:
            raise InvalidInput(f"{name}.{field.name}", None, "a finite number (it is missing)")
    numbers = {one: real_number(f"{name}.{one}", value) for one, value in values.items()}
    try:
        return kind(**numbers)
    except InvalidInput as error:
        # Laws name themselves by the effect they are in a drive, or not at all.
        number = error.field.rpartition(".")[2]
        raise InvalidInput(f"{name}.{number}", error.value, error.allowed) from None


def values_of(effect: LawAt) -> dict[str, float]:
    """Return the numbers of an effect in SI, of which `law_from_values` makes an equal law.

    Raises
    ------
    InvalidInput
        If the name is none of `EFFECTS`, or the law is not the one of that name.
    """
    kind, names = EFFECTS[one_of("effect.name", effect.name, EFFECTS)]
    if not isinstance(effect.law, kind):
        raise InvalidInput(f"{effect.name}.law", effect.law, f"a {kind.__name__}")
    return {one: float(getattr(effect.law, one)) for one in names}
