"""Algorithms ranked over many problems: Friedman, Nemenyi, and tests of one against the others.

The tests are those of Demsar, "Statistical comparisons of classifiers over multiple data sets",
J. Mach. Learn. Res. 7 (2006) 1-30. Indicators come as arrays of shape (problems, algorithms), or
(problems, algorithms, seeds) where single runs count. A value that is not finite marks a run that
failed, and a failed run is worse than any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2, mannwhitneyu, rankdata, studentized_range
from scipy.stats import f as fisher

from experiments.comparison.paired import SIGNIFICANT
from experiments.comparison.statistics import holm, wilcoxon_p
from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number

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


class RivalTest(NamedTuple):
    """A control against one rival: p after Holm, and on how many problems it is better, worse.

    ``ahead`` is whether the signed ranks, which p is about, favour the control.
    """

    rival: str
    p: float
    better: int
    worse: int
    ahead: bool

    @property
    def beaten(self) -> bool:
        """Whether the control is better than this rival beyond chance."""
        return self.ahead and self.p < SIGNIFICANT


class WinTieLoss(NamedTuple):
    """On how many problems a control beats a rival significantly, does not differ, or loses."""

    rival: str
    wins: int
    ties: int
    losses: int


def medians(values: ArrayLike, *, smaller_is_better: bool) -> NDArray[np.float64]:
    """Return the median (problems, algorithms) of runs (problems, algorithms, seeds).

    It is infinite where so many runs failed that the median run did.
    """
    middle = np.median(_costs(values, smaller_is_better, OF_RUNS), axis=-1)
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
    return rankdata(_costs(values, smaller_is_better, OF_PROBLEMS), axis=1)


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


def holm_against(
    control: str, algorithms: Sequence[str], values: ArrayLike, *, smaller_is_better: bool
) -> list[RivalTest]:
    """Test one algorithm against each other by Wilcoxon's signed ranks over the problems.

    The test orders the problems by the size of the difference, so differences must mean the same
    on all of them: hand over normalised indicators, or logarithms to weigh their ratios. A
    difference to a failed run outweighs all others; problems on which both are equal, or both
    failed, are dropped.

    Parameters
    ----------
    control : str
        One of ``algorithms``.
    algorithms : sequence of str
        Names of the columns of ``values``.
    values, smaller_is_better
        See `problem_ranks`.

    Returns
    -------
    list of RivalTest
        In the order of ``algorithms``; p after Holm's correction over all rivals.

    Raises
    ------
    InvalidInput
        For a control or names that do not fit, and what `problem_ranks` refuses.
    """
    ours, theirs, rivals = _opponents(
        control, algorithms, _costs(values, smaller_is_better, OF_PROBLEMS)
    )
    gains = [_gain(ours, cost) for cost in theirs]
    p = holm([wilcoxon_p(gain, np.zeros_like(gain)) for gain in gains])
    return [
        RivalTest(
            rival, float(adjusted), int(np.sum(gain > 0)), int(np.sum(gain < 0)), _ahead(gain)
        )
        for rival, adjusted, gain in zip(rivals, p, gains, strict=True)
    ]


def outcomes(
    control: str, algorithms: Sequence[str], values: ArrayLike, *, smaller_is_better: bool
) -> NDArray[np.int_]:
    """Judge one algorithm against each other on each problem by the Mann-Whitney test of the runs.

    Runs are independent, so they are not paired. Holm's correction goes over all pairs of problem
    and rival, because their counts are read together as one table: with 95 % confidence none of
    its verdicts is due to chance. That takes many seeds (n runs that all beat n others have
    p = 2 / C(2n, n)) and hides small defeats as well as small victories: 0 does not mean equal.

    Parameters
    ----------
    control, algorithms, smaller_is_better
        See `holm_against`.
    values : array_like, shape (problems, algorithms, seeds)
        One indicator of every run; runs that are not finite failed.

    Returns
    -------
    ndarray of int, shape (problems, algorithms - 1)
        1 where the control is significantly better, -1 where worse, 0 elsewhere; the rivals in
        the order of ``algorithms``.

    Raises
    ------
    InvalidInput
        For a control, names or a shape that do not fit.
    """
    ours, theirs, _ = _opponents(control, algorithms, _costs(values, smaller_is_better, OF_RUNS))
    tests = [[mannwhitneyu(b, a) for a, b in zip(ours, rival, strict=True)] for rival in theirs]
    p = np.array([[test.pvalue for test in row] for row in tests])
    # U counts the pairs of runs in which the rival's cost is the larger.
    excess = np.array([[test.statistic for test in row] for row in tests]) - ours.shape[-1] ** 2 / 2
    significant = holm(p.ravel()).reshape(p.shape) < SIGNIFICANT
    return np.where(significant, np.sign(excess), 0.0).astype(int).T


def win_tie_loss(
    control: str, algorithms: Sequence[str], values: ArrayLike, *, smaller_is_better: bool
) -> list[WinTieLoss]:
    """Count the `outcomes` against each rival, in the order of ``algorithms``."""
    verdicts = outcomes(control, algorithms, values, smaller_is_better=smaller_is_better)
    rivals = [name for name in algorithms if name != control]
    return [
        WinTieLoss(rival, *(int(np.sum(column == verdict)) for verdict in (1, 0, -1)))
        for rival, column in zip(rivals, verdicts.T, strict=True)
    ]


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
    costs = _costs(values, smaller_is_better, OF_RUNS)
    means = np.empty((RESAMPLES, costs.shape[1]))
    for mean in means:
        drawn = rng.integers(costs.shape[-1], size=costs.shape)
        resampled = np.median(np.take_along_axis(costs, drawn, axis=-1), axis=-1)
        mean[:] = rankdata(resampled, axis=1).mean(axis=0)
    return np.quantile(means, (SIGNIFICANT / 2, 1 - SIGNIFICANT / 2), axis=0).T


def _costs(
    values: ArrayLike, smaller_is_better: bool, axes: tuple[str, ...]
) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=float)
    if numbers.ndim != len(axes) or not numbers.size:
        raise InvalidInput("shape of values", numbers.shape, f"({', '.join(axes)})")
    return np.where(np.isfinite(numbers), numbers if smaller_is_better else -numbers, np.inf)


def _opponents(
    control: str, algorithms: Sequence[str], costs: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]:
    """Split costs (problems, algorithms, ...) into the control's, the rivals' and their names."""
    names = list(algorithms)
    if len(set(names)) != len(names) or len(names) != costs.shape[1]:
        raise InvalidInput("algorithms", names, f"{costs.shape[1]} different names")
    place = names.index(one_of("control", control, names))
    theirs = np.moveaxis(np.delete(costs, place, axis=1), 1, 0)
    return costs[:, place], theirs, names[:place] + names[place + 1 :]


def _ahead(gain: NDArray[np.float64]) -> bool:
    """Return whether the ranks of the gains outweigh those of the losses."""
    moved = gain[gain != 0]
    return bool(np.sum(np.sign(moved) * rankdata(np.abs(moved))) > 0)


def _gain(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much larger their costs are; none where both failed."""
    gain = np.zeros_like(ours)
    return np.subtract(theirs, ours, out=gain, where=np.isfinite(ours) | np.isfinite(theirs))
