"""Inputs as functions of independent standard normal variables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.problems._simulator.tails import NormalScatter

Array = NDArray[np.float64]


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
        self.scatter = NormalScatter(inputs.axes)
        self.d = self.scatter.d

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
