"""First velocities of a particle swarm."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class InitialVelocity(Protocol):
    """A law of the velocities that particles start with."""

    def __call__(
        self,
        X: NDArray[np.float64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the velocities of the particles, shape (n, d), in the units of the variables.

        Parameters
        ----------
        X : ndarray, shape (n, d)
            First positions.
        lower, upper : ndarray, shape (d,)
            Bounds of the search.
        random_state : numpy.random.Generator
            Source of random numbers.
        """
        ...


class VelocityWithinBounds:
    """Velocities uniform between the bounds of the positions (paper, Section 5.1, step 1).

    Such a velocity depends on where the origin of the variables lies: the mean step is the middle
    of the box, so that in a box far from the origin every particle starts by leaving it through the
    same corner. `FirstStepWithinBounds` does not have that property.

    Examples
    --------
    >>> bounds = np.array([2.0]), np.array([3.0])
    >>> V = VelocityWithinBounds()(np.array([[2.5]]), *bounds, np.random.default_rng(1))
    >>> bool(2.0 <= V[0, 0] <= 3.0)
    True
    """

    def __call__(
        self,
        X: NDArray[np.float64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return velocities in [``lower``, ``upper``], shape (n, d).

        Parameters
        ----------
        X : ndarray, shape (n, d)
            First positions, in the units of the problem's variables; only their shape is used.
        lower, upper : ndarray, shape (d,)
            Bounds of the search, in the units of the problem's variables.
        random_state : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        ndarray, shape (n, d)
            In the units of the problem's variables.
        """
        return random_state.uniform(lower, upper, X.shape)


class FirstStepWithinBounds:
    """Velocities uniform such that a first step by them alone ends within the bounds.

    The law of SPSO 2011: M. Clerc, "Standard Particle Swarm Optimisation", 2012, hal-00764996.

    Examples
    --------
    >>> bounds = np.array([2.0]), np.array([3.0])
    >>> V = FirstStepWithinBounds()(np.array([[2.5]]), *bounds, np.random.default_rng(1))
    >>> bool(-0.5 <= V[0, 0] <= 0.5)
    True
    """

    def __call__(
        self,
        X: NDArray[np.float64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return velocities in [``lower`` - ``X``, ``upper`` - ``X``], shape (n, d).

        Parameters
        ----------
        X : ndarray, shape (n, d)
            First positions, in the units of the problem's variables.
        lower, upper : ndarray, shape (d,)
            Bounds of the search, in the units of the problem's variables.
        random_state : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        ndarray, shape (n, d)
            In the units of the problem's variables.
        """
        return random_state.uniform(lower - X, upper - X)
