"""Straight lines by least squares, with standard errors."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike
from scipy.stats import t as student

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.identification.noise import Noise

FEWEST_POINTS = 3
"""Two points lie on a line exactly and say nothing about its error."""


@dataclass(frozen=True)
class LinearFit:
    """The line y = slope x + intercept, by least squares.

    Standard errors and intervals as in Draper and Smith, Applied Regression Analysis, Wiley 1998.

    Attributes
    ----------
    slope, intercept : float
        In the units of y / x and of y.
    slope_error, intercept_error : float
        Standard errors, in the same units.
    degrees_of_freedom : float
        Of the noise estimate behind the standard errors; a pure number.

    Examples
    --------
    >>> fit = fit_line([0.0, 1.0, 2.0, 3.0], [0.1, 1.1, 2.0, 3.1])
    >>> low, high = fit.slope_interval()
    >>> bool(low < fit.slope < high)
    True
    """

    slope: float
    intercept: float
    slope_error: float
    intercept_error: float
    degrees_of_freedom: float

    def slope_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the slope, by Student's t.

        Parameters
        ----------
        level : float
            Probability that it holds the true value, above 0 and below 1.

        Returns
        -------
        tuple of float, length 2
            Lower and upper limit, in the unit of the slope.

        Raises
        ------
        InvalidInput
            For another level.
        """
        return self._interval(self.slope, self.slope_error, level)

    def intercept_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the intercept, length 2, in its unit.

        Parameters and errors as in `slope_interval`.
        """
        return self._interval(self.intercept, self.intercept_error, level)

    def _interval(self, value: float, error: float, level: float) -> tuple[float, float]:
        level = real_number("level", level, above=0.0, below=1.0)
        half = error * float(student.ppf(0.5 + level / 2.0, self.degrees_of_freedom))
        return value - half, value + half


def fit_line(x: ArrayLike, y: ArrayLike, noise: Noise | None = None) -> LinearFit:
    """Fit a line to points by ordinary least squares (Draper and Smith, Wiley 1998).

    The standard errors assume that ``x`` is exact and the noise of ``y`` normal and of one standard
    deviation. Without ``noise`` they take it as independent from point to point and as large as the
    scatter about the line; with it, as given, so that curvature does not pass for noise.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        At least three points, in the order of the record; any units.
    noise : Noise, optional
        Of ``y`` along the record.

    Returns
    -------
    LinearFit

    Raises
    ------
    InvalidInput
        For too few points, unequal lengths, a value that is not finite, or an ``x`` that does not
        vary.

    Examples
    --------
    >>> fit = fit_line([0.0, 1.0, 2.0, 3.0], [1.0, 3.0, 5.0, 7.0])
    >>> print(f"{fit.slope:.1f} {fit.intercept:.1f}")
    2.0 1.0
    """
    x = finite_array("x", x, (None,))
    y = finite_array("y", y, (len(x),))
    n = len(x)
    if n < FEWEST_POINTS:
        raise InvalidInput("number of points", n, f"at least {FEWEST_POINTS}")
    middle = float(x.mean())
    centred = x - middle
    spread = float(centred @ centred)
    if spread == 0.0:
        raise InvalidInput("x", middle, "values that differ, or no slope can be fitted")
    slope = float(centred @ y) / spread
    intercept = float(y.mean()) - slope * middle
    if noise is None:
        residuals = y - slope * x - intercept
        freedom = float(n - 2)
        variance = float(residuals @ residuals) / freedom
    else:
        freedom = noise.degrees_of_freedom
        variance = noise.std**2 * noise.inflation
    return LinearFit(
        slope=slope,
        intercept=intercept,
        slope_error=(variance / spread) ** 0.5,
        intercept_error=(variance * (1.0 / n + middle**2 / spread)) ** 0.5,
        degrees_of_freedom=freedom,
    )
