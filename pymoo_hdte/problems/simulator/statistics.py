"""What can be asked of an uncertain response: its statistics, as objectives or as constraints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.problems.simulator.around import Around
from pymoo_hdte.surrogate.moments import divide_or_zero

Array = NDArray[np.float64]
S = TypeVar("S", bound="Statistic")


@dataclass(frozen=True)
class Statistic:
    """A number that belongs to one response at each design.

    ``-statistic`` is its negative, to maximise it; ``statistic <= bound`` or ``statistic >= bound``
    is a robust constraint.

    Parameters
    ----------
    response : str or None
        Name of the response; None for the only one.
    """

    response: str | None = field(default=None, kw_only=True)
    sign: float = field(default=1.0, kw_only=True, repr=False)

    has_gradient: ClassVar[bool] = True
    relative_to_scatter: ClassVar[bool] = True

    def __neg__(self: S) -> S:
        return replace(self, sign=-self.sign)

    def __le__(self, bound: float) -> RobustConstraint:
        return RobustConstraint(self, real_number("bound", bound), 1.0)

    def __ge__(self, bound: float) -> RobustConstraint:
        return RobustConstraint(self, real_number("bound", bound), -1.0)

    @property
    def name(self) -> str:
        """What it is called as an objective."""
        words = [type(self).__name__.lower(), *([self.response] if self.response else [])]
        return ("-" if self.sign < 0 else "") + "_".join(words)

    def value(self, around: Around) -> tuple[Array, Array]:
        """Return its values, without the sign, and their slopes in the response's expansion.

        Parameters
        ----------
        around : Around
            The response around n designs.

        Returns
        -------
        value : ndarray, shape (n,)
            In the response's unit; a probability is dimensionless.
        slope : ndarray, shape (n, q)
            In its coefficients, dimensionless.
        """
        return self._of(around)

    def half_width(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        """Return the half-width of its error band, shape (n,), in its unit.

        Parameters
        ----------
        mean_error, std_error : ndarray, shape (n,)
            Errors of mean and standard deviation in the response's unit.
        around : Around
            The response around n designs.
        """
        return self._error(mean_error, std_error, around)

    def _of(self, around: Around) -> tuple[Array, Array]:
        raise NotImplementedError

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return mean_error


@dataclass(frozen=True)
class RobustConstraint:
    """A bound on a statistic, as ``Quantile(0.99) <= 250e6`` makes it.

    Parameters
    ----------
    statistic : Statistic
    bound : float
        In the statistic's unit.
    side : float
        1 where the statistic must not be above the bound, -1 where not below.
    """

    statistic: Statistic
    bound: float
    side: float


@dataclass(frozen=True)
class Mean(Statistic):
    """The mean of a response, exact for the surrogate."""

    def _of(self, around: Around) -> tuple[Array, Array]:
        slope = np.zeros_like(around.expansion)
        slope[:, 0] = 1.0
        return around.mean, slope


@dataclass(frozen=True)
class Std(Statistic):
    """The standard deviation of a response, exact for the surrogate."""

    def _of(self, around: Around) -> tuple[Array, Array]:
        slope = divide_or_zero(around.expansion, np.repeat(around.std[:, None], around.size, 1))
        slope[:, 0] = 0.0
        return around.std, slope

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return std_error


@dataclass(frozen=True)
class MeanPlusStd(Statistic):
    """Mean plus k standard deviations of a response, exact for the surrogate.

    Parameters
    ----------
    k : float
        Dimensionless; negative for a lower limit.
    """

    k: float = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "k", real_number("k", self.k))

    def _of(self, around: Around) -> tuple[Array, Array]:
        parts = [one.value(around) for one in (Mean(), Std())]
        return parts[0][0] + self.k * parts[1][0], parts[0][1] + self.k * parts[1][1]

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return mean_error + abs(self.k) * std_error


@dataclass(frozen=True)
class Quantile(Statistic):
    """The value below which a response stays with a given probability, sampled on the surrogate.

    Parameters
    ----------
    p : float
        Probability, above 0 and below 1.
    """

    p: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "p", real_number("p", self.p, above=0.0, below=1.0))

    def _of(self, around: Around) -> tuple[Array, Array]:
        values, basis = around.samples
        place = self.p * len(basis) - 0.5
        low = int(np.clip(np.floor(place), 0, len(basis) - 2))
        share = np.clip(place - low, 0.0, 1.0)
        order = np.argpartition(values, (low, low + 1), axis=1)[:, [low, low + 1]]
        chosen = np.take_along_axis(values, order, axis=1)
        slope = (1.0 - share) * basis[order[:, 0]] + share * basis[order[:, 1]]
        return chosen @ np.array([1.0 - share, share]), slope

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return _sampled_error(self, mean_error, std_error, around)


@dataclass(frozen=True)
class CVaR(Statistic):
    """The mean of the largest values of a response, beyond its p-quantile, sampled.

    The conditional value at risk of Rockafellar and Uryasev, Journal of Risk 2, 2000.

    Parameters
    ----------
    p : float
        Probability of the values that are left out, above 0 and below 1.
    """

    p: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "p", real_number("p", self.p, above=0.0, below=1.0))

    def _of(self, around: Around) -> tuple[Array, Array]:
        values, basis = around.samples
        count = (1.0 - self.p) * len(basis)
        whole = min(int(np.floor(count)), len(basis) - 1)
        order = np.argsort(-values, axis=1)[:, : whole + 1]
        weights = np.ones(whole + 1)
        weights[-1] = count - whole
        weights /= count
        largest = np.take_along_axis(values, order, axis=1)
        return largest @ weights, np.einsum("nkq,k->nq", basis[order], weights)

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return _sampled_error(self, mean_error, std_error, around)


@dataclass(frozen=True)
class WorstCase(Statistic):
    """The largest value of a response in the box of the scatter around the design.

    That box is the support of the scatter, or its quantiles of 1e-5 where that is unbounded.

    Parameters
    ----------
    side : {"largest", "smallest"}
        Which value is worst.
    """

    side: str = "largest"

    def __post_init__(self) -> None:
        one_of("side", self.side, ("largest", "smallest"))

    def _of(self, around: Around) -> tuple[Array, Array]:
        return around.extreme(1.0 if self.side == "largest" else -1.0)

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        return mean_error + _farthest(self._of(around)[0], around) * std_error


@dataclass(frozen=True)
class FailureProbability(Statistic):
    """The probability that a response is above, or below, a limit; sampled, without a gradient.

    Parameters
    ----------
    above, below : float or None
        The limit, in the response's unit; exactly one of both.
    """

    above: float | None = None
    below: float | None = None

    has_gradient: ClassVar[bool] = False
    relative_to_scatter: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if (self.above is None) == (self.below is None):
            raise InvalidInput("above and below", (self.above, self.below), "exactly one of both")
        for name in ("above", "below"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, real_number(name, getattr(self, name)))

    def _of(self, around: Around) -> tuple[Array, Array]:
        return self._share(around, np.zeros(len(around.mean))), np.zeros((0, 0))

    def _share(self, around: Around, shift: Array) -> Array:
        values = around.samples[0] + shift[:, None]
        if self.above is not None:
            return np.mean(values > self.above, axis=1)
        return np.mean(values < float(self.below or 0.0), axis=1)

    def _error(self, mean_error: Array, std_error: Array, around: Around) -> Array:
        # How far it moves if the response is off by its error, plus the error of sampling.
        shift = mean_error + std_error
        ends = [self._share(around, side * shift) for side in (-1.0, 1.0)]
        found = self._share(around, 0.0 * shift)
        count = len(around.samples[1])
        sampling = 2.0 * np.sqrt(np.maximum(found * (1.0 - found), 1.0 / count) / count)
        return np.max(np.abs(np.array(ends) - found), axis=0) + sampling


def _farthest(values: Array, around: Around) -> Array:
    return np.abs(divide_or_zero(values - around.mean, around.std))


def _sampled_error(statistic: Any, mean_error: Array, std_error: Array, around: Around) -> Array:
    """Return the error by that of the surrogate and by the spread of four parts of the sample."""
    value = statistic.value(around)[0]
    parts = np.array([statistic.value(part)[0] for part in around.quarters()])
    sampling = 2.0 * parts.std(axis=0, ddof=1) / np.sqrt(len(parts))
    return mean_error + _farthest(value, around) * std_error + sampling
