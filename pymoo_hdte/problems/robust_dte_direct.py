"""The robust DTE problem on the drive model itself, without a surrogate, as a pymoo `Problem`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems.drive_response import (
    DESIGN_VARIABLES,
    OBJECTIVES,
    PAPERS_ORDER,
    UNITS,
    DriveResponse,
)
from pymoo_hdte.problems.model_moments import FIRST_NODES, ModelMoments
from pymoo_hdte.problems.operating_conditions import OperatingCondition
from pymoo_hdte.problems.reference import StoredFront
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand


class RobustDTEDirect(StoredFront, Problem):
    """Minimise mean and standard deviation of the DTE as the drive model has them.

    As `RobustDTE`, with the moments by quadrature of the model in place of a surrogate. The stored
    front is therefore the model's. A design costs ``prod(nodes)`` steady states: some 20 ms, or
    0.2 s for a model with laws at ports.

    Parameters
    ----------
    model : str or DriveModel
        A preset (``"calibrated"``, ``"resonant"``, ``"published"``) or a model of your own.
    tolerance, box : float
        As for `RobustDTE`.
    conditions : sequence of OperatingCondition, optional
        As for `RobustDTE`.
    nodes : sequence of int
        Numbers of nodes of the Gauss rules of theta_s, K, J_in, B_in and B_fc.

    Attributes
    ----------
    model, conditions, inputs, nominal, var_names, obj_names, units
        As those of `RobustDTE`.
    moments : ModelMoments
        The same moments, NaN where a design has no steady state.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, naming it, its value and what is; also for a model
        whose theta_s could become negative.
    ArithmeticError
        On evaluating a design around which the drive has no steady state; names where.

    Notes
    -----
    ``pareto_front()`` and ``pareto_set()`` are stored for ``calibrated`` under the defaults, found
    by ``python -m experiments direct_front``; with any other setting both return None.

    Examples
    --------
    >>> problem = RobustDTEDirect(nodes=(2, 2, 2, 1, 1))
    >>> problem.evaluate(problem.nominal[np.newaxis]).shape
    (1, 2)
    """

    def __init__(
        self,
        model: str | DriveModel = "calibrated",
        tolerance: float = 0.05,
        box: float = 0.25,
        conditions: Sequence[OperatingCondition] | None = None,
        nodes: Sequence[int] = FIRST_NODES,
    ) -> None:
        response = DriveResponse(model, PAPERS_ORDER, box, conditions)
        tolerance = real_number("tolerance", tolerance, above=0.0, below=1.0)
        self.model, self.conditions = response.model, response.conditions
        self.nominal = response.nominal
        bands = [UniformBand(tolerance) for _ in DESIGN_VARIABLES]
        self.inputs: tuple[TruncatedNormal | UniformBand, ...] = (response.theta_s, *bands)
        self.moments = ModelMoments(self.model, self.conditions, self.inputs, nodes)
        settings = {key: value for key, value in response.settings.items() if key != "order"}
        settings |= {"tolerance": tolerance, "nodes": list(self.moments.nodes)}
        StoredFront.__init__(self, f"{response.variant}_direct", settings)
        space = response.design_box
        self.var_names, self.obj_names, self.units = space.names, OBJECTIVES, UNITS
        Problem.__init__(
            self, n_var=len(space), n_obj=2, xl=space.lower.copy(), xu=space.upper.copy()
        )

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        objectives = self.moments(x)
        gone = np.flatnonzero(np.isnan(objectives).any(axis=1))
        if gone.size:
            # A NaN objective would pass for a non-dominated one.
            raise ArithmeticError(self.without_steady_state(x[gone[0]]))
        out["F"] = objectives

    def without_steady_state(self, design: NDArray[np.float64]) -> str:
        """Say around which design, and where, there is no steady state.

        Parameters
        ----------
        design : ndarray, shape (4,)
            SI; one whose moments are NaN.

        Returns
        -------
        str
        """
        node = self.moments.lost(design)
        around = ", ".join(self._values(dict(zip(self.var_names, design, strict=True))))
        text = f"no steady state around the design {around}"
        if node is None:
            return text
        where = ", ".join(self._values({name: node[name] for name in self.var_names}))
        return f"{text}: none at {where}"

    def _values(self, entries: dict[str, float]) -> list[str]:
        return [f"{name} = {value:.4g} {self.units[name]}" for name, value in entries.items()]
