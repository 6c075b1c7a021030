"""What can be asked of an uncertain response: its statistics, as objectives or as constraints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import one_of, real_number
from pymoo_hdte.surrogate.moments import divide_or_zero

if TYPE_CHECKING:
    from pymoo_hdte.problems._simulator.around import Around

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
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Attributes
    ----------
    has_gradient : bool
        Whether it is smooth enough for a gradient in the design.
    relative_to_scatter : bool
        Whether its error is reported as a share of the scatter.
    """

    response: str | None = field(default=None, kw_only=True)
    sign: float = field(default=1.0, kw_only=True, repr=False)
    has_gradient: ClassVar[bool] = True
    relative_to_scatter: ClassVar[bool] = True

    def __neg__(self: S) -> S:
        return replace(self, sign=-self.sign)

    def __le__(self, bound: float) -> RobustConstraint:
        return RobustConstraint(self, self._bound(bound), 1.0)

    def __ge__(self, bound: float) -> RobustConstraint:
        return RobustConstraint(self, self._bound(bound), -1.0)

    def _bound(self, bound: float) -> float:
        return real_number("bound", bound)

    @property
    def responses(self) -> tuple[str | None, ...]:
        """Names of the responses it belongs to; None for the only one."""
        return (self.response,)

    def rarest(self, bound: float | None = None) -> float:
        """Return the least probability that it asks for, dimensionless.

        Parameters
        ----------
        bound : float, optional
            As which constraint it is met, in its unit.
        """
        return 0.5

    @property
    def name(self) -> str:
        """Name of the statistic as an objective."""
        words = [type(self).__name__.lower(), *([self.response] if self.response else [])]
        return ("-" if self.sign < 0 else "") + "_".join(words)

    def _value(self, around: Around) -> tuple[Array, Array]:
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
        raise NotImplementedError

    def _half_width(self, around: Around) -> Array:
        """Return the half-width of its error band, shape (n,), in its unit; NaN if it has none."""
        return around.mean_error

    @property
    def weights(self) -> tuple[float, float] | None:
        """Weights of mean and standard deviation, dimensionless; None if it is no such sum."""
        return None


@dataclass(frozen=True)
class Probability(Statistic):
    """A share of what scatters: it has no unit, and that of a sample jumps."""

    has_gradient = False
    relative_to_scatter = False


@dataclass(frozen=True)
class RobustConstraint:
    """A bound on a statistic, as ``Quantile(0.99) <= 250e6`` makes it.

    Parameters
    ----------
    statistic : Statistic
    bound : float
        In the statistic's unit.
    side : float
        Dimensionless: 1 where the statistic must not be above the bound, -1 where not below.

    Examples
    --------
    >>> limit = MeanPlusStd(3, response="stress") <= 250e6
    >>> isinstance(limit, RobustConstraint), limit.bound
    (True, 250000000.0)
    """

    statistic: Statistic
    bound: float
    side: float

    @property
    def rarest(self) -> float:
        """The least probability that it asks for, dimensionless."""
        return self.statistic.rarest(self.bound)


class _WeightedMoments(Statistic):
    """A weighted sum of mean and standard deviation, exact for the surrogate."""

    @property
    def weights(self) -> tuple[float, float]:
        """Weights of mean and standard deviation, dimensionless."""
        raise NotImplementedError

    def _value(self, around: Around) -> tuple[Array, Array]:
        of_mean, of_std = self.weights
        slope = of_std * divide_or_zero(around.expansion, around.std[:, None])
        slope[:, 0] = of_mean
        return of_mean * around.mean + of_std * around.std, slope

    def _half_width(self, around: Around) -> Array:
        of_mean, of_std = self.weights
        return of_mean * around.mean_error + abs(of_std) * around.std_error


@dataclass(frozen=True)
class Mean(_WeightedMoments):
    """The mean of a response, exact for the surrogate.

    Parameters
    ----------
    response : str or None
        Name of the response; None for the only one.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Examples
    --------
    >>> problem = robust_problem(
    ...     lambda x: x**2, {"x": Design(1.0, 2.0, tolerance=0.1)}, None, [Mean()], progress=False
    ... )
    >>> print(f"{problem.evaluate(np.array([[1.0]]))[0, 0]:.4f}")
    1.0033
    """

    @property
    def weights(self) -> tuple[float, float]:
        """Weights of mean and standard deviation, dimensionless."""
        return 1.0, 0.0


@dataclass(frozen=True)
class Std(_WeightedMoments):
    """The standard deviation of a response, exact for the surrogate.

    Parameters
    ----------
    response : str or None
        Name of the response; None for the only one.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Examples
    --------
    >>> Std(response="stress").response
    'stress'
    """

    @property
    def weights(self) -> tuple[float, float]:
        """Weights of mean and standard deviation, dimensionless."""
        return 0.0, 1.0


@dataclass(frozen=True)
class MeanPlusStd(_WeightedMoments):
    """Mean plus k standard deviations of a response, exact for the surrogate.

    Parameters
    ----------
    k : float
        Dimensionless; negative for a lower limit.
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
    >>> MeanPlusStd(3, response="deflection").k
    3.0
    """

    k: float = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "k", real_number("k", self.k))

    @property
    def weights(self) -> tuple[float, float]:
        """Weights of mean and standard deviation, dimensionless."""
        return 1.0, self.k


@dataclass(frozen=True)
class WorstCase(Statistic):
    """The largest value of a response in the box of the scatter around the design.

    That box is the support of the scatter, or its quantiles of 1e-5 where that is unbounded. The
    value is found by a search along one input after the other, so it is a lower estimate. It has no
    error band (NaN): errors are measured at draws of the scatter, hardly one of them in a corner.

    Parameters
    ----------
    side : {"largest", "smallest"}
        The value that is the worst.
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
    >>> WorstCase("smallest", response="margin").side
    'smallest'
    """

    side: str = "largest"

    def __post_init__(self) -> None:
        one_of("side", self.side, ("largest", "smallest"))

    def _value(self, around: Around) -> tuple[Array, Array]:
        return around.extreme(1.0 if self.side == "largest" else -1.0)

    def _half_width(self, around: Around) -> Array:
        return np.full_like(around.mean_error, np.nan)


def reach_of(values: Array | float, around: Around) -> Array:
    """Return how many deviations values lie from the mean, shape (n,), 0 without scatter."""
    return np.abs(divide_or_zero(values - around.mean, around.std))
