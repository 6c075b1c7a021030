"""A robust design study: the front, the design that a preference chooses, and a check of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.callback import Callback
from pymoo.optimize import minimize
from tqdm import tqdm

from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import OperatingCondition, RobustDTE
from pymoo_hdte.problems.operating_conditions import duty_cycle_dte_arcsec
from pymoo_hdte.surrogate import SobolIndices, sobol_indices

POPULATION = 100
CHECKED_DRIVES = 1000
LITTLE = 1e-3
"""Share of mean and standard deviation that a variable must move, over its box, to matter."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Settings:
    """Settings of a study.

    Attributes
    ----------
    tolerance, box : float
        Relative half-widths of the parts' scatter and of the search space.
    order : int
        Of the surrogate.
    conditions : tuple of OperatingCondition or None
        The duty cycle; None for the rated condition.
    evaluations : int
        Of the swarm, in whole generations of `POPULATION`.
    seed : int
    """

    tolerance: float
    box: float
    order: int
    conditions: tuple[OperatingCondition, ...] | None
    evaluations: int
    seed: int


class Progress(Callback):
    """Moves a bar of tqdm on to the evaluations made so far."""

    def __init__(self, bar: tqdm) -> None:
        super().__init__()
        self.bar = bar

    def notify(self, algorithm: Algorithm) -> None:
        """Follow the algorithm."""
        self.bar.update(algorithm.evaluator.n_eval - self.bar.n)


@dataclass(frozen=True, eq=False)
class Check:
    """What the drive model itself says of a design, where the study asked its surrogate.

    Attributes
    ----------
    mean, std : float
        Of the DTE, arcsec: the surrogate's exact moments, corrected by what surrogate and model
        differ in on the same drives (a control variate).
    mean_influence : ndarray, shape (CHECKED_DRIVES,)
        Of every drive on ``mean``: its DTE by the model less that by the surrogate, arcsec.
    std_influence : ndarray, shape (CHECKED_DRIVES,)
        Of every drive on ``std``, to first order, arcsec.
    """

    mean: float
    std: float
    mean_influence: Values
    std_influence: Values

    @property
    def mean_error(self) -> float:
        """Standard error of ``mean``, arcsec."""
        return _error_of_mean(self.mean_influence)

    @property
    def std_error(self) -> float:
        """Standard error of ``std``, arcsec."""
        return _error_of_mean(self.std_influence)


@dataclass(frozen=True)
class Gain:
    """How far an objective falls from the nominal to the chosen design; negative where it rises.

    Attributes
    ----------
    promised : float
        By the surrogate, arcsec.
    found : float
        By the drive model itself, arcsec.
    error : float
        Standard error of ``found``, arcsec.
    share : float
        Of ``found`` in the value at the nominal design.
    """

    promised: float
    found: float
    error: float
    share: float

    @property
    def refuted(self) -> bool:
        """Whether the model does not confirm that the objective falls, as promised."""
        return self.promised > 0.0 and self.found <= 2.0 * self.error

    @property
    def coarse(self) -> bool:
        """Whether the surrogate is off by more than half of what it promises, beyond chance."""
        off = abs(self.promised - self.found)
        return off > max(0.5 * abs(self.promised), 2.0 * self.error)


@dataclass(frozen=True, eq=False)
class DesignStudy:
    """The outcome of a study.

    Attributes
    ----------
    problem : RobustDTE
    settings : Settings
    designs : ndarray, shape (n, 4)
        K, J_in, B_in, B_fc of the front, SI, by rising mean DTE.
    front : ndarray, shape (n, 2)
        Mean and standard deviation of the DTE, arcsec, row for row.
    chosen : dict of int
        Row that each of `PREFERENCES` chooses.
    preference : str
        The one that was asked for.
    initial : ndarray, shape (2,)
        Mean and standard deviation at the nominal design, at the same tolerance.
    initial_check, optimum_check : Check
        Of the nominal and of the chosen design, on the same random drives.
    sources : SobolIndices
        What causes the scatter that is left at the chosen design.
    """

    problem: RobustDTE
    settings: Settings
    designs: Values
    front: Values
    chosen: dict[str, int]
    preference: str
    initial: Values
    initial_check: Check
    optimum_check: Check
    sources: SobolIndices

    @property
    def design(self) -> Values:
        """The chosen design, shape (4,), SI."""
        return self.designs[self.chosen[self.preference]]

    @property
    def objectives(self) -> Values:
        """Its mean and standard deviation, shape (2,), arcsec."""
        return self.front[self.chosen[self.preference]]

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the variables that move neither objective by `LITTLE` over their whole box."""
        problem = self.problem
        moved = np.repeat(self.design[None], 2 * problem.n_var, axis=0)
        for row, bound in enumerate((problem.xl, problem.xu)):
            np.fill_diagonal(moved[row * problem.n_var :], bound)
        changes = np.abs(problem.evaluate(moved) / self.objectives - 1.0).max(axis=1)
        largest = changes.reshape(2, problem.n_var).max(axis=0)
        return tuple(
            name for name, one in zip(problem.var_names, largest, strict=True) if one < LITTLE
        )

    @property
    def gains(self) -> dict[str, Gain]:
        """Gains in mean and standard deviation; both designs were checked on the same drives."""
        before, after = self.initial_check, self.optimum_check
        promised = (self.initial - self.objectives).tolist()
        errors = (
            _error_of_mean(before.mean_influence - after.mean_influence),
            _error_of_mean(before.std_influence - after.std_influence),
        )
        found = (before.mean - after.mean, before.std - after.std)
        shares = (found[0] / before.mean, found[1] / before.std)
        gains = map(Gain, promised, found, errors, shares)
        return dict(zip(("mean", "standard deviation"), gains, strict=True))


def run_design_study(
    model: DriveModel, preference: str, settings: Settings, callback: Callback | None = None
) -> DesignStudy:
    """Optimise a drive and choose a design.

    Parameters
    ----------
    model : DriveModel
    preference : str
        One of `PREFERENCES`.
    settings : Settings
    callback : pymoo.core.callback.Callback, optional
        Called after every generation.

    Raises
    ------
    InvalidInput
        For a setting that is not allowed, or a theta_s that could become negative.
    UnstableDrive
        If a design of the search space has no steady state.
    """
    problem = RobustDTE(
        model,
        order=settings.order,
        tolerance=settings.tolerance,
        box=settings.box,
        conditions=settings.conditions,
    )
    result = minimize(
        problem,
        ElitistSwarm(pop_size=POPULATION),
        ("n_eval", settings.evaluations),
        seed=settings.seed,
        callback=callback or Callback(),
    )
    order = np.argsort(result.F[:, 0], kind="stable")
    designs, front = result.X[order], result.F[order]
    chosen = {word: WeightedUtopia(PREFERENCES[word]).do(front) for word in PREFERENCES}
    design = designs[chosen[preference]]
    initial_check, optimum_check = (
        _check(problem, one, settings.seed) for one in (problem.nominal, design)
    )
    return DesignStudy(
        problem=problem,
        settings=settings,
        designs=designs,
        front=front,
        chosen=chosen,
        preference=preference,
        initial=problem.evaluate(problem.nominal[None])[0],
        initial_check=initial_check,
        optimum_check=optimum_check,
        sources=sobol_indices(problem.surrogate, problem.inputs, design),
    )


def _check(problem: RobustDTE, design: Values, seed: int) -> Check:
    """Judge a design by the model on random drives, the same ones for every design."""
    rng = np.random.default_rng(seed)
    drives = np.column_stack([entry.sample(rng, CHECKED_DRIVES) for entry in problem.inputs])
    drives[:, 1:] *= design
    by_model = duty_cycle_dte_arcsec(problem.model, problem.conditions, drives)
    by_surrogate = problem.surrogate(drives)
    mean, std = problem.evaluate(design[None])[0]
    difference = by_model - by_surrogate
    corrected = float(std * by_model.std() / by_surrogate.std())
    # Half the difference of two relative variances is the influence of a drive on log std.
    influence = 0.5 * (_relative_square(by_model) - _relative_square(by_surrogate))
    return Check(
        mean=float(mean + difference.mean()),
        std=corrected,
        mean_influence=difference,
        std_influence=corrected * influence,
    )


def _relative_square(values: Values) -> Values:
    return (values - values.mean()) ** 2 / values.var()


def _error_of_mean(values: Values) -> float:
    return float(values.std(ddof=1) / len(values) ** 0.5)
