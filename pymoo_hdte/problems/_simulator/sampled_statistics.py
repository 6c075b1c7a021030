"""Statistics that are read off samples of the surrogate around a design.

Where the 4096 common samples resolve them, off these; where they do not, off samples by importance
of every design (`Tail`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.problems._simulator.around import Around, sampling_error
from pymoo_hdte.problems._simulator.crashes import NONE_OF
from pymoo_hdte.problems._simulator.statistics import Probability, Statistic, reach_of
from pymoo_hdte.problems._simulator.tails import SMALLEST, Tail, Z, near_quantile, quantile_above
from pymoo_hdte.surrogate._rare.events import Event, Limit

Array = NDArray[np.float64]

FEWEST = 10
"""Draws that have to lie beyond a quantile: ten have an error of a third."""
UNBOUNDED = 1e-6
"""Probability that is to be resolved where an event is an objective, or has no bound yet."""


def _probability(field: str, given: float, lowest: float, highest: float) -> float:
    share = real_number(field, given)
    if not lowest <= share <= highest:
        allowed = f"{lowest:g} to {f'1 - {SMALLEST:g}' if highest < 1.0 else '1'}"
        raise InvalidInput(field, share, allowed)
    return share


def _ordered(values: Array, weights: Array, order: Any) -> tuple[Array, Array]:
    """Return values in an order, and the sum of their weights up to each, shape (n, k) each."""
    summed = np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1)
    return np.take_along_axis(values, order, axis=1), summed


@dataclass(frozen=True)
class _TailStatistic(Statistic):
    """A statistic beyond a probability, whose band has the error of sampling."""

    p: float

    def rarest(self, bound: float | None = None) -> float:
        """Return the least probability that it asks for, dimensionless.

        Parameters
        ----------
        bound : float, optional
            As which constraint it is met, in its unit.
        """
        return min(self.p, 1.0 - self.p)

    def _value(self, around: Around) -> tuple[Array, Array]:
        if around.weights is not None:
            return self._of_weighted(*around.samples, around.weights / len(around.samples[1]))
        if self._common_serve(around):
            return self._of_common(around)
        tails = [self._of_tail(*self._tail(around, row)) for row in range(len(around.mean))]
        values, slopes, _ = zip(*tails, strict=True)
        return np.array(values), np.array(slopes)

    def _half_width(self, around: Around) -> Array:
        if around.weights is not None:
            # What is open about success has the error of sampling.
            value, sampling = self._value(around)[0], np.zeros_like(around.mean)
        elif self._common_serve(around):
            value = self._of_common(around)[0]
            parts = np.array([self._of_common(part)[0] for part in around.quarters()])
            sampling = sampling_error(parts)
        else:
            tails = [self._of_tail(*self._tail(around, row)) for row in range(len(around.mean))]
            value, sampling = (np.array([tail[place] for tail in tails]) for place in (0, 2))
        return around.mean_error + reach_of(value, around) * around.std_error + sampling

    def _common_serve(self, around: Around) -> bool:
        return 1.0 - self.p >= around.resolved

    @property
    def _side(self) -> float:
        return 1.0

    def _tail(self, around: Around, row: int) -> tuple[Tail, Array, float]:
        """Return samples around one design, the response there times its side, and the share."""
        share, side = self.rarest(), self._side
        name = next(name for name, other in around.beside.items() if other is around)
        tail = around.tail(
            row,
            lambda values: side * values[name],
            lambda values, weights: quantile_above(values, weights, share),
        )
        return tail, side * tail.values[name], share

    def _of_common(self, around: Around) -> tuple[Array, Array]:
        raise NotImplementedError

    def _of_weighted(self, values: Array, basis: Array, weights: Array) -> tuple[Array, Array]:
        """Return value and slope from samples of weights that sum to 1, shape (n, k)."""
        raise NotImplementedError

    def _of_tail(self, tail: Tail, values: Array, share: float) -> tuple[float, Array, float]:
        """Return value, slope in the expansion and sampling error, from samples of one design."""
        raise NotImplementedError


@dataclass(frozen=True)
class Quantile(_TailStatistic):
    """The value below which a response stays with a given probability, sampled on the surrogate.

    Parameters
    ----------
    p : float
        Probability, 1e-9 to 1 - 1e-9.
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
        object.__setattr__(self, "p", _probability("p", self.p, SMALLEST, 1.0 - SMALLEST))

    def _common_serve(self, around: Around) -> bool:
        return self.rarest() >= around.resolved

    @property
    def _side(self) -> float:
        return 1.0 if self.p > 0.5 else -1.0

    def _of_tail(self, tail: Tail, values: Array, share: float) -> tuple[float, Array, float]:
        weights = tail.sample.weights
        value = quantile_above(values, weights, share)
        _, error = tail.sample.mean(values > value)
        ends = [
            quantile_above(values, weights, share * np.exp(side * Z * error / share))
            for side in (-1.0, 1.0)
        ]
        slope = near_quantile(values, weights, value, share) @ tail.polynomials
        return self._side * value, slope, 0.5 * abs(ends[0] - ends[1])

    def _of_weighted(self, values: Array, basis: Array, weights: Array) -> tuple[Array, Array]:
        order = np.argsort(values, axis=1)
        ordered, below = _ordered(values, weights, order)
        # Between the middles of two samples, as without weights.
        middles = below - 0.5 * np.take_along_axis(weights, order, axis=1)
        high = np.clip(np.sum(middles < self.p, axis=1), 1, values.shape[1] - 1)[:, None]
        ends = [np.take_along_axis(middles, high - step, axis=1) for step in (1, 0)]
        share = np.clip((self.p - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
        low_value, high_value = (
            np.take_along_axis(ordered, high - step, axis=1) for step in (1, 0)
        )
        slope = [basis[np.take_along_axis(order, high - step, axis=1)[:, 0]] for step in (1, 0)]
        value = (1.0 - share) * low_value + share * high_value
        return value[:, 0], (1.0 - share) * slope[0] + share * slope[1]

    def _of_common(self, around: Around) -> tuple[Array, Array]:
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
        Probability of the values that are left out, above 0 and at most 1 - 1e-9.
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
        object.__setattr__(self, "p", _probability("p", self.p, 0.0, 1.0 - SMALLEST))

    def rarest(self, bound: float | None = None) -> float:
        """Return the least probability that it asks for, dimensionless.

        Parameters
        ----------
        bound : float, optional
            As which constraint it is met, in its unit.
        """
        return 1.0 - self.p

    def _of_tail(self, tail: Tail, values: Array, share: float) -> tuple[float, Array, float]:
        weights = tail.sample.weights
        value = quantile_above(values, weights, share)
        # Rockafellar and Uryasev's form has no slope in the quantile: its error does not matter.
        beyond = weights * (values > value) / (share * len(values))
        _, error = tail.sample.mean(np.maximum(values - value, 0.0))
        mean = value + float(beyond @ (values - value))
        slope = beyond @ tail.polynomials / max(float(beyond.sum()), np.finfo(float).tiny)
        return mean, slope, Z * error / share

    def _of_weighted(self, values: Array, basis: Array, weights: Array) -> tuple[Array, Array]:
        order = np.argsort(-values, axis=1)
        largest, above = _ordered(values, weights, order)
        own = np.take_along_axis(weights, order, axis=1)
        counts = np.clip(1.0 - self.p - (above - own), 0.0, own) / (1.0 - self.p)
        share = np.zeros_like(values)
        np.put_along_axis(share, order, counts, axis=1)
        return np.sum(largest * counts, axis=1), share @ basis

    def _of_common(self, around: Around) -> tuple[Array, Array]:
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
class FailureProbability(Probability):
    """The probability that a response is beyond a limit, or of a joint event; without a gradient.

    Sampled on the surrogate, by importance where it is below 0.1. As a constraint its bound is
    1e-9 to 1 - 1e-9; as an objective it is resolved down to 1e-6. The inputs' reach grows with what
    is asked for, and with it the runs.

    Parameters
    ----------
    above, below : float or None
        The limit, in the response's unit.
    response : str or None
        Name of the response; None for the only one.
    event : Event or None
        An event of one or several responses, as ``(Response("stress") > 250e6) |
        (Response("margin") < 0.0)``; in the place of limit and response.
    sign : float
        Dimensionless factor: -1 to maximise, which ``-statistic`` sets.

    Raises
    ------
    InvalidInput
        If an argument is not in its range, or not exactly one of limits and event is given.

    Examples
    --------
    >>> FailureProbability(above=250e6, response="stress").above
    250000000.0
    """

    above: float | None = None
    below: float | None = None
    event: Event | None = None

    def __post_init__(self) -> None:
        given = self.above, self.below, self.event
        if sum(part is not None for part in given) != 1:
            raise InvalidInput("above, below and event", given, "exactly one of them")
        if self.event is not None and not isinstance(self.event, Event):
            allowed = "an event, as Response('stress') > 250e6 makes it"
            raise InvalidInput("event", self.event, allowed)
        if self.event is not None and self.response is not None:
            raise InvalidInput("response", self.response, "None: the event names its own")
        for name in ("above", "below"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, real_number(name, getattr(self, name)))

    @property
    def failure(self) -> Event:
        """The event."""
        if self.event is not None:
            return self.event
        side = -1.0 if self.above is None else 1.0
        bound = self.below if self.above is None else self.above
        return Limit(self.response, float(bound or 0.0), side)

    @property
    def responses(self) -> tuple[str | None, ...]:
        """Names of the responses it belongs to; None for the only one."""
        return self.failure.responses

    def rarest(self, bound: float | None = None) -> float:
        """Return the least probability that it asks for, dimensionless.

        Parameters
        ----------
        bound : float, optional
            As which constraint it is met, in its unit.
        """
        return UNBOUNDED if bound is None else min(bound, 1.0 - bound)

    def _value(self, around: Around) -> tuple[Array, Array]:
        return self._shares(around)[0], np.zeros((0, 0))

    def _bound(self, bound: float) -> float:
        return _probability("bound of a probability", bound, SMALLEST, 1.0 - SMALLEST)

    def _shares(self, around: Around, slack: Any = None) -> tuple[Array, Array]:
        """Return probabilities with the responses nearer to their limits or not, and their errors.

        Both have shape (k, n); of k slacks, or shape (n,) without any.
        """
        slacks = [None] if slack is None else slack
        weights = 1.0 if around.weights is None else around.weights
        values = {name: around.beside[name].samples[0] for name in self.responses}
        wide = [
            part and {name: of_name[:, None] for name, of_name in part.items()} for part in slacks
        ]
        margins = [self.failure.margin(values, part) for part in wide]
        shares = np.array([np.mean(weights * (margin > 0.0), axis=1) for margin in margins])
        errors = Z * np.sqrt(np.maximum(shares * (1.0 - shares), 0.0) / len(around.samples[1]))
        errors = np.maximum(errors, NONE_OF / len(around.samples[1]))
        rare = np.minimum(shares[0], 1.0 - shares[0]) < around.often
        for row in () if around.common_alone else np.flatnonzero(rare):
            side = 1.0 if shares[0, row] < 0.5 else -1.0
            tail = around.tail(int(row), partial(self._signed, side))
            for place, part in enumerate(slacks):
                own = part and {name: of_name[row] for name, of_name in part.items()}
                beyond = side * self.failure.margin(tail.values, own) > 0.0
                share, error = tail.sample.mean(beyond)
                shares[place, row] = share if side > 0.0 else 1.0 - share
                errors[place, row] = Z * error
        return (shares[0], errors[0]) if slack is None else (shares, errors)

    def _signed(self, side: float, values: Mapping[str | None, Array]) -> Array:
        return side * self.failure.margin(values)

    def _half_width(self, around: Around) -> Array:
        # How far it moves if the responses are off by their errors, plus the error of sampling.
        nearer: dict[str | None, Array] = {}
        for limit in self.failure.limits:
            response = around.beside[limit.response]
            apart = np.maximum(reach_of(limit.bound, response), 1.0)
            off = response.mean_error + apart * response.std_error
            nearer[limit.response] = np.maximum(nearer.get(limit.response, 0.0), off)
        slacks = [None, nearer, {name: -off for name, off in nearer.items()}]
        shares, errors = self._shares(around, slacks)
        moved = np.max(np.abs(shares[1:] - shares[0]), axis=0)
        return np.maximum(moved + errors[0], SMALLEST)
