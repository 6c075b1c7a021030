"""One uncertain input: its coordinate in -1..1 and its scatter around a design.

The coordinate of a designed variable is z = A(u) + B(u) s with the design u and a scatter s whose
distribution does not depend on it; noise is the same without a design. A polynomial of z then is
one of s, whose expectations are sums over a Gauss rule, exact to rounding.
"""

from __future__ import annotations

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from pymoo_hdte.surrogate._sparse.measures import Discrete, Distribution, Measure

TAIL = 1e-5
"""Share of the probability beyond the interval of an unbounded input on either side."""
LONGEST_TAIL = 4.0
"""Distance from the median to the 1 - 1e-9 quantile over that to the 1 - 1e-3 quantile.

1.9 for a normal, 3.2 for an exponential distribution; set by hand. Where it is larger (log-normal
with a large deviation, Student's t), polynomials of the variable itself have huge moments; its
coordinate then is the standard normal variable of the same probability.
"""

Array = NDArray[np.float64]


class Scatter:
    """The distribution of a deviation or a noise variable, and the interval for its nodes.

    Parameters
    ----------
    distribution : Distribution or Discrete
        Distribution of the variable.
    measure : Measure
        The same as weighted nodes.
    tail : float
        Share of the probability beyond the interval of an unbounded variable on either side.

    Attributes
    ----------
    lower, upper : float
        Interval: the support, or the quantiles of ``tail`` where that goes on for long.
    box : tuple of float
        The interval for `TAIL`: what counts as the worst case.
    cut : Measure
        The measure inside that interval, where there are runs.
    ended : Measure
        The measure with all that lies beyond the interval moved to its ends.
    """

    def __init__(
        self, distribution: Distribution | Discrete, measure: Measure, tail: float = TAIL
    ) -> None:
        self.distribution = distribution
        self.measure = measure
        self.tail = tail
        self.box = self._between(TAIL)
        if isinstance(distribution, Discrete):
            # There are runs at all values: nothing lies beyond them.
            self.lower, self.upper = distribution.lower, distribution.upper
            self.cut = self.ended = measure
            return
        self.lower, self.upper = self._between(tail)
        self.cut, self.ended = measure.inside(self.lower, self.upper)

    def _between(self, tail: float) -> tuple[float, float]:
        """Return the ends of the support, or quantiles of ``tail`` where it goes on for long."""
        p = np.array([1e-3, 0.5, 1.0 - 1e-3, tail, 1.0 - tail])
        low, middle, high, tail_low, tail_high = self.distribution.quantile(p).tolist()
        lower, upper = self.distribution.lower, self.distribution.upper
        if middle - lower > 2.0 * (middle - low):
            lower = tail_low
        if upper - middle > 2.0 * (high - middle):
            upper = tail_high
        return lower, upper

    @property
    def is_heavy(self) -> bool:
        """Whether a tail is longer than `LONGEST_TAIL`; never of single values."""
        if isinstance(self.distribution, Discrete):
            return False
        p = np.array([1e-9, 1e-3, 0.5, 1.0 - 1e-3, 1.0 - 1e-9])
        far_low, low, middle, high, far_high = self.distribution.quantile(p)
        outer_spans = max(middle - far_low, 0.0), max(far_high - middle, 0.0)
        inner_spans = middle - low, high - middle
        return any(
            outer > LONGEST_TAIL * inner
            for outer, inner in zip(outer_spans, inner_spans, strict=True)
        )


def standard_normal(tail: float = TAIL) -> Scatter:
    """Return the scatter of a normal variable of mean 0 and deviation 1."""
    distribution = Distribution("standard normal", scipy.stats.norm())
    return Scatter(distribution, Measure.of("standard normal", distribution), tail)


class Axis:
    """One variable of the surrogate.

    Parameters
    ----------
    name : str
        Name of the variable.
    scatter : Scatter or None
        Scatter of the deviation of a designed variable, or of a noise variable; None for none.
    design : tuple of float or None
        Lower and upper bound of a designed variable in its unit, None for noise.
    relative : bool
        Whether the deviation is a share of the design.
    logarithmic : bool
        Whether the coordinate is the logarithm; only for a positive design that scatters
        relatively or not at all.
    from_normal : FromNormal, optional
        Turns the standard normal coordinate of a noise variable into the variable, and back.

    Attributes
    ----------
    measure, cut, ended : Measure
        Measures of s: the whole, and those of `Scatter`; a single node where nothing scatters.
    """

    def __init__(
        self,
        name: str,
        scatter: Scatter | None,
        design: tuple[float, float] | None = None,
        relative: bool = False,
        logarithmic: bool = False,
        from_normal: FromNormal | None = None,
    ) -> None:
        self.name = name
        self.scatter, self.design = scatter, design
        self.relative, self.logarithmic = relative, logarithmic
        self._from_normal = from_normal
        fixed = Measure(np.zeros(1), np.ones(1))
        measures = [scatter.measure, scatter.cut, scatter.ended] if scatter else [fixed] * 3
        if logarithmic:
            measures = [Measure(np.log1p(measure.nodes), measure.weights) for measure in measures]
        self.measure, self.cut, self.ended = measures
        low, high = self._ends()
        # Of a single value any width will do.
        self.centre, self.half_width = 0.5 * (low + high), 0.5 * (high - low) or 1.0

    @property
    def designed(self) -> bool:
        """Whether the variable has a design."""
        return self.design is not None

    @property
    def discrete(self) -> Discrete | None:
        """The distribution of noise that takes some values only; None for all others."""
        distribution = None if self.scatter is None else self.scatter.distribution
        return distribution if isinstance(distribution, Discrete) else None

    def _ends(self) -> tuple[float, float]:
        """Return the ends of the coordinate before it is brought to -1..1."""
        low, high = (self.scatter.lower, self.scatter.upper) if self.scatter else (0.0, 0.0)
        if self.design is None:
            return low, high
        if self.relative:
            corners = np.outer(self.design, (1.0 + low, 1.0 + high))
        else:
            corners = np.add.outer(self.design, (low, high))
        ends = np.array([corners.min(), corners.max()])
        return tuple((np.log(ends) if self.logarithmic else ends).tolist())

    def cube(self, values: Array) -> Array:
        """Return the coordinate of values of the variable, same shape."""
        if self._from_normal is not None:
            values = self._from_normal.inverse(values)
        values = np.log(values) if self.logarithmic else values
        return (values - self.centre) / self.half_width

    def physical(self, z: Array) -> Array:
        """Return the variable in its unit at coordinates, same shape."""
        values = self.centre + self.half_width * z
        if self.discrete is not None:
            # As given, not as rounding to -1..1 and back makes them.
            return self.discrete.settled(values)
        if self._from_normal is not None:
            return self._from_normal(values)
        return np.exp(values) if self.logarithmic else values

    def around(self, designs: Array | None) -> tuple[Array, Array, Array, Array]:
        """Return A, B and their slopes in the design, shape (n,) each; (1,) for noise."""
        if self.design is None or designs is None:
            zero = np.zeros(1)
            return zero - self.centre / self.half_width, zero + 1.0 / self.half_width, zero, zero
        zero, ones = np.zeros_like(designs), np.ones_like(designs)
        offset, slope = self.cube(designs), ones / self.half_width
        if self.logarithmic:
            return offset, slope, slope / designs, zero
        if self.relative:
            return offset, slope * designs, slope, slope
        return offset, slope, slope, zero

    def sample(self, p: Array) -> Array:
        """Return values of s below which these shares of its probability lie, same shape.

        Values beyond the interval for nodes are moved to its ends.
        """
        if self.scatter is None:
            return np.zeros_like(p)
        values = self.scatter.distribution.quantile(p)
        values = np.clip(values, self.scatter.lower, self.scatter.upper)
        return np.log1p(values) if self.logarithmic else values

    @property
    def is_unbounded(self) -> bool:
        """Whether there is scatter beyond the interval for nodes."""
        return len(self.cut.nodes) != len(self.measure.nodes)

    @property
    def scatter_ends(self) -> tuple[float, float]:
        """Smallest and largest s of the box around a design."""
        if self.scatter is None:
            return 0.0, 0.0
        ends = np.array(self.scatter.box)
        return tuple((np.log1p(ends) if self.logarithmic else ends).tolist())


def discrete_axis(name: str, distribution: Discrete) -> Axis:
    """Return the axis of noise that takes some values only."""
    return Axis(name, Scatter(distribution, distribution.measure))


def noise_axis(name: str, scatter: Scatter) -> Axis:
    """Return the axis of a noise variable, in the normal coordinate if its tail is heavy."""
    if not scatter.is_heavy:
        return Axis(name, scatter)
    return Axis(name, standard_normal(scatter.tail), from_normal=FromNormal(scatter.distribution))


class FromNormal:
    """The value of a variable at that of the standard normal one of the same probability."""

    def __init__(self, distribution: Distribution | Discrete) -> None:
        self._distribution = distribution

    def __call__(self, w: Array) -> Array:
        return self._distribution.quantile(ndtr(w))

    def inverse(self, values: Array) -> Array:
        """Return the standard normal values of the same probability as these, same shape."""
        return ndtri(self._distribution.share_below(values))
