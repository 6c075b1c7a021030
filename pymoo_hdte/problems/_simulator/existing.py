"""The robust counterpart of an existing pymoo problem, constraints included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.problems._simulator.robust_problem import robust_problem
from pymoo_hdte.problems._simulator.statistics import Mean, MeanPlusStd, RobustConstraint, Statistic

Array = NDArray[np.float64]


class _Responses:
    """Objectives F1, F2, .. and constraints G1, G2, .. of a problem as a simulator."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.objectives = tuple(f"F{k + 1}" for k in range(problem.n_obj))
        self.constraints = tuple(f"G{k + 1}" for k in range(problem.n_ieq_constr))

    def __call__(self, **variables: Array) -> dict[str, Array]:
        X = np.column_stack(list(variables.values()))
        outputs = self.problem.evaluate(X, return_as_dictionary=True)
        columns = dict(zip(self.objectives, np.atleast_2d(outputs["F"]).T, strict=True))
        if self.constraints:
            columns |= dict(zip(self.constraints, np.atleast_2d(outputs["G"]).T, strict=True))
        return columns


def Robust(
    problem: Problem,
    scatter: Mapping[str, Any] | Sequence[Any] | float,
    objectives: Sequence[Statistic] | None = None,
    constraints: Sequence[RobustConstraint] | None = None,
    k: float = 3.0,
    **options: Any,
) -> SimulatorProblem:
    """Return the robust counterpart of a pymoo problem whose variables scatter.

    Its objectives become their means and its constraints have to hold by k standard deviations,
    as in Du and Chen, Journal of Mechanical Design 122, 2000, unless other statistics are given.

    Parameters
    ----------
    problem : pymoo.core.problem.Problem
        It has real variables, finite bounds and no equality constraints. Objectives are called
        ``F1``, ``F2``, .., constraints ``G1``, .., variables ``x1``, ..
    scatter : float, sequence or mapping
        Absolute deviation of each variable in its unit: a number d stands for uniform in -d..d, a
        distribution is that of the deviation. One for all, one for each, or by name where the
        others do not scatter. Scattered variables leave the bounds of the problem by it.
    objectives, constraints : sequence, optional
        Statistics of the responses ``F1``, .., ``G1``, .., in the place of those above.
    k : float
        Standard deviations by which constraints have to hold, dimensionless.
    options : dict
        Other arguments of `robust_problem`: accuracy, budget, noise, seed and the others, all but
        ``vectorised``: problems of pymoo are.

    Returns
    -------
    SimulatorProblem

    Raises
    ------
    InvalidInput
        If the problem is none of these, the scatter does not fit, or as `robust_problem`.
    UntrustedSurrogate, SimulatorFailed
        As `robust_problem`.

    Examples
    --------
    >>> from pymoo.problems import get_problem
    >>> problem = Robust(get_problem("bnh"), scatter=0.02)  # doctest: +SKIP
    >>> problem.n_obj, problem.n_ieq_constr  # doctest: +SKIP
    """
    if not isinstance(problem, Problem):
        raise InvalidInput("problem", problem, "a Problem of pymoo")
    if problem.vtype not in (None, float):
        raise InvalidInput("variables of the problem", problem.vtype, "real ones")
    if not options.pop("vectorised", True):
        raise InvalidInput("vectorised", False, "True: problems of pymoo are")
    if problem.n_eq_constr:
        raise InvalidInput("equality constraints", problem.n_eq_constr, "0: scatter breaks them")
    names = tuple(f"x{j + 1}" for j in range(problem.n_var))
    lower, upper = problem.bounds()
    if lower is None or upper is None:
        raise InvalidInput("bounds of the problem", (lower, upper), "finite")
    deviations = _deviations(scatter, names)
    designs = {
        name: Design(float(low), float(high), deviation=deviations[name])
        for name, low, high in zip(names, lower, upper, strict=True)
    }
    responses = _Responses(problem)
    if objectives is None:
        objectives = [Mean(response=name) for name in responses.objectives]
    if constraints is None:
        constraints = [MeanPlusStd(k, response=name) <= 0.0 for name in responses.constraints]
    vectorised = {"vectorised": True, "objectives": objectives, "constraints": constraints}
    return robust_problem(responses, designs, **(options | vectorised))


def _deviations(scatter: Any, names: tuple[str, ...]) -> dict[str, Any]:
    if isinstance(scatter, Mapping):
        for name in scatter:
            if name not in names:
                raise InvalidInput("scatter", name, f"one of {names}")
        return dict.fromkeys(names, 0.0) | dict(scatter)
    if isinstance(scatter, Sequence | np.ndarray):
        if len(scatter) != len(names):
            raise InvalidInput("length of scatter", len(scatter), str(len(names)))
        return dict(zip(names, scatter, strict=True))
    return dict.fromkeys(names, scatter)
