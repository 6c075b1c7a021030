"""One method on one function, as a job of a campaign."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from experiments.robust.ours import stopped, trace
from experiments.robust.rivals import chaospy_traces, openturns_trace, until_it_stays
from experiments.robust.task import Task
from experiments.runner.campaign import Run

OURS = "pymoo_hdte"
OPENTURNS = "OpenTURNS"
CHAOSPY = "chaospy"
METHODS = (OURS, CHAOSPY, OPENTURNS)
ACCURACY = 0.01
BUDGET = 1000
CURVE = ("way", "runs", "error_at_designs", "error_overall")


@dataclass(frozen=True)
class Curve:
    """Errors of one method over its runs, each way of it up to where it needs no more."""

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
        if self.method == OURS:
            ways = {OURS: iter(trace(task, self.budget, ACCURACY))}
        elif self.method == OPENTURNS:
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


@dataclass(frozen=True)
class Stop:
    """Where our surrogate stops by itself, and whether its band covers its errors."""

    function: str
    seed: int
    budget: int = BUDGET

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"{self.function}_stop_{self.budget}_{self.seed}".replace(" ", "_")

    def execute(self) -> Run:
        """Return the numbers of `stopped` as one row."""
        task, started = Task(self.function), time.perf_counter()
        found = stopped(task, ACCURACY, self.budget, self.seed)
        seconds = time.perf_counter() - started
        return Run(tuple(found), np.array([list(found.values())]), seconds)
