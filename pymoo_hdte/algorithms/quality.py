"""What makes a set of solutions a good one: the choice between truncations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.algorithms.hypervolume import most_hypervolume
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.checks import InvalidInput

Truncation = Callable[[NDArray[np.float64], int], NDArray[np.int_]]
"""Takes mutually non-dominated objectives (n, m) and a size, and returns which rows stay."""

Quality = Literal["spread", "hypervolume"] | Truncation

_NAMED: dict[str, Truncation] = {"spread": most_spread, "hypervolume": most_hypervolume}


def truncation_of(quality: Quality) -> Truncation:
    """Return the truncation of a quality's name, or a truncation as it is.

    Raises
    ------
    InvalidInput
        If the name is not known.
    """
    if callable(quality):
        return quality
    if quality not in _NAMED:
        raise InvalidInput("quality", quality, f"{', '.join(_NAMED)} or a callable")
    return _NAMED[quality]
