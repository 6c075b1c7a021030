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
    """

    n: int
    mean: float
    std: float

    @classmethod
    def of(cls, values: ArrayLike) -> NormalSample:
        """Describe a sample, shape (n,); `InvalidInput` if n < 2 or a value is not finite."""
        sample = finite_array("values", values, (None,))
        if len(sample) < 2:
            raise InvalidInput("number of values", len(sample), "at least 2")
        return cls(len(sample), float(sample.mean()), float(sample.std(ddof=1)))

    @property
    def mean_error(self) -> float:
        """Standard error of the mean."""
        return self.std / self.n**0.5

    @property
    def std_error(self) -> float:
        """Standard error of the standard deviation, to first order in 1 / n."""
        return self.std / (2.0 * (self.n - 1)) ** 0.5

    @property
    def cv_percent(self) -> float:
        """Coefficient of variation, per cent of the mean's size."""
        return 100.0 * self.std / abs(self.mean)

    def mean_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the mean."""
        level = real_number("level", level, above=0.0, below=1.0)
        half = self.mean_error * float(student.ppf(0.5 + level / 2.0, self.n - 1))
        return self.mean - half, self.mean + half

    def std_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the standard deviation."""
        level = real_number("level", level, above=0.0, below=1.0)
        tails = chi2.ppf([0.5 + level / 2.0, 0.5 - level / 2.0], self.n - 1)
        low, high = self.std * np.sqrt((self.n - 1) / tails)
        return float(low), float(high)


@dataclass(frozen=True)
class Series:
    """A parameter over the prototypes of one design.

    Attributes
    ----------
    prototypes : ndarray, shape (n_prototypes,)
        Mean of each prototype's repeats, in the order of their numbers.
    between : NormalSample
        Of these means: overall mean mu_p, inter-prototype std S_p, CV.
    repeatability : float
        Standard deviation of repeats on one prototype, pooled; NaN without repeats.
    """

    prototypes: NDArray[np.float64]
    between: NormalSample
    repeatability: float


def series(values: Mapping[RunKey, float]) -> Series:
    """Summarise one identified value for each (prototype, repeat).

    Raises
    ------
    InvalidInput
        For fewer than two prototypes or a value that is not finite.
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
