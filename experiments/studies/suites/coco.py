"""Problems of bbob-biobj, and the share of COCO's targets that a run reaches.

COCO's own logger follows a run: every evaluated point counts, in an archive without bound, and a
target is reached once the hypervolume of the archive, normalised by ideal and nadir point, comes
that near to the best known (D. Brockhoff, A. Auger, N. Hansen, T. Tusar, Using well-understood
single-objective functions in multiobjective black-box optimization test suites, Evolutionary
Computation 30(2), 2022).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.core.sampling import Sampling

from experiments.runner.registry import require
from pymoo_hdte.checks import InvalidInput

EXTRA = "suites"
FUNCTIONS = range(1, 56)
TARGETS = np.concatenate(
    [-(10.0 ** np.linspace(-4.0, -5.0, 6)), [0.0], 10.0 ** np.linspace(-5.0, 0.0, 51)]
)
"""The 58 distances to the best known hypervolume; below zero, better than that."""
MARKS = (100, 200, 500, 1000, 2000, 5000, 10_000, 25_000)
"""Numbers of evaluations at which shares are told."""
KNOWN = 10
"""Instances with best known hypervolumes; beyond, cocoex 2.8 has 1.0 in their place."""
START = 5.0
"""First positions are drawn from -5 to 5 in each variable, as COCO recommends, in a box of 100."""


class BbobProblem(Problem):
    """A problem of the suite as pymoo sees it; ``reference`` (2,) is COCO's nadir point."""

    def __init__(self, problem: Any) -> None:
        low, high = problem.lower_bounds, problem.upper_bounds
        super().__init__(n_var=problem.dimension, n_obj=2, xl=low, xu=high, vtype=float)
        self.problem = problem
        self.reference = np.array(problem.largest_fvalues_of_interest)
        self.start = np.full(self.n_var, -START), np.full(self.n_var, START)

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        out["F"] = np.array([self.problem(design) for design in x])


class StartBox(Sampling):
    """Uniform first positions within the box ``start`` of a problem."""

    def _do(
        self, problem: Problem, n_samples: int, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> NDArray[np.float64]:
        low, high = problem.start
        return random_state.uniform(low, high, (n_samples, problem.n_var))


def shares_of_run(
    function: int, dimension: int, instance: int, run: Callable[[BbobProblem], object]
) -> NDArray[np.float64]:
    """Return the share of targets reached at each of `MARKS`, shape (8,), by a run on a problem.

    Raises
    ------
    ExtraMissing
        coco-experiment is not installed.
    InvalidInput
        For an instance without a best known hypervolume, from which targets are counted.
    """
    require("cocoex", EXTRA)
    import cocoex

    if not 1 <= instance <= KNOWN:
        raise InvalidInput("instance", instance, f"1 to {KNOWN}, for which COCO has targets")
    cocoex.log_level("error")
    only = f"dimensions:{dimension} function_indices:{function} instance_indices:{instance}"
    suite = cocoex.Suite("bbob-biobj", "", only)
    with tempfile.TemporaryDirectory() as folder:
        kept = f"outer_folder: {folder} result_folder: run log_nondominated: none"
        observer = cocoex.Observer("bbob-biobj", f"{kept} log_decision_variables: none")
        problem = suite[0]
        problem.observe_with(observer)
        run(BbobProblem(problem))
        problem.free()
        (log,) = Path(folder).rglob("*_hyp.dat")
        return shares(log.read_text())


def shares(log: str) -> NDArray[np.float64]:
    """Return the share of targets at each of `MARKS` from the text of COCO's logger.

    A line that is no comment begins with the evaluations and the distance then reached.
    """
    lines = [line.split()[:2] for line in log.splitlines() if line.strip() and line[0] != "%"]
    steps = np.array(lines, dtype=float).reshape(-1, 2)
    reached = [steps[steps[:, 0] <= mark, 1].min(initial=np.inf) for mark in MARKS]
    return np.mean(np.array(reached)[:, np.newaxis] <= TARGETS, axis=1)
