"""A surrogate that may not be trusted is refused: the reason, and where it is so."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput

Array = NDArray[np.float64]

TELLING_SHARE = 0.7
"""A variable is named in a region that covers less than this share of its range."""


class UntrustedSurrogate(InvalidInput):
    """A surrogate is not what was asked for; the message tells the reason and the region.

    Attributes
    ----------
    field, allowed : str
        What is wrong, and what was asked for.
    value : float
        Size of what is wrong: an error as a share of the scatter, a mean in the response's unit.
    region : dict of str to tuple of float
        Interval of those variables, in their units, in which that is so; empty if all over the box.
    problem : SimulatorProblem or None
        The problem on the surrogate that is refused, which `robust_problem` returns where
        ``accept="best"`` is asked for: its band is as wide as its errors are.
    runs : Runs or None
        All runs that were made, for ``data`` of another study.

    Examples
    --------
    >>> def rough(x):
    ...     return np.sin(1e4 * x)
    ...
    >>> try:
    ...     design = {"x": Design(1.0, 2.0, tolerance=0.1)}
    ...     _ = robust_problem(rough, design, budget=60, progress=False)
    ... except UntrustedSurrogate as error:
    ...     print(error.field.startswith("error of the"))
    ...
    True
    """

    def __init__(
        self, field: str, value: float, allowed: str, region: Mapping[str, tuple[float, float]]
    ) -> None:
        ends = [f"{name} is {low:.4g} to {high:.4g}" for name, (low, high) in region.items()]
        where = f"so where {' and '.join(ends)}" if ends else "so all over the box"
        super().__init__(field, value, f"{allowed}; {where}")
        self.region = dict(region)
        self.problem: Any = None
        self.runs: Any = None
        self._arguments = (field, value, allowed, self.region)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self._arguments, {"problem": self.problem, "runs": self.runs}


def region_of(
    names: tuple[str, ...], points: Array, everywhere: Array
) -> dict[str, tuple[float, float]]:
    """Return the intervals that hold the points, of those variables of which they tell something.

    Parameters
    ----------
    names : tuple of str, length d
    points : ndarray, shape (k, d)
        Where something is wrong, in units.
    everywhere : ndarray, shape (2, d)
        Smallest and largest values there are.

    Returns
    -------
    dict of str to tuple of float
        Empty if they lie all over the box.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    share = (high - low) / np.maximum(everywhere[1] - everywhere[0], np.finfo(float).tiny)
    telling = share < TELLING_SHARE
    return {name: (float(low[j]), float(high[j])) for j, name in enumerate(names) if telling[j]}
