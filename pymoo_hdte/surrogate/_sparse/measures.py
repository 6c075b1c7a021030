"""Distributions of one variable as weighted nodes, and polynomials that are orthonormal there.

Any continuous distribution of `chaospy` or frozen one of `scipy.stats` will do. Its density is
integrated on panels that are halved until that changes nothing, so that kinks and infinite
densities at an end do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate._sparse.unusable import named, unusable
from pymoo_hdte.surrogate.inputs import TruncatedNormal

_NODES_OF_PANEL = 64
_PANEL_ERROR = 1e-13
"""Largest difference of a panel's probability from that of its halves."""
_CONTRADICTION = 1e-4
"""Largest difference from 1 of what the density integrates to; Trunc of chaospy has 2e-6."""
_SHORTEST_PANEL = 1e-11
"""Shortest panel as a share of the support: nodes of a shorter one would be rounded onto an end."""
_NO_VARIANCE = 0.499
"""Exponent of the quantiles of a tail above which it has no variance: 1/2, less rounding."""
_SHORTENS = 0.95
"""Ratio of two such exponents, three decades apart, below which a tail shortens; set by hand."""
_FIRST_QUANTILES = (1e-12, 1e-6, 1e-5, 1e-3, 0.1)


class Distribution:
    """One interface to the continuous distributions of one variable that users know.

    Parameters
    ----------
    field : str
        Name of the distribution in an error.
    given : object
        A distribution of `chaospy`, a frozen one of `scipy.stats`, or a `TruncatedNormal`.

    Attributes
    ----------
    lower, upper : float
        Ends of its support, or where 1e-16 of its probability is left, in the variable's unit.

    Raises
    ------
    InvalidInput
        If it is none of these, discrete, of several variables, not finite or without a variance.
    """

    def __init__(self, field: str, given: Any) -> None:
        if isinstance(given, TruncatedNormal):
            given = _truncated(given)
        wrong = unusable(given)
        if wrong:
            raise InvalidInput(field, given, wrong)
        allowed = "a distribution with a finite, positive scatter"
        # Libraries find impossible numbers when they are asked, and raise anything.
        try:
            self._ask(given)
            spread = self.lower < self.upper and np.isfinite([self.lower, self.upper]).all()
            if spread and self._has_no_variance():
                allowed, spread = "a distribution with a finite variance", False
        except Exception as error:
            raise InvalidInput(field, given, f"{allowed} ({error}){named(given)}") from error
        if not spread:
            raise InvalidInput(field, given, f"{allowed}{named(given)}")

    def _ask(self, given: Any) -> None:
        self._given = given
        from_chaospy = hasattr(given, "inv")
        quantile = "inv" if from_chaospy else "ppf" if hasattr(given, "ppf") else "icdf"
        self._quantile = getattr(given, quantile)
        ends = (given.lower[0], given.upper[0]) if from_chaospy else given.support()
        self.lower, self.upper = (
            float(end if np.isfinite(end) else self._quantile(p))
            for end, p in zip(ends, (1e-16, 1.0 - 1e-16), strict=True)
        )

    def _has_no_variance(self) -> bool:
        """Whether a tail falls so slowly that squares have no mean, as Student's t(2).

        A tail of the power -k has quantiles in proportion to p^(-1/k); k has to be above 2. That of
        a log-normal becomes ever shorter. The libraries' own variances are wrong for some.
        """
        p = np.array([1e-6, 1e-9, 1e-12])
        middle = self.quantile(0.5)
        for distances in (middle - self.quantile(p), self.quantile(1.0 - p) - middle):
            early, late = np.diff(np.log(np.maximum(distances, 1e-300))) / np.log(1e3)
            if late > _NO_VARIANCE and late > _SHORTENS * early:
                return True
        return False

    def quantile(self, p: ArrayLike) -> NDArray[np.float64]:
        """Return the values below which these shares of the probability lie, same shape."""
        values = np.asarray(self._quantile(np.asarray(p, dtype=float)), dtype=float)
        return np.clip(values.reshape(np.shape(p)), self.lower, self.upper)

    def share_below(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probability of smaller values, same shape, dimensionless."""
        points = np.asarray(x, dtype=float)
        return np.asarray(self._given.cdf(points), dtype=float).reshape(points.shape)

    def density(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probability density, same shape, in 1 over the variable's unit."""
        points = np.asarray(x, dtype=float)
        return np.asarray(self._given.pdf(points), dtype=float).reshape(points.shape)


class Discrete:
    """Values with probabilities, under the interface of `Distribution`.

    Parameters
    ----------
    values : ndarray, shape (k,)
        Different values in the variable's unit.
    weights : ndarray, shape (k,)
        Their probabilities, above 0; they sum to 1.

    Attributes
    ----------
    values : ndarray, shape (k,)
        The values in order.
    lower, upper : float
        The first and the last of them.
    measure : Measure
        The same as weighted nodes.
    """

    def __init__(self, values: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
        order = np.argsort(values)
        self.values, self._weights = values[order], weights[order]
        self.lower, self.upper = float(self.values[0]), float(self.values[-1])
        self.measure = Measure(self.values, self._weights)

    def drawn(self, p: ArrayLike, power: float = 1.0) -> NDArray[np.float64]:
        """Return values at shares of a probability in proportion to a power of theirs."""
        below = np.cumsum(self._weights**power)
        place = np.searchsorted(below / below[-1], np.asarray(p, dtype=float))
        return self.values[np.minimum(place, len(self.values) - 1)]

    def quantile(self, p: ArrayLike) -> NDArray[np.float64]:
        """Return the least values at or below which these shares lie, same shape."""
        return self.drawn(p)

    def share_below(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probability of values that are not larger, same shape, dimensionless."""
        count = np.searchsorted(self.values, np.asarray(x, dtype=float), side="right")
        return np.append(0.0, np.cumsum(self._weights))[count]

    def density(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the probabilities of the nearest values, same shape, dimensionless."""
        return self._weights[self._nearest(x)]

    def settled(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return the nearest values, same shape."""
        return self.values[self._nearest(x)]

    def _nearest(self, x: ArrayLike) -> NDArray[np.intp]:
        middles = 0.5 * (self.values[1:] + self.values[:-1])
        return np.searchsorted(middles, np.asarray(x, dtype=float))


def _truncated(normal: TruncatedNormal) -> Any:
    return scipy.stats.truncnorm(-normal.cut, normal.cut, loc=normal.mean, scale=normal.std)


def _panel(distribution: Distribution, low: float, high: float) -> NDArray[np.float64]:
    """Return nodes of one panel and their probabilities, shape (2, q)."""
    nodes, weights = leggauss(_NODES_OF_PANEL)
    x = 0.5 * (low + high) + 0.5 * (high - low) * nodes
    with np.errstate(all="ignore"):
        density = distribution.density(x)
    # Rounded onto an end where the density is infinite.
    return np.array([x, 0.5 * (high - low) * weights * np.where(density < np.inf, density, 0.0)])


@dataclass(frozen=True)
class Measure:
    """Nodes of one variable, shape (q,), and their weights, which sum to 1."""

    nodes: NDArray[np.float64]
    weights: NDArray[np.float64]

    @classmethod
    def of(cls, field: str, distribution: Distribution) -> Measure:
        """Return nodes so many that sums over them are expectations of smooth functions.

        Raises
        ------
        InvalidInput
            If the density does not integrate to 1.
        """
        below = np.array(_FIRST_QUANTILES)
        inner = distribution.quantile([*below, 0.5, *(1.0 - below)])
        edges = np.unique([distribution.lower, *inner, distribution.upper])
        panels = list(pairwise(edges.tolist()))
        shortest = _SHORTEST_PANEL * (distribution.upper - distribution.lower)
        rules = []
        while panels:
            low, high = panels.pop()
            middle = 0.5 * (low + high)
            whole = _panel(distribution, low, high)
            halves = _panel(distribution, low, middle), _panel(distribution, middle, high)
            total, *others = (float(panel[1].sum()) for panel in (whole, *halves))
            if abs(total - sum(others)) < _PANEL_ERROR or high - low < shortest:
                rules.append(whole)
            else:
                panels += [(low, middle), (middle, high)]
        nodes, weights = np.concatenate(rules, axis=1)
        if not abs(weights.sum() - 1.0) < _CONTRADICTION:
            raise InvalidInput(f"integral of the density of {field}", float(weights.sum()), "1")
        order = np.argsort(nodes)
        return cls(nodes[order], weights[order] / weights.sum())

    @property
    def mean(self) -> float:
        """The expectation, in the variable's unit."""
        return float(self.weights @ self.nodes)

    @property
    def std(self) -> float:
        """The standard deviation, in the variable's unit."""
        return float(np.sqrt(self.weights @ (self.nodes - self.mean) ** 2))

    def inside(self, lower: float, upper: float) -> tuple[Measure, Measure]:
        """Return what lies in an interval, and the whole with all beyond moved to the ends."""
        below, above = self.nodes < lower, self.nodes > upper
        within = ~(below | above)
        nodes, weights = self.nodes[within], self.weights[within]
        beyond = [self.weights[below].sum()], [self.weights[above].sum()]
        ended = np.concatenate([[lower], nodes, [upper]])
        cut = Measure(nodes, weights / weights.sum())
        return cut, Measure(ended, np.concatenate([beyond[0], weights, beyond[1]]))


class OrthonormalPolynomials:
    """Polynomials that are orthonormal under a measure, and its Gauss rule.

    Parameters
    ----------
    measure : Measure
        Its distribution. A single node makes the constant the only polynomial.
    degree : int
        Highest degree k.

    Attributes
    ----------
    nodes, weights : ndarray, shape (k + 1,)
        The Gauss rule, exact for polynomials of degree 2 k + 1 under the measure.
    """

    def __init__(self, measure: Measure, degree: int) -> None:
        size = min(degree + 1, len(measure.nodes))
        self._centre, self._scale = measure.mean, measure.std or 1.0
        standard = (measure.nodes - self._centre) / self._scale
        self._diagonal, self._beside = _recurrence(standard, measure.weights, size)
        beside = self._beside[:-1]
        matrix = np.diag(self._diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
        roots, vectors = np.linalg.eigh(matrix)
        self.nodes = self._centre + self._scale * roots
        self.weights = vectors[0] ** 2 / np.sum(vectors[0] ** 2)

    @property
    def size(self) -> int:
        """Number of polynomials."""
        return len(self._diagonal)

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return p_0 .. p_k at the values, shape (k + 1, *values.shape)."""
        x = (values - self._centre) / self._scale
        table = np.ones((self.size, *x.shape))
        for k in range(1, self.size):
            table[k] = (x - self._diagonal[k - 1]) * table[k - 1]
            if k > 1:
                table[k] -= self._beside[k - 2] * table[k - 2]
            table[k] /= self._beside[k - 1]
        return table


def _recurrence(
    nodes: NDArray[np.float64], weights: NDArray[np.float64], size: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return diagonal and off-diagonal of the Jacobi matrix (Lanczos, reorthogonalised)."""
    diagonal, beside = np.zeros(size), np.ones(size)
    vectors = np.zeros((size + 1, len(nodes)))
    vectors[0] = np.sqrt(weights)
    for k in range(size):
        new = nodes * vectors[k]
        diagonal[k] = new @ vectors[k]
        for _ in range(2):
            new -= vectors[: k + 1].T @ (vectors[: k + 1] @ new)
        beside[k] = np.linalg.norm(new)
        vectors[k + 1] = new / beside[k] if beside[k] > 0.0 else 0.0
    return diagonal, beside
