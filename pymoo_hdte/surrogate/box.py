"""The box of physical variables on which a polynomial is known, and its map to the unit cube."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array

# Points computed from the bounds themselves miss them by a few roundings; those are accepted.
_EDGE = 1e-12

_PRINTED_DIGITS = 4
_LARGEST_MOVE = 0.01
"""Share of a half-width that no rounding to print may exceed: four digits tell such ends apart."""

LARGEST = 1e150
"""Largest size of bounds and coefficients; its square is still finite."""


class ExtrapolationError(InvalidInput):
    """A point lies outside the box on which a polynomial was built.

    Attributes as in `pymoo_hdte.checks.InvalidInput`: the variable, its value and its interval.

    Examples
    --------
    >>> box = Box(("x",), np.array([0.0]), np.array([1.0]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0], box, 1)
    >>> try:
    ...     _ = surrogate(np.array([[2.0]]))
    ... except ExtrapolationError as error:
    ...     print(error.field)
    ...
    x
    """


@dataclass(frozen=True, eq=False)
class Box:
    """A product of intervals, one for each named variable.

    Parameters
    ----------
    names : tuple of str, length d
        Distinct names of the variables.
    lower, upper : array_like, shape (d,)
        Finite bounds in the variables' own units, ``lower < upper`` everywhere.

    Raises
    ------
    InvalidInput
        If names repeat or are no words, or bounds are not finite, in order and of length d, or
        beyond +-1e150.

    Attributes
    ----------
    centre, half_width : ndarray, shape (d,)
        Midpoint and half the length of every interval, in the variables' own units.

    Examples
    --------
    >>> box = Box(("K", "J"), np.array([1.0, 0.1]), np.array([3.0, 0.3]))
    >>> box.from_cube(np.zeros((1, 2)))
    array([[2. , 0.2]])
    """

    names: tuple[str, ...]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    centre: NDArray[np.float64] = field(init=False, repr=False)
    half_width: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        names = _distinct_names(self.names)
        lower = finite_array("lower", self.lower, (len(names),))
        upper = finite_array("upper", self.upper, (len(names),))
        for name, low, high in zip(names, lower, upper, strict=True):
            if not low < high:
                raise InvalidInput(f"upper[{name!r}]", float(high), f"above lower = {low!s}")
            if 0.5 * high - 0.5 * low == 0.0 or max(-low, high) > LARGEST:
                allowed = f"apart by more than the smallest number, within +-{LARGEST:g}"
                raise InvalidInput(f"bounds of {name!r}", (float(low), float(high)), allowed)
        object.__setattr__(self, "names", names)
        arrays = {
            "lower": lower,
            "upper": upper,
            "centre": 0.5 * (lower + upper),
            "half_width": 0.5 * (upper - lower),
        }
        for attribute, array in arrays.items():
            array.flags.writeable = False
            object.__setattr__(self, attribute, array)

    def __len__(self) -> int:
        """Return the number of variables d."""
        return len(self.names)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Box):
            return NotImplemented
        return (
            self.names == other.names
            and np.array_equal(self.lower, other.lower)
            and np.array_equal(self.upper, other.upper)
        )

    def to_cube(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map points of the box to the cube [-1, 1]^d (inverse of Eq. 25).

        Parameters
        ----------
        points : array_like, shape (n, d)
            Physical units. A point outside by less than 1e-12 of the half-width counts as on
            the boundary.

        Returns
        -------
        ndarray, shape (n, d)
            Dimensionless, -1 to 1.

        Raises
        ------
        ExtrapolationError
            If a point lies outside the box or is NaN; names the variable and its interval.
        InvalidInput
            If ``points`` is no array of numbers of shape (n, d).
        """
        physical = self._as_points(points)
        # One variable per contiguous row: every later step works variable by variable.
        cube = np.subtract(physical.T, self.centre[:, None], order="C")
        cube /= self.half_width[:, None]
        farthest = np.abs(cube).max(initial=0.0)
        if not farthest <= 1.0:
            if not farthest <= 1.0 + _EDGE:
                self._refuse(physical, cube.T)
            np.clip(cube, -1.0, 1.0, out=cube)
        return cube.T

    def from_cube(self, cube: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map points of the cube [-1, 1]^d to the box (Eq. 25).

        Parameters
        ----------
        cube : ndarray, shape (n, d)
            Dimensionless.

        Returns
        -------
        ndarray, shape (n, d)
            In the variables' own units.
        """
        return self.centre + self.half_width * cube

    def check_inside(self, points: ArrayLike) -> None:
        """Raise an error unless all points lie in the box.

        Parameters and errors as in `to_cube`.
        """
        self.to_cube(points)

    def settle(self, points: ArrayLike) -> NDArray[np.float64]:
        """Move points that rounding to print has put outside onto the boundary.

        A table gives 3.229e4 for an upper bound of 32287.5. A value outside by at most half a
        unit of the fourth significant digit of the bound, and by at most 1 % of the half-width,
        is therefore taken for the bound. Nothing is extrapolated.

        Parameters
        ----------
        points : array_like, shape (n, d)
            Physical units.

        Returns
        -------
        ndarray, shape (n, d)
            Points of the box in the variables' own units; those inside as they were.

        Raises
        ------
        ExtrapolationError
            If a point lies farther outside or is NaN; names the variable and its interval.
        InvalidInput
            If ``points`` is no array of numbers of shape (n, d).
        """
        physical = self._as_points(points)
        inside = np.clip(physical, self.lower, self.upper)
        if np.array_equal(inside, physical):
            return physical
        below, above = (
            np.minimum(_half_unit(bound), _LARGEST_MOVE * self.half_width)
            for bound in (self.lower, self.upper)
        )
        touching = (physical >= self.lower - below) & (physical <= self.upper + above)
        settled = np.where(touching, inside, physical)
        self.check_inside(settled)
        return settled

    def _as_points(self, points: ArrayLike) -> NDArray[np.float64]:
        wanted = f"numbers of shape (n, {len(self)})"
        try:
            array = np.asarray(points, dtype=float)
        except (TypeError, ValueError):
            raise InvalidInput("points", points, wanted) from None
        if array.ndim != 2 or array.shape[1] != len(self):
            raise InvalidInput("shape of points", array.shape, wanted)
        return array

    def _refuse(self, physical: NDArray[np.float64], cube: NDArray[np.float64]) -> None:
        row, column = np.argwhere(~(np.abs(cube) <= 1.0 + _EDGE))[0]
        raise ExtrapolationError(
            self.names[column],
            float(physical[row, column]),
            f"{self.lower[column]!s} to {self.upper[column]!s} (row {row} of the points)",
        )


def corners(
    ends: NDArray[np.float64], most: int, random_state: int | np.random.Generator = 0
) -> NDArray[np.float64]:
    """Return all corners of a box with ends of shape (d, 2), or so many by chance, shape (k, d)."""
    moving = np.flatnonzero(ends[:, 0] < ends[:, 1])
    if 2 ** len(moving) <= most:
        sides = np.array(list(product((0, 1), repeat=len(moving))), dtype=int)
    else:
        sides = np.random.default_rng(random_state).integers(0, 2, (most, len(moving)))
    chosen = np.tile(ends[:, 0], (len(sides), 1))
    chosen[:, moving] = ends[moving, sides]
    return chosen


def _half_unit(bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return half a unit of the last printed digit of each bound, 0 for a bound of 0."""
    shown = [f"{bound:.{_PRINTED_DIGITS - 1}e}" for bound in bounds]
    units = np.array(
        [10.0 ** (int(text.partition("e")[2]) - _PRINTED_DIGITS + 1) for text in shown]
    )
    # A tie is rounded by exactly half a unit, which the binary numbers miss by a rounding.
    return np.where(bounds == 0.0, 0.0, 0.5 * (1.0 + 1e-9) * units)


def _distinct_names(names: Any) -> tuple[str, ...]:
    allowed = "one or more distinct, non-empty words"
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InvalidInput("names", names, allowed)
    words = tuple(names)
    if not words or not all(isinstance(word, str) and word for word in words):
        raise InvalidInput("names", words, allowed)
    if len(set(words)) < len(words):
        raise InvalidInput("names", words, allowed)
    return words
