"""The swarm's own time, which evaluations are no part of, beside that of NSGA-II.

``python -m experiments.studies.suites.own_time`` measures seconds of one core on two cheap
problems, in a minute, and stores them with the name of the processor. Only their ratios say
anything elsewhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.algorithm import Algorithm
from pymoo.problems import get_problem

from experiments.runner.committed import (
    DATA,
    committed_file,
    read_origin,
    read_rows,
    table_with_origin,
)
from experiments.runner.machine import machine_table
from experiments.runner.own_time import seconds_of_run
from experiments.studies.suites.peers import OURS
from pymoo_hdte._runner.result import Cell, Column, Table
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.algorithms import CompactSwarm

NAME = "suites_own_time"
COLUMNS = ("problem", "algorithm", "evaluations", "generations", "seconds")
PROBLEMS = ("zdt1", "dtlz2")
EVALUATIONS, REPEATS = 10_000, 5
RIVAL = "NSGA-II"
MADE: dict[str, Callable[[], Algorithm]] = {
    RIVAL: lambda: NSGA2(pop_size=100),
    OURS: CompactSwarm,
    f"{OURS}, 100 particles": lambda: CompactSwarm(100),
}


def own_seconds(problem: str, make: Callable[[], Algorithm]) -> tuple[int, float]:
    """Return the generations of a run and the seconds of the core without evaluations."""
    algorithm = make()
    algorithm.setup(get_problem(problem), termination=("n_eval", EVALUATIONS), seed=1)
    own, _ = seconds_of_run(algorithm, time.process_time)
    return algorithm.n_iter - 1, own


def own_time_table() -> Table:
    """Show the stored ratios."""
    path = committed_file(f"{NAME}.csv", "suites")
    rows = read_rows(path)
    of_rival = {row["problem"]: row for row in rows if row["algorithm"] == RIVAL}
    shown: list[tuple[Cell, ...]] = []
    for row in rows:
        rival = of_rival[row["problem"]]
        shown.append(
            (
                *(row["problem"].upper(), row["algorithm"], int(row["generations"])),
                _seconds(row, each=True) / _seconds(rival, each=True),
                _seconds(row) / _seconds(rival),
            )
        )
    return Table(
        "own_time",
        f"Own time beside {RIVAL}'s, evaluations left out",
        (
            *(Column("problem"), Column("algorithm"), Column("generations")),
            *(Column(f"of {RIVAL}'s", "", 2, what) for what in ("a generation", "the whole run")),
        ),
        tuple(shown),
        note=f"{EVALUATIONS:,} evaluations, the least of {REPEATS} runs, seconds of one core on "
        f"{read_origin(path)['processor']}; {RIVAL} has 100 individuals. At most half of its time "
        "a generation had been demanded.",
        folded=True,
    )


def _seconds(row: dict[str, str], *, each: bool = False) -> float:
    return float(row["seconds"]) / (int(row["generations"]) if each else 1)


def main() -> None:
    """Measure and store."""
    rows = []
    for problem in PROBLEMS:
        for name, make in MADE.items():
            own_seconds(problem, make)  # What is compiled is compiled by then.
            runs = [own_seconds(problem, make) for _ in range(REPEATS)]
            generations, seconds = min(runs, key=lambda run: run[1])
            rows.append([problem, name, EVALUATIONS, generations, f"{seconds:.4g}"])
    facts = {
        "command": "python -m experiments.studies.suites.own_time",
        "processor": next(fact for what, fact in machine_table().rows if what == "processor"),
    }
    write_atomically(DATA / f"{NAME}.csv", table_with_origin(COLUMNS, rows, **facts).encode())


if __name__ == "__main__":
    main()
