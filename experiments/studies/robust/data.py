"""Curves and stops of all functions: computed, and as the two CSV files that the repo keeps."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.runner.committed import committed_file, read_rows, table_with_origin
from experiments.runner.registry import Context, require
from experiments.studies.robust.functions import FUNCTIONS
from experiments.studies.robust.ours import Growth
from experiments.studies.robust.rivals import (
    CHAOSPY_WAYS,
    Step,
    chaospy_traces,
    openturns_trace,
    runs_needed,
    until_it_stays,
)
from experiments.studies.robust.task import Task
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.store import write_atomically

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


NAME = "robust"
STOPS = f"{NAME}_stops"
SEEDS = (1, 2, 3)
FURTHER = 3
"""Others are tried up to so many times the runs that ours needs, and at most `BUDGET`."""
QUICK_BUDGET = 60
QUICK_FUNCTIONS = ("Ishigami", "kink")
CURVE_COLUMNS = ("function", "method", "way", "runs", "error_at_designs", "error_overall")
STOP_NUMBERS = (
    "runs",
    "spent",
    "covered_mean",
    "covered_std",
    "true_mean_error",
    "true_std_error",
    "stated_mean_error",
    "stated_std_error",
)


@dataclass(frozen=True)
class Outcome:
    """What was found.

    Attributes
    ----------
    curves : dict of list of tuple
        By function, method and way: runs and both errors.
    stops : dict of dict
        By function and seed: the numbers of `STOP_NUMBERS`.
    """

    curves: dict[tuple[str, str, str], list[Step]]
    stops: dict[tuple[str, int], dict[str, float]]

    def functions(self) -> list[str]:
        """Names of the functions, in the order of `FUNCTIONS`."""
        names = {function for function, _, _ in self.curves}
        return [function.name for function in FUNCTIONS if function.name in names]

    def needed(self, function: str, method: str, column: int = 1) -> int | None:
        """Return the least runs that a method needs by its best way, None if above the budget."""
        counts = [
            runs_needed(steps, ACCURACY, column)
            for (name, who, _), steps in self.curves.items()
            if (name, who) == (function, method)
        ]
        return min((count for count in counts if count is not None), default=None)

    def tried(self, function: str, method: str) -> int:
        """Return the most runs that a method was given on a function; 0 if it was not run."""
        runs = [
            step[0]
            for key, steps in self.curves.items()
            if key[:2] == (function, method)
            for step in steps
        ]
        return max(runs, default=0)


def outcome_for(context: Context) -> Outcome:
    """Return the committed outcome, or that of a full or quick run, which leaves its files."""
    if not (context.full or context.quick):
        return read_outcome(*(committed_file(f"{name}.csv", NAME) for name in (NAME, STOPS)))
    require("openturns", "uq")
    require("sklearn", "uq")
    names = [function.name for function in FUNCTIONS] if context.full else QUICK_FUNCTIONS
    budget, seeds = (BUDGET, SEEDS) if context.full else (QUICK_BUDGET, SEEDS[:1])
    # The curve is that of the first seed.
    ours = [Grown(name, seed, seed == seeds[0], budget) for name in names for seed in seeds]
    grown = dict(zip(ours, context.campaign.run(ours, "ours"), strict=True))
    needed = gathered(grown, {}).needed
    rivals = [
        Curve(name, method, min(budget, FURTHER * (needed(name, OURS) or budget)))
        for name in names
        for method in METHODS
        if method != OURS
    ]
    outcome = gathered(
        grown, dict(zip(rivals, context.campaign.run(rivals, "rivals"), strict=True))
    )
    for name, text in ((NAME, curves_text(outcome)), (STOPS, stops_text(outcome))):
        write_atomically(context.out / NAME / f"{name}.csv", text.encode())
    return outcome


def gathered(grown: dict[Grown, Run], rivals: dict[Curve, Run]) -> Outcome:
    """Return the outcome of finished jobs."""
    curves: dict[tuple[str, str, str], list[Step]] = {}
    stops = {}
    for growth, run in grown.items():
        if growth.whole_curve:
            steps = run.values[:, : len(STEP)].tolist()
            curves[growth.function, OURS, OURS] = [(int(n), step, all_) for n, step, all_ in steps]
        numbers = run.values[0, len(STEP) :].tolist()
        stops[growth.function, growth.seed] = dict(zip(STOP_NUMBERS, numbers, strict=True))
    for job, run in rivals.items():
        names = ways_of(job.method)
        for way, runs, *errors in run.values.tolist():
            key = job.function, job.method, names[int(way)]
            curves.setdefault(key, []).append((int(runs), errors[0], errors[1]))
    return Outcome(curves, stops)


def ways_of(method: str) -> Sequence[str]:
    """Return the names of a method's ways."""
    return CHAOSPY_WAYS if method == "chaospy" else (method,)


def curves_text(outcome: Outcome) -> str:
    """Return the CSV text of the curves, with date and versions in a first comment line."""
    rows = (
        [*key, runs, f"{at_designs:.4g}", f"{overall:.4g}"]
        for key, steps in outcome.curves.items()
        for runs, at_designs, overall in steps
    )
    return table_with_origin(CURVE_COLUMNS, rows)


def stops_text(outcome: Outcome) -> str:
    """Return the CSV text of the stops."""
    rows: Iterable[list[object]] = (
        [*key, *(f"{numbers[name]:.4g}" for name in STOP_NUMBERS)]
        for key, numbers in outcome.stops.items()
    )
    return table_with_origin(["function", "seed", *STOP_NUMBERS], rows)


def read_outcome(curves: Path, stops: Path) -> Outcome:
    """Read what `curves_text` and `stops_text` wrote."""
    by_way: dict[tuple[str, str, str], list[Step]] = {}
    for row in read_rows(curves):
        step = int(row["runs"]), float(row["error_at_designs"]), float(row["error_overall"])
        by_way.setdefault((row["function"], row["method"], row["way"]), []).append(step)
    numbers = {
        (row["function"], int(row["seed"])): {name: float(row[name]) for name in STOP_NUMBERS}
        for row in read_rows(stops)
    }
    return Outcome(by_way, numbers)


def ahead(outcome: Outcome, function: str) -> bool:
    """Whether ours needs fewer runs than every rival, and than those it was tried with in vain."""
    ours = outcome.needed(function, OURS)
    rivals = [
        outcome.needed(function, method) or outcome.tried(function, method)
        for method in METHODS
        if method != OURS
    ]
    return ours is not None and all(ours < runs_of for runs_of in rivals)
