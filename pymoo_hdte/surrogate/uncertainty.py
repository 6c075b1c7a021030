"""Which variables of a surrogate are designed, which are noise, and whether its box holds both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate.box import Box, ExtrapolationError
from pymoo_hdte.surrogate.distributions import TruncatedNormal, UniformBand

UncertainInput = TruncatedNormal | UniformBand


class Uncertainty:
    """The uncertain inputs of a surrogate, checked against its box.

    Parameters
    ----------
    surrogate_box : Box
        All d variables of the surrogate.
    inputs : sequence of TruncatedNormal or UniformBand, length d
        One for each variable, in the surrogate's order.
    design_box : Box
        The m variables that have a `UniformBand`, in the surrogate's order.

    Raises
    ------
    InvalidInput
        If the inputs or names do not match, or if a design in ``design_box`` or a noise variable
        can reach a value outside the surrogate's box.
    """

    def __init__(
        self, surrogate_box: Box, inputs: Sequence[UncertainInput], design_box: Box
    ) -> None:
        self.surrogate_box = surrogate_box
        self.inputs = tuple(inputs)
        self.design_box = design_box
        if len(self.inputs) != len(surrogate_box):
            raise InvalidInput("number of inputs", len(self.inputs), str(len(surrogate_box)))
        for name, entry in zip(surrogate_box.names, self.inputs, strict=True):
            if not isinstance(entry, UncertainInput):
                raise InvalidInput(f"input {name!r}", entry, "a TruncatedNormal or a UniformBand")
        self.design_axes = tuple(
            axis for axis, entry in enumerate(self.inputs) if entry.scales_design
        )
        designed = tuple(surrogate_box.names[axis] for axis in self.design_axes)
        if design_box.names != designed:
            raise InvalidInput("names of the design box", design_box.names, str(designed))
        self._check_support()

    def reachable(self) -> NDArray[np.float64]:
        """Return the smallest and largest value of every variable over all designs, (2, d)."""
        extremes = np.array([entry.support for entry in self.inputs]).T
        bounds = zip(self.design_axes, self.design_box.lower, self.design_box.upper, strict=True)
        for axis, low, high in bounds:
            corners = np.outer((low, high), extremes[:, axis])
            extremes[:, axis] = corners.min(), corners.max()
        return extremes

    def _check_support(self) -> None:
        try:
            self.surrogate_box.check_inside(self.reachable())
        except ExtrapolationError as error:
            raise InvalidInput(
                f"{error.field} over the design box and its scatter",
                error.value,
                f"the surrogate's interval, {error.allowed.partition(' (')[0]}",
            ) from None
