"""One algorithm against each of the others over many problems, corrected after Holm.

Indicators come as in `ranks`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, mannwhitneyu, rankdata

from pymoo_hdte._comparing.indicators import smaller_is_better
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.ranks import OF_PROBLEMS, OF_RUNS, costs_of
from pymoo_hdte._comparing.statistics import holm, state_of, wilcoxon_p
from pymoo_hdte.checks import InvalidInput, one_of


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


def better_than_each(tests: Sequence[RivalTest]) -> str:
    """Return the state of the demand to be better than each rival, shown if beyond chance."""
    return state_of(all(test.ahead for test in tests), shown=all(test.beaten for test in tests))


class WinTieLoss(NamedTuple):
    """On how many problems a control beats a rival significantly, does not differ, or loses."""

    rival: str
    wins: int
    ties: int
    losses: int


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
        See `ranks.problem_ranks`.

    Returns
    -------
    list of RivalTest
        In the order of ``algorithms``; p after Holm's correction over all rivals.

    Raises
    ------
    InvalidInput
        For a control or names that do not fit, and what `ranks.problem_ranks` refuses.
    """
    costs = costs_of(values, smaller_is_better, OF_PROBLEMS)
    ours, theirs, rivals = _opponents(control, algorithms, costs)
    return _tested(rivals, [_gain(ours, cost) for cost in theirs])


def tests_of_medians(
    control: str, algorithms: Sequence[str], medians: NDArray[np.float64], measure: str
) -> list[RivalTest]:
    """Test one algorithm against each other as `holm_against` on medians of one measure.

    Ratios of distances mean the same on all problems, differences of hypervolumes do as well.
    """
    smaller = smaller_is_better(measure)
    compared = np.log(medians) if smaller else medians
    return holm_against(control, algorithms, compared, smaller_is_better=smaller)


def signs_against(
    control: str, algorithms: Sequence[str], values: ArrayLike, *, smaller_is_better: bool
) -> list[RivalTest]:
    """Test one algorithm against each other by the signs of the differences on the problems.

    For indicators that have no common unit over the problems. It counts on how many problems the
    control is better (Demsar's Section 3.1.4), and needs more of them than `holm_against`; unlike
    a test of average ranks it does not depend on which others take part (A. Benavoli, G. Corani,
    F. Mangili, J. Mach. Learn. Res. 17 (2016) 1-10). Parameters, returns and raises as there.
    """
    costs = costs_of(values, smaller_is_better, OF_PROBLEMS)
    ours, theirs, rivals = _opponents(control, algorithms, costs)
    # Signs alone, so that who is ahead is the one who is better on more problems.
    return _tested(rivals, [np.sign(_gain(ours, cost)) for cost in theirs], sign_p)


def sign_p(gain: NDArray[np.float64]) -> float:
    """Return the two-sided p of the sign test on differences (n,); zeros are dropped."""
    moved = int(np.count_nonzero(gain))
    return float(binomtest(int(np.sum(gain > 0)), moved).pvalue) if moved else 1.0


def _signed_rank_p(gain: NDArray[np.float64]) -> float:
    return wilcoxon_p(gain, np.zeros_like(gain))


def _tested(
    rivals: Sequence[str],
    gains: Sequence[NDArray[np.float64]],
    p_of: Callable[[NDArray[np.float64]], float] = _signed_rank_p,
) -> list[RivalTest]:
    """Return the tests of gains (problems,) over each rival, corrected over all of them."""
    p = holm([p_of(gain) for gain in gains])
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
    ours, theirs, _ = _opponents(control, algorithms, costs_of(values, smaller_is_better, OF_RUNS))
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
