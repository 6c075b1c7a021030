"""What the verdict asks of the data, whatever the machine and the tests that they come from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.excess import Excess
from pymoo_hdte.discrepancy.parameters import Parameter

if TYPE_CHECKING:
    from pymoo_hdte.discrepancy.fit import Fit

Vector = NDArray[np.float64]
Response = Callable[[Sequence[Any]], Vector]
"""From effects that are added to a fit to what its whitened residuals change by, shape (n,)."""


class Residuals(Protocol):
    """Whitened residuals of a model with candidates, and their derivatives."""

    candidates: tuple[Candidate, ...]
    parameters: tuple[Parameter, ...]
    scale: Vector
    start: Vector
    lower: Vector
    upper: Vector

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        ...

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives (n_residuals, n_parameters) in units of the parameters' scale."""
        ...

    def slopes_at(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives by base parameters, for other fits to start from."""
        ...


class Evidence(Protocol):
    """Measurements that a model of few unknowns and effects can be held against.

    Attributes
    ----------
    base : tuple of Parameter
        Unknowns of the model without effects.
    remainder : float
        Share of the base's excess that is no effect's, because no model of such data is exact.
    """

    @property
    def base(self) -> tuple[Parameter, ...]:
        """Unknowns of the model without effects."""
        ...

    @property
    def remainder(self) -> float:
        """Share of the base's excess up to which what is left is nobody's effect."""
        ...

    def objective(
        self, candidates: Sequence[Candidate], slopes: NDArray[np.float64] | None
    ) -> Residuals:
        """Return the residuals of a model with candidates; see `objective.Objective`."""
        ...

    def response(self, fitted: Fit) -> Response:
        """Return how the residuals of a fit respond to further effects."""
        ...

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return where the residuals of each part of the data stand."""
        ...

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part."""
        ...

    def out_of_tolerance(self, at_bounds: Sequence[str]) -> list[Candidate]:
        """Return a candidate for each base parameter that a fit left at a bound."""
        ...
