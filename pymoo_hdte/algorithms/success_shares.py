"""Choice of a particle's move: moves that have led to more survivors are chosen more often."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class SuccessShares:
    """Shares of several moves, matched to their recent rates of success.

    Probability matching (D. Thierens, "An adaptive pursuit strategy for allocating operator
    probabilities", GECCO 2005, section 2): the share of a move grows with the rate at which its
    particles survived, old generations fading by 0.9 each, and never falls below 0.05, so that a
    move that has become useful is noticed.

    Parameters
    ----------
    n_moves : int

    Attributes
    ----------
    shares : ndarray, shape (n_moves,)
        Probabilities of the moves, which sum to 1.
    """

    MEMORY = 0.9
    SMALLEST = 0.05

    def __init__(self, n_moves: int) -> None:
        self._tried = np.zeros(n_moves)
        self._survived = np.zeros(n_moves)
        self.shares = np.full(n_moves, 1.0 / n_moves)

    def draw(self, n: int, random_state: np.random.Generator) -> NDArray[np.int_]:
        """Return a move for each of ``n`` particles."""
        return np.searchsorted(np.cumsum(self.shares)[:-1], random_state.random(n), side="right")

    def learn(self, moves: NDArray[np.int_], survived: NDArray[np.bool_]) -> None:
        """Record the moves (n,) of a generation and which particles survived (n,)."""
        n_moves = len(self.shares)
        fading = self.MEMORY
        self._tried = fading * self._tried + np.bincount(moves, minlength=n_moves)
        self._survived = fading * self._survived + np.bincount(moves[survived], minlength=n_moves)
        # A prior of one success in two trials gives a rate to a move that was never tried.
        rate = (self._survived + 1.0) / (self._tried + 2.0)
        self.shares = self.SMALLEST + (1.0 - n_moves * self.SMALLEST) * rate / rate.sum()
