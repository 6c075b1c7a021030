"""Probabilities and quantiles of responses around one design where common samples hardly reach."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

# Its special functions load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._rare.importance import Sample, adapted, sample_of
from pymoo_hdte.surrogate._sparse.axes import TAIL, Axis

Array = NDArray[np.float64]

REACH = 7.5
"""Largest absolute value of a standard normal variable; 1e-9 has a deviation of 6."""
TAIL_OF_REACH = 3e-14
"""The probability beyond it."""
SMALLEST = 1e-9
"""Least probability, or share beyond a quantile, that may be asked for."""
BEYOND = 1.1
"""Deviations by which the reach of the inputs exceeds that of a probability.

Of what is beyond four deviations, some 1 % is beyond 5.1; the response there is that at 5.1.
"""
Z = 1.96
"""Standard errors within which an estimate lies with 95 %."""
_COUNT, _FINAL = 500, 3000
"""Points of a round of `adapted`, and of the last one."""
_GRID = np.linspace(-REACH, REACH, 6001)
_NEAR = 0.05
"""Share of the points beyond a quantile that are near enough for its slope."""


def tail_of(probability: float) -> float:
    """Return the tail of the inputs, `Axis`, that a probability of failure needs.

    Parameters
    ----------
    probability : float
        Of the rarer side, dimensionless.
    """
    deviations = -scipy.special.ndtri(min(probability, 1.0 - probability))
    return float(min(TAIL, scipy.special.ndtr(-(deviations + BEYOND))))


class NormalScatter:
    """The scatter of all axes as a function of standard normal variables, one for each that moves.

    Parameters
    ----------
    axes : list of Axis

    Attributes
    ----------
    d : int
        Number of variables.
    """

    def __init__(self, axes: list[Axis]) -> None:
        self._count = len(axes)
        self._moving = [j for j, axis in enumerate(axes) if axis.scatter is not None]
        self.d = len(self._moving)
        shares = scipy.special.ndtr(_GRID)
        self._scatter = [axes[j].sample(shares) for j in self._moving]
        # There is nothing between the values of a discrete one.
        self._discrete = [axes[j].discrete for j in self._moving]

    def __call__(self, points: Array) -> Array:
        """Return the values of s on every axis at points of shape (n, d), shape (n, axes)."""
        values = np.zeros((len(points), self._count))
        for j, column, table, discrete in zip(
            self._moving, points.T, self._scatter, self._discrete, strict=True
        ):
            values[:, j] = (
                np.interp(column, _GRID, table)
                if discrete is None
                else discrete.quantile(scipy.special.ndtr(column))
            )
        return values


class Tail:
    """Responses around one design, sampled where they are beyond a limit or a quantile.

    Parameters
    ----------
    scatter : NormalScatter
    basis : callable
        Maps values of s, shape (n, axes), to the polynomials of the expansion, shape (n, q).
    expansions : mapping of str to ndarray
        Expansion of each response by name, shape (q,).
    margin : callable
        Maps responses by name, shape (n,) each, to what is above ``target``, shape (n,).
    target : callable, optional
        As in `adapted`.

    Attributes
    ----------
    sample : Sample
        Points in standard normal space with their weights.
    polynomials : ndarray, shape (n, q)
        The polynomials there.
    values : dict of str to ndarray
        The responses there.
    """

    def __init__(
        self,
        scatter: NormalScatter,
        basis: Callable[[Array], Array],
        expansions: Mapping[str | None, Array],
        margin: Callable[[Mapping[str | None, Array]], Array],
        target: Callable[[Array, Array], float] = lambda values, weights: 0.0,
    ) -> None:
        def at(points: Array) -> tuple[Array, dict[str | None, Array]]:
            polynomials = basis(scatter(points))
            return polynomials, {name: polynomials @ own for name, own in expansions.items()}

        # The same at every design: what differs between two designs is not the points.
        random_state = np.random.default_rng(0)
        mixture = adapted(
            lambda points: margin(at(points)[1]), scatter.d, random_state, _COUNT, _FINAL, target
        )
        self.sample: Sample = sample_of(mixture, random_state)
        self.polynomials, self.values = at(self.sample.points)


def quantile_above(values: Array, weights: Array, share: float) -> float:
    """Return the value above which a share of the probability lies.

    Parameters
    ----------
    values, weights : ndarray, shape (n,)
        Of points whose mean weight is 1.
    share : float
        Dimensionless.
    """
    order = np.argsort(-values)
    beyond = (np.cumsum(weights[order]) - 0.5 * weights[order]) / len(values)
    return float(np.interp(share, beyond, values[order]))


def near_quantile(values: Array, weights: Array, quantile: float, share: float) -> Array:
    """Return weights, shape (n,), which sum to 1, of the points next to a quantile."""
    apart = np.abs(values - quantile)
    order = np.argsort(apart)
    enough = np.cumsum(weights[order]) / len(values) <= _NEAR * share
    chosen = order[: max(int(enough.sum()), 8)]
    near = np.zeros_like(weights)
    near[chosen] = weights[chosen] / weights[chosen].sum()
    return near
