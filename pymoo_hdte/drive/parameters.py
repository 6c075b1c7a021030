"""The uncertain parameters of a drive: names, units, and which values can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.drive.datasheet import unit_of

PARAMETERS = ("theta_s", "K", "J_in", "B_in", "B_fc")
"""The uncertain parameters xi of Section 2.3, in this order.

Examples
--------
>>> dict(zip(PARAMETERS, PARAMETER_UNITS))["K"]
'N.m/rad'
"""

PARAMETER_UNITS = tuple(unit_of(name) for name in PARAMETERS)
"""Units of `PARAMETERS`, one for each.

Examples
--------
>>> PARAMETER_UNITS[PARAMETERS.index("J_in")]
'kg.m2'
"""

LARGEST_STATIC_ERROR = 0.1
"""Largest theta_s, rad; any larger value must be in another unit."""


def checked(parameters: ArrayLike) -> NDArray[np.float64]:
    """Return the parameters of n designs as an array.

    Parameters
    ----------
    parameters : array_like, shape (n, 5)
        `PARAMETERS` in SI units.

    Returns
    -------
    ndarray, shape (n, 5)

    Raises
    ------
    InvalidInput
        If the shape is wrong, a value is not finite or not above 0, or theta_s is 0.1 or more.
    """
    values = finite_array("parameters", parameters, (None, len(PARAMETERS)))
    for name, column in zip(PARAMETERS, values.T, strict=True):
        if np.any(column <= 0.0):
            raise InvalidInput(name, float(column.min()), "above 0")
    theta_s = values[:, PARAMETERS.index("theta_s")]
    if np.any(theta_s >= LARGEST_STATIC_ERROR):
        limit = f"below {LARGEST_STATIC_ERROR} rad; it is not given in arcsec"
        raise InvalidInput("theta_s", float(theta_s.max()), limit)
    return values
