"""Algorithms ranked over many problems: Friedman and Nemenyi.

The tests are those of Demsar, "Statistical comparisons of classifiers over multiple data sets",
J. Mach. Learn. Res. 7 (2006) 1-30. Indicators come as arrays of shape (problems, algorithms), or
(problems, algorithms, seeds) where single runs count. A value that is not finite marks a run that
failed, and a failed run is worse than any other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2, rankdata, studentized_range
from scipy.stats import f as fisher

from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte.checks import InvalidInput, real_number, whole_number

OF_PROBLEMS = ("problems", "algorithms")
OF_RUNS = (*OF_PROBLEMS, "seeds")

RESAMPLES = 1000
"""Bootstrap samples: the ends of a 95 % interval then rest on 25 of them each."""


class Friedman(NamedTuple):
    """Whether the algorithms differ at all: Friedman's chi-square, Iman and Davenport's F."""

    chi_square: float
    chi_square_p: float
    f: float
    f_p: float


def medians(values: ArrayLike, *, smaller_is_better: bool) -> NDArray[np.float64]:
    """Return the median (problems, algorithms) of runs (problems, algorithms, seeds).

    It is infinite where so many runs failed that the median run did.
    """
    middle = np.median(costs_of(values, smaller_is_better, OF_RUNS), axis=-1)
    return middle if smaller_is_better else -middle


def problem_ranks(values: ArrayLike, *, smaller_is_better: bool) -> NDArray[np.float64]:
    """Rank the algorithms on each problem: 1 is the best, ties share the mean of their ranks.

    Parameters
    ----------
    values : array_like, shape (problems, algorithms)
        One indicator; NaN and infinities are failures, which share the last ranks.
    smaller_is_better : bool
        Whether the indicator is a cost (IGD) or a merit (hypervolume).

    Raises
    ------
    InvalidInput
        For another shape, or without problems or algorithms.
    """
    return rankdata(costs_of(values, smaller_is_better, OF_PROBLEMS), axis=1)


def average_ranks(values: ArrayLike, *, smaller_is_better: bool) -> NDArray[np.float64]:
    """Return the mean over the problems of `problem_ranks`, shape (algorithms,)."""
    return problem_ranks(values, smaller_is_better=smaller_is_better).mean(axis=0)


def friedman(values: ArrayLike, *, smaller_is_better: bool) -> Friedman:
    """Test whether all algorithms rank alike (Demsar's Section 3.2.2).

    Ties are not corrected for, as with Demsar: with ties, `scipy.stats.friedmanchisquare` gives a
    larger chi-square, and the p-values here err on the safe side. The F test of Iman and Davenport
    (Commun. Stat. 9, 1980) is the sharper of the two; where all problems agree, F is infinite.

    Raises `InvalidInput` for fewer than two problems or algorithms, and for what `problem_ranks`
    refuses.
    """
    ranks = problem_ranks(values, smaller_is_better=smaller_is_better)
    n, k = ranks.shape
    if n < 2 or k < 2:
        raise InvalidInput("shape of values", ranks.shape, "at least two problems and algorithms")
    deviations = ranks.mean(axis=0) - (k + 1) / 2
    chi_square = float(12 * n / (k * (k + 1)) * np.sum(deviations**2))
    agreement = chi_square / (n * (k - 1))
    # Rounding may leave the largest agreement on either side of 1.
    f = (n - 1) * agreement / (1 - agreement) if agreement < 1 - 1e-12 else np.inf
    f_p = float(fisher.sf(f, k - 1, (k - 1) * (n - 1)))
    return Friedman(chi_square, float(chi2.sf(chi_square, k - 1)), f, f_p)


def nemenyi_difference(n_algorithms: int, n_problems: int, level: float = SIGNIFICANT) -> float:
    """Return how far two average ranks must lie apart to differ (Nemenyi; Demsar's Section 3.2.2).

    The critical value is that of the studentized range over infinitely many degrees of freedom,
    divided by sqrt(2); the chance that any two of equal algorithms differ so much is ``level``.

    Raises
    ------
    InvalidInput
        For fewer than two algorithms or one problem, or a level outside (0, 1).
    """
    k = whole_number("n_algorithms", n_algorithms, 2)
    n = whole_number("n_problems", n_problems, 1)
    level = real_number("level", level, above=0.0, below=1.0)
    critical = studentized_range.isf(level, k, np.inf) / np.sqrt(2.0)
    return float(critical * np.sqrt(k * (k + 1) / (6 * n)))


def cliques(average_ranks: ArrayLike, difference: float) -> list[tuple[int, ...]]:
    """Return the largest groups of algorithms whose average ranks (k,) lie less than that apart.

    The groups hold indices, best first, and stand in the order of their best members. Every
    algorithm is in one, alone if need be; none lies within another. Raises `InvalidInput` for
    a difference that is not above zero.
    """
    difference = real_number("difference", difference, above=0.0)
    ranks = np.asarray(average_ranks, dtype=float)
    order = np.argsort(ranks, kind="stable")
    ends = np.searchsorted(ranks[order], ranks[order] + difference)
    groups, reached = [], 0
    for start, end in enumerate(ends.tolist()):
        if end > reached:
            groups.append(tuple(order[start:end].tolist()))
            reached = end
    return groups


def rank_intervals(
    values: ArrayLike, rng: np.random.Generator, *, smaller_is_better: bool
) -> NDArray[np.float64]:
    """Return 95 % intervals of the average ranks of the median runs, bootstrapped over the seeds.

    They say how much the ranks depend on the seeds, not on the choice of problems. The runs of
    every problem and algorithm are resampled on their own. Resampled medians scatter more than
    the medians themselves, so the intervals lean towards the middle rank; with 21 seeds, 35
    problems and 12 algorithms they held 95 to 96 % of the true ranks of simulated benchmarks.

    Parameters
    ----------
    values : array_like, shape (problems, algorithms, seeds)
        One indicator of every run; runs that are not finite failed.
    rng : numpy.random.Generator
        Draws the resamples.
    smaller_is_better : bool
        See `problem_ranks`.

    Returns
    -------
    ndarray, shape (algorithms, 2)
        Lower and upper ends.
    """
    costs = costs_of(values, smaller_is_better, OF_RUNS)
    means = np.empty((RESAMPLES, costs.shape[1]))
    for mean in means:
        drawn = rng.integers(costs.shape[-1], size=costs.shape)
        resampled = np.median(np.take_along_axis(costs, drawn, axis=-1), axis=-1)
        mean[:] = rankdata(resampled, axis=1).mean(axis=0)
    return np.quantile(means, (SIGNIFICANT / 2, 1 - SIGNIFICANT / 2), axis=0).T


def costs_of(
    values: ArrayLike, smaller_is_better: bool, axes: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return indicators as costs, infinite for failed runs, whose axes have been checked."""
    numbers = np.asarray(values, dtype=float)
    if numbers.ndim != len(axes) or not numbers.size:
        raise InvalidInput("shape of values", numbers.shape, f"({', '.join(axes)})")
    return np.where(np.isfinite(numbers), numbers if smaller_is_better else -numbers, np.inf)
