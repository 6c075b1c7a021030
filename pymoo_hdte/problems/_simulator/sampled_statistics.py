"""Statistics that are read off common samples of the surrogate around a design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.problems._simulator.around import PARTS, SAMPLES, Around
from pymoo_hdte.problems._simulator.statistics import Statistic, reach_of

Array = NDArray[np.float64]

FEWEST = 10
"""Samples that have to lie beyond a quantile or a limit: ten have an error of a third."""
RESOLVED = FEWEST / SAMPLES
"""Smallest probability that the samples resolve."""
STUDENT = 3.182
"""Standard errors of a mean of four parts within which it lies with 95 %: Student's t(3).

The size of the standard error itself is taken from these four; 2 would cover some 86 %.
"""
NONE_OF = 3.0
"""Events of a probability p are none in n draws with 5 % where n p = -ln 0.05 = 3.0."""


def _resolved(field: str, given: float, lowest: float, highest: float) -> float:
    share = real_number(field, given)
    if not lowest <= share <= highest:
        allowed = f"{lowest:.4g} to {highest:.4g}: {SAMPLES} samples tell nothing beyond"
        raise InvalidInput(field, share, allowed)
    return share


@dataclass(frozen=True)
class _TailStatistic(Statistic):
    """A statistic beyond a probability, whose band has the spread of four parts of the sample."""

    p: float

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        value = self.value(around)[0]
        parts = np.array([self.value(part)[0] for part in around.quarters()])
        sampling = STUDENT * parts.std(axis=0, ddof=1) / np.sqrt(PARTS)
        return mean_error + reach_of(value, around) * std_error + sampling


@dataclass(frozen=True)
class Quantile(_TailStatistic):
    """The value below which a response stays with a given probability, sampled on the surrogate.

    Parameters
    ----------
    p : float
        Probability, at least 10/4096 from 0 and from 1: there are 4096 samples.
    response : str or None
        Name of the response; None for the only one.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Raises
    ------
    InvalidInput
        If an argument is not in its range.

    Examples
    --------
    >>> Quantile(0.99, response="stress").response
    'stress'
    """

    def __post_init__(self) -> None:
        object.__setattr__(self, "p", _resolved("p", self.p, RESOLVED, 1.0 - RESOLVED))

    def _of(self, around: Around) -> tuple[Array, Array]:
        values, basis = around.samples
        place = self.p * len(basis) - 0.5
        low = int(np.clip(np.floor(place), 0, len(basis) - 2))
        share = np.clip(place - low, 0.0, 1.0)
        order = np.argpartition(values, (low, low + 1), axis=1)[:, [low, low + 1]]
        chosen = np.take_along_axis(values, order, axis=1)
        slope = (1.0 - share) * basis[order[:, 0]] + share * basis[order[:, 1]]
        return chosen @ np.array([1.0 - share, share]), slope


@dataclass(frozen=True)
class CVaR(_TailStatistic):
    """The mean of the largest values of a response, beyond its p-quantile, sampled.

    The conditional value at risk of Rockafellar and Uryasev, Journal of Risk 2, 2000.

    Parameters
    ----------
    p : float
        Probability of the values that are left out, above 0 and at most 1 - 10/4096: there are
        4096 samples.
    response : str or None
        Name of the response; None for the only one.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Raises
    ------
    InvalidInput
        If an argument is not in its range.

    Examples
    --------
    >>> CVaR(0.95, response="stress").response
    'stress'
    """

    def __post_init__(self) -> None:
        real_number("p", self.p, above=0.0)
        object.__setattr__(self, "p", _resolved("p", self.p, 0.0, 1.0 - RESOLVED))

    def _of(self, around: Around) -> tuple[Array, Array]:
        values, basis = around.samples
        count = (1.0 - self.p) * len(basis)
        whole = min(int(np.floor(count)), len(basis) - 1)
        order = np.argsort(-values, axis=1)[:, : whole + 1]
        weights = np.ones(whole + 1)
        weights[-1] = count - whole
        weights /= count
        largest = np.take_along_axis(values, order, axis=1)
        share = np.zeros_like(values)
        np.put_along_axis(share, order, np.broadcast_to(weights, order.shape), axis=1)
        return largest @ weights, share @ basis


@dataclass(frozen=True)
class FailureProbability(Statistic):
    """The probability that a response is above, or below, a limit; sampled, without a gradient.

    From 4096 samples: as a constraint its bound is at least 10/4096 from 0 and from 1.

    Parameters
    ----------
    above, below : float or None
        The limit, in the response's unit; exactly one of both.
    response : str or None
        Name of the response; None for the only one.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Raises
    ------
    InvalidInput
        If an argument is not in its range.

    Examples
    --------
    >>> FailureProbability(above=250e6, response="stress").above
    250000000.0
    """

    above: float | None = None
    below: float | None = None

    def __post_init__(self) -> None:
        if (self.above is None) == (self.below is None):
            raise InvalidInput("above and below", (self.above, self.below), "exactly one of both")
        for name in ("above", "below"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, real_number(name, getattr(self, name)))

    def _of(self, around: Around) -> tuple[Array, Array]:
        return self._share(around, np.zeros(len(around.mean))), np.zeros((0, 0))

    def _bound(self, bound: float) -> float:
        return _resolved("bound of a probability", bound, RESOLVED, 1.0 - RESOLVED)

    @property
    def has_gradient(self) -> bool:
        """False: the share of a sample jumps."""
        return False

    @property
    def relative_to_scatter(self) -> bool:
        """False: a probability has no unit."""
        return False

    def _share(self, around: Around, shift: Array) -> Array:
        values = around.samples[0] + shift[:, None]
        if self.above is not None:
            return np.mean(values > self.above, axis=1)
        return np.mean(values < float(self.below or 0.0), axis=1)

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        # How far it moves if the response is off by its error, plus the error of sampling.
        shift = mean_error + std_error
        ends = [self._share(around, side * shift) for side in (-1.0, 1.0)]
        share = self._share(around, 0.0 * shift)
        count = len(around.samples[1])
        sampling = np.maximum(2.0 * np.sqrt(share * (1.0 - share) / count), NONE_OF / count)
        return np.max(np.abs(np.array(ends) - share), axis=0) + sampling
