"""The surrogate of this package on a task: one growth, and where it would stop by itself."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from experiments.studies.robust.task import Task
from pymoo_hdte.problems import Mean, Std
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.surrogate._sparse.adaptive import (
    IN_A_ROW,
    AdaptiveFit,
    fit_adaptively,
    least_runs,
)

Array = NDArray[np.float64]
Step = tuple[int, float, float]
"""Runs, error of the deviation at the designs, and overall."""

STAYS = 1.5
"""Growth goes on up to this factor in runs from where the error is as small as asked for."""


class _Enough(Exception):
    """Growth has shown what is asked."""


class Growth:
    """A growth that is watched: every fit is judged, and nothing is fitted twice.

    It goes on until it would have stopped by itself and the error has stayed below the bound for a
    while, or until the budget is spent.

    Parameters
    ----------
    task : Task
    accuracy : float
        What `robust_problem` would be asked for, at most 0.01; a share of the scatter.
    budget : int
        Most runs.
    seed : int
        Of the runs.

    Attributes
    ----------
    steps : list of Step
        Of every fit.
    stop : AdaptiveFit
        With which it would have stopped; the last one where it would not have.
    stopped : bool
        Whether it would have.
    """

    def __init__(self, task: Task, accuracy: float, budget: int, seed: int = 1) -> None:
        self._task, self._accuracy, self._budget = task, accuracy, budget
        self._points = _cube(task)
        self.steps: list[Step] = []
        self.stopped, self._passed = False, 0

        def function(cube: Array) -> Array:
            return task(task.inputs.values(cube))

        rng = np.random.default_rng(seed)
        # An infinite accuracy has every fit shown, and `_watch` accepts none.
        with suppress(_Enough):
            fit_adaptively(task.inputs.axes, function, np.inf, budget, rng, self._watch)

    def _watch(self, fit: AdaptiveFit) -> bool:
        if not self.stopped:
            self.stop = fit
            good = fit.largest_error <= self._accuracy
            self._passed = self._passed + 1 if good else 0
            enough = fit.n_runs >= least_runs(len(self._task.names))
            self.stopped = enough and self._passed >= IN_A_ROW
        values = fit.polynomial(self._points).reshape(self._task.judged[1].shape)
        self.steps.append((fit.n_runs, *self._task.errors(values)))
        if self.stopped and self._stays(fit.n_runs):
            raise _Enough
        return False

    def _stays(self, runs: int) -> bool:
        above = [n for n, error, _ in self.steps if not error < self._accuracy]
        reached = next((n for n, _, _ in self.steps if n > max(above, default=0)), self._budget)
        return runs >= STAYS * reached

    def band(self) -> dict[str, float]:
        """Return how the band of the fit with which it stops compares with its true errors.

        ``runs`` is NaN where the budget ends first: `robust_problem` refuses such a surrogate.
        """
        task, fit = self._task, self.stop
        responses = tuple(f"y{k}" for k in range(fit.truth.shape[1]))
        objectives = [kind(response=name) for kind in (Mean, Std) for name in responses]
        problem = SimulatorProblem(task.inputs, fit, responses, objectives, (), fit.n_runs)
        moments, bands = problem.evaluate(task.X, return_values_of=["F", "F_band"])
        # Mean and deviation of all values of a field together: shape (n, 2).
        mean, std = task.true_moments
        true = np.column_stack([mean.ravel(), std.ravel()])
        error, band = (
            np.column_stack([part.ravel() for part in np.hsplit(values, 2)])
            for values in (np.abs(moments - np.hstack([mean, std])), bands)
        )
        # The true moments are sampled.
        own_error = 5e-4 * true[:, 1:]
        covered = np.mean(error <= band + own_error, axis=0)
        relative = np.quantile(error / true[:, 1:], 0.95, axis=0)
        stated = np.median(band / true[:, 1:], axis=0)
        return {
            "runs": float(fit.n_runs) if self.stopped else np.nan,
            "spent": float(fit.n_runs),
            "covered_mean": float(covered[0]),
            "covered_std": float(covered[1]),
            "true_mean_error": float(relative[0]),
            "true_std_error": float(relative[1]),
            "stated_mean_error": float(stated[0]),
            "stated_std_error": float(stated[1]),
        }


def _cube(task: Task) -> Array:
    """Return the judged points in -1..1."""
    points = task.judged[0].reshape(-1, len(task.names))
    columns = [axis.cube(v) for axis, v in zip(task.inputs.axes, points.T, strict=True)]
    return np.clip(np.column_stack(columns), -1.0, 1.0)
