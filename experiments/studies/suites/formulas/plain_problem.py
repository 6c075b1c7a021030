"""A problem that is a function of its variables in a box, with an optional sampler of its front."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.problem import Problem

Objectives = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Takes designs (n, d) and returns objectives (n, m)."""


class PlainProblem(Problem):
    """Objectives given by a function, without constraints.

    Parameters
    ----------
    objectives : callable
        Takes designs (n, d) and returns objectives (n, m).
    lower, upper : array_like, shape (d,)
    n_obj : int
    """

    def __init__(
        self, objectives: Objectives, lower: ArrayLike, upper: ArrayLike, n_obj: int
    ) -> None:
        low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        super().__init__(n_var=len(low), n_obj=n_obj, xl=low, xu=high, vtype=float)
        self.objectives = objectives

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        out["F"] = self.objectives(x)
