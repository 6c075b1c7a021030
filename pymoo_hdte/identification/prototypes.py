"""What repeated identifications of several prototypes say of the series (Table 3 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2
from scipy.stats import t as student

from pymoo_hdte.checks import InvalidInput, finite_array, real_number

RunKey = tuple[int, int]
"""Number of the prototype and of the repeat."""


@dataclass(frozen=True)
class NormalSample:
    """Mean and standard deviation of a sample (ddof 1), with standard errors and intervals.

    The intervals are those of Student's t and of chi-square: exact for independent normal values;
    that of the standard deviation fails for others, however large the sample.

    Attributes
    ----------
    n : int
        Size of the sample, at least 2.
    mean, std : float
        In the unit of the sample.

    Examples
    --------
    >>> sample = NormalSample.of(np.array([1.0, 2.0, 3.0]))
    >>> sample.mean, sample.std
    (2.0, 1.0)
    """

    n: int
    mean: float
    std: float

    @classmethod
    def of(cls, values: ArrayLike) -> NormalSample:
        """Describe a sample.

        Parameters
        ----------
        values : array_like, shape (n,)
            At least two, in any unit.

        Returns
        -------
        NormalSample

        Raises
        ------
        InvalidInput
            For fewer than two values, or one that is not finite.
        """
        sample = finite_array("values", values, (None,))
        if len(sample) < 2:
            raise InvalidInput("number of values", len(sample), "at least 2")
        return cls(len(sample), float(sample.mean()), float(sample.std(ddof=1)))

    @property
    def mean_error(self) -> float:
        """Standard error of the mean, in the unit of the sample."""
        return self.std / self.n**0.5

    @property
    def std_error(self) -> float:
        """Standard error of the standard deviation, in its unit, to first order in 1 / n."""
        return self.std / (2.0 * (self.n - 1)) ** 0.5

    @property
    def cv_percent(self) -> float:
        """Coefficient of variation, per cent of the mean's size (Table 3)."""
        return 100.0 * self.std / abs(self.mean) if self.mean else float("inf")

    def mean_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the mean, by Student's t.

        Parameters
        ----------
        level : float
            Probability that it holds the true value, above 0 and below 1.

        Returns
        -------
        tuple of float, length 2
            Lower and upper limit, in the unit of the sample.

        Raises
        ------
        InvalidInput
            For another level.
        """
        level = real_number("level", level, above=0.0, below=1.0)
        half = self.mean_error * float(student.ppf(0.5 + level / 2.0, self.n - 1))
        return self.mean - half, self.mean + half

    def std_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the standard deviation, by chi-square.

        Its two limits, length 2, are in the unit of the sample. Parameters and errors as in
        `mean_interval`.
        """
        level = real_number("level", level, above=0.0, below=1.0)
        tails = chi2.ppf([0.5 + level / 2.0, 0.5 - level / 2.0], self.n - 1)
        low, high = self.std * np.sqrt((self.n - 1) / tails)
        return float(low), float(high)


@dataclass(frozen=True)
class Series:
    """A parameter over the prototypes of one design (Table 3).

    Attributes
    ----------
    prototypes : ndarray, shape (n_prototypes,)
        Mean of each prototype's repeats, in the unit of the parameter and the order of their
        numbers.
    between : NormalSample
        Of these means: overall mean mu_p, inter-prototype std S_p, CV.
    repeatability : float
        Standard deviation of repeats on one prototype, pooled, in the unit of the parameter; NaN
        without repeats.

    Examples
    --------
    >>> found = series({(1, 1): 2.0, (1, 2): 2.2, (2, 1): 3.0, (2, 2): 3.2})
    >>> print(f"{found.between.mean:.1f} {found.repeatability:.2f}")
    2.6 0.14
    """

    prototypes: NDArray[np.float64]
    between: NormalSample
    repeatability: float


def series(values: Mapping[RunKey, float]) -> Series:
    """Summarise one identified value for each (prototype, repeat), as Table 3 does.

    Parameters
    ----------
    values : mapping of (int, int) to float
        By number of the prototype and of the repeat, in one unit.

    Returns
    -------
    Series

    Raises
    ------
    InvalidInput
        For fewer than two prototypes or a value that is not finite.

    Examples
    --------
    >>> found = series({(1, 1): 2.0, (1, 2): 2.2, (2, 1): 3.0, (2, 2): 3.2})
    >>> print(f"{found.between.mean:.1f} {found.repeatability:.2f}")
    2.6 0.14
    """
    by_prototype: dict[int, list[float]] = {}
    for (prototype, repeat), value in values.items():
        checked = real_number(f"value of prototype {prototype}, repeat {repeat}", value)
        by_prototype.setdefault(prototype, []).append(checked)
    groups = [np.array(by_prototype[number]) for number in sorted(by_prototype)]
    if len(groups) < 2:
        raise InvalidInput("number of prototypes", len(groups), "at least 2")
    means = np.array([group.mean() for group in groups])
    freedom = sum(len(group) - 1 for group in groups)
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in groups)
    repeatability = (squares / freedom) ** 0.5 if freedom else float("nan")
    return Series(means, NormalSample.of(means), repeatability)
