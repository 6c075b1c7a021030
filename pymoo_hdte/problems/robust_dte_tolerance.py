"""The robust DTE problem with the tolerance as a design variable that costs money."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import finite_array, real_number
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems.drive_response import (
    DESIGN_VARIABLES,
    OBJECTIVES,
    PAPERS_ORDER,
    UNITS,
    DriveResponse,
)
from pymoo_hdte.problems.operating_conditions import OperatingCondition
from pymoo_hdte.problems.reference import StoredFront
from pymoo_hdte.problems.robust import RobustProblem
from pymoo_hdte.surrogate import (
    Box,
    ExactMoments,
    TruncatedNormal,
    UniformBand,
    VariableBandMoments,
)

PAPERS_TOLERANCE = 0.05
"""Relative half-width of the bands of Section 5.1; there the cost is 1."""


class RobustDTETolerance(StoredFront, RobustProblem):
    """Minimise mean and standard deviation of the DTE, and the cost of the tolerance.

    X = (K, J_in, B_in, B_fc, tolerance): the four design variables of `RobustDTE`, and one relative
    tolerance that holds for all of them. The cost follows the reciprocal model A + B / t of Chase
    and Greenwood [1]_ without its fixed part, relative to the paper's tolerance: 0.05 / t. That one
    model holds for all four parameters is our simplification.

    Parameters
    ----------
    model, order, box, conditions
        As in `RobustDTE`.
    tolerances : tuple of float, length 2
        Smallest and largest tolerance, relative, above 0 and below 1. At 8 % and the default box
        the scatter just fills the surrogate's +-35 %, so at each tolerance the problem is
        `RobustDTE` of that tolerance.

    Attributes
    ----------
    model, conditions, surrogate, nominal, var_names, obj_names, units
        As in `RobustDTE`; the tolerance and its cost are pure numbers.
    moments : VariableBandMoments
        Moments of the surrogate, over designs and tolerances.

    Raises
    ------
    InvalidInput, UnstableDrive
        As `RobustDTE`.

    References
    ----------
    .. [1] K. W. Chase and W. H. Greenwood, "Design issues in mechanical tolerance analysis",
       Manufacturing Review 1(1), 1988; named so and compared with other models by K. W. Chase and
       A. R. Parkinson, Research in Engineering Design 3, 1991, 23-37.

    Examples
    --------
    >>> problem = RobustDTETolerance()
    >>> problem.obj_names
    ('mean_dte_arcsec', 'std_dte_arcsec', 'tolerance_cost')
    """

    def __init__(
        self,
        model: str | DriveModel = "calibrated",
        order: int = PAPERS_ORDER,
        tolerances: tuple[float, float] = (0.01, 0.08),
        box: float = 0.25,
        conditions: Sequence[OperatingCondition] | None = None,
    ) -> None:
        response = DriveResponse(model, order, box, conditions)
        least, widest = finite_array("tolerances", tolerances, (2,)).tolist()
        real_number("tolerances[1]", widest, above=0.0, below=1.0)
        real_number("tolerances[0]", least, above=0.0, below=widest)
        self.model, self.conditions = response.model, response.conditions
        self.nominal = response.nominal
        settings = {**response.settings, "tolerances": [least, widest]}
        StoredFront.__init__(self, f"{response.variant}_tolerance", settings)

        self._response = response
        self.surrogate = response.surrogate(widest)
        designs = response.design_box
        names = (*DESIGN_VARIABLES, "tolerance")
        space = Box(names, np.append(designs.lower, least), np.append(designs.upper, widest))
        moments = VariableBandMoments(self.surrogate, {"theta_s": response.theta_s}, space)
        units = UNITS | {"tolerance": "1", "tolerance_cost": "1"}
        RobustProblem.__init__(self, moments, (*OBJECTIVES, "tolerance_cost"), units)

    def at_tolerance(self, tolerance: float) -> RobustProblem:
        """Return the problem of the four design variables and two moments at one tolerance.

        Parameters
        ----------
        tolerance : float
            Relative half-width of the bands, in the range of the problem's.

        Returns
        -------
        RobustProblem

        Raises
        ------
        InvalidInput
            If the tolerance is not in the range of the problem's.
        """
        least, widest = self.xl[-1], self.xu[-1]
        band = UniformBand(real_number("tolerance", tolerance, at_least=least, at_most=widest))
        bands = [band for _ in DESIGN_VARIABLES]
        inputs: list[TruncatedNormal | UniformBand] = [self._response.theta_s, *bands]
        moments = ExactMoments(self.surrogate, inputs, self._response.design_box)
        return RobustProblem(moments, OBJECTIVES, UNITS)

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        x = self.moments.design_box.settle(x)
        super()._evaluate(x, out, *args, **kwargs)
        tolerance = x[:, -1]
        out["F"] = np.column_stack([out["F"], PAPERS_TOLERANCE / tolerance])
        if "dF" in out:
            slope = np.zeros((len(x), 1, self.n_var))
            slope[:, 0, -1] = -PAPERS_TOLERANCE / tolerance**2
            out["dF"] = np.concatenate([out["dF"], slope], axis=1)
