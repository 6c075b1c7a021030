"""Quantities of effects and of sheets: their SI units, and how files write them."""

from __future__ import annotations

from pymoo_hdte._io.fields import UNITS


def si_unit(quantity: str) -> str:
    """Return the SI unit of a quantity of `fields.UNITS`, or the quantity if it is a unit; or 1.

    >>> si_unit("torque"), si_unit("N.m.s3/rad3"), si_unit("")
    ('N.m', 'N.m.s3/rad3', '1')
    """
    return next(iter(UNITS.get(quantity, {quantity: 1.0}))) if quantity else "1"


def with_unit(value: float, quantity: str) -> object:
    """Return a value in SI with its unit, as in model files."""
    return {"value": value, "unit": si_unit(quantity)} if quantity else value
