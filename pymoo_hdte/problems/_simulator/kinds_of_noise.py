"""Noise that has no density: scenarios with probabilities, and intervals without any."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.surrogate._sparse.measures import Discrete

Array = NDArray[np.float64]

MOST_VALUES = 10_000
"""Values of a discrete distribution; those of more are as good as continuous."""
BEYOND = 1e-9
"""Probability on either side at which a discrete distribution without an end is cut."""


@dataclass(frozen=True, init=False)
class Scenarios:
    """Noise that takes some values only, each with a probability: load cases, sizes, counts.

    Under a tuple of names, as ``{("speed", "load"): Scenarios([(1.0, 5.0), (2.0, 3.0)])}``, a
    scenario sets several inputs at once. Mean and deviation are exact for the surrogate, which is
    a polynomial of the value, or of the position of a scenario that sets several.

    Parameters
    ----------
    values : array_like, shape (n,) or (n, k)
        Different values in the noise's unit, or rows of one value for each of k names.
    weights : array_like, shape (n,), optional
        Weight of each, above 0; they are divided by their sum. Alike by default.

    Raises
    ------
    InvalidInput
        If there is no value, one is repeated or not finite, or a weight is missing or not above 0.

    Examples
    --------
    >>> problem = robust_problem(
    ...     lambda x, gusts: x * gusts,
    ...     {"x": Design(1.0, 2.0)},
    ...     {"gusts": Scenarios([0, 1, 4], weights=[0.5, 0.3, 0.2])},
    ...     progress=False,
    ... )
    >>> print(problem.evaluate(np.array([[1.0]])).round(3))
    [[1.1   1.513]]
    """

    values: tuple[Any, ...]
    weights: tuple[float, ...]

    def __init__(self, values: Sequence[Any], weights: Sequence[float] | None = None) -> None:
        single = np.ndim(values[0]) == 0 if np.ndim(values) and len(values) else True
        table = finite_array("values", values, (None,) if single else (None, None))
        if not len(table):
            raise InvalidInput("values", values, "one or more")
        rows = table.tolist() if single else [tuple(row) for row in table.tolist()]
        if len(set(rows)) < len(rows) or len(rows) > MOST_VALUES:
            raise InvalidInput("values", values, f"different ones, at most {MOST_VALUES}")
        given = np.ones(len(rows)) if weights is None else weights
        shares = finite_array("weights", given, (len(rows),))
        if not np.all(shares > 0.0):
            raise InvalidInput("weights", weights, "above 0")
        object.__setattr__(self, "values", tuple(rows))
        object.__setattr__(self, "weights", tuple((shares / shares.sum()).tolist()))

    @property
    def size(self) -> int:
        """Number of inputs that a scenario sets."""
        return len(self.values[0]) if isinstance(self.values[0], tuple) else 1

    def discrete(self) -> Discrete:
        """Return the distribution of the value, or of the scenario's position from 0."""
        values = np.arange(len(self.values)) if self.size > 1 else np.ravel(self.values)
        return Discrete(np.asarray(values, dtype=float), np.array(self.weights))


@dataclass(frozen=True)
class Interval:
    """Noise of which only the ends are known: a goal counts by the worst value in between.

    Every objective and constraint is taken at the values of all intervals that are worst for it
    alone; other noise scatters there as it does everywhere. The worst is searched on the surrogate
    along one interval after the other, so with several it is a lower estimate. Gradients are those
    at the worst.

    Parameters
    ----------
    lower, upper : float
        Ends in the noise's unit.

    Raises
    ------
    InvalidInput
        If they are not finite or not in order.

    Examples
    --------
    >>> problem = robust_problem(
    ...     lambda x, heat, load: (x - heat) ** 2 + load,
    ...     {"x": Design(0.0, 1.0)},
    ...     {"heat": Interval(0.2, 0.6), "load": TruncatedNormal(0.5, 0.1)},
    ...     objectives=[Mean()],
    ...     progress=False,
    ... )
    >>> print(problem.evaluate(np.array([[0.0], [0.5]])).round(3).ravel())
    [0.86 0.59]
    """

    lower: float
    upper: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", real_number("lower", self.lower))
        object.__setattr__(self, "upper", real_number("upper", self.upper, above=self.lower))


def whole_numbers(field: str, given: Any) -> Scenarios | None:
    """Return a discrete distribution of `chaospy` or `scipy.stats` as scenarios; None for others.

    Parameters
    ----------
    field : str
        Name of the distribution in an error.
    given : object
        What a user passed as noise.

    Raises
    ------
    InvalidInput
        If it has more than `MOST_VALUES` values or others than whole numbers, or its probabilities
        do not sum to 1.
    """
    if isinstance(given, type) or hasattr(given, "freeze"):
        return None
    of_scipy = hasattr(getattr(given, "dist", None), "pmf")
    of_chaospy = getattr(given, "interpret_as_integer", False) and len(given) == 1
    if not (of_scipy or of_chaospy):
        return None
    allowed = f"a discrete distribution of at most {MOST_VALUES} whole numbers"
    try:
        quantile = given.ppf if of_scipy else given.inv
        ends = np.ravel(np.asarray(quantile(np.array([BEYOND, 1.0 - BEYOND])), dtype=float))
        first, last = np.floor(ends[0]), np.ceil(ends[1])
        if not last - first < MOST_VALUES:
            raise InvalidInput(field, given, allowed)
        values = np.arange(first, last + 1.0)
        # Not the density, which of chaospy.DiscreteUniform does not sum to 1.
        below = np.ravel(given.cdf(np.arange(first - 1.0, last + 1.0)))
        weights = np.diff(below)
        if of_scipy and np.any(given.cdf(np.nextafter(values, -np.inf)) > below[:-1] + BEYOND):
            # Something lies between a number and the one before it.
            raise InvalidInput(field, given, allowed)
    except InvalidInput:
        raise
    except Exception as error:  # Libraries raise anything for numbers that do not fit.
        raise InvalidInput(field, given, f"{allowed} ({error})") from error
    if not abs(weights.sum() - 1.0) < 1e-6:
        raise InvalidInput(f"sum of the probabilities of {field}", float(weights.sum()), "1")
    return Scenarios(values[weights > 0.0].tolist(), weights[weights > 0.0].tolist())
