"""Evaluated positions as arrays: what every part of the swarm works on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.population import Population


@dataclass(frozen=True)
class Points:
    """Positions with their objectives and constraint violations, row for row.

    Attributes
    ----------
    X : (n, d) array
        Positions in the units of the problem.
    F : (n, m) array
        Objectives, to be minimised.
    violation : (n,) array
        Total constraint violation: 0 for a feasible point, inf for one that cannot be judged
        because an objective is not finite or a constraint is not a number.
    """

    X: NDArray[np.float64]
    F: NDArray[np.float64]
    violation: NDArray[np.float64]

    @classmethod
    def of(cls, population: Population, constrained: bool) -> Points:
        """Read the points of an evaluated pymoo population, whose problem may have constraints."""
        X = np.array([individual.X for individual in population.tolist()], dtype=float)
        return cls(X, *judged(population, constrained))

    @classmethod
    def none(cls, n_var: int, n_obj: int) -> Points:
        """Return no points, of the given dimensions."""
        return cls(np.empty((0, n_var)), np.empty((0, n_obj)), np.empty(0))

    def __len__(self) -> int:
        return len(self.violation)

    def __getitem__(self, rows: NDArray | slice) -> Points:
        return Points(self.X[rows], self.F[rows], self.violation[rows])

    def __deepcopy__(self, memo: dict[int, Any]) -> Points:
        """Return the points themselves, which nobody changes."""
        return self

    def followed_by(self, *others: Points) -> Points:
        """Return these points followed by ``others``."""
        parts = (self, *others)
        return Points(
            np.concatenate([part.X for part in parts]),
            np.concatenate([part.F for part in parts]),
            np.concatenate([part.violation for part in parts]),
        )


def judged(
    population: Population, constrained: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return F (n, m) and violation (n,) of `Points` of an evaluated pymoo population."""
    # Attributes in a list, because Population.get costs more than all else in a generation.
    individuals = population.tolist()
    F = np.array([individual.F for individual in individuals], dtype=float)
    violation = np.zeros(len(individuals))
    if constrained:
        violation = np.array([individual.CV[0] for individual in individuals])
        violation[violation <= individuals[0].config.get("cv_eps", 0.0)] = 0.0
    known = np.isfinite(F).all(axis=1) & ~np.isnan(violation)
    return F, np.where(known, violation, np.inf)
