"""How large the torques of a campaign are, beside those that the library of effects is sized for.

Physics knows no N.m: a drive whose torques, stiffnesses, inertias and noises are all ten times as
large is the same drive. Typical sizes and largest values of effects must grow with it, or a
friction would end at a cap that was meant for another drive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pymoo_hdte.discrepancy.believed import Believed

RATED_TORQUE = 40.0
"""N.m at the output of the drive that the effects are sized for."""
RATED_STIFFNESS = 2.583e4
"""N.m/rad of its mesh."""


def torque_scale(loads: Sequence[float], believed: Believed) -> float:
    """Return the size of a drive in torque: 1 for rigs near `RATED_TORQUE`, a power of two.

    The larger of what was loaded and what the stiffness lets expect, since the friction of a drive
    that was tested with light loads, or with none, is still that of its size. In steps of two,
    because only the size counts; and multiplying by a power of two does not round.

    Parameters
    ----------
    loads : sequence of float
        Of the running records, N.m.
    believed : Believed
        For the stiffness.
    """
    largest = max(abs(load) for load in loads)
    size = max(largest / RATED_TORQUE, believed.stiffness / RATED_STIFFNESS)
    return 2.0 ** round(math.log2(size))
