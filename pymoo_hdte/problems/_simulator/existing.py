"""The robust counterpart of an existing pymoo problem, constraints included."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.problems._simulator.around import PARTS
from pymoo_hdte.problems._simulator.direct import (
    DirectProblem,
    is_mixed,
    names_of,
    real_names,
    responses_of,
)
from pymoo_hdte.problems._simulator.inputs import MOST_INPUTS, Design
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.problems._simulator.robust_problem import robust_problem
from pymoo_hdte.problems._simulator.runs import SimulatorFailed
from pymoo_hdte.problems._simulator.statistics import Mean, MeanPlusStd, RobustConstraint, Statistic
from pymoo_hdte.surrogate.trust import UntrustedSurrogate

Array = NDArray[np.float64]

BUDGET = 300
"""Runs within which a surrogate is tried: a few designs of direct sampling cost as many."""
_LOOKED_AT = 256
"""Designs whose scatter is looked at, whether the problem is finite there."""


class _Responses:
    """Objectives F1, F2, .. and constraints G1, G2, .. of a problem as a simulator."""

    def __init__(self, problem: Problem, clip: bool) -> None:
        self.problem, self.clip = problem, clip
        self.names = responses_of(problem)

    def __call__(self, **variables: Array) -> dict[str, Array]:
        X = np.column_stack(list(variables.values()))
        if self.clip:
            X = np.clip(X, *self.problem.bounds())
        outputs = self.problem.evaluate(X, return_as_dictionary=True)
        columns = list(np.atleast_2d(outputs["F"]).T)
        if self.problem.n_ieq_constr:
            columns += list(np.atleast_2d(outputs["G"]).T)
        return dict(zip(self.names, columns, strict=True))


def Robust(
    problem: Problem,
    scatter: Mapping[str, Any] | Sequence[Any] | float,
    objectives: Sequence[Statistic] | None = None,
    constraints: Sequence[RobustConstraint] | None = None,
    k: float = 3.0,
    method: str = "auto",
    draws: int = 128,
    clip: bool | None = None,
    **options: Any,
) -> SimulatorProblem | DirectProblem:
    """Return the robust counterpart of a pymoo problem whose variables scatter.

    Its objectives become their means and its constraints have to hold by k standard deviations,
    as in Du and Chen, Journal of Mechanical Design 122, 2000, unless other statistics are given.
    A surrogate is tried first; where none serves, the problem itself is run at common draws of the
    scatter around every design.

    Parameters
    ----------
    problem : pymoo.core.problem.Problem
        With real variables and finite bounds, and without equality constraints. Of mixed variables
        (``vars``) the real ones scatter. Objectives are called ``F1``, ``F2``, .., constraints
        ``G1``, .., variables ``x1``, .. or as in ``vars``.
    scatter : float, sequence or mapping
        Absolute deviation of each variable in its unit: a number d stands for uniform in -d..d, a
        distribution is that of the deviation. One for all, one for each, or by name where the
        others do not scatter.
    objectives, constraints : sequence, optional
        Statistics of the responses ``F1``, .., ``G1``, .., in the place of those above.
    k : float
        Standard deviations by which constraints have to hold, dimensionless.
    method : {"auto", "surrogate", "direct"}
        Whether there has to be a surrogate, or must not be. With ``"auto"`` there is one where it
        is accurate enough after 300 runs, for up to 20 variables, none of them mixed.
    draws : int
        Runs of the problem for every design without a surrogate; a multiple of 4. The bar's line on
        the error stream tells them.
    clip : bool, optional
        Whether scattered variables are kept within the bounds of the problem. By default only where
        the problem is not finite beyond them.
    options : dict
        Other arguments of `robust_problem`: accuracy, budget, seed and the others, all but
        ``vectorised``: problems of pymoo are.

    Returns
    -------
    SimulatorProblem or DirectProblem

    Raises
    ------
    InvalidInput
        If the problem is none of these, the scatter does not fit, or as `robust_problem`.
    UntrustedSurrogate, SimulatorFailed
        As `robust_problem`, with ``method="surrogate"``.

    Warns
    -----
    RuntimeWarning
        If scattered variables are kept within the bounds though this was not asked for.

    Examples
    --------
    >>> from pymoo.problems import get_problem
    >>> problem = Robust(get_problem("zdt1"), scatter=0.02, clip=True, progress=False)
    >>> problem.n_var, problem.draws
    (30, 128)
    """
    deviations = _checked(problem, scatter)
    one_of("method", method, ("auto", "surrogate", "direct"))
    if whole_number("draws", draws, PARTS) % PARTS:
        raise InvalidInput("draws", draws, f"a multiple of {PARTS}")
    if not options.pop("vectorised", True):
        raise InvalidInput("vectorised", False, "True: problems of pymoo are")
    if objectives is None:
        objectives = [Mean(response=f"F{j + 1}") for j in range(problem.n_obj)]
    if constraints is None:
        limited = [f"G{j + 1}" for j in range(problem.n_ieq_constr)]
        constraints = [MeanPlusStd(k, response=name) <= 0.0 for name in limited]
    seed = whole_number("seed", options.get("seed", 1), 0)
    asked = objectives, constraints
    if clip is None:
        clip = _has_to_clip(problem, deviations, seed)
    reason = _no_surrogate(problem)
    if method == "surrogate" and reason:
        raise InvalidInput("method", method, f"'direct' or 'auto': {reason}")
    if method != "direct" and not reason:
        if method == "auto":
            options.setdefault("budget", BUDGET)
        try:
            return _on_surrogate(problem, deviations, clip, *asked, **options)
        except (UntrustedSurrogate, SimulatorFailed) as error:
            if method == "surrogate":
                raise
            reason = str(error)
    if options.get("progress", True):
        because = f" ({reason})" if reason else ""
        message = f"Robust: {draws} runs of the problem for every design{because}"
        tqdm.write(message, file=sys.stderr)
    return DirectProblem(problem, deviations, *asked, draws, seed, clip)


def _checked(problem: Any, scatter: Any) -> dict[str, Any]:
    """Return the deviations by name.

    Raises
    ------
    InvalidInput
        If the problem has no robust counterpart, or the scatter does not fit.
    """
    if not isinstance(problem, Problem):
        raise InvalidInput("problem", problem, "a Problem of pymoo")
    if not is_mixed(problem) and problem.vtype not in (None, float):
        allowed = "real ones, or mixed ones (vars) of which the real ones scatter"
        raise InvalidInput("variables of the problem", problem.vtype, allowed)
    if problem.n_eq_constr:
        raise InvalidInput("equality constraints", problem.n_eq_constr, "0: scatter breaks them")
    names = real_names(problem)
    if not names:
        raise InvalidInput("variables of the problem", names_of(problem), "at least one real one")
    lower, upper = problem.bounds() if not is_mixed(problem) else (0.0, 0.0)
    if lower is None or upper is None:
        raise InvalidInput("bounds of the problem", (lower, upper), "finite")
    deviations = _deviations(scatter, names)
    for name, given in deviations.items():
        if not hasattr(given, "pdf"):
            real_number(f"scatter of {name!r}", given, at_least=0.0)
    return deviations


def _no_surrogate(problem: Problem) -> str:
    """Return why no surrogate is tried, or nothing."""
    if is_mixed(problem):
        return "its variables are mixed"
    if problem.n_var > MOST_INPUTS:
        return f"a surrogate has at most {MOST_INPUTS} inputs"
    return ""


def _has_to_clip(problem: Problem, deviations: Mapping[str, Any], seed: int) -> bool:
    """Return whether the problem is finite within its bounds only, and warn then.

    A problem that evaluates one design after the other may be costly, and is not asked.
    """
    if is_mixed(problem) or problem.elementwise:
        return False
    draws, lower_upper = 4 * PARTS, np.array(problem.bounds())
    random_state = np.random.default_rng(seed)
    # At corners and edges most variables leave their bounds.
    designs = random_state.choice([0.0, 0.5, 1.0], size=(_LOOKED_AT // PARTS, problem.n_var))
    X = lower_upper[0] + designs * (lower_upper[1] - lower_upper[0])
    statistics: tuple[list[Statistic], list[RobustConstraint]] = [Mean(response="F1")], []
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            DirectProblem(problem, deviations, *statistics, draws, seed, False).evaluate(X)
        except SimulatorFailed:
            finite_inside = True
            try:
                DirectProblem(problem, deviations, *statistics, draws, seed, True).evaluate(X)
            except SimulatorFailed:
                finite_inside = False
        else:
            return False
    if finite_inside:
        message = "the problem is not finite beyond its bounds: scattered variables are kept inside"
        warnings.warn(message, RuntimeWarning, stacklevel=3)
    return finite_inside


def _on_surrogate(
    problem: Problem,
    deviations: Mapping[str, Any],
    clip: bool,
    objectives: Sequence[Statistic],
    constraints: Sequence[RobustConstraint],
    **options: Any,
) -> SimulatorProblem:
    designs = {
        name: Design(float(low), float(high), deviation=deviations[name])
        for name, low, high in zip(names_of(problem), *problem.bounds(), strict=True)
    }
    asked = {"vectorised": True, "objectives": objectives, "constraints": constraints}
    return robust_problem(_Responses(problem, clip), designs, **(options | asked))


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
