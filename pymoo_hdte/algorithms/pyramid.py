"""Hierarchies: which particle follows its own memory, which the leaders, and which mutates."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Hierarchy(Protocol):
    """A division of labour within the swarm by the Pareto ranks of its particles."""

    def acceleration(
        self, ranks: NDArray[np.int_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the cognitive factors c1 and the social factors c2, shape (n,) each."""
        ...

    def mutation(
        self,
        ranks: NDArray[np.int_],
        progress: float,
        span: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return what to add to the positions, shape (n, d).

        Parameters
        ----------
        ranks : ndarray of int, shape (n,)
            Pareto ranks of the swarm, from 1.
        progress : float
            Elapsed share t / G_max of the generations, in [0, 1].
        span : ndarray, shape (d,)
            Widths of the search box, in the units of the problem's variables.
        random_state : numpy.random.Generator
            Source of random numbers.
        """
        ...


class Flat:
    """No division of labour: c1 = c2 = 2 for all, no mutation (Kennedy and Eberhart 1995).

    Examples
    --------
    >>> Flat().acceleration(np.array([0, 1]))
    (array([2., 2.]), array([2., 2.]))
    """

    def acceleration(
        self, ranks: NDArray[np.int_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the cognitive and the social factors, 2 each whatever the ranks.

        Parameters
        ----------
        ranks : ndarray of int, shape (n,)
            Pareto ranks of the swarm, from 1.

        Returns
        -------
        c1, c2 : ndarray, shape (n,)
            Dimensionless.
        """
        factors = np.full(len(ranks), 2.0)
        return factors, factors

    def mutation(
        self,
        ranks: NDArray[np.int_],
        progress: float,
        span: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return zeros, shape (n, d), in the units of the problem's variables.

        Parameters as in `Pyramid.mutation`; only the lengths n and d are used.
        """
        return np.zeros((len(ranks), len(span)))


class Pyramid:
    """Two layers: the top ranks exploit, the others explore (paper, Section 5.1, step 4).

    Ranks 1 and 2 follow the leaders, c1 = 1 and c2 = 2. All others follow their own memory, c1 = 2
    and c2 = 1, and with probability 0.4 the whole position is shifted by a normal random vector
    of standard deviation 0.2 span max(0.05, 1 - t / G_max). The velocity is left as it is.

    Attributes
    ----------
    TOP_RANKS : int
        Last rank of the top layer.
    MUTATION_PROBABILITY : float
        Probability that a particle of the bottom layer mutates in a generation.

    Examples
    --------
    >>> Pyramid.TOP_RANKS, Pyramid.MUTATION_PROBABILITY
    (2, 0.4)
    """

    TOP_RANKS = 2
    MUTATION_PROBABILITY = 0.4

    def acceleration(
        self, ranks: NDArray[np.int_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the cognitive and the social factors by the layer of each rank.

        Parameters
        ----------
        ranks : ndarray of int, shape (n,)
            Pareto ranks of the swarm, from 1.

        Returns
        -------
        c1, c2 : ndarray, shape (n,)
            Dimensionless.
        """
        top = ranks <= self.TOP_RANKS
        return np.where(top, 1.0, 2.0), np.where(top, 2.0, 1.0)

    def mutation(
        self,
        ranks: NDArray[np.int_],
        progress: float,
        span: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the normal shifts of the chosen bottom particles, zeros for the others.

        Parameters
        ----------
        ranks : ndarray of int, shape (n,)
            Pareto ranks of the swarm, from 1.
        progress : float
            Elapsed share t / G_max of the generations, in [0, 1].
        span : ndarray, shape (d,)
            Widths of the search box, in the units of the problem's variables.
        random_state : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        ndarray, shape (n, d)
            In the units of the problem's variables.
        """
        struck = random_state.random(len(ranks)) < self.MUTATION_PROBABILITY
        struck &= ranks > self.TOP_RANKS
        shift = np.zeros((len(ranks), len(span)))
        normal = random_state.standard_normal((np.count_nonzero(struck), len(span)))
        shift[struck] = mutation_step(progress, span) * normal
        return shift


def mutation_step(progress: float, span: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations (d,) of the mutation, shrinking with ``progress``."""
    return 0.2 * span * max(0.05, 1.0 - progress)
