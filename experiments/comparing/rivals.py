"""One algorithm against each of the others over many problems, corrected after Holm.

Indicators come as in `ranks`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, rankdata

from pymoo_hdte._comparing.indicators import smaller_is_better
from pymoo_hdte._comparing.paired import SIGNIFICANT
from pymoo_hdte._comparing.ranks import OF_PROBLEMS, costs_of
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
