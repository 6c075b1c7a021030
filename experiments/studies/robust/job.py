"""One method on one function, as a job of a campaign."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from experiments.runner.campaign import Run
from experiments.studies.robust.ours import Growth
from experiments.studies.robust.rivals import chaospy_traces, openturns_trace, until_it_stays
from experiments.studies.robust.task import Task

OURS = "pymoo_hdte"
OPENTURNS = "OpenTURNS"
CHAOSPY = "chaospy"
METHODS = (OURS, CHAOSPY, OPENTURNS)
ACCURACY = 0.01
BUDGET = 1000
STEP = ("runs", "error_at_designs", "error_overall")
CURVE = ("way", *STEP)


@dataclass(frozen=True)
class Grown:
    """One growth of ours: where it stops by itself, what its band covers, and its errors."""

    function: str
    seed: int
    whole_curve: bool
    budget: int = BUDGET

    @property
    def key(self) -> str:
        """All settings in one name."""
        curve = "_curve" * self.whole_curve
        return f"{self.function}_{OURS}_{self.budget}_{self.seed}{curve}".replace(" ", "_")

    def execute(self) -> Run:
        """Return the columns of `STEP` of every fit, and beside each the numbers of the stop.

        Without the curve there is one row, and its `STEP` is NaN.
        """
        task, started = Task(self.function), time.perf_counter()
        growth = Growth(task, ACCURACY, self.budget, self.seed, self.whole_curve)
        stop = growth.band()
        steps = np.array(growth.steps, dtype=float) if growth.steps else np.full((1, 3), np.nan)
        rows = np.column_stack([steps, np.tile([*stop.values()], (len(steps), 1))])
        columns = (*STEP, *(f"stop_{name}" for name in stop))
        return Run(columns, rows, time.perf_counter() - started)


@dataclass(frozen=True)
class Curve:
    """Errors of another library over its runs, each way of it up to where it needs no more."""

    function: str
    method: str
    budget: int = BUDGET

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"{self.function}_{self.method}_{self.budget}".replace(" ", "_")

    def execute(self) -> Run:
        """Return the columns of `CURVE`, ways counted from 0."""
        task, started = Task(self.function), time.perf_counter()
        if self.method == OPENTURNS:
            ways = {OPENTURNS: openturns_trace(task, self.budget)}
        else:
            ways = chaospy_traces(task, self.budget)
        rows = [
            (way, *step)
            for way, steps in enumerate(ways.values())
            for step in until_it_stays(steps, ACCURACY)
        ]
        seconds = time.perf_counter() - started
        return Run(CURVE, np.array(rows, dtype=float).reshape(-1, len(CURVE)), seconds)
