"""A robust design study: the front of the drive model, a chosen design, and a check of both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.algorithms import FoundFront, interpolated_front
from pymoo_hdte.cli.design_check import Check, check_designs, standard_error
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.decision.influence import without_influence
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import OperatingCondition, RobustDTEDirect
from pymoo_hdte.problems.model_moments import FIRST_NODES
from pymoo_hdte.surrogate import SobolIndices

AGREEMENT = 0.05
"""Share of the front's width to which front and drive model have to agree."""
HARDLY_WORTH = 0.02
"""Share of an objective below which a gain is hardly worth a change of design.

A front that is narrower counts as that wide: nobody needs its designs apart.
"""
CHECKED = 4
"""Designs along the front that are checked, beside those that preferences choose."""
_SEARCHES = 3
"""Largest number of searches; each has more nodes than the one before."""
_OF_QUADRATURE = 0.25
"""Share of `AGREEMENT` that doubled nodes may change when nodes are chosen anew."""

Values = NDArray[np.float64]
Notify = Callable[[int, float], None]


@dataclass(frozen=True)
class Settings:
    """Settings of a study.

    Attributes
    ----------
    tolerance, box : float
        Relative half-widths of the parts' scatter and of the search space.
    conditions : tuple of OperatingCondition or None
        The duty cycle; None for the rated condition.
    designs : int
        Evaluated on the drive model in one search, after which no further round begins.
    seed : int
    """

    tolerance: float
    box: float
    conditions: tuple[OperatingCondition, ...] | None
    designs: int
    seed: int


@dataclass(frozen=True)
class Gain:
    """The reduction of an objective from the nominal to the chosen design.

    Attributes
    ----------
    reduction : float
        Reduction by the drive model on the checked drives, arcsec; negative for a rise.
    error : float
        Standard error of ``reduction``, arcsec.
    share : float
        ``reduction`` over the value at the nominal design.
    """

    reduction: float
    error: float
    share: float


@dataclass(frozen=True, eq=False)
class DesignStudy:
    """The outcome of a study.

    Attributes
    ----------
    problem : RobustDTEDirect
        The problem, with as many nodes as the study needed.
    settings : Settings
    search : FoundFront
        The front, by rising mean DTE.
    evaluated : int
        Number of designs in all searches.
    chosen : dict of int
        Row of the front that each of `PREFERENCES` chooses.
    preference : str
        The preference that was requested.
    initial : ndarray, shape (2,)
        Mean and standard deviation at the nominal design, at the same tolerance.
    initial_check : Check
        Check of the nominal design.
    checks : dict of Check
        Checks of the chosen designs and of `CHECKED` along the front, by row of the front.
    sources : SobolIndices
        Causes of the scatter at the chosen design.
    """

    problem: RobustDTEDirect
    settings: Settings
    search: FoundFront
    evaluated: int
    chosen: dict[str, int]
    preference: str
    initial: Values
    initial_check: Check
    checks: dict[int, Check]
    sources: SobolIndices

    @property
    def designs(self) -> Values:
        """K, J_in, B_in, B_fc of the front, SI, shape (n, 4)."""
        return self.search.designs

    @property
    def front(self) -> Values:
        """Mean and standard deviation of the DTE, arcsec, row for row, shape (n, 2)."""
        return self.search.front

    @property
    def design(self) -> Values:
        """The chosen design, shape (4,), SI."""
        return self.designs[self.chosen[self.preference]]

    @property
    def objectives(self) -> Values:
        """Mean and standard deviation of the chosen design, shape (2,), arcsec."""
        return self.front[self.chosen[self.preference]]

    @property
    def optimum_check(self) -> Check:
        """Check of the chosen design, on the same drives as the nominal design."""
        return self.checks[self.chosen[self.preference]]

    @property
    def quadrature(self) -> float:
        """Largest difference of front and drive model on other drives, at most, in widths."""
        return _difference(self.search, self.checks)

    @property
    def disagreement(self) -> float:
        """Largest difference of front and drive model, in widths."""
        return max(self.search.difference, self.quadrature)

    @property
    def recommended(self) -> bool:
        """Whether front and drive model agree, so that a design may be recommended."""
        return self.disagreement <= AGREEMENT

    @cached_property
    def uninfluential(self) -> tuple[str, ...]:
        """Names of the variables that move neither objective; see `without_influence`."""
        problem = self.problem
        idle = without_influence(problem.moments, problem.xl, problem.xu, self.design)
        return tuple(name for name, is_idle in zip(problem.var_names, idle, strict=True) if is_idle)

    @property
    def gains(self) -> dict[str, Gain]:
        """Gains in mean and standard deviation; both designs were checked on the same drives."""
        before, after = self.initial_check, self.optimum_check
        changes = (before.means - after.means, before.stds - after.stds)
        values = (before.mean, before.std)
        return {
            name: Gain(float(change.mean()), standard_error(change), float(change.mean() / value))
            for name, change, value in zip(
                ("mean", "standard deviation"), changes, values, strict=True
            )
        }


def run_design_study(
    model: DriveModel, preference: str, settings: Settings, notify: Notify | None = None
) -> DesignStudy:
    """Optimise a drive on its own model and choose a design.

    The moments of a design are those of the model by quadrature (`ModelMoments`). Its front is
    interpolated between designs that were evaluated (`interpolated_front`), then checked on other
    drives; if it does not hold there, nodes are added and the search is repeated from it.

    Parameters
    ----------
    model : DriveModel
    preference : str
        One of `PREFERENCES`.
    settings : Settings
    notify : callable, optional
        Called often with the number of designs evaluated and the last round's difference.

    Raises
    ------
    InvalidInput
        For a setting that is not allowed, or a theta_s that could become negative.
    ArithmeticError
        If the nominal design has no steady state somewhere within its scatter; names where.
    """
    rng = np.random.default_rng(settings.seed)
    nodes, start, before, runs = FIRST_NODES, None, 0, 0
    for number in range(_SEARCHES):
        problem = RobustDTEDirect(
            model, settings.tolerance, settings.box, settings.conditions, nodes
        )
        problem.moments.n_runs = runs
        initial = problem.evaluate(problem.nominal[None])[0]
        search = interpolated_front(
            problem.moments,
            problem.xl,
            problem.xu,
            rng,
            accuracy=AGREEMENT,
            least_width=HARDLY_WORTH,
            start=start,
            most=settings.designs,
            notify=_later(notify, before),
        )
        chosen = {word: WeightedUtopia(PREFERENCES[word]).do(search.front) for word in PREFERENCES}
        rows = _rows_to_check(len(search.front), list(chosen.values()))
        # The same drives in every search, and for the nominal design.
        drives = np.random.default_rng(settings.seed)
        looked_at = np.vstack([problem.nominal, search.designs[rows]])
        initial_check, *others = check_designs(problem, looked_at, drives)
        checks = dict(zip(rows, others, strict=True))
        off = _difference(search, checks)
        if off <= AGREEMENT or not np.isfinite(off) or number == _SEARCHES - 1:
            break
        wanted = _OF_QUADRATURE * AGREEMENT * search.width
        refined = problem.moments.refined(search.designs[rows], wanted)
        if refined.nodes == nodes:
            break
        nodes, start = refined.nodes, search.designs
        before, runs = before + search.evaluated, refined.n_runs
    return DesignStudy(
        problem=problem,
        settings=settings,
        search=search,
        evaluated=before + search.evaluated,
        chosen=chosen,
        preference=preference,
        initial=initial,
        initial_check=initial_check,
        checks=checks,
        sources=problem.moments.at_least_two().sources(search.designs[chosen[preference]]),
    )


def _difference(search: FoundFront, checks: dict[int, Check]) -> float:
    return max(check.differs(search.front[row], search.width) for row, check in checks.items())


def _rows_to_check(n: int, chosen: list[int]) -> list[int]:
    along = np.linspace(0, n - 1, CHECKED).round().astype(int)
    return sorted({*along.tolist(), *chosen})


def _later(notify: Notify | None, before: int) -> Notify | None:
    """Return a notifier that adds the designs of earlier searches."""
    if notify is None:
        return None
    return lambda evaluated, difference: notify(before + evaluated, difference)
