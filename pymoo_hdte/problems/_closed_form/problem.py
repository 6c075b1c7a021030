"""Robust problems whose statistics and fronts are known without a sample or a surrogate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.statistics import RobustConstraint, Statistic
from pymoo_hdte.surrogate.box import Box

Array = NDArray[np.float64]

FRONT_POINTS = 1000


class ClosedFormProblem(Problem):
    """A robust problem that evaluates closed forms, to test algorithms and surrogates on.

    ``robust_problem(problem.simulator, **problem.settings)`` is the same problem on a surrogate.

    Parameters
    ----------
    designs : mapping of str to Design
        Design variables with bounds and scatter. X has their order.
    objectives : sequence of Statistic
        Objectives to be minimised.
    constraints : sequence of RobustConstraint
        Constraints to be met.

    Attributes
    ----------
    designs, objectives, constraints
        As given.
    var_names, obj_names : tuple of str
        Names in the order of X, shape (n, n_var), and F, shape (n, n_obj).

    Notes
    -----
    Evaluating a design outside the box, or one that is NaN, raises `ExtrapolationError`. One that
    is outside only because its values were printed with four digits is evaluated on the boundary
    (`Box.settle`).
    """

    def __init__(
        self,
        designs: Mapping[str, Design],
        objectives: Sequence[Statistic],
        constraints: Sequence[RobustConstraint] = (),
    ) -> None:
        self.designs = dict(designs)
        self.objectives, self.constraints = tuple(objectives), tuple(constraints)
        bounds = np.array([(design.lower, design.upper) for design in self.designs.values()])
        self._box = Box(tuple(self.designs), *bounds.T)
        super().__init__(
            n_var=len(bounds),
            n_obj=len(self.objectives),
            n_ieq_constr=len(self.constraints),
            xl=bounds[:, 0].copy(),
            xu=bounds[:, 1].copy(),
        )
        self.var_names = self._box.names
        self.obj_names = tuple(statistic.name for statistic in self.objectives)

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments of `robust_problem` that belong to the simulator."""
        return {
            "designs": dict(self.designs),
            "noise": self.noise(),
            "objectives": list(self.objectives),
            "constraints": list(self.constraints),
            "vectorised": True,
        }

    def noise(self) -> dict[Any, Any]:
        """Return the distributions of what scatters beside the designs, by name."""
        return {}

    def simulator(self, **inputs: Array) -> dict[str, Array]:
        """Return the responses, shape (n,) each, at designs and noise by name, shape (n,) each."""
        raise NotImplementedError

    def closed_form(self, designs: Array) -> tuple[Array, Array]:
        """Return the statistics of the responses.

        Parameters
        ----------
        designs : ndarray, shape (n, n_var)
            In the variables' units.

        Returns
        -------
        F : ndarray, shape (n, n_obj)
            Objectives, in the units of their responses.
        G : ndarray, shape (n, n_ieq_constr)
            Constraints, met where they are not above 0.
        """
        raise NotImplementedError

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        """Fill F and G.

        Raises
        ------
        ExtrapolationError
            If a design is outside the box or NaN.
        """
        out["F"], out["G"] = self.closed_form(self._box.settle(x))

    def _calc_pareto_set(self) -> Array:
        raise NotImplementedError

    def _calc_pareto_front(self) -> Array:
        """Return the true front, row for row that of ``pareto_set()``."""
        return self.closed_form(self.pareto_set())[0]


def unconstrained(n: int) -> Array:
    """Return the G of n designs of a problem without constraints, shape (n, 0)."""
    return np.empty((n, 0))
