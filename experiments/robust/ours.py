"""The surrogate of this package on a task: its error after every batch, and where it stops."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from experiments.robust.task import Task
from pymoo_hdte.problems import Mean, Std
from pymoo_hdte.problems.simulator.problem import SimulatorProblem
from pymoo_hdte.surrogate.sparse.adaptive import AdaptiveFit, fit_adaptively

Array = NDArray[np.float64]
Step = tuple[int, float, float]
"""Runs, error of the deviation at the designs, and overall."""


STAYS = 1.5
"""Growth goes on up to this factor in runs from where the error is as small as asked for."""


class _Enough(Exception):
    """Growth has shown what is asked."""


def trace(task: Task, budget: int, accuracy: float, seed: int = 1) -> list[Step]:
    """Return the true errors after every batch of a growth that does not stop by itself."""
    found: list[Step] = []
    points = _cube(task)

    def watch(fit: AdaptiveFit) -> bool:
        values = fit.polynomial(points)[:, 0].reshape(task.judged[1].shape)
        found.append((fit.n_runs, *task.errors(values)))
        above = [runs for runs, error, _ in found if not error < accuracy]
        first = next((runs for runs, _, _ in found if runs > max(above, default=0)), budget)
        if fit.n_runs >= STAYS * first:
            raise _Enough
        return False

    with suppress(_Enough):
        _grown(task, np.inf, budget, seed, watch)
    return found


def stopped(task: Task, accuracy: float, budget: int, seed: int = 1) -> dict[str, float]:
    """Return where growth stops by itself, and how its band compares with its true errors.

    ``runs`` is NaN where the budget ends first: `robust_problem` refuses such a surrogate.
    """
    fit = _grown(task, accuracy, budget, seed, lambda fit: True)
    problem = SimulatorProblem(task.inputs, fit, ("y",), (Mean(), Std()), (), fit.n_runs)
    found = problem.evaluate(task.X)
    true = np.column_stack(task.true_moments)
    error, band = np.abs(found - true), problem.band(task.X)
    # The true moments are sampled.
    own_error = 5e-4 * true[:, 1:]
    covered = np.mean(error <= band + own_error, axis=0)
    relative = np.quantile(error / true[:, 1:], 0.95, axis=0)
    stated = np.median(band / true[:, 1:], axis=0)
    return {
        "runs": float(fit.n_runs) if fit.largest_error <= accuracy else np.nan,
        "spent": float(fit.n_runs),
        "covered_mean": float(covered[0]),
        "covered_std": float(covered[1]),
        "true_mean_error": float(relative[0]),
        "true_std_error": float(relative[1]),
        "stated_mean_error": float(stated[0]),
        "stated_std_error": float(stated[1]),
    }


def _grown(task: Task, accuracy: float, budget: int, seed: int, watch: object) -> AdaptiveFit:
    def function(cube: Array) -> Array:
        return task(task.inputs.values(cube))[:, None]

    rng = np.random.default_rng(seed)
    return fit_adaptively(task.inputs.axes, function, accuracy, budget, rng, watch)  # type: ignore[arg-type]


def _cube(task: Task) -> Array:
    """Return the judged points in -1..1."""
    points = task.judged[0].reshape(-1, len(task.names))
    columns = [axis.cube(v) for axis, v in zip(task.inputs.axes, points.T, strict=True)]
    return np.clip(np.column_stack(columns), -1.0, 1.0)
