"""Likely causes of readings that are off by a factor: units, signs, and the ratio of the gear."""

from __future__ import annotations

import math

from pymoo_hdte.units import FOREIGN, UNITS, si_unit

LARGEST_DISTANCE = 0.1
"""Largest relative distance from a factor at which it still is the likely cause."""
_RATIO_DIGITS = 5
"""Digits of the ratio of both angles' travels that hold whatever the zeros of the angles."""


def likely_unit(quantity: str, factor: float, distance: float = LARGEST_DISTANCE) -> str:
    """Return which unit or sign explains readings that are too large, as the end of a sentence.

    Parameters
    ----------
    quantity : {"angle", "torque"}
    factor : float
        What was read, in SI, over what is expected.
    distance : float
        Largest relative distance from a factor that explains it.

    Returns
    -------
    str
        Empty where no factor explains them.

    Examples
    --------
    >>> likely_unit("torque", 1000.0)
    "; 1000 times what is expected: is the column in 'N.mm' or 'mN.m'?"
    >>> likely_unit("angle", -57.1)
    "; -57.1 times what is expected: is the column in 'deg', and scale = -1.0 missing?"
    """
    size = abs(factor)
    if not 0.0 < size < math.inf:
        return ""
    shown = f"; {factor:.4g} times what is expected: "
    minus = "scale = -1.0 missing" if factor < 0.0 else ""
    if abs(size - 1.0) <= distance:
        return f"{shown}is {minus}?" if minus else ""
    also = f", and {minus}" if minus else ""
    known = {unit: 1.0 / in_si for unit, in_si in UNITS[quantity].items()}
    units = [unit for unit, scale in known.items() if abs(size / scale - 1.0) <= distance]
    if units:
        return f"{shown}is the column in {' or '.join(map(repr, units))}{also}?"
    # The column was converted from a unit that it is not in.
    units = [unit for unit, scale in known.items() if abs(size * scale - 1.0) <= distance]
    if units:
        stated = " or ".join(map(repr, units))
        return f"{shown}is the column in {si_unit(quantity)!r} and not in {stated}{also}?"
    for unit, (base, scale, _) in FOREIGN.items():
        if base == si_unit(quantity) and abs(size * scale - 1.0) <= distance:
            return f"{shown}is the column in {unit}, with scale = {scale:.5g} missing{also}?"
        if base == si_unit(quantity) and abs(size / scale - 1.0) <= distance:
            return (
                f"{shown}is the load in {unit}, or scale = {scale:.5g} there once too often{also}?"
            )
    return ""


def likely_ratio(shown: float, ratio: float) -> str:
    """Return what explains that angles turn at another ratio, as the end of a sentence.

    Parameters
    ----------
    shown : float
        Travel of the input over travel of the output.
    ratio : float
        Believed.

    Returns
    -------
    str
        Empty where the angles turn at the believed ratio.

    Examples
    --------
    >>> likely_ratio(100.0, 50.0)
    '; the angles show a ratio of 100: is believed.ratio 100?'
    """
    if not math.isfinite(shown) or abs(shown / ratio - 1.0) < 10.0 ** -(_RATIO_DIGITS - 2):
        return ""
    said = f"; the angles show a ratio of {shown:.{_RATIO_DIGITS}g}"
    # Of units only those that fit closely: ratios are known better than any load.
    for quotient, column in ((shown / ratio, "input_angle"), (ratio / shown, "output_angle")):
        cause = likely_unit("angle", quotient, 1e-2)
        if cause and abs(quotient) > 1.0 - 1e-2:
            return f"{said}: {column} is {cause.removeprefix('; ')}"
    return f"{said}: is believed.ratio {abs(shown):.{_RATIO_DIGITS}g}?" + (
        " And scale = -1.0 is missing for one angle" if shown < 0.0 else ""
    )
