"""Inputs as functions of independent standard normal variables."""

from __future__ import annotations

import numpy as np

# Its special functions load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.problems._simulator.inputs import Inputs

Array = NDArray[np.float64]

REACH = 7.5
"""Largest absolute value of a variable; 1e-9 has a deviation of 6."""
TAIL_OF_REACH = 3e-14
"""The probability beyond it."""
_GRID = np.linspace(-REACH, REACH, 6001)


class NormalSpace:
    """Standard normal variables that make the scatter of all inputs, one for each that scatters.

    Parameters
    ----------
    inputs : Inputs

    Attributes
    ----------
    d : int
        Number of variables.
    """

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self._moving = [j for j, axis in enumerate(inputs.axes) if axis.scatter is not None]
        self.d = len(self._moving)
        shares = scipy.special.ndtr(_GRID)
        self._scatter = [inputs.axes[j].sample(shares) for j in self._moving]

    def scatter(self, points: Array) -> Array:
        """Return the values of s on every axis at points of shape (n, d), shape (n, axes)."""
        values = np.zeros((len(points), len(self.inputs.axes)))
        for j, column, table in zip(self._moving, points.T, self._scatter, strict=True):
            values[:, j] = np.interp(column, _GRID, table)
        return values

    def cube(self, points: Array, design: Array | None = None) -> Array:
        """Return the coordinates of the surrogate in -1..1, shape (n, axes).

        Parameters
        ----------
        points : ndarray, shape (n, d)
            Standard normal variables.
        design : ndarray, shape (m,), optional
            Around which designed variables scatter, in their units.
        """
        z = self.scatter(points)
        place = 0
        for j, axis in enumerate(self.inputs.axes):
            own = None
            if axis.designed and design is not None:
                own = design[place : place + 1]
                place += 1
            offset, factor, _, _ = axis.around(own)
            z[:, j] = offset + factor * z[:, j]
        return np.clip(z, -1.0, 1.0)

    def values(self, points: Array, design: Array | None = None) -> Array:
        """Return the inputs in their units, shape (n, axes); parameters as in `cube`."""
        return self.inputs.values(self.cube(points, design))
