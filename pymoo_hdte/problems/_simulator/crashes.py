"""Runs that give no result, as a response of its own: how often they fail around a design."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pymoo_hdte._unchanging import Unchanging
from pymoo_hdte.problems._simulator.statistics import Probability
from pymoo_hdte.surrogate._sparse.axes import Axis
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.success import Success

if TYPE_CHECKING:
    from pymoo_hdte.problems._simulator.around import Around

Array = NDArray[np.float64]

NONE_OF = 3.0
"""Events of a probability p are none in n draws with 5 % where n p = -ln 0.05 = 3.0."""


class SuccessMoments(Unchanging):
    """The probability of success around designs, at samples of the scatter.

    Parameters
    ----------
    success : Success
    axes : list of Axis
    scatter : ndarray, shape (k, d)
        The samples.
    """

    def __init__(self, success: Success, axes: list[Axis], scatter: Array) -> None:
        self.success, self._scatter = success, scatter
        self._mode = SparseMoments(success.polynomial, axes)
        self._draws = SparseMoments(success.draws, axes)

    def around(self, designs: Array) -> SuccessAround:
        """Return it around designs of shape (n, m)."""
        return SuccessAround(self, self._mode.expansion(designs)[:, 0], designs)

    def drawn(self, designs: Array) -> Array:
        """Return the expansions of the posterior's draws around designs, shape (n, 16, q)."""
        return self._draws.expansion(designs)

    @cached_property
    def of_mode(self) -> Array:
        """The polynomials of the mode at the samples, shape (k, q)."""
        return self._mode.basis(self._scatter)

    @cached_property
    def of_draws(self) -> Array:
        """Those of the draws, shape (k, q)."""
        return self._draws.basis(self._scatter)

    def at(self, scatter: Array) -> Array:
        """Return the polynomials of the mode, shape (k, q), at any s of shape (k, d)."""
        return self._mode.basis(scatter)


@dataclass(frozen=True)
class SuccessAround:
    """The probability of success around n designs."""

    moments: SuccessMoments
    expansion: Array
    designs: Array
    is_draw: bool = False

    def probabilities(self, part: slice = slice(None)) -> Array:
        """Return the probability of success at the samples, shape (n, k)."""
        basis = self.moments.of_draws if self.is_draw else self.moments.of_mode
        return ndtr(self.expansion @ basis[part].T)

    def drawn(self) -> Iterator[SuccessAround]:
        """Yield it by every draw of the posterior."""
        for expansion in np.swapaxes(self.moments.drawn(self.designs), 0, 1):
            yield replace(self, expansion=expansion, is_draw=True)

    def likely_at(self, scatter: Array) -> NDArray[np.bool_]:
        """Return whether success is likelier than failure at values of s around every design.

        Parameters
        ----------
        scatter : ndarray, shape (k, d) or (n, k, d)
            The same for all designs, or for each its own.

        Returns
        -------
        ndarray of bool, shape (n, k)
        """
        basis = self.moments.at(scatter.reshape(-1, scatter.shape[-1]))
        if scatter.ndim == 2:
            return self.expansion @ basis.T > 0.0
        basis = basis.reshape(*scatter.shape[:2], -1)
        return np.einsum("nkq,nq->nk", basis, self.expansion) > 0.0


@dataclass(frozen=True)
class CrashProbability(Probability):
    """The probability that a run of the simulator around a design gives no result.

    A run that raises, gives NaN or exceeds the time limit. Of all responses together; without a
    gradient. Where no run has failed it is 0, with a band of three runs in those that were made.

    Parameters
    ----------
    response : None
        It belongs to all.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Examples
    --------
    >>> limit = CrashProbability() <= 0.01
    >>> limit.bound
    0.01
    """

    @property
    def responses(self) -> tuple[str | None, ...]:
        """It belongs to no response alone."""
        return ()

    def _value(self, around: Around) -> tuple[Array, Array]:
        return 1.0 - around.success_share, np.zeros((0, 0))

    def _half_width(self, around: Around) -> Array:
        none = NONE_OF / max(around.n_runs, NONE_OF) if around.success is None else 0.0
        return np.full_like(around.mean_error, none)
