"""How many generations a run will have, for parts that follow a schedule."""

from __future__ import annotations

import math
import warnings

from pymoo.core.termination import TerminateIfAny, Termination
from pymoo.termination.collection import TerminationCollection
from pymoo.termination.default import DefaultTermination
from pymoo.termination.max_eval import MaximumFunctionCallTermination
from pymoo.termination.max_gen import MaximumGenerationTermination

_USUAL = 1000
"""Generations that schedules count on where nothing limits a run: pymoo's default."""


def generation_limit(termination: Termination, pop_size: int, n_max_gen: int | None) -> int:
    """Return G_max: of an ``n_gen`` termination, else ``n_max_gen``, else of other limits.

    Other limits are a number of evaluations, ``pop_size`` of which make a generation, and the
    smallest of the limits within a collection or a default termination of pymoo.

    Warns
    -----
    UserWarning
        If nothing limits the number of generations, as with a tolerance or a time: then it is
        1,000, the limit of pymoo's default termination.
    """
    limit = _limit(termination, pop_size)
    if n_max_gen is not None and not (
        isinstance(termination, MaximumGenerationTermination) and math.isfinite(limit)
    ):
        return n_max_gen
    if math.isinf(limit):
        warnings.warn(
            f"{type(termination).__name__} does not say how many generations a run has: schedules "
            f"count on {_USUAL}; give n_max_gen to the algorithm, or stop by ('n_gen', n) or "
            "('n_eval', n)",
            UserWarning,
            stacklevel=5,
        )
        return _USUAL
    return max(1, math.ceil(limit))


def evaluation_limit(termination: Termination) -> float:
    """Return the largest number of evaluations a termination allows, inf if it names none."""
    return _limit(termination, None)


def _limit(termination: Termination, pop_size: int | None) -> float:
    """Return the largest number of generations that a termination allows, inf if unlimited.

    Without ``pop_size`` the number of evaluations, for which a limit on generations is none.
    """
    match termination:
        case MaximumGenerationTermination(n_max_gen=limit) if limit is not None:
            return math.inf if pop_size is None else limit
        case MaximumFunctionCallTermination(n_max_evals=limit) if limit is not None:
            return limit / (pop_size or 1)
        case DefaultTermination(criteria=parts) | TerminateIfAny(criteria=parts):
            return min((_limit(part, pop_size) for part in parts), default=math.inf)
        case TerminationCollection(terminations=parts):
            return min((_limit(part, pop_size) for part in parts), default=math.inf)
    return math.inf
