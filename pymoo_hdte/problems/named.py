"""The robust problems by name, as `pymoo.problems.get_problem` has pymoo's own."""

from __future__ import annotations

from typing import Any

from pymoo.core.problem import Problem

from pymoo_hdte.checks import one_of
from pymoo_hdte.problems.catalogue import robust_benchmarks
from pymoo_hdte.problems.family import robust_dte_family


def get_problem(name: str, **settings: Any) -> Problem:
    """Return the problem of a name of `robust_dte_family` or `robust_benchmarks`.

    Parameters
    ----------
    name : str
        Such as ``"resonant"`` or ``"deb_gupta_1"``.
    **settings
        Keyword arguments of its constructor, where others than the usual ones are wanted. A front
        is stored for the usual ones only.

    Raises
    ------
    InvalidInput
        If there is no problem of that name.
    TypeError
        For a setting that the problem does not have.

    Examples
    --------
    >>> problem = get_problem("resonant")
    >>> problem.n_var, problem.pareto_front().shape[1]
    (4, 2)
    """
    named = {**robust_dte_family(), **robust_benchmarks()}
    return named[one_of("name of a problem", name, tuple(named))](**settings)
