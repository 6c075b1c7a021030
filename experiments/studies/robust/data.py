"""Curves, stops and small probabilities: computed, and as the three CSV files that are kept."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.runner.committed import committed_file, read_rows, table_with_origin
from experiments.runner.registry import Context, require
from experiments.studies.robust.functions import FUNCTIONS
from experiments.studies.robust.limit_states import LIMIT_STATES
from experiments.studies.robust.ours import Growth
from experiments.studies.robust.rare import COLUMNS as RARE_COLUMNS
from experiments.studies.robust.rare import METHODS as RARE_METHODS
from experiments.studies.robust.rare import RareJob
from experiments.studies.robust.rivals import (
    CHAOSPY_WAYS,
    Step,
    chaospy_traces,
    kriging_trace,
    openturns_trace,
    process_trace,
    runs_needed,
    until_it_stays,
)
from experiments.studies.robust.task import Task
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.store import write_atomically

OURS = "pymoo_hdte"
OPENTURNS = "OpenTURNS"
CHAOSPY = "chaospy"
KRIGING = "OpenTURNS Kriging"
PROCESS = "Matern process"
RIVALS = (CHAOSPY, OPENTURNS, KRIGING, PROCESS)
METHODS = (OURS, *RIVALS)
TRACES = {OPENTURNS: openturns_trace, KRIGING: kriging_trace, PROCESS: process_trace}
ACCURACY = 0.01
BUDGET = 500
STEP = ("runs", "error_at_designs", "error_overall")
CURVE = ("way", *STEP)


@dataclass(frozen=True)
class Grown:
    """One growth of ours: where it stops by itself, what its band covers, and its errors."""

    function: str
    seed: int
    budget: int = BUDGET

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"{self.function}_{OURS}_{self.budget}_{self.seed}".replace(" ", "_")

    def execute(self) -> Run:
        """Return the columns of `STEP` of every fit, and beside each the numbers of the stop."""
        task, started = Task(self.function), time.perf_counter()
        growth = Growth(task, ACCURACY, self.budget, self.seed)
        stop = growth.band()
        steps = np.array(growth.steps, dtype=float)
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
        if self.method == CHAOSPY:
            ways = chaospy_traces(task, self.budget)
        else:
            ways = {self.method: TRACES[self.method](task, self.budget)}
        rows = [
            (way, *step)
            for way, steps in enumerate(ways.values())
            for step in until_it_stays(steps, ACCURACY)
        ]
        seconds = time.perf_counter() - started
        return Run(CURVE, np.array(rows, dtype=float).reshape(-1, len(CURVE)), seconds)


NAME = "robust"
STOPS = f"{NAME}_stops"
RARE = f"{NAME}_rare"
RARE_SEEDS = tuple(range(1, 21))
RARE_AT_ONCE = 5
"""Seeds of one job."""
RARE_PROBABILITIES = (1e-3, 1e-4, 1e-6)
QUICK_STATES = ("short column",)
SEEDS = (1, 2, 3, 4, 5)
QUICK_BUDGET = 60
QUICK_FUNCTIONS = ("Ishigami", "kink")
CURVE_COLUMNS = ("function", "method", "way", "runs", "error_at_designs", "error_overall")
STOP_NUMBERS = (
    "needed",
    "runs",
    "spent",
    "covered_mean",
    "covered_std",
    "true_mean_error",
    "true_std_error",
    "stated_mean_error",
    "stated_std_error",
)


RareCase = tuple[str, float, str]
"""Limit state, probability and method."""


@dataclass(frozen=True)
class Outcome:
    """What was found.

    Attributes
    ----------
    curves : dict of list of tuple
        By function, method and way: runs and both errors.
    stops : dict of dict
        By function and seed: the numbers of `STOP_NUMBERS`; ``needed`` is infinite where the error
        did not stay below the bound within the budget.
    rare : dict of ndarray
        By limit state, probability and method: rows of the columns of a `RareJob`, one for each
        seed.
    """

    curves: dict[tuple[str, str, str], list[Step]]
    stops: dict[tuple[str, int], dict[str, float]]
    rare: dict[RareCase, NDArray[np.float64]] = field(default_factory=dict)

    def rare_cases(self) -> list[tuple[str, float]]:
        """Limit states and probabilities that were run, in the order of `LIMIT_STATES`."""
        order = {state.name: place for place, state in enumerate(LIMIT_STATES)}
        cases = {(state, probability) for state, probability, _ in self.rare}
        return sorted(cases, key=lambda case: (order[case[0]], -case[1]))

    def functions(self) -> list[str]:
        """Names of the functions, in the order of `FUNCTIONS`."""
        names = {function for function, _, _ in self.curves}
        return [function.name for function in FUNCTIONS if function.name in names]

    def stops_of(self, function: str) -> list[dict[str, float]]:
        """Return where ours stopped on a function, of all seeds that were run."""
        return [stop for (name, _), stop in self.stops.items() if name == function]

    def needed(self, function: str, method: str, column: int = 1) -> int | None:
        """Return the least runs that a method needs by its best way, None if above the budget.

        Ours is the median of its seeds, as far as they were run.
        """
        seeds = [stop["needed"] for stop in self.stops_of(function)]
        if method == OURS and column == 1 and seeds:
            median = float(np.median(seeds))
            return int(np.ceil(median)) if np.isfinite(median) else None
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
        return read_outcome(*(committed_file(f"{name}.csv", NAME) for name in (NAME, STOPS, RARE)))
    require("openturns", "uq")
    require("sklearn", "uq")
    names = [function.name for function in FUNCTIONS] if context.full else QUICK_FUNCTIONS
    budget, seeds = (BUDGET, SEEDS) if context.full else (QUICK_BUDGET, SEEDS[:1])
    ours = [Grown(name, seed, budget) for name in names for seed in seeds]
    grown = dict(zip(ours, context.campaign.run(ours, "ours"), strict=True))
    needed = gathered(grown, {}).needed
    # Whether another needs no more runs shows when it is given as many.
    rivals = [
        Curve(name, method, runs)
        for name in names
        if (runs := needed(name, OURS)) is not None
        for method in RIVALS
    ]
    states = [state.name for state in LIMIT_STATES] if context.full else QUICK_STATES
    groups = [
        RARE_SEEDS[start : start + RARE_AT_ONCE]
        for start in range(0, len(RARE_SEEDS), RARE_AT_ONCE)
    ]
    rare = [
        RareJob(state, probability, method, group)
        for group in (groups if context.full else [RARE_SEEDS[:1]])
        for state in states
        for probability in (RARE_PROBABILITIES if context.full else RARE_PROBABILITIES[:1])
        for method in RARE_METHODS
    ]
    outcome = gathered(
        grown,
        dict(zip(rivals, context.campaign.run(rivals, "rivals"), strict=True)),
        dict(zip(rare, context.campaign.run(rare, "small probabilities"), strict=True)),
    )
    for name, text in (
        (NAME, curves_text(outcome)),
        (STOPS, stops_text(outcome)),
        (RARE, rare_text(outcome)),
    ):
        write_atomically(context.out / NAME / f"{name}.csv", text.encode())
    return outcome


def gathered(
    grown: dict[Grown, Run], rivals: dict[Curve, Run], rare: dict[RareJob, Run] | None = None
) -> Outcome:
    """Return the outcome of finished jobs; the curve of ours is that of the first seed."""
    curves: dict[tuple[str, str, str], list[Step]] = {}
    stops = {}
    for growth, run in grown.items():
        rows = run.values[:, : len(STEP)].tolist()
        steps = [(int(runs), step, overall) for runs, step, overall in rows]
        needed = runs_needed(steps, ACCURACY) or np.inf
        curves.setdefault((growth.function, OURS, OURS), steps)
        numbers = [needed, *run.values[0, len(STEP) :].tolist()]
        stops[growth.function, growth.seed] = dict(zip(STOP_NUMBERS, numbers, strict=True))
    for job, run in rivals.items():
        names = ways_of(job.method)
        for way, runs, *errors in run.values.tolist():
            key = job.function, job.method, names[int(way)]
            curves.setdefault(key, []).append((int(runs), errors[0], errors[1]))
    seeds: dict[RareCase, list[NDArray[np.float64]]] = {}
    for small, run in (rare or {}).items():
        seeds.setdefault((small.state, small.probability, small.method), []).append(run.values)
    return Outcome(curves, stops, {case: np.concatenate(rows) for case, rows in seeds.items()})


def ways_of(method: str) -> Sequence[str]:
    """Return the names of a method's ways."""
    return CHAOSPY_WAYS if method == CHAOSPY else (method,)


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


def rare_text(outcome: Outcome) -> str:
    """Return the CSV text of the small probabilities; seeds count from 1."""
    rows = (
        [state, probability, method, seed, *(f"{number:.5g}" for number in row)]
        for (state, probability, method), seeds in outcome.rare.items()
        for seed, row in enumerate(seeds.tolist(), 1)
    )
    return table_with_origin(["state", "truth", "method", "seed", *RARE_COLUMNS], rows)


def read_outcome(curves: Path, stops: Path, rare: Path) -> Outcome:
    """Read what `curves_text`, `stops_text` and `rare_text` wrote."""
    by_way: dict[tuple[str, str, str], list[Step]] = {}
    for row in read_rows(curves):
        step = int(row["runs"]), float(row["error_at_designs"]), float(row["error_overall"])
        by_way.setdefault((row["function"], row["method"], row["way"]), []).append(step)
    numbers = {
        (row["function"], int(row["seed"])): {name: float(row[name]) for name in STOP_NUMBERS}
        for row in read_rows(stops)
    }
    seeds: dict[RareCase, list[list[float]]] = {}
    for row in read_rows(rare):
        case = row["state"], float(row["truth"]), row["method"]
        seeds.setdefault(case, []).append([float(row[name]) for name in RARE_COLUMNS])
    return Outcome(by_way, numbers, {case: np.array(rows) for case, rows in seeds.items()})


def is_complete(outcome: Outcome, function: str) -> bool:
    """Whether every rival has as many runs as ours needs, or needs fewer, or ours too many."""
    ours = outcome.needed(function, OURS)
    return ours is None or all(
        outcome.needed(function, method) or outcome.tried(function, method) >= ours
        for method in RIVALS
    )


def ahead(outcome: Outcome, function: str) -> bool:
    """Whether ours needs fewer runs than every rival, each of which was tried with as many."""
    ours = outcome.needed(function, OURS)
    if ours is None or not is_complete(outcome, function):
        return False
    counts = [outcome.needed(function, method) for method in RIVALS]
    return all(count is None or ours < count for count in counts)
