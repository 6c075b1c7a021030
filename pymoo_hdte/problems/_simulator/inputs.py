"""What enters a simulator: designs with their scatter, and noise, independent or dependent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte._unchanging import Unchanging
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.problems._simulator.distributions import joint_distribution
from pymoo_hdte.problems._simulator.kinds_of_noise import Interval, Scenarios, whole_numbers
from pymoo_hdte.surrogate._sparse.axes import (
    TAIL,
    Axis,
    Scatter,
    discrete_axis,
    noise_axis,
    standard_normal,
)
from pymoo_hdte.surrogate._sparse.measures import Distribution, Measure

MOST_INPUTS = 20
SCALES = ("linear", "log")

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Design:
    """A design variable: its bounds, and how a built part deviates from the design.

    Parameters
    ----------
    lower, upper : float
        Bounds of the design in the variable's unit.
    tolerance : float or distribution
        Relative deviation: a number t stands for uniform in -t..t of the design, a distribution of
        `chaospy` or a frozen one of `scipy.stats` is that of the relative deviation.
    deviation : float or distribution
        Absolute deviation in the variable's unit, a number and a distribution alike. Not together
        with ``tolerance``; with neither the variable does not scatter.
    scale : {"linear", "log"}
        ``"log"`` lets the surrogate be a polynomial of the logarithm. It takes fewer runs where the
        bounds differ by a factor of 3 and more and the response is like a power of the variable.

    Raises
    ------
    InvalidInput
        If bounds are not finite and in order, both kinds of deviation are given or one is not
        allowed, the scatter is relative and the bounds do not have one sign, or the logarithm is
        asked for where the variable is not positive or deviates absolutely.

    Examples
    --------
    >>> width = Design(0.02, 0.05, tolerance=0.02)
    >>> width.lower, width.upper
    (0.02, 0.05)
    """

    lower: float
    upper: float
    tolerance: Any = 0.0
    deviation: Any = 0.0
    scale: str = "linear"

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", real_number("lower", self.lower))
        object.__setattr__(self, "upper", real_number("upper", self.upper, above=self.lower))
        one_of("scale", self.scale, SCALES)
        relative = _scatters("tolerance", self.tolerance, below=1.0)
        absolute = _scatters("deviation", self.deviation)
        if relative and absolute:
            raise InvalidInput("deviation", self.deviation, "0 where a tolerance is given")
        if relative and self.lower <= 0.0 <= self.upper:
            allowed = "bounds of one sign where the scatter is relative: at 0 there would be none"
            raise InvalidInput("bounds", (self.lower, self.upper), allowed)
        if self.scale == "log" and (self.lower <= 0.0 or absolute):
            allowed = "'linear' unless lower is above 0 and the deviation relative"
            raise InvalidInput("scale", self.scale, allowed)

    def axis(self, name: str, tail: float = TAIL) -> Axis:
        """Return the variable as the surrogate sees it.

        Parameters
        ----------
        name : str
            Name of the variable.
        tail : float
            As in `Scatter`.

        Returns
        -------
        Axis

        Raises
        ------
        InvalidInput
            If the distribution of the deviation is none, or a tolerance reaches -1.
        """
        relative = _scatters("tolerance", self.tolerance, below=1.0)
        given = self.tolerance if relative else self.deviation
        scatter = None
        if relative or _scatters("deviation", given):
            scatter = _scatter(f"deviation of {name!r}", given, tail)
            if relative and scatter.distribution.lower <= -1.0:
                lowest = scatter.distribution.lower
                raise InvalidInput(f"smallest relative deviation of {name!r}", lowest, "above -1")
        bounds = (self.lower, self.upper)
        return Axis(name, scatter, bounds, relative, logarithmic=self.scale == "log")


def _scatters(field: str, given: Any, below: float = np.inf) -> bool:
    if hasattr(given, "pdf"):
        return True
    return real_number(field, given, at_least=0.0, below=below) > 0.0


def _scatter(field: str, given: Any, tail: float) -> Scatter:
    if not hasattr(given, "pdf"):
        given = scipy.stats.uniform(-float(given), 2.0 * float(given))
    return _measured(field, given, tail)


def _measured(field: str, given: Any, tail: float) -> Scatter:
    distribution = Distribution(field, given)
    return Scatter(distribution, Measure.of(field, distribution), tail)


class Inputs(Unchanging):
    """All inputs of a simulator, as independent axes in -1..1 and as named values.

    Parameters
    ----------
    designs : mapping of str to Design
    noise : mapping
        From a name to its distribution, to `Scenarios` or an `Interval`, or from a tuple of names
        to a joint distribution of `chaospy` or `Scenarios`. Dependent variables are functions of
        independent standard normal ones (inverse Rosenblatt transformation), in which the surrogate
        is a polynomial: of degree one for `chaospy.MvNormal`. Its moments are exact, and its error
        is part of the estimated one.
    tail : float
        Share of the probability beyond the reach of an unbounded scatter on either side.
    designed : bool
        Whether there has to be a design.

    Attributes
    ----------
    designs, noise : dict
        As given, discrete distributions as `Scenarios`.
    axes : list of Axis
        The designs first, in their order. Intervals have designs too.
    names : tuple of str
        Names of the simulator's inputs, in the order of the axes.
    axis_names : tuple of str
        Name of each axis; scenarios of several inputs have one, with the names of all.

    Raises
    ------
    InvalidInput
        If there is no design, a name is none or repeated, there are more than 20 inputs, or a
        distribution is not allowed.
    """

    def __init__(
        self,
        designs: Mapping[str, Design],
        noise: Mapping[Any, Any],
        tail: float = TAIL,
        designed: bool = True,
    ) -> None:
        if not isinstance(designs, Mapping) or (designed and not designs):
            raise InvalidInput("designs", designs, "a mapping of one or more names to a Design")
        if not isinstance(noise, Mapping):
            raise InvalidInput("noise", noise, "a mapping of names to distributions")
        self.designs, self.noise, self.tail = dict(designs), {}, tail
        self.axes: list[Axis] = []
        names: list[str] = []
        for name, design in designs.items():
            if not isinstance(design, Design):
                raise InvalidInput(f"designs[{name!r}]", design, "a Design")
            names.append(name)
            self.axes.append(design.axis(name, tail))
        # Place of the first axis, and what makes several inputs from as many axes or from one.
        self._joint: list[tuple[int, Any]] = []
        self._tables: list[tuple[int, Array]] = []
        for key, given in noise.items():
            group = key if isinstance(key, tuple) else (key,)
            if not isinstance(given, Scenarios | Interval):
                given = whole_numbers(f"noise[{key!r}]", given) or given
            self.noise[key] = given
            self._add_noise(group, given)
            names += group
        words = all(isinstance(name, str) and name for name in names)
        if not words or len(set(names)) < len(names) or len(names) > MOST_INPUTS:
            allowed = f"at most {MOST_INPUTS} different words"
            raise InvalidInput("names of the inputs", tuple(names), allowed)
        self.names = tuple(names)
        self.axis_names = tuple(axis.name for axis in self.axes)

    def _add_noise(self, group: Sequence[str], given: Any) -> None:
        start = len(self.axes)
        if isinstance(given, Scenarios):
            if given.size != len(group):
                allowed = f"scenarios of {len(group)} values, one for each name"
                raise InvalidInput(f"noise[{group!r}]", given, allowed)
            self.axes.append(discrete_axis(", ".join(map(str, group)), given.discrete()))
            if given.size > 1:
                self._tables.append((start, np.array(given.values)))
            return
        if isinstance(given, Interval):
            if len(group) > 1:
                raise InvalidInput(f"noise[{group!r}]", given, "an interval for each name alone")
            self.axes.append(Axis(group[0], None, (given.lower, given.upper)))
            return
        if len(group) == 1:
            scatter = _measured(f"noise[{group[0]!r}]", given, self.tail)
            self.axes.append(noise_axis(group[0], scatter))
            return
        given = joint_distribution(f"noise[{group!r}]", given, len(group))
        if not given.stochastic_dependent:
            for place, name in enumerate(group):
                self._add_noise((name,), given[place])
            return
        self.axes += [Axis(name, standard_normal(self.tail)) for name in group]
        self._joint.append((start, given))

    @property
    def designed(self) -> tuple[str, ...]:
        """Names of the designs, and of the intervals behind them."""
        return tuple(axis.name for axis in self.axes if axis.designed)

    def values(self, cube: Array) -> Array:
        """Return the simulator's inputs in their units at points of -1..1, both shape (n, d)."""
        columns = [axis.physical(z) for axis, z in zip(self.axes, cube.T, strict=True)]
        for start, joint in self._joint:
            place = slice(start, start + len(joint))
            columns[place] = list(
                np.asarray(joint.inv(scipy.special.ndtr(np.array(columns[place]))))
            )
        for start, table in reversed(self._tables):
            columns[start : start + 1] = list(table[columns[start].astype(int)].T)
        return np.column_stack(columns)

    def cube(self, values: Array) -> Array:
        """Return the points of -1..1 of inputs in their units, both shape (n, d).

        Values beyond the reach are beyond -1..1, infinite or NaN.
        """
        columns = list(values.T)
        for start, table in self._tables:
            place = slice(start, start + table.shape[1])
            columns[place] = [_positions(table, np.array(columns[place]).T)]
        for start, joint in self._joint:
            place = slice(start, start + len(joint))
            shares = np.asarray(joint.fwd(np.array(columns[place])))
            columns[place] = list(scipy.special.ndtri(shares))
        with np.errstate(invalid="ignore", divide="ignore"):
            cubes = [axis.cube(v) for axis, v in zip(self.axes, columns, strict=True)]
        return np.column_stack(cubes)

    def reach(self) -> dict[str, tuple[float, float]]:
        """Return smallest and largest value at which the simulator will be called, by name.

        For dependent noise, they are taken along the lines through its centre.
        """
        points = [np.diag(np.full(len(self.axes), side)) for side in (-1.0, 1.0)]
        for start, table in self._tables:
            points.append(np.zeros((len(table), len(self.axes))))
            points[-1][:, start] = self.axes[start].cube(np.arange(float(len(table))))
        extremes = self.values(np.vstack(points))
        lows, highs = extremes.min(axis=0).tolist(), extremes.max(axis=0).tolist()
        return dict(zip(self.names, zip(lows, highs, strict=True), strict=True))


def _positions(table: Array, rows: Array) -> Array:
    """Return the positions of rows in a table, shape (n,); NaN where they are none of its."""
    same = np.all(np.isclose(rows[:, None], table[None], rtol=1e-9, atol=0.0), axis=2)
    return np.where(same.any(axis=1), np.argmax(same, axis=1), np.nan)
