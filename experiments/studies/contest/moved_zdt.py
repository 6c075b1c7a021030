"""ZDT problems whose optima lie at random interior points, with or without a rotation.

The optima of ZDT1 to ZDT6 lie on the lower bound in all distance variables (ZDT4: in the middle of
the box), where an algorithm that cuts positions to the box drops its particles, and the variables
do not interact. Here a distance variable is the size of ``rotation @ (x - optimum)``, and all else
is as before: the same true front, reached inside the box.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems import get_problem
from scipy.stats import ortho_group

INTERIOR = (0.25, 0.75)
"""Part of the range of a variable in which its optimum lies."""


class MovedZDT(Problem):
    """One of ZDT1, 2, 3, 4, 6 (Zitzler, Deb, Thiele 2000) with its distance variables moved.

    Parameters
    ----------
    name : str
        Of the problem as pymoo knows it, such as ``"zdt1"``.
    rotated : bool
        Whether the distance variables are also turned by a random rotation.
    seed : int
        Of optimum and rotation.

    Attributes
    ----------
    optimum : ndarray, shape (n_var - 1,)
        Best values of the distance variables x_2 .. x_n.
    rotation : ndarray, shape (n_var - 1, n_var - 1)
    """

    def __init__(self, name: str, rotated: bool, seed: int) -> None:
        self.original = get_problem(name)
        n_var = self.original.n_var
        lower, upper = self.original.bounds()
        super().__init__(n_var=n_var, n_obj=2, xl=lower, xu=upper, vtype=float)
        rng = np.random.default_rng(seed)
        share = rng.uniform(*INTERIOR, n_var - 1)
        self.optimum = lower[1:] + share * (upper - lower)[1:]
        distances = n_var - 1
        self.rotation = (
            ortho_group.rvs(distances, random_state=rng) if rotated else np.eye(distances)
        )

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        distance = np.abs((x[:, 1:] - self.optimum) @ self.rotation.T)
        self.original._evaluate(np.column_stack([x[:, 0], distance]), out)

    def _calc_pareto_front(self, n_pareto_points: int = 100) -> NDArray[np.float64]:
        return self.original.pareto_front(n_pareto_points)
