"""Archives of the best points found so far: the leaders of a swarm, and fronts to be offered."""

from __future__ import annotations

import numpy as np
from moocore import is_nondominated
from numpy.typing import NDArray
from pymoo.core.population import Population

from pymoo_hdte.algorithms.crowding import crowding_tournaments, least_crowded
from pymoo_hdte.algorithms.dominance import best_front
from pymoo_hdte.algorithms.points import Points, judged
from pymoo_hdte.algorithms.survival import Truncation


class LeaderArchive:
    """Mutually non-dominated, feasible solutions without duplicates, at most ``capacity`` of them.

    Until a feasible solution is known it holds the least infeasible one; a solution with an
    objective that is not finite or a constraint that is not a number never enters. Above
    ``capacity`` the solution of smallest crowding distance (Deb, Pratap, Agarwal, Meyarivan 2002)
    leaves, one at a time (paper, Section 5.1, step 5).

    Parameters
    ----------
    capacity : int
        Largest number of members.
    n_var, n_obj : int
        Numbers of variables and objectives.

    Attributes
    ----------
    members : Population
        The archived individuals, in order of arrival.
    points : Points
        The same as arrays.

    Examples
    --------
    >>> archive = LeaderArchive(capacity=10, n_var=1, n_obj=2)
    >>> len(archive.members)
    0
    """

    def __init__(self, capacity: int, n_var: int, n_obj: int) -> None:
        self.capacity = capacity
        self.members = Population.empty()
        self.points = Points.none(n_var, n_obj)

    def __len__(self) -> int:
        return len(self.points)

    def update(self, population: Population, points: Points) -> None:
        """Add an evaluated population and keep the best.

        Parameters
        ----------
        population : Population
            n evaluated individuals.
        points : Points
            The same as arrays, row for row.
        """
        everyone = Population.merge(self.members, population)
        points = self.points.followed_by(points)
        front = best_front(points)
        rows = front[least_crowded(points.F[front], self.capacity)]
        self.members, self.points = everyone[rows], points[rows]

    def draw(self, n: int, random_state: np.random.Generator) -> NDArray[np.float64]:
        """Draw positions of leaders, each the less crowded of two random members.

        Parameters
        ----------
        n : int
            Number of positions.
        random_state : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        ndarray, shape (n, d)
            Positions in the units of the problem's variables.
        """
        return self.points.X[crowding_tournaments(self.points.F, n, random_state)]


class FrontArchive:
    """Feasible, mutually non-dominated solutions of different objectives, in order of arrival.

    It keeps individuals, some kilobytes each, and judges them again at every update, since
    callbacks may evaluate them again and constraint handling may grow stricter. An update reads the
    members, half a microsecond each, and compares N points in O(N log N) for two and three
    objectives, N being the members and the newcomers together.

    Parameters
    ----------
    capacity : int
        Largest number of members.
    truncation : Truncation
        Chooses who stays above the capacity.
    thinned_to : int, optional
        Number that a truncation leaves, by default the capacity; with fewer it is seldom needed.

    Attributes
    ----------
    members : Population
        The archived individuals.
    """

    def __init__(
        self, capacity: int, truncation: Truncation, thinned_to: int | None = None
    ) -> None:
        self._capacity, self._truncation = capacity, truncation
        self._thinned_to = capacity if thinned_to is None else thinned_to
        self.members = Population.empty()

    def __len__(self) -> int:
        return len(self.members)

    def update(self, population: Population, constrained: bool) -> None:
        """Add an evaluated population and keep what is feasible and non-dominated.

        Parameters
        ----------
        population : Population
            n evaluated individuals.
        constrained : bool
            Whether their problem has constraints.
        """
        # Members are read again, since what counts as feasible may have changed.
        groups = [group for group in (self.members, population) if len(group)]
        if not groups:
            return
        everyone = Population.merge(self.members, population)
        parts = zip(*(judged(group, constrained) for group in groups), strict=True)
        F, violation = map(np.concatenate, parts)
        rows = np.flatnonzero(violation == 0.0)
        if len(rows):
            rows = rows[is_nondominated(F[rows])]
        if len(rows) > self._capacity:
            rows = rows[self._truncation(F[rows], self._thinned_to)]
        self.members = everyone[rows]
